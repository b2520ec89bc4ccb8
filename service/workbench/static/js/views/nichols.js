/** The loop as a Nichols or a Nyquist plot, with its margins and the disk that it stays out of. */

import { frequencyView } from "./live/frequency_view.js";
import { circle, cutLoop, diskCircle, marginMarks, short } from "./loop_curves.js";

const FREQUENCIES = 400;
const CLOSED_LOOP_DB = [-20, -12, -6, -3, 0, 1, 3, 6, 12];
const WINDOW_DB = [-36, 36];
const REACH = 2.6;

export default { id: "nichols", title: "Nichols and Nyquist", group: "point", needs: ["controller", "point"], mount };

function mount(el, context) {
  const { plot, dom, param, setParam } = context;
  return frequencyView(el, context, { frequencies: FREQUENCIES, choices, draw });

  function inputs({ designed }) {
    return Object.keys(designed.point.controllers[0].margins);
  }

  function cut(answer) {
    return inputs(answer).includes(param("cut", null)) ? param("cut", null) : inputs(answer)[0];
  }

  function nyquist() {
    return param("form", "nichols") === "nyquist";
  }

  function choices(answer) {
    const loops = inputs(answer).map((input) => ({ value: input, label: `opened at the ${input}` }));
    return [
      dom.select("Loop", loops, cut(answer), (value) => setParam("cut", value)),
      dom.checkbox("Nyquist plot", nyquist(), (on) => setParam("form", on ? "nyquist" : null)),
    ];
  }

  function draw(picture, answer) {
    const input = cut(answer);
    const [mine, first] = [answer.now, answer.designed].map((one) => cutLoop(one.frequency_response, input));
    const margins = answer.now.point.controllers[0].margins[input];
    const marks = marginMarks(mine, margins);
    const said = marks.map(({ words, omega }) => `${words} at ${short(omega)} rad/s`).join(", ") || "no margin is finite";
    const { traces, layout } = nyquist() ? nyquistPlot(mine, first, marks, margins) : nicholsPlot(mine, first, marks, margins);
    return plot.draw(picture, traces, layout, { label: `${nyquist() ? "Nyquist" : "Nichols"} plot of the loop opened at the ${input}: ${said}`, height: 600 });
  }
}

function curve(name, x, y, line, omega) {
  return { name, x, y, mode: "lines", line, customdata: omega, hovertemplate: "%{x:.4g}, %{y:.4g}<br>%{customdata:.4g} rad/s<extra></extra>" };
}

function markers(marks, read) {
  const style = { gain: ["diamond", "--series-2"], phase: ["square", "--series-3"], delay: ["circle-open", "--series-5"], disk: ["cross-open", "--series-4"] };
  return Object.entries(style).flatMap(([kind, [symbol, name]]) => {
    const own = marks.filter((mark) => mark.kind === kind);
    if (!own.length) return [];
    const points = own.map(read);
    const words = own.map((mark) => mark.words);
    const marker = { symbol, size: kind === "delay" ? 14 : 10, color: name, line: { width: 2 } };
    return [{ name: own.length === 1 ? words[0] : `${kind} margins`, x: points.map(([x]) => x), y: points.map(([, y]) => y), text: words, hoverinfo: "text", mode: "markers", marker }];
  });
}

const NOW = { color: "--series-1", width: 2.2, dash: "solid" };
const DESIGNED = { color: "--line-strong", width: 1.3, dash: "dash" };
const DISK = { mode: "lines", line: { color: "--series-4", dash: "dot", width: 1.6 }, fill: "toself", fillcolor: "rgba(204, 121, 167, 0.12)", hoverinfo: "skip" };

function nicholsPlot(mine, first, marks, margins) {
  const phases = mine.phase.filter((value, k) => value !== null && mine.db[k] > WINDOW_DB[0] && mine.db[k] < WINDOW_DB[1]);
  const turns = halfTurns(phases.length ? phases : [-180]);
  const range = [90 * Math.floor(Math.min(...phases, turns[0] - 90) / 90), 90 * Math.ceil(Math.max(...phases, turns.at(-1) + 90) / 90)];
  const disk = turns.flatMap((turn) => [...diskCircle(margins.disk_margin).map((value) => place(value, turn)), [null, null]]);
  const traces = [
    ...closedLoopLines(turns),
    ...(disk.length > turns.length ? [{ name: "disk", x: disk.map(([x]) => x), y: disk.map(([, y]) => y), ...DISK }] : []),
    curve("as designed", first.phase, first.db, DESIGNED, first.omega),
    curve("loop", mine.phase, mine.db, NOW, mine.omega),
    { name: "critical", x: turns, y: turns.map(() => 0), mode: "markers", marker: { symbol: "x", size: 10, color: "--bad" } },
    ...markers(marks, ({ phase, db }) => [phase, db]),
  ];
  const layout = {
    xaxis: { title: { text: "phase [deg]" }, dtick: 45, range },
    yaxis: { title: { text: "magnitude [dB]" }, range: WINDOW_DB },
    annotations: closedLoopNames(turns),
    margin: { l: 60, r: 14, t: 12, b: 46 },
    uirevision: `nichols ${range}`,
  };
  return { traces, layout };
}

