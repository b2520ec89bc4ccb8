/** Weights of a state feedback by sliders: the whole grid is designed again while they move. */

import { linesOf, valueAxis } from "./envelope_axes.js";
import { liveController } from "./live/live.js";
import { WEIGHTS_OVER_GRID } from "./live/scope.js";

const STUDIES = ["actuator_requirements"];
const LEGEND_ROWS = 8; // more lines than these would leave no room for the plot; a pointer on one says which it is
const PEAKS = ["peak_torque_n_m", "holding_torque_n_m", "peak_rate_deg_s", "peak_deflection_deg", "peak_power_w"];

export default { id: "weights", title: "Weights over the grid", group: "envelope", needs: ["controller"], kind: "lqr", mount };

function mount(el, context) {
  const { state, plot, dom, format, param, setParam } = context;
  const { h } = dom;
  const live = liveController(el, context, { scope: WEIGHTS_OVER_GRID, studies: STUDIES, onAnswer });
  const choice = h("div", { class: "row" });
  const picture = h("div", {});
  const tables = h("div", { class: "two-plots" });
  live.body.append(choice, picture, tables);
  let answer = null;
  live.start();
  return { update, unmount };

  function unmount() {
    live.unmount();
    plot.forget(picture);
  }

  function update(changed) {
    if (WEIGHTS_OVER_GRID.of.some((key) => changed.has(key))) answer = null;
    live.update(changed);
    if (answer && changed.has("params")) draw();
  }

  function onAnswer(told) {
    const first = answer === null;
    answer = told;
    if (first) drawChoice();
    tell();
    return draw();
  }

  function controllers() {
    return [answer.now, answer.designed].map(({ design }) => design.controllers[0]);
  }

  function drawChoice() {
    const options = controllers()[1].gains.map(({ name }) => ({ value: name, label: name }));
    dom.clear(choice).append(dom.select("Gain", options, gain(), (name) => setParam("gain", name)));
  }

  function gain() {
    const wanted = param("gain", "");
    const known = controllers()[1].gains.map(({ name }) => name);
    return known.includes(wanted) ? wanted : known.find((name) => name === "K_T_a_da") ?? known[0];
  }

  function draw() {
    const { grid } = answer.designed.design;
    const [mine, designed] = controllers();
    const [now, was] = [mine, designed].map(({ gains }) => gains.find(({ name }) => name === gain()));
    const dotted = linesOf(grid, was.values, "as designed, ").map((line, row) => ({ ...line, mode: "lines", showlegend: row === 0, line: { dash: "dot", color: "--line-strong", width: 1.4 } }));
    const heading = `${gain()} [${was.unit}]`;
    const layout = { xaxis: valueAxis(grid.axes[1]), yaxis: { title: { text: heading } }, uirevision: gain(), margin: { l: 72, r: 16, t: 24, b: 48 }, showlegend: dotted.length <= LEGEND_ROWS };
    const failed = mine.outcomes.flat().filter((outcome) => outcome !== "ok").length;
    const label = `${heading} of ${mine.name} over the grid with these weights, beside the design's${failed ? `; ${failed} points have no gains` : ""}`;
    return plot.draw(picture, [...linesOf(grid, now.values), ...dotted], layout, { label, height: 380 });
  }

  function tell() {
    const [mine, designed] = controllers();
    const mark = (passed) => h("span", { class: `tag ${passed ? "good" : passed === null ? "warn" : "bad"}` }, passed ? "met" : passed === null ? "not judged" : "missed");
    const judged = mine.verdicts.map((now) => {
      const was = designed.verdicts.find(({ spec, source }) => spec === now.spec && source === now.source);
      return [`${format.title(now.spec)} (${format.words(now.source)})`, format.number(now.limit), format.number(was?.worst_value), format.number(now.worst_value), mark(now.passed)];
    });
    const [needed, before] = [answer.now, answer.designed].map((one) => one.actuator_requirements.envelope);
    const peaks = Object.entries(needed).flatMap(([actuator, figures]) => PEAKS.map((name) => {
      const [was, now] = [before[actuator][name].value, figures[name].value];
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
