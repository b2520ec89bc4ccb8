/** Bryson weights of a state feedback by sliders: the whole grid is designed again while they move. */

import { linesOf, valueAxis } from "./envelope_axes.js";

const DELAY = 60; // ms that a slider rests before the grid is designed again
const DECADES = 1.5; // each way of the design's own weight
const PEAKS = ["peak_torque_n_m", "holding_torque_n_m", "peak_rate_deg_s", "peak_deflection_deg", "peak_power_w"];

export default { id: "weights", title: "Weights over the grid", group: "envelope", needs: ["controller"], mount };

function mount(el, { api, state, plot, dom, format, param, setParam, show, end }) {
  const { h } = dom;
  const sliders = h("div", { class: "sliders" });
  const actions = h("div", { class: "row" });
  const choice = h("div", { class: "row" });
  const picture = h("div", {});
  const tables = h("div", { class: "two-plots" });
  const body = h("div", { class: "stack" }, sliders, actions, choice, picture, tables);
  el.append(body);
  let timer = null;
  let before = null; // {controller, requirements}: of the stored design
  let shown = null; // the preview's answer
  start();
  return { update, unmount };

  function unmount() {
    window.clearTimeout(timer);
    plot.forget(picture);
  }

  function asked() {
    const { design, controller } = state.get();
    return design.request.controllers.find(({ name }) => name === controller);
  }

  function controller() {
    const { design, controller: name } = state.get();
    return design.controllers.find((one) => one.name === name);
  }

  /** Names of the weights that are numbers. */
  function names() {
    return Object.keys(asked().weights).filter((name) => typeof asked().weights[name] === "number");
  }

  function weights() {
    const own = asked().weights;
    const moved = names().map((name) => [name, Number(param(name, String(own[name])))]).filter(([, value]) => Number.isFinite(value) && value > 0);
    return { ...own, ...Object.fromEntries(moved) };
  }

  /** The design's request with these weights; of all controllers or of this one. */
  function request(all) {
    const { design: { request: own } } = state.get();
    const changed = own.controllers.map((one) => (one.name === asked().name ? { ...one, weights: weights() } : one));
    return { ...own, controllers: all ? changed : changed.filter(({ name }) => name === asked().name) };
  }

  function start() {
    end();
    window.clearTimeout(timer);
    shown = before = null;
    if (asked().weights?.rule !== "bryson") {
      plot.forget(picture);
      const why = asked().kind === "lqr" ? `its weights have the rule ${asked().weights.rule}` : `it is a ${asked().kind.replaceAll("_", " ")}`;
      dom.message(body, "empty", `Sliders are for state feedback whose weights follow Bryson's rule; of ${asked().name}, ${why}. Choose another controller above.`);
      return;
    }
    dom.clear(body).append(sliders, actions, choice, picture, tables);
    dom.clear(tables);
    dom.clear(actions).append(
      h("button", { type: "button", class: "primary", onclick: take }, "Take these weights"),
      h("button", { type: "button", onclick: reset }, "Back to the design's"),
      h("span", { class: "muted" }, "Each is the largest value that is acceptable: smaller weighs more."),
    );
    const options = controller().gains.map(({ name }) => ({ value: name, label: name }));
    dom.clear(choice).append(dom.select("Gain", options, gain(), (name) => setParam("gain", name)));
    showSliders();
    design();
  }

  function update(changed) {
    if (changed.has("controller")) return start();
    if (asked().weights?.rule !== "bryson") return undefined;
    window.clearTimeout(timer);
    timer = window.setTimeout(design, DELAY);
    if (shown) draw(shown);
    return undefined;
  }

  function gain() {
    const wanted = param("gain", "");
    const known = controller().gains.map(({ name }) => name);
    return known.includes(wanted) ? wanted : known.find((name) => name === "K_T_a_da") ?? known[0];
  }

  /** Sliders are of the logarithm: a weight is a ratio. */
  function showSliders() {
    const entry = (name) => {
      const middle = Math.log10(asked().weights[name]);
      const unit = name === "aileron_integral_deg_s" || name === "tab_integral_deg_s" ? "deg s" : format.unitOf(name);
      const options = { unit, min: middle - DECADES, max: middle + DECADES, step: 0.01, format: (value) => format.number(10 ** value, 3) };
      const words = format.words(name.replace(/_integral_deg_s$/, "_integral"));
      return dom.slider(words, Math.log10(weights()[name]), options, (value) => setParam(name, String(Number((10 ** value).toPrecision(4)))));
    };
    dom.clear(sliders).append(...names().map(entry));
  }

  function reset() {
    state.set({ params: Object.fromEntries(Object.entries(state.get().params).filter(([name]) => !names().includes(name))) });
    showSliders();
  }

  function take() {
    state.set({ draft: request(true), panel: "define" });
    dom.live("The request has these weights now; design it here.");
  }

  function design() {
    const { designId, controller: name } = state.get();
    const preview = (signal) => api.post("v1/previews", { request: request(false), controller: name, studies: ["actuator_requirements"] }, { signal });
    show(picture, async (signal) => {
      const [answer, requirements] = await Promise.all([
        preview(signal),
        before?.requirements ?? api.get(`v1/designs/${designId}/controllers/${encodeURIComponent(name)}/actuator-requirements`, { signal }),
      ]);
      before = { requirements };
      return answer;
    }, (answer) => {
      shown = answer;
      return draw(answer);
    });
  }

  function draw({ design: found, studies: { actuator_requirements: requirements } }) {
    const { design: { grid } } = state.get();
    const [own, made] = [controller(), found.controllers[0]];
    const of = (one) => one.gains.find(({ name }) => name === gain());
    const [was, now] = [of(own), of(made)];
    const dashed = linesOf(grid, was.values, "design, ").map((line) => ({ ...line, mode: "lines", line: { dash: "dot", color: "#76848f", width: 1.4 } }));
    const live = linesOf(grid, now?.values ?? was.values.map((row) => row.map(() => null)), "now, ");
    const heading = `${gain()} [${was.unit}]`;
    const layout = { xaxis: valueAxis(grid.axes[1]), yaxis: { title: { text: heading } }, uirevision: gain() };
    tell(own, made, requirements);
    const failed = made.outcomes.flat().filter((outcome) => outcome !== "ok").length;
    const label = `${heading} of ${own.name} over the grid with these weights, beside the design's${failed ? `; ${failed} points have no gains` : ""}`;
    return plot.draw(picture, [...live, ...dashed], layout, { label, height: 380 });
  }

  function tell(own, made, requirements) {
    const mark = (passed) => h("span", { class: `tag ${passed ? "good" : passed === null ? "warn" : "bad"}` }, passed ? "met" : passed === null ? "not judged" : "missed");
    const judged = made.verdicts.map((now) => {
      const was = own.verdicts.find(({ spec, source }) => spec === now.spec && source === now.source);
      return [`${format.title(now.spec)} (${format.words(now.source)})`, format.number(now.limit), format.number(was?.worst_value), format.number(now.worst_value), mark(now.passed)];
    });
    const peaks = Object.entries(requirements.envelope).flatMap(([actuator, figures]) => PEAKS.map((name) => {
      const was = before.requirements.envelope[actuator][name].value;
      const now = figures[name].value;
      return [`${actuator}: ${format.title(name)}`, format.number(was), format.number(now), changed(was, now)];
    }));
    dom.clear(tables).append(
      h("div", {}, h("h4", {}, "Verdicts, worst over the grid"), dom.table("Verdicts", ["spec", "limit", "design", "now", ""], judged)),
      h("div", {}, h("h4", {}, "Actuators, worst over the grid"), dom.table("Peaks of the actuators", ["requirement", "design", "now", "change"], peaks)),
    );
  }
}

/** A change in per cent, to a tenth. */
function changed(was, now) {
  if (!was || now === null) return "";
  const percent = 100 * (now / was - 1);
  if (Math.abs(percent) < 0.05) return "0 %";
  return `${percent > 0 ? "+" : "\u2212"}${Math.abs(percent).toFixed(1)} %`;
}
