/** Compare: two controllers, of two designs or of one, side by side. */

import { figureOptions } from "../compare/figures.js";
import { drawMaps } from "../compare/maps.js";
import { carriedOver, differences, pointTable } from "../compare/tables.js";
import { clear, h, message, select } from "../dom.js";
import { words } from "../format.js";
import { pointName } from "../grid.js";
import * as plot from "../plot.js";
import { viewContext } from "../views/context.js";

const LISTED = 100;

export default { id: "compare", title: "Compare", mount };

function mount(el, { api, state }) {
  const { param, setParam, show, end } = viewContext({ api, state });
  const listing = new AbortController();
  const bar = h("div", { class: "surface design-bar" });
  const body = h("div", { class: "stack" });
  const maps = [0, 1, 2].map(() => ({ heading: h("h4", {}), picture: h("div", {}) }));
  const there = h("div", { class: "stack" });
  let designs = []; // of this server, newest first
  let last = null; // {key, answer, other} that came last
  let drawn = null; // key of what is drawn; null while it is asked for, and after a refusal
  const ends = [state.subscribe(["design", "designProblem"], open), state.subscribe(["point", "controller", "params"], update)];
  open();
  return { unmount };

  function unmount() {
    ends.forEach((one) => one());
    listing.abort();
    end();
    maps.forEach(({ picture }) => plot.forget(picture));
  }

  async function open() {
    const { design, designId, designProblem } = state.get();
    if (!designId) return noDesign();
    if (designProblem) return message(el, "refused", designProblem.detail);
    if (!design) return message(el, "loading", "Loading the design");
    clear(el).append(h("div", { class: "stack" }, bar, body));
    update();
    try {
      designs = (await api.get("v1/designs", { signal: listing.signal, query: { limit: LISTED } })).items;
      showBar();
    } catch (problem) {
      if (problem.name !== "AbortError") message(body, "refused", problem.detail ?? problem.message);
    }
    return undefined;
  }

  function noDesign() {
    message(el, "empty", "There is no design open: two designs, or two controllers of one, are set side by side here.");
    el.append(h("p", { class: "row" }, h("button", { type: "button", class: "primary", onclick: () => state.set({ panel: "explore" }) }, "Open a design")));
  }

  function otherId() {
    return param("with", state.get().designId);
  }

  /** Name of the other controller, where one is chosen or must be: a controller beside itself shows nothing. */
  function otherController() {
    const { design, controller } = state.get();
    if (otherId() !== design.id) return param("other", null);
    return param("other", design.controllers.map(({ name }) => name).find((name) => name !== controller) ?? controller);
  }

  function update() {
    const { design, controller } = state.get();
    if (!design) return undefined;
    showBar();
    const key = [design.id, controller, otherId(), otherController()].join(" ");
    if (drawn === key) return showFigures();
    drawn = null;
    return show(body, (signal) => ask(key, signal), showAll);
  }

  async function ask(key, signal) {
    const { design, controller } = state.get();
    const query = { with: otherId(), controller, other_controller: otherController() };
    const [answer, other] = await Promise.all([
      api.get(`v1/designs/${design.id}/compare`, { signal, query }),
      otherId() === design.id ? design : api.get(`v1/designs/${encodeURIComponent(otherId())}`, { signal }),
    ]);
    return { key, answer, other };
  }

  function showBar() {
    const { design, controller } = state.get();
    const other = otherId() === design.id ? design : last?.other.id === otherId() ? last.other : null;
    const held = bar.contains(document.activeElement) ? document.activeElement.dataset.role : null;
    const named = (one) => one.controllers.map(({ name, kind }) => ({ value: name, label: `${name} (${words(kind)})` }));
    const chosenOther = last?.other === other && last ? last.answer.other.controller : otherController();
    clear(bar).append(
      h("h2", {}, "Compare"),
      role("this", select("Design", designOptions(design), design.id, (id) => state.set({ designId: id, controller: null }))),
      role("mine", select("Controller", named(design), controller, (name) => state.set({ controller: name }))),
      role("with", select("with design", designOptions(design, other), otherId(), (id) => state.set({ params: { ...state.get().params, with: id, other: null } }))),
      other ? role("other", select("its controller", named(other), chosenOther, (name) => setParam("other", name))) : "",
    );
    if (held) bar.querySelector(`[data-role="${held}"]`)?.focus();
  }

  /** The listed designs, and those that are shown but not listed. */
  function designOptions(...shown) {
    const entry = ({ id, name, created_at: made, provenance }) => ({ value: id, label: `${name}, ${(made ?? provenance.created_at).slice(0, 16).replace("T", " ")}` });
    const known = new Set(designs.map(({ id }) => id));
    const found = [...new Set(shown)].filter((one) => one && !known.has(one.id));
    const wanted = otherId();
    const unknown = known.has(wanted) || found.some(({ id }) => id === wanted) ? [] : [{ value: wanted, label: `design ${wanted.slice(0, 8)}` }];
    return [...found.map(entry), ...(shown.length > 1 ? unknown : []), ...designs.map(entry)];
  }

  function showAll(found) {
    last = found;
    drawn = found.key;
    showBar();
    const { answer } = found;
    maps.forEach(({ picture }) => plot.forget(picture));
    clear(body).append(
      section("What the requests differ in", differences(answer, designNames())),
      ...(answer.points.length ? compared(answer) : [section("Common points", [h("p", {}, `Nothing to set side by side: ${answer.reason}.`)])]),
    );
    return answer.points.length ? showFigures() : undefined;
  }

  function compared(answer) {
    const options = optionsOf(answer);
    const choice = select("Compare by", options, param("figure", options[0].value), (id) => setParam("figure", id));
    choice.control.dataset.role = "figure";
    return [
      section("Over the common points", [h("div", { class: "row" }, choice), h("div", { class: "three-maps" }, maps.map(({ heading, picture }) => h("div", { class: "map-card" }, heading, picture))), there]),
      ...(answer.this.id === answer.other.id ? [] : [section("Gains carried to the other plant", carriedOver(answer, controllerNames(), choose))]),
    ];
  }

  function showFigures() {
    const { answer } = last;
    if (!answer.points.length) return undefined;
    const { point, design } = state.get();
    const options = optionsOf(answer);
    const wanted = param("figure", options[0].value);
    const figure = options.some(({ value }) => value === wanted) ? wanted : options[0].value;
    body.querySelector('[data-role="figure"]').value = figure;
    const chosen = answer.points.find((one) => one.point === point);
    const name = pointName(design, point);
    clear(there).append(h("h4", {}, `${name[0].toUpperCase()}${name.slice(1)}`), chosen ? pointTable(chosen, controllerNames()) : h("p", { class: "muted" }, "The other grid does not have this point; choose one in the maps."));
    return drawMaps(maps, answer, figure, point, { names: controllerNames(), onPoint: choose });
  }

  /** Two controllers of one design fly the same plant: nothing is carried over. */
  function optionsOf(answer) {
    return figureOptions(answer).filter(({ value }) => answer.this.id !== answer.other.id || !value.startsWith("carried."));
  }

  function choose(point) {
    state.set({ point });
  }

  /** Names that tell the two apart. */
  function controllerNames() {
    const { this: one, other } = last.answer;
    if (one.id === other.id) return one.controller === other.controller ? [one.controller, `${other.controller} again`] : [one.controller, other.controller];
    const [first, second] = designNames();
    return [`${one.controller} of ${first}`, `${other.controller} of ${second}`];
  }

  function designNames() {
    const { this: one, other } = last.answer;
    return one.name === other.name ? ["this design", "the other"] : [one.name, other.name];
  }
}

function section(heading, content) {
  return h("section", { class: "surface stack", "aria-label": heading }, h("h3", {}, heading), content);
}

function role(name, control) {
  control.control.dataset.role = name;
  return control;
}
