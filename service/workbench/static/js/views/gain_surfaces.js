/** Gains over the grid: lines over the last axis, contours, a surface; and between the points, as the schedule reads them. */

import { categoriesOf, linesOf, valueAxis } from "./envelope_axes.js";
import { viewContext } from "./context.js";

const KINDS = [{ value: "lines", label: "lines" }, { value: "contour", label: "contours" }, { value: "surface", label: "surface in three dimensions" }];
const RULES = [{ value: "multilinear", label: "multilinear (of the files)" }, { value: "monotone_cubic", label: "monotone cubic" }];
const PROBE_DELAY = 60; // ms that a slider rests before it is asked for

export default { id: "gains", title: "Gain surfaces", group: "envelope", needs: ["controller"], mount };

function mount(el, context) {
  const { api, state, plot, dom, format, param, setParam } = context;
  const { h } = dom;
  const probing = viewContext({ api, state });
  const choice = h("div", { class: "row" });
  const pictures = h("div", { class: "small-plots" });
  const sliders = h("div", { class: "row" });
  const between = h("div", {});
  el.append(choice, pictures, h("h4", {}, "Between the points"), sliders, between);
  let timer = null;
  let found = null; // gains where the sliders stand
  start();
  return { update, unmount };

  function unmount() {
    window.clearTimeout(timer);
    probing.end();
    forget();
  }

  function forget() {
    for (const one of pictures.children) plot.forget(one);
  }

  function controller() {
    const { design, controller: name } = state.get();
    return design.controllers.find((one) => one.name === name);
  }

  function start() {
    const all = [{ value: "", label: "all gains" }, ...controller().gains.map(({ name }) => ({ value: name, label: name }))];
    dom.clear(choice).append(
      dom.select("Gain", all, gain(), (name) => setParam("gain", name || null)),
      dom.select("As", KINDS, kind(), (chosen) => setParam("as", chosen)),
      dom.select("Read between points", RULES, rule(), (chosen) => setParam("rule", chosen)),
    );
    const { axes } = state.get().design.grid;
    dom.clear(sliders).append(...axes.map((axis, index) => probe(axis, index)));
    found = null;
    draw();
    read();
  }

  function update(changed) {
    if (changed.has("controller")) return start();
    draw();
    schedule();
    return undefined;
  }

  function gain() {
    const wanted = param("gain", "");
    return controller().gains.some(({ name }) => name === wanted) ? wanted : "";
  }

  function kind() {
    const wanted = param("as", "lines");
    return KINDS.some(({ value }) => value === wanted) ? wanted : "lines";
  }

  function rule() {
    const wanted = param("rule", "multilinear");
    return RULES.some(({ value }) => value === wanted) ? wanted : "multilinear";
  }

  /** Where the schedule is read on an axis: the middle of it unless the address says. */
  function where(index) {
    const { values } = state.get().design.grid.axes[index];
    const [low, high] = [values[0], values.at(-1)];
    const wanted = Number(param(`at${index}`, String((low + high) / 2)));
    return Number.isFinite(wanted) ? Math.min(Math.max(wanted, low), high) : low;
  }

  function probe({ name, values }, index) {
    const [min, max] = [values[0], values.at(-1)];
    if (min === max) return h("span", { class: "muted" }, `${format.words(name)} ${format.quantity(min, format.unitOf(name))}`);
    const options = { unit: format.unitOf(name), min, max, step: (max - min) / 200, format: (value) => format.number(value) };
    return dom.slider(format.words(name), where(index), options, (value) => setParam(`at${index}`, String(value)));
  }

  function schedule() {
    window.clearTimeout(timer);
    timer = window.setTimeout(read, PROBE_DELAY);
  }

  function read() {
    const { design, designId, controller: name } = state.get();
    const coordinates = Object.fromEntries(design.grid.axes.map((axis, index) => [axis.name, where(index)]));
    const path = `v1/designs/${designId}/controllers/${encodeURIComponent(name)}/gains`;
    probing.show(between, (signal) => api.get(path, { signal, query: { ...coordinates, rule: rule() } }), tell);
  }

  function tell(answer) {
    found = answer.gains ? answer : null;
    if (answer.reason) {
      dom.message(between, "empty", answer.reason);
    } else {
      const rows = Object.entries(answer.gains).map(([name, value]) => [name, format.number(value, 6), answer.units[name]]);
      const flagged = answer.clipped ? " Clipped to the edge of the grid." : "";
      dom.clear(between).append(h("p", { class: "small muted" }, `${answer.law}; read ${answer.rule}.${flagged}`), dom.table("Gains between the points", ["gain", "value", "unit"], rows));
    }
    return draw();
  }

  function draw() {
    const shown = controller().gains.filter(({ name }) => gain() === "" || name === gain());
    if (!shown.length) return dom.message(pictures, "empty", "This controller has no gains.");
    const key = `${kind()} ${shown.map(({ name }) => name).join(" ")}`;
    if (pictures.dataset.key !== key) {
      forget();
      dom.clear(pictures).append(...shown.map(() => h("div", {})));
      pictures.dataset.key = key;
      pictures.classList.toggle("one", shown.length === 1);
    }
    return Promise.all(shown.map((one, index) => drawGain(pictures.children[index], one, shown.length === 1)));
  }

  function drawGain(place, { name, unit, values }, alone) {
    const { grid } = state.get().design;
    const [rows, columns] = grid.axes;
    const heading = unit === "1" ? name : `${name} [${unit}]`;
    const label = `${heading} of controller ${controller().name} over the grid, as ${KINDS.find(({ value }) => value === kind()).label}`;
    const size = { height: alone ? 460 : 300 };
    const numbers = { z: values, x: columns.values, y: rows.values, name: heading };
    if (kind() === "surface") {
      const scene = { xaxis: { title: { text: format.title(columns.name) } }, yaxis: { title: { text: format.title(rows.name) } }, zaxis: { title: { text: heading } }, aspectmode: "manual", aspectratio: { x: 1.3, y: 1.3, z: 0.8 }, camera: { eye: { x: 1.5, y: -1.7, z: 1 } } };
      return plot.draw(place, [{ ...numbers, type: "surface", colorscale: plot.FIELD, showscale: alone }], { scene, margin: { l: 0, r: 0, t: 8, b: 0 } }, { label, ...size });
    }
    if (kind() === "contour") {
      if (rows.values.length < 2 || columns.values.length < 2) return dom.message(place, "empty", "Contours need two values on each axis of the grid.");
      const trace = { ...numbers, type: "contour", colorscale: plot.FIELD, contours: { showlabels: true }, connectgaps: false, colorbar: { title: { text: heading, side: "right" }, thickness: 14 } };
      return plot.draw(place, [trace], { xaxis: valueAxis(columns), yaxis: valueAxis(rows) }, { label, ...size });
    }
    const layout = { xaxis: valueAxis(columns), yaxis: { title: { text: heading } }, showlegend: alone || rows.values.length <= 3 };
    return plot.draw(place, [...linesOf(grid, values), ...reading(name, columns)], layout, { label: `${label}; a line for each of ${categoriesOf(rows).join(", ")} (${format.title(rows.name)})`, ...size });
  }

  /** What the schedule gives where the sliders stand. */
  function reading(name, columns) {
    if (!found || found.gains[name] === undefined || found.name !== controller().name) return [];
    const marker = { symbol: "diamond", size: 13, color: "#d55e00", line: { width: 1.5, color: "#ffffff" } };
    return [{ name: `read ${found.rule}`, mode: "markers", x: [found.coordinates[columns.name]], y: [found.gains[name]], marker }];
  }
}