/** Odd half turns that a curve comes near. */
function halfTurns(phases) {
  const [low, high] = [Math.min(...phases), Math.max(...phases)];
  const all = [-900, -540, -180, 180, 540].filter((turn) => turn > low - 180 && turn < high + 180);
  return all.length ? all : [-180];
}

/** A value of the loop as phase within half a turn of an odd half turn, and magnitude. */
function place({ re, im }, turn) {
  return [turn + (Math.atan2(-im, -re) * 180) / Math.PI, 20 * Math.log10(Math.hypot(re, im))];
}

/** Lines of constant closed-loop magnitude |T|, as one trace. */
function closedLoopLines(turns) {
  const points = turns.flatMap((turn) => CLOSED_LOOP_DB.flatMap((db) => [...closedLoopLine(10 ** (db / 20)).map((value) => place(value, turn)).sort(([a], [b]) => (db <= 0 ? a - b : 0)), [null, null]]));
  return [{ name: "|T| [dB]", x: points.map(([x]) => x), y: points.map(([, y]) => y), mode: "lines", hoverinfo: "skip", line: { color: "--line-strong", width: 0.7, dash: "solid" } }];
}

/** L = T / (1 - T) for T of one magnitude. */
function closedLoopLine(size) {
  const angles = Array.from({ length: 180 }, (_, k) => ((k + 0.5) * 2 * Math.PI) / 180);
  return angles.map((angle) => {
    const [re, im] = [size * Math.cos(angle), size * Math.sin(angle)];
    const below = (1 - re) ** 2 + im ** 2;
    return { re: (re * (1 - re) - im ** 2) / below, im: im / below };
  });
}

function closedLoopNames(turns) {
  const turn = turns.at(-1);
  return CLOSED_LOOP_DB.filter((db) => db < 0).map((db) => {
    const size = 10 ** (db / 20);
    const [, y] = place({ re: size / (1 - size), im: 0 }, turn);
    return { x: turn + 179, y: y > WINDOW_DB[1] ? WINDOW_DB[1] : y, text: `${short(db)} dB`, showarrow: false, xanchor: "right", yanchor: "bottom", font: { size: 10, color: "--muted" } };
  });
}

function nyquistPlot(mine, first, marks, margins) {
  const mirrored = mine.im.map((value) => (value === null ? null : -value));
  const read = (points) => ({ x: points.map(({ re }) => re), y: points.map(({ im }) => im) });
  const disk = diskCircle(margins.disk_margin);
  const traces = [
    { name: "unit circle", ...read(circle(0, 1)), mode: "lines", hoverinfo: "skip", line: { color: "--line-strong", width: 1, dash: "dot" } },
    ...(disk.length ? [{ name: "disk", ...read(disk), ...DISK }] : []),
    curve("as designed", first.re, first.im, DESIGNED, first.omega),
    curve("negative frequencies", mine.re, mirrored, { color: "--series-1", width: 1, dash: "dot" }, mine.omega),
    curve("loop", mine.re, mine.im, NOW, mine.omega),
    { name: "critical", x: [-1], y: [0], mode: "markers", marker: { symbol: "x", size: 10, color: "--bad" } },
    ...markers(marks, ({ phase, db }) => [10 ** (db / 20) * Math.cos((phase * Math.PI) / 180), 10 ** (db / 20) * Math.sin((phase * Math.PI) / 180)]),
  ];
  const layout = {
    xaxis: { title: { text: "real part" }, range: [-REACH, REACH] },
    yaxis: { title: { text: "imaginary part" }, range: [-REACH, REACH], scaleanchor: "x", scaleratio: 1 },
    margin: { l: 60, r: 14, t: 12, b: 46 },
    uirevision: "nyquist",
  };
  return { traces, layout };
}
