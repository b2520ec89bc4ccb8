/**
 * A controller whose gains or weights are moved, at a point or over the grid: the knobs, and previews that follow them.
 * One preview is under way at a time; of the moves in the meantime the latest is asked for next. Those of a state that
 * is left are aborted.
 */

import { clear, h, live as say, message } from "../../dom.js";
import { knobPanel } from "./knob_panel.js";
import { knobsOf } from "./knobs.js";
import { withValue } from "./narrow.js";
import { partOf, taken } from "./take.js";

const SETTLED_MS = 300;

/**
 * Knobs of the chosen controller.
 * @param {Element} el gets the knobs, a place for what is refused, and the body
 * @param {Object} context of the view
 * @param {Object} options
 * @param {import("./scope.js").Scope} options.scope where it is looked at
 * @param {string[]} options.studies wanted of previews
 * @param {function(): Object} [options.query] more fields of the preview's body
 * @param {function(): import("./knobs.js").Knob[]} [options.extra] knobs that are no part of the request
 * @param {function(string): string[]} [options.moving] studies wanted while this knob moves; all of them when it rests
 * @param {function(Object<string, number>): void} [options.onMove] told at once of all values, by knob
 * @param {function({now: Object, designed: Object, problems: Object, values: Object}): void} options.onAnswer studies as moved and as designed,
 *   with the `design` that they are of; `problems`: why one of them is not there at all
 * @returns {{body: Element, start: function(): void, update: function(Set<string>): void, values: function(): Object<string, number>,
 *   designedValue: function(string): ?number, unmount: function(): void}} values by knob
 */
