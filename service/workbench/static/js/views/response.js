/** The reference step at a point, linear and simulated: angles, rates, torques and powers with the actuators' limits. */

import { largest, limitLines, limitsOf } from "./limit_lines.js";
import { poleTable, stepTable, verdictTable } from "./point_figures.js";
import { transient } from "./live/step_plot.js";
import { limitWords, QUANTITIES, series } from "./response_words.js";

const SAMPLES = ["201", "501", "1001", "2001"];

export default { id: "response", title: "Response in time", group: "point", needs: ["controller", "point"], mount };

function mount(el, { api, state, plot, dom, param, setParam, show }) {
  const { h } = dom;
  const choice = h("div", { class: "row" });
  const place = h("div", { class: "stack" });
  el.append(choice, place);
  const pictures = QUANTITIES.map(({ title }) => h("section", { "aria-label": title }));
  const whole = dom.checkbox("Whole duration", false, (on) => setParam("span", on ? "whole" : null));
  choice.append(dom.select("Samples", SAMPLES.map((value) => ({ value, label: value })), samples(), (value) => setParam("samples", value)), whole);
  update();
  return { update, unmount: () => pictures.forEach(plot.forget) };

  function samples() {
    return SAMPLES.includes(param("samples", "501")) ? param("samples", "501") : "501";
  }

  function update() {
    choice.querySelector("select").value = samples();
    whole.control.checked = param("span", null) === "whole";
    show(place, ask, draw);
  }

  /** The linear response, and a simulation that may take longer, or be refused: of a fast delay, a sampled regulator. */
  async function ask(signal) {
    const { designId, controller, point } = state.get();
    const path = `v1/designs/${designId}/controllers/${controller}/response`;
    const query = { point, samples: samples() };
    const simulation = api.get(path, { signal, query: { ...query, kind: "nonlinear" } }).then((simulated) => ({ simulated }), (refused) => ({ refused }));
    const [linear, at] = await Promise.all([api.get(path, { signal, query }), api.get(`v1/designs/${designId}/points/${point}`, { signal })]);
    return { linear, point: at, simulation };
  }

  /** What is exact is shown while the simulation is under way. */
  async function draw({ simulation, ...exact }) {
    await drawWith(exact, {});
    const found = await simulation;
    if (found.refused?.name === "AbortError") throw found.refused;
    await drawWith(exact, found);
  }

  function drawWith({ linear, point }, { simulated = null, refused = null }) {
    const { design, controller: name } = state.get();
    const limits = limitsOf(design, name);
    const own = point.controllers.find((one) => one.name === name);
    const words = limitWords(own.verdicts, simulated);
    const line = ({ text, kept }) => h("li", {}, h("span", { class: `tag ${kept ? "good" : "bad"}` }, kept ? "kept" : "exceeded"), ` ${text}`);
    dom.clear(place).append(
      h("h4", {}, "Limits"),
      words.length ? h("ul", { class: "reasons" }, words.map(line)) : h("p", { class: "muted" }, "The actuators have no limits."),
      simulationNote(simulated, refused),
      h("div", { class: "four" }, pictures),
      h("div", { class: "four" },
        h("div", { class: "stack" }, h("h4", {}, "Step"), stepTable(own)),
        h("div", { class: "stack" }, h("h4", {}, "Closed-loop poles"), poleTable(own.poles, `Closed-loop poles of ${name}`))),
      h("h4", {}, "Verdicts"),
      h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Verdicts" }, verdictTable(own)),
    );
    const range = whole.control.checked ? [0, linear.time_s.at(-1)] : transient(linear, own.step);
    return Promise.all(QUANTITIES.map((quantity, k) => drawQuantity(pictures[k], quantity, { linear, simulated, limits, range })));
  }

  /** How far the simulation went, and what it does not enforce. */
  function simulationNote(simulated, refused) {
    if (refused) return h("p", { class: "small" }, `There is no simulated response: ${refused.detail ?? refused.message}`);
    if (!simulated) return h("p", { class: "small muted" }, "Linear: exact, without limits. The simulation with total hinge moments and the actuators' limits is under way.");
    const { outcome, reason, unenforced } = simulated.simulation;
    const ended = outcome === "completed" ? "" : ` It ended early: ${reason ?? outcome.replaceAll("_", " ")}.`;
    const open = unenforced.length ? ` Not enforced: ${unenforced.join(", ")}.` : "";
    return h("p", { class: "small muted" }, `Linear: exact, without limits. Simulated: with total hinge moments and the actuators' limits. Torques include the trim.${ended}${open}`);
  }

  function drawQuantity(picture, { id, title, field, unit }, { linear, simulated, limits, range }) {
    const style = { aileron: "--series-1", tab: "--series-2" };
    const line = (response, surface, name, dash, width) => ({ name: `${surface} ${name}`, x: response.time_s, y: series(response, surface, id), mode: "lines", line: { color: style[surface], dash, width } });
    const surfaces = ["aileron", "tab"];
    const traces = [
      ...surfaces.map((surface) => line(linear, surface, "linear", surface === "tab" ? "dash" : "solid", 1.5)),
      ...(simulated ? surfaces.map((surface) => line(simulated, surface, "simulated", surface === "tab" ? "dashdot" : "longdash", 2.6)) : []),
    ];
    const most = largest(...traces.map(({ y }) => y));
    const layout = {
      xaxis: { title: { text: "time [s]" }, range },
      yaxis: { title: { text: `${title.toLowerCase()} [${unit}]` } },
      uirevision: String(range),
      margin: { l: 58, r: 12, t: 12, b: 44 },
      ...limitLines(limits, field, 2.5 * most),
    };
    return plot.draw(picture, traces, layout, { label: `${title} of aileron and tab over the reference step, linear${simulated ? " and simulated" : ""}; the largest is ${most.toPrecision(4)} ${unit}`, height: 290 });
  }
}
