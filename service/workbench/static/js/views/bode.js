/** Bode plots of the loop with its margins, and of what else the loop does: S, T, KS, reference, disturbances, noise. */

import { frequencyView } from "./live/frequency_view.js";
import { cutLoop, decibels, marginMarks } from "./loop_curves.js";

const FREQUENCIES = 240;
const SETS = {
  sensitivity: "Sensitivity S",
  complementary: "Complementary sensitivity T",
  control: "To the command (KS)",
  reference: "Of the reference",
  disturbance: "Of a disturbance",
  noise: "Of measurement noise",
};

export default { id: "bode", title: "Bode plots", group: "point", needs: ["controller", "point"], mount };

function mount(el, context) {
  const { plot, dom, param, setParam } = context;
  return frequencyView(el, context, { frequencies: FREQUENCIES, choices, draw });

  function options({ designed: { frequency_response: found, point } }) {
    if (!found) return [];
    const loops = Object.keys(point.controllers[0].margins).map((input) => ({ value: `loop.${input}`, label: `L, opened at the ${input}`, group: "Loop" }));
    const pairs = Object.entries(SETS).flatMap(([set, group]) => found[set].map(({ from, to, unit }) => ({ value: `${set}.${from}.${to}`, label: `${from} to ${to}${unit === "1" ? "" : ` [${unit}]`}`, group })));
    return [...loops, ...pairs];
  }

  function chosen(answer) {
    const all = options(answer);
    return all.find(({ value }) => value === param("transfer", null)) ?? all[0];
  }

  function choices(answer) {
    const all = options(answer);
    return all.length ? [dom.select("Transfer", all, chosen(answer).value, (value) => setParam("transfer", value))] : [];
  }

  function draw(picture, answer) {
    const { value, label, group } = chosen(answer);
    const [set, from, to] = value.split(".");
    const curveOf = ({ frequency_response: found }) => (set === "loop" ? cutLoop(found, from) : decibels(found, found[set].find((one) => one.from === from && one.to === to)));
    const [mine, first] = [curveOf(answer.now), curveOf(answer.designed)];
    const marks = set === "loop" ? marginMarks(mine, answer.now.point.controllers[0].margins[from]) : [];
    const traces = [...curveTraces(first, "as designed", { color: "--line-strong", width: 1.3, dash: "dash" }), ...curveTraces(mine, "now", { color: "--series-1", width: 2.2, dash: "solid" }), ...markTraces(marks)];
    const said = marks.map(({ words, omega }) => `${words} at ${omega.toPrecision(4)} rad/s`).join(", ");
    return plot.draw(picture, traces, layout(marks), { label: `Magnitude and phase over frequency: ${group}, ${label}${said ? `; ${said}` : ""}`, height: 560 });
  }
}

function curveTraces({ omega, db, phase }, name, line) {
  return [
    { name: `magnitude ${name}`, x: omega, y: db, mode: "lines", line },
    { name: `phase ${name}`, x: omega, y: phase, mode: "lines", line, yaxis: "y2", showlegend: false },
  ];
}

/** Gain margins reach to 0 dB, phase margins to an odd half turn. */
function markTraces(marks) {
  const of = (kind) => marks.filter((mark) => mark.kind === kind);
  const segments = (found, read) => ({ x: found.flatMap(({ omega }) => [omega, omega, null]), y: found.flatMap((mark) => [...read(mark), null]) });
  const style = (color, symbol) => ({ mode: "lines+markers", line: { color, dash: "solid", width: 2 }, marker: { color, symbol, size: 7 } });
  const traces = [
    { name: "gain margins", ...segments(of("gain"), ({ db }) => [db, 0]), ...style("--series-2", "diamond") },
    { name: "phase margins", yaxis: "y2", ...segments(of("phase"), ({ phase, size }) => [phase, phase - size]), ...style("--series-3", "square") },
    { name: "nearest to the disk", x: of("disk").map(({ omega }) => omega), y: of("disk").map(({ db }) => db), mode: "markers", marker: { color: "--series-4", symbol: "circle-open", size: 11, line: { width: 2 } } },
  ];
  return traces.filter(({ x }) => x.length);
}

function layout(marks) {
  const turns = [...new Set(marks.filter(({ kind }) => kind === "phase").map(({ phase, size }) => Math.round(phase - size)))];
  const line = (yref, y) => ({ type: "line", xref: "paper", x0: 0, x1: 1, yref, y0: y, y1: y, line: { color: "--line-strong", width: 1, dash: "dot" } });
  const note = (mark, yref, y) => ({ xref: "x", yref, x: Math.log10(mark.omega), y, text: mark.words, showarrow: false, xanchor: "left", xshift: 8, font: { size: 11 } });
  const beside = { gain: (mark) => note(mark, "y", mark.db / 2), phase: (mark) => note(mark, "y2", mark.phase - mark.size / 2) };
  return {
    xaxis: { type: "log", title: { text: "frequency [rad/s]" }, anchor: "y2" },
    yaxis: { title: { text: "magnitude [dB]" }, domain: [0.44, 1] },
    yaxis2: { title: { text: "phase [deg]" }, domain: [0, 0.38], dtick: 90 },
    shapes: marks.length ? [line("y", 0), ...turns.map((turn) => line("y2", turn))] : [],
    annotations: marks.filter(({ kind }) => beside[kind]).map((mark) => beside[mark.kind](mark)),
    margin: { l: 62, r: 14, t: 12, b: 46 },
  };
}