export function liveController(el, context, { scope, studies, query = () => ({}), extra = () => [], moving = () => studies, onMove, onAnswer }) {
  const { api, state } = context;
  const panel = h("div", { class: "stack" });
  const note = h("div", { class: "live-note" });
  const body = h("div", { class: "stack live-body" });
  body.hidden = true;
  el.append(panel, note, body);
  let session = null;
  let forgetting = false;
  let answered = false;

  const designedValue = (id) => session.knobs.find((knob) => knob.id === id)?.value ?? null;
  return { body, start, update, values: () => session?.values ?? {}, designedValue, unmount: end };

  function end() {
    window.clearTimeout(session?.timer);
    session = null;
  }

  /** Begin anew with the controller, the point and the parameters that are chosen now. */
  async function start() {
    end();
    const signal = context.signal();
    const { design, controller: name, point } = state.get();
    const designed = design.controllers.find((one) => one.name === name);
    const missing = scope.missing(design, designed, point);
    if (missing) {
      clear(panel);
      refuse(missing, "empty");
      return;
    }
    const request = scope.request(design, designed, point);
    const knobs = [...extra(), ...knobsOf(request.controllers[0], designed)];
    const own = { signal, request, knobs, values: {}, wanted: null, busy: false, designed: null, problems: {}, timer: 0, asked: studies };
    session = own;
    own.values = fromAddress(own);
    drawPanel(own);
    if (!answered) message(note, "loading", "Computing");
    el.setAttribute("aria-busy", "true");
    try {
      Object.assign(own, await baseline(own));
      if (own !== session) return;
      if (own.problems.point) return refuse(own.problems.point.detail);
      accept();
      await tell(own, own.designed);
      if (moved(own)) ask(own, studies);
    } catch (problem) {
      if (own === session && problem.name !== "AbortError") refuse(problem.detail ?? problem.message);
    } finally {
      if (own === session && !own.busy) el.removeAttribute("aria-busy");
    }
    return undefined;
  }

  /** The studies as designed, and why those are missing that are not to be had of such a controller. */
  async function baseline(own) {
    try {
      return { designed: await post(own, own.request, studies), problems: {} };
    } catch (problem) {
      if (problem.name === "AbortError" || studies.length === 1) throw problem;
      const each = await Promise.allSettled(studies.map((study) => post(own, own.request, [study])));
      if (own.signal.aborted) throw new DOMException("left", "AbortError");
      const found = each.filter((one) => one.value).map((one) => Object.entries(one.value).filter(([, study]) => study));
      const missing = studies.map((study, k) => [study, each[k].reason]).filter(([, reason]) => reason);
      return { designed: Object.fromEntries(found.flat()), problems: Object.fromEntries(missing) };
    }
  }

  async function post(own, request, wanted) {
    const document = { request, studies: wanted, controller: request.controllers[0].name, point: 0, ...query() };
    const answer = await api.post("v1/previews", document, { signal: own.signal });
    return { ...answer.studies, design: answer.design };
  }

  /** A change of state that the view was told of. */
  function update(changed) {
    const placed = scope.of.some((key) => changed.has(key));
    if (forgetting) return undefined;
    if (placed && !changed.has("params")) forgetMoves();
    if (placed || !session) return void start();
    const values = fromAddress(session);
    if (session.knobs.every(({ id }) => values[id] === session.values[id])) return undefined;
    if (session.timer) return undefined; // a hand is on a knob; the address follows it
    session.values = values;
    drawPanel(session);
    onMove?.(values);
    return void ask(session, studies);
  }

  function drawPanel(own) {
    const [controller] = own.request.controllers;
    const part = partOf(controller);
    own.reset = h("button", { type: "button", onclick: reset, disabled: !moved(own) }, `Back to the design's ${part}`);
    const take = h("button", { type: "button", onclick: () => takeOver(own) }, `Take these ${part}`);
    own.panel = knobPanel(panel, own.knobs, { title: `${part === "gains" ? "Gains" : "Weights"} of ${controller.name} ${scope.words}`, onMove: (id, value) => move(own, id, value), actions: [own.reset, take] });
    own.panel.show(own.values);
  }

  function move(own, id, value) {
    own.values = { ...own.values, [id]: value };
    own.reset.disabled = !moved(own);
    if (own.knobs.find((knob) => knob.id === id).path) {
      own.asked = moving(id);
      ask(own, own.asked); // the service works while the page draws
    }
    onMove?.(own.values);
    settleSoon(own);
  }

  function reset() {
    session.values = Object.fromEntries(session.knobs.map((knob) => [knob.id, knob.value]));
    drawPanel(session);
    panel.querySelector("button:last-child").focus();
    onMove?.(session.values);
    ask(session, studies);
    toAddress(session);
  }

  function takeOver(own) {
    const { draft, design } = state.get();
    const [controller] = requestNow(own).controllers;
    state.set({ draft: taken(draft, design, controller) });
    say(`The ${partOf(controller)} of ${controller.name} are in the request under Define, for every point of its grid.`);
  }

  /** When nothing has moved for a while, everything is asked for, and the address says what is shown. */
  function settleSoon(own) {
    window.clearTimeout(own.timer);
    own.timer = window.setTimeout(() => {
      own.timer = 0;
      if (own !== session) return;
      toAddress(own);
      if (studies.some((study) => !own.asked.includes(study))) ask(own, studies);
    }, SETTLED_MS);
  }

  async function ask(own, wanted) {
    own.wanted = [...new Set([...(own.wanted ?? []), ...wanted])].filter((study) => !own.problems[study]);
    if (own.busy || !own.designed) return;
    own.busy = true;
    el.setAttribute("aria-busy", "true");
    while (own.wanted && own === session) {
      const now = own.wanted;
      own.wanted = null;
      try {
        const answer = await post(own, requestNow(own), now);
        if (own !== session) return;
        accept();
        await tell(own, answer);
      } catch (problem) {
        if (own !== session || problem.name === "AbortError") return;
        message(note, "refused", problem.detail ?? problem.message);
        body.classList.add("stale");
      }
    }
    own.busy = false;
    el.removeAttribute("aria-busy");
  }

  function tell(own, now) {
    return onAnswer({ now, designed: own.designed, problems: own.problems, values: own.values });
  }

  function accept() {
    answered = true;
    clear(note);
    body.hidden = false;
    body.classList.remove("stale");
  }

  function refuse(text, kind = "refused") {
    el.removeAttribute("aria-busy");
    body.hidden = true;
    message(note, kind, text);
  }

  function requestNow(own) {
    const parts = own.knobs.filter((knob) => knob.path && own.values[knob.id] !== knob.value);
    return parts.reduce((request, { id, path }) => withValue(request, ["controllers", 0, ...path], own.values[id]), own.request);
  }

  function moved(own) {
    return own.knobs.some((knob) => own.values[knob.id] !== knob.value);
  }

  function fromAddress(own) {
    const { params } = state.get();
    const value = ({ id, value: designed }) => (params[id] !== undefined && params[id] !== null && params[id] !== "" && Number.isFinite(Number(params[id])) ? Number(params[id]) : designed);
    return Object.fromEntries(own.knobs.map((knob) => [knob.id, value(knob)]));
  }

  function toAddress(own) {
    const patch = own.knobs.map((knob) => [knob.id, own.values[knob.id] === knob.value ? null : String(own.values[knob.id])]);
    state.set({ params: { ...state.get().params, ...Object.fromEntries(patch) } });
  }

  /** Gains of one controller at one point mean nothing to another. */
  function forgetMoves() {
    const left = Object.keys(state.get().params).filter((name) => !session?.knobs.some((knob) => knob.id === name));
    const { params } = state.get();
    forgetting = true;
    state.set({ params: Object.fromEntries(left.map((name) => [name, params[name]])) });
    forgetting = false;
  }
}
