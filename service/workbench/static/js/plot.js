/** Plots: the only place that calls Plotly. Colours follow the theme; every plot says in words what it shows and gives its numbers as a table. */

import { h } from "./dom.js";
import { dataOf } from "./plot_data.js";
import { colour } from "./theme.js";

const CONFIG = { displaylogo: false, showSendToCloud: false, responsive: true };
const DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"];
const SYMBOLS = ["circle", "x", "square", "diamond", "triangle-up", "cross"];
const drawn = new WeakMap(); // element -> what was drawn in it, to draw it again in another theme
let script = null;

document.addEventListener("themechange", () => {
  for (const el of document.querySelectorAll(".plot")) if (drawn.has(el)) render(el, drawn.get(el));
});

/** Colour scale of fields; reads well in grey and to the colour-blind. @type {string} */
export const FIELD = "Cividis";

/**
 * Draw traces in an element, or draw what is there anew.
 * @param {Element} el kept between calls; it gets a canvas and a table of the numbers
 * @param {Object[]} traces of Plotly; lines and markers without style get colours, dashes and symbols by their order; a colour
 *   may be named as in the style sheet, e.g. `--ink`, and then follows the theme
 * @param {Object} layout of Plotly, with such colours; `xaxis: {title: {text}}` with units
 * @param {{label: string, onPick?: function(Object): void, height?: number}} options `label` says in words what is shown; `onPick` is told Plotly's point that was clicked
 * @returns {Promise<void>} when it is drawn
 */
export async function draw(el, traces, layout, { label, onPick, height = 420 }) {
  const plot = { traces, layout, label, onPick, height };
  drawn.set(el, plot);
  await loaded();
  if (drawn.get(el) !== plot || !el.isConnected) return;
  render(el, plot);
}

/**
 * Poles, zeros and branches in the s-plane: equal axes, the imaginary axis marked.
 * @param {Element} el
 * @param {Object[]} traces x: real parts [1/s], y: imaginary parts [rad/s]
 * @param {{label: string, layout?: Object, height?: number, onPick?: function(Object): void}} options
 * @returns {Promise<void>}
 */
export function sPlane(el, traces, { layout = {}, ...options }) {
  const axes = {
    xaxis: { title: { text: "real part [1/s]" }, zeroline: true },
    yaxis: { title: { text: "imaginary part [rad/s]" }, zeroline: true, scaleanchor: "x", scaleratio: 1 },
  };
  return draw(el, traces, { ...axes, ...layout }, { height: 520, ...options });
}

/**
 * Free what Plotly holds of an element that goes away.
 * @param {Element} el
 */
export function forget(el) {
  const canvas = el.querySelector(".plot-canvas");
  if (canvas && globalThis.Plotly) globalThis.Plotly.purge(canvas);
  drawn.delete(el);
}

/** Plotly's script, fetched with the first plot. */
function loaded() {
  script ??= new Promise((resolve, reject) => {
    const failed = () => reject(new Error("the plotting script could not be loaded"));
    const address = new URL(document.documentElement.dataset.plotly, document.baseURI).href;
    document.head.append(h("script", { src: address, onload: resolve, onerror: failed }));
  });
  return script;
}

function render(el, plot) {
  const canvas = canvasOf(el);
  canvas.setAttribute("aria-label", plot.label);
  canvas.style.height = `${plot.height}px`;
  globalThis.Plotly.react(canvas, plot.traces.map(styled).map(coloured), coloured(themed(plot.layout)), CONFIG).then(hideParts);
  if (canvas.dataset.listens !== "yes") {
    canvas.dataset.listens = "yes";
    canvas.on("plotly_click", (event) => drawn.get(el)?.onPick?.(event.points[0]));
  }
  const before = el.querySelector(":scope > details");
  const data = dataOf(plot);
  data.open = before.open;
  before.replaceWith(data);
}

/** The canvas is one picture with a name: its parts, and the drawing that Plotly measures text with, say nothing. */
function hideParts() {
  for (const part of document.querySelectorAll(".plot-canvas svg, #js-plotly-tester")) part.setAttribute("aria-hidden", "true");
}

function canvasOf(el) {
  const canvas = el.querySelector(":scope > .plot-canvas");
  if (canvas) return canvas;
  el.classList.add("plot");
  const made = h("div", { class: "plot-canvas", role: "img" });
  el.replaceChildren(made, h("details"));
  return made;
}

/** Names of the style sheet's colours replaced by the colours that they stand for now; numbers are left alone. */
function coloured(part) {
  if (typeof part === "string") return part.startsWith("--") ? colour(part) : part;
  if (Array.isArray(part)) return part[0] !== null && typeof part[0] === "object" ? part.map(coloured) : part;
  if (part === null || typeof part !== "object" || ArrayBuffer.isView(part)) return part;
  return Object.fromEntries(Object.entries(part).map(([key, value]) => [key, coloured(value)]));
}

/** Style by order where the trace says none, never by colour alone. */
function styled(trace, index) {
  if (!["scatter", "scattergl", undefined].includes(trace.type)) return trace;
  const own = `--series-${(index % 7) + 1}`;
  const mode = trace.mode ?? "lines";
  return {
    ...trace,
    mode,
    line: { color: own, dash: DASHES[index % DASHES.length], width: 1.8, ...trace.line },
    marker: { color: own, symbol: SYMBOLS[index % SYMBOLS.length], size: 8, ...trace.marker },
  };
}

/** A layout that gives its margins keeps them: margins that grow with the labels draw a plot twice. */
function themed(layout) {
  const axis = { gridcolor: "--line", linecolor: "--line-strong", zerolinecolor: "--line-strong", ticks: "outside", tickcolor: "--line-strong", automargin: layout.margin === undefined };
  const axes = Object.keys(layout).filter((key) => /^[xy]axis\d*$/.test(key));
  const themedAxes = Object.fromEntries([...new Set(["xaxis", "yaxis", ...axes])].map((key) => [key, { ...axis, ...layout[key], title: { standoff: 8, ...layout[key]?.title } }]));
  return {
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "--sans", size: 12, color: "--ink" },
    margin: { l: 60, r: 16, t: 24, b: 48 },
    legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 },
    hoverlabel: { bgcolor: "--surface", bordercolor: "--line-strong", font: { color: "--ink" } },
    uirevision: "kept", // zoom stays while numbers change
    ...layout,
    ...themedAxes,
  };
}
