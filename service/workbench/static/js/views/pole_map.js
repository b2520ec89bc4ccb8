/** Closed-loop poles of every grid point at once: coloured by the last axis, a symbol for each value of the first. */

import { MARKER_SCALE } from "./envelope_axes.js";
import { plantOf } from "./plant_request.js";

const SYMBOLS = ["circle-open", "x-thin-open", "square-open", "diamond-open", "triangle-up-open", "cross-thin-open", "triangle-down-open", "star-open", "hexagon-open", "pentagon-open"];
/** How many of each point's slowest poles are sure to be in the picture. */
const RANGES = [{ value: "2", label: "the two slowest of each point" }, { value: "4", label: "the four slowest of each point" }, { value: "all", label: "all poles" }];
const PLANTS = [{ value: "closed", label: "closed loop" }, { value: "both", label: "closed loop and plant" }];

export default { id: "poles", title: "Poles over the envelope", group: "envelope", needs: ["controller", "point"], mount };

function mount(el, { api, state, plot, dom, format, grid, param, setParam, show }) {
  const { h } = dom;
  const choice = h("div", { class: "row" });
  const picture = h("div", {});
  el.append(choice, picture);
  const asked = new Map(); // controller, or null for the plant -> what the service answered
  choice.append(
    dom.select("Range", RANGES, range(), (value) => setParam("range", value)),
    dom.select("Poles of", PLANTS, plants(), (value) => setParam("of", value)),
  );
  update();
  return { update, unmount: () => plot.forget(picture) };

  function range() {
    const wanted = param("range", "4");
    return RANGES.some(({ value }) => value === wanted) ? wanted : "4";
  }

  function plants() {
    return param("of", "closed") === "both" ? "both" : "closed";
  }

  function update() {
    show(picture, (signal) => Promise.all([closedLoop(signal), plants() === "both" ? plant(signal) : []]), draw);
  }

  /** Poles of the closed loop: one list a point, empty where the controller has no gains. */
  async function closedLoop(signal) {
    const { designId, controller } = state.get();
    if (!asked.has(controller)) asked.set(controller, (await api.get(`v1/designs/${designId}/controllers/${encodeURIComponent(controller)}/figures`, { signal })).poles.flat());
    return asked.get(controller).map((poles) => poles ?? []);
  }

  /** Poles of the plant alone: one list a point, empty where there is no plant. */
  async function plant(signal) {
    if (!asked.has(null)) asked.set(null, (await api.post("v1/linear-models", plantOf(state.get().design), { signal })).points);
    const found = Array.from({ length: grid.pointCount(state.get().design) }, () => []);
    for (const { index, poles } of asked.get(null)) found[index] = poles ?? [];
    return found;
  }

  function draw([own, free]) {
    const { design, controller, point } = state.get();
    if (own.every((poles) => !poles.length)) return dom.message(picture, "empty", `Controller ${controller} has no gains at any point, hence no poles.`);
    const [rows, columns] = design.grid.axes;
    const names = rows.values.map((value) => `${format.words(rows.name)} ${format.quantity(value, format.unitOf(rows.name))}`);
    const traces = [...names.map((name, row) => ofRow(own, row, name)), ...names.map(ofLegend)];
    if (plants() === "both") traces.push(ofPlant(free));
    traces.push(ofChosen(own[point] ?? [], point));
    const shown = plants() === "both" ? [...own, ...free] : own;
    const radius = range() === "all" ? null : slowRadius(shown, Number(range()));
    const limits = radius ? { xaxis: axis("real part [1/s]", [-radius, 0.25 * radius]), yaxis: axis("imaginary part [rad/s]", [-radius, radius], "x") } : {};
    const last = columns.values.length > 1 ? columns.values : [columns.values[0], columns.values[0] + 1];
    const coloraxis = { colorscale: MARKER_SCALE, cmin: last[0], cmax: last.at(-1), colorbar: { title: { text: format.title(columns.name), side: "right" }, thickness: 14 } };
    const worst = Math.max(...own.flat().map(({ re }) => re));
    const label = `Poles of controller ${controller} at ${own.length} points, largest real part ${format.number(worst)} 1/s; chosen is ${grid.pointName(design, point)}`;
    return plot.sPlane(picture, traces, { label, layout: { ...limits, coloraxis, uirevision: `${range()} ${plants()} ${controller}` }, onPick: ({ customdata }) => state.set({ point: customdata }) });
  }

  function ofRow(own, row, name) {
    const { grid: { axes: [, columns] } } = state.get().design;
    const width = columns.values.length;
    const entries = own.slice(row * width, (row + 1) * width).flatMap((poles, column) => poles.map((pole) => ({ pole, column, point: row * width + column })));
    return { ...trace(name, entries, { symbol: SYMBOLS[row % SYMBOLS.length], color: entries.map(({ column }) => columns.values[column]), coloraxis: "coloraxis", size: 10, line: { width: 2 } }), showlegend: false };
  }

  /** An entry of the legend: of a trace coloured by a scale Plotly has no single colour to draw there. */
  function ofLegend(name, row) {
    return { name, mode: "markers", x: [null], y: [null], hoverinfo: "skip", marker: { symbol: SYMBOLS[row % SYMBOLS.length], size: 10, color: "--line-strong", line: { width: 2 } } };
  }

  function ofPlant(free) {
    const entries = free.flatMap((poles, point) => poles.map((pole) => ({ pole, point })));
    return trace("plant, no control", entries, { symbol: "asterisk-open", size: 8, color: "--line-strong", line: { width: 1.2, color: "--line-strong" } });
  }

  function ofChosen(poles, point) {
    return trace("chosen point", poles.map((pole) => ({ pole, point })), { symbol: "circle-open", size: 18, color: "#d55e00", line: { width: 2, color: "#d55e00" } });
  }

  function trace(name, entries, marker) {
    const { design } = state.get();
    const damping = ({ re, im }) => format.number(-re / Math.hypot(re, im));
    return {
      name,
      mode: "markers",
      x: entries.map(({ pole }) => pole.re),
      y: entries.map(({ pole }) => pole.im),
      customdata: entries.map(({ point }) => point),
      text: entries.map(({ pole, point }) => `${grid.pointName(design, point)}<br>${format.complex(pole)}, damping ratio ${damping(pole)}`),
      hovertemplate: "%{text}<extra></extra>",
      marker,
    };
  }

  function axis(title, shown, anchor = null) {
    return { title: { text: title }, range: shown, ...(anchor ? { scaleanchor: anchor, scaleratio: 1 } : { constraintoward: "right" }) };
  }
}

/** Radius that holds the slowest poles of every point, with a margin. */
function slowRadius(all, count) {
  const last = (poles) => poles.map(({ re, im }) => Math.hypot(re, im)).sort((one, other) => one - other).slice(0, count).at(-1) ?? 0;
  return 1.15 * Math.max(...all.map(last), 1e-9);
}
