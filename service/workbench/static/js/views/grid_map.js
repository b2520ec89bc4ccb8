/** The envelope as a map: one figure of the design at every grid point; a click or the arrow keys choose a point. */

import { fieldOf, figureOptions, needsVerdicts } from "./grid_figures.js";

const ARROWS = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0] };

export default { id: "map", title: "Map of the envelope", group: "envelope", needs: ["controller", "point"], mount };

function mount(el, { api, state, plot, dom, format, grid, param, setParam, show }) {
  const { h } = dom;
  const choice = h("div", { class: "row" });
  const picture = h("div", {});
  const keys = h("div", { tabindex: "0", role: "application", "aria-label": "Map of the grid: arrow keys choose a point", onkeydown: step }, picture);
  const facts = h("div", { class: "stack" });
  el.append(choice, h("div", { class: "map-with-facts" }, keys, facts));
  let options = null;
  let judged = null;
  update(new Set(["controller"]));
  return { update, unmount: () => plot.forget(picture) };

  function controller() {
    const { design, controller: name } = state.get();
    return design.controllers.find((one) => one.name === name);
  }

  function update(changed) {
    if (changed.has("controller")) {
      options = figureOptions(controller());
      judged = null;
      const select = dom.select("Colour by", options, figure(), (id) => setParam("figure", id));
      dom.clear(choice).append(select);
    }
    show(picture, judge, draw);
    tell();
  }

  /** Verdicts at every point are asked for with the first of them. */
  async function judge(signal) {
    const { designId, controller: name } = state.get();
    if (needsVerdicts(figure())) judged ??= await api.get(`v1/designs/${designId}/controllers/${name}/verdicts`, { signal });
    return judged;
  }

  function figure() {
    const asked = param("figure", options[0].value);
    return options.some((option) => option.value === asked) ? asked : options[0].value;
  }

  function draw() {
    const { design, point } = state.get();
    const field = fieldOf(controller(), figure(), judged);
    const [rows, columns] = design.grid.axes;
    const [i, j] = grid.placeOf(design, point);
    const heat = {
      type: "heatmap",
      z: field.z,
      x: columns.values.map((_, index) => index),
      y: rows.values.map((_, index) => index),
      text: field.text,
      texttemplate: design.grid.shape[1] <= 12 ? "%{text}" : "",
      hovertemplate: "%{text}<extra></extra>",
      colorscale: field.scale ?? plot.FIELD,
      ...field.range,
      showscale: field.showScale,
      colorbar: { title: { text: field.title, side: "right" }, thickness: 14 },
      xgap: 1,
      ygap: 1,
      name: field.title,
    };
    const mark = { type: "rect", x0: j - 0.5, x1: j + 0.5, y0: i - 0.5, y1: i + 0.5, line: { width: 4, color: "#d55e00" } };
    const label = `${field.title} of controller ${controller().name} over the grid; chosen is ${grid.pointName(design, point)}: ${field.text[i][j].replace("<br>", ", ")}`;
    return plot.draw(picture, [heat], { xaxis: ticks(format, columns), yaxis: ticks(format, rows), shapes: [mark] }, { label, onPick: pick, height: Math.min(560, 170 + 60 * rows.values.length) });
  }

  function pick({ x, y }) {
    const { design } = state.get();
    state.set({ point: y * design.grid.shape[1] + x });
  }

  function step(event) {
    const move = ARROWS[event.key];
    if (!move) return;
    event.preventDefault();
    const { design, point } = state.get();
    const [i, j] = grid.placeOf(design, point);
    const [rows, columns] = design.grid.shape;
    const row = Math.min(Math.max(i + move[0], 0), rows - 1);
    const column = Math.min(Math.max(j + move[1], 0), columns - 1);
    state.set({ point: row * columns + column });
    dom.live(`${grid.pointName(design, state.get().point)}`);
  }

  /** The chosen point in figures. */
  function tell() {
    const { design, point } = state.get();
    const [i, j] = grid.placeOf(design, point);
    const own = controller();
    const air = Object.entries(design.air).map(([name, values]) => [format.words(name), format.quantity(values[i][j], format.unitOf(name))]);
    const gains = own.gains.map(({ name, unit, values }) => [name, format.quantity(values[i][j], unit)]);
    const list = (pairs) => h("dl", { class: "facts" }, pairs.map(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]));
    const outcome = own.outcomes[i][j];
    const reason = own.reasons[i][j];
    dom.clear(facts).append(
      h("h4", {}, `Point ${point}`), list(air),
      h("h4", {}, `Gains of ${own.name}`),
      h("p", {}, h("span", { class: `tag ${outcome === "ok" ? "good" : "bad"}` }, outcome.replaceAll("_", " ")), reason ? ` ${reason}` : ""),
      list(gains),
    );
  }
}

function ticks(format, { name, values }) {
  return {
    title: { text: format.title(name) },
    tickvals: values.map((_, index) => index),
    ticktext: values.map((value) => format.number(value)),
    showgrid: false,
    zeroline: false,
  };
}
