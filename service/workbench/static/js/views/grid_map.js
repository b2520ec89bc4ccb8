/** The envelope as a map: one figure of the design at every grid point; a click or the arrow keys choose a point. */

import { addressOf } from "../permalink.js";
import { drawField } from "./field_map.js";
import { fieldOf, figureOptions, sourceOf } from "./grid_figures.js";
import { drawProof, proofTable } from "./proof_map.js";
import { offer } from "./slow_study.js";

const ARROWS = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0] };
/** Cells that are proved at once; more are begun by a button. */
const QUICK_CELLS = 40;
/** Where to look closer at the chosen point. */
const CLOSER = [["root-locus", "Root locus"], ["response", "Response in time"], ["bode", "Bode plots"]];

export default { id: "map", title: "Map of the envelope", group: "envelope", needs: ["controller", "point"], mount };

function mount(el, { api, state, plot, dom, format, grid, param, setParam, show }) {
  const { h } = dom;
  const choice = h("div", { class: "row" });
  const place = h("div", {});
  const note = h("p", { class: "small muted" });
  const keys = h("div", { tabindex: "0", role: "application", "aria-label": "Map of the grid: arrow keys choose a point", onkeydown: step }, place);
  const facts = h("div", { class: "stack" });
  const cells = h("div", {});
  el.append(choice, h("div", { class: "map-with-facts" }, h("div", { class: "stack" }, keys, note), facts), cells);
  let options = null;
  let picture = null;
  const asked = new Map(); // path -> answer
  update(new Set(["controller"]));
  return { update, unmount: () => picture && plot.forget(picture) };

  function controller() {
    const { design, controller: name } = state.get();
    return design.controllers.find((one) => one.name === name);
  }

  function update(changed) {
    if (changed.has("controller")) {
      options = figureOptions(controller());
      dom.clear(choice).append(dom.select("Colour by", options, figure(), (id) => setParam("figure", id)));
    }
    choice.firstChild.control.value = figure();
    dom.clear(cells);
    note.textContent = "";
    if (figure() === "proof") prove();
    else show(fresh("field"), (signal) => askOnce(sourceOf(figure()), signal), draw);
    tell();
  }

  function figure() {
    const wanted = param("figure", options[0].value);
    return options.some((option) => option.value === wanted) ? wanted : options[0].value;
  }

  /** The place of the picture; fields and proofs have one each, whose axes differ. */
  function fresh(kind) {
    if (picture?.dataset.kind === kind) return picture;
    if (picture) plot.forget(picture);
    picture = h("div", { "data-kind": kind });
    dom.clear(place).append(picture);
    return picture;
  }

  /** Each answer is asked for once, with the first figure that needs it. */
  async function askOnce(path, signal) {
    if (path === null) return null;
    const { designId, controller: name } = state.get();
    const whole = path.startsWith("verification") ? `v1/designs/${designId}/${path}` : `v1/designs/${designId}/controllers/${encodeURIComponent(name)}/${path}`;
    if (!asked.has(whole)) asked.set(whole, await api.get(whole, { signal }));
    return asked.get(whole);
  }

  function draw(answer) {
    const { design, point } = state.get();
    const field = fieldOf(controller(), figure(), answer);
    note.textContent = field.note ?? "";
    return drawField(picture, design, point, field, { of: `controller ${controller().name}`, onPoint: choose });
  }

  function prove() {
    const { design, controller: name } = state.get();
    const path = `verification?controller=${encodeURIComponent(name)}`;
    const [rows, columns] = design.grid.shape;
    const count = Math.max(rows - 1, 1) * Math.max(columns - 1, 1);
    const begin = () => show(fresh("proof"), (signal) => askOnce(path, signal), drawCells);
    if (count <= QUICK_CELLS || asked.has(`v1/designs/${state.get().designId}/${path}`)) begin();
    else offer(fresh("proof"), { label: `Prove ${count} cells`, words: "Stability in every cell between the grid lines: some seconds." }, begin);
  }

  async function drawCells(answer) {
    const { design, point } = state.get();
    const proof = answer.controllers[controller().name];
    await drawProof(picture, design, point, proof, { of: `controller ${controller().name}`, onPoint: choose });
    const { columns, rows } = proofTable(design, proof);
    dom.clear(cells).append(h("p", {}, `${proof.summary.words}.`, proof.reason ? ` ${proof.reason}.` : ""), h("div", { class: "scroll" }, dom.table("Verdicts of the cells", columns, rows)));
  }

  function choose(point) {
    state.set({ point });
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
    choose(row * columns + column);
    dom.live(grid.pointName(design, state.get().point));
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
      h("nav", { class: "row small", "aria-label": "Views of this point" }, CLOSER.map(([view, title]) => h("a", { href: addressOf({ ...state.get(), view, params: {} }) }, title))),
    );
  }
}
