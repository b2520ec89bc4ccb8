/** The weights of a regulator: its poles, step, torques and margins follow them. */

import { drawStep, transient } from "./live/step_plot.js";
import { liveController } from "./live/live.js";
import { WEIGHTS_AT_POINT } from "./live/scope.js";
import { largest, limitLines, limitsOf } from "./limit_lines.js";
import { figureTable, reasonList, verdictLine } from "./point_figures.js";

const STUDIES = ["point", "response"];
const SAMPLES = 301;

export default { id: "point-weights", title: "Weights of a regulator", group: "point", needs: ["controller", "point"], kind: "lqr", mount };

function mount(el, context) {
  const { state, plot, dom } = context;
  const { h } = dom;
  const live = liveController(el, context, { scope: WEIGHTS_AT_POINT, studies: STUDIES, query: () => ({ samples: SAMPLES }), onAnswer });
  const [poles, step, torque] = [h("div", {}), h("div", {}), h("div", {})];
  const figures = h("div", { class: "stack" });
  const left = h("div", { class: "stack" }, h("h4", {}, "Closed-loop poles"), poles, h("h4", {}, "Torques"), torque);
  live.body.append(h("div", { class: "live-pair" }, left, h("div", { class: "stack" }, h("h4", {}, "Step response"), step, figures)));
  let extent = null;
  live.start();
  return { update, unmount };

  function unmount() {
    live.unmount();
    [poles, step, torque].forEach(plot.forget);
  }

  function update(changed) {
    if (WEIGHTS_AT_POINT.of.some((key) => changed.has(key))) extent = null;
    live.update(changed);
  }

  async function onAnswer({ now, designed }) {
    const [mine, first] = [now.point.controllers[0], designed.point.controllers[0]];
    dom.clear(figures).append(verdictLine(mine), figureTable(mine, first), reasonList(mine));
    await Promise.all([
      drawPoles(mine, first, now.point.poles),
      drawStep(step, plot, { now: now.response, designed: designed.response, step: first.step }),
      drawTorques(now.response, designed.response, transient(designed.response, first.step)),
    ]);
  }

  function drawPoles(mine, first, open) {
    const points = (name, found, marker) => ({ name, mode: "markers", x: found.map(({ re }) => re), y: found.map(({ im }) => im), marker });
    extent ??= 1.2 * Math.max(...first.poles.map(({ re, im }) => Math.hypot(re, im)));
    const traces = [
      points("open loop", open, { symbol: "x-thin", size: 9, color: "--ink", line: { width: 1.8, color: "--ink" } }),
      points("as designed", first.poles, { symbol: "circle-open", size: 11, color: "--line-strong" }),
      points("now", mine.poles, { symbol: "circle", size: 8, color: "--series-2" }),
    ];
    const ranges = {
      xaxis: { title: { text: "real part [1/s]" }, range: [-1.2 * extent, 0.3 * extent] },
      yaxis: { title: { text: "imaginary part [rad/s]" }, range: [-0.6 * extent, 0.6 * extent], scaleanchor: "x", scaleratio: 1 },
    };
    const fastest = Math.max(...mine.poles.map(({ re }) => re));
    return plot.sPlane(poles, traces, { label: `Closed-loop poles of ${mine.name}: the slowest has the real part ${fastest.toPrecision(4)} 1/s`, layout: { ...ranges, margin: { l: 60, r: 12, t: 12, b: 44 } }, height: 360 });
  }

  function drawTorques(now, first, range) {
    const limits = limitsOf(state.get().design, state.get().controller);
    const line = (response, surface, signal, more) => ({ name: surface, x: response.time_s, y: response.signals[signal], mode: "lines", ...more });
    const most = largest(now.signals.T_a_n_m, now.signals.T_t_n_m);
    const traces = [
      line(now, "aileron", "T_a_n_m", { line: { width: 2.2 } }),
      line(now, "tab", "T_t_n_m", { line: { width: 2.2 } }),
      line(first, "aileron as designed", "T_a_n_m", { line: { color: "--line-strong", width: 1.2, dash: "solid" } }),
      line(first, "tab as designed", "T_t_n_m", { line: { color: "--line-strong", width: 1.2, dash: "dot" } }),
    ];
    const layout = { xaxis: { title: { text: "time [s]" }, range }, uirevision: String(range), yaxis: { title: { text: "torque [N m]" } }, margin: { l: 56, r: 12, t: 12, b: 44 }, ...limitLines(limits, "torque_n_m", 2 * most) };
    return plot.draw(torque, traces, layout, { label: `Torques of the actuators over the reference step; the largest is ${most.toPrecision(4)} N m`, height: 280 });
  }
}
