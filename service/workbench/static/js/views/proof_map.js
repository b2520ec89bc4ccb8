/** The proof between the grid lines: a cell with its verdict as a letter and a colour, points where a loop is not stable. */

import { number, quantity, unitOf, words } from "../format.js";
import { placeOf, pointName } from "../grid.js";
import * as plot from "../plot.js";
import { valueAxis } from "./envelope_axes.js";

/** Order of the scale; the letter stands in the cell. */
const VERDICTS = ["proved", "undecided", "sampled", "refuted"];
const LETTERS = { proved: "P", undecided: "?", sampled: "S", refuted: "R" };
const SHADES = ["#56b4e9", "#f0e442", "#c5ccd3", "#d55e00"];
const SCALE = SHADES.flatMap((shade, index) => [[index / 4, shade], [(index + 1) / 4, shade]]);

/**
 * Draw the cells of one controller, the grid's points between them and what refutes a cell.
 * @param {Element} el
 * @param {Object} design
 * @param {number} point the chosen one
 * @param {Object} proof of the controller, as the verification answers it: `cells`, `summary`
 * @param {{of: string, onPoint: function(number): void}} options
 * @returns {Promise<void>}
 */
export function drawProof(el, design, point, proof, { of, onPoint }) {
  const [rows, columns] = design.grid.axes;
  const traces = [cells(rows, columns, proof.cells), points(design), ...refutations(rows, columns, proof.cells), chosen(design, point)];
  const layout = { xaxis: valueAxis(columns), yaxis: valueAxis(rows), legend: { orientation: "h", y: 1.02, yanchor: "bottom" } };
  const label = `Proof of ${of} between the grid lines: ${proof.summary.words}; chosen is ${pointName(design, point)}`;
  const onPick = (picked) => picked.data.meta === "points" && onPoint(picked.pointNumber);
  return plot.draw(el, traces, layout, { label, onPick, height: 420 });
}

/**
 * The verdicts of the cells in words, worst first.
 * @param {Object} design
 * @param {Object} proof of a controller
 * @returns {{columns: string[], rows: string[][]}}
 */
export function proofTable(design, proof) {
  const order = [...proof.cells].sort((one, other) => VERDICTS.indexOf(other.status) - VERDICTS.indexOf(one.status));
  const place = (cell) => design.grid.axes.map(({ name, values }, axis) => span(values, cell.index[axis], unitOf(name))).join("; ");
  const slowest = (cell) => cell.counterexample ?? cell.slowest;
  const rows = order.map((cell) => [place(cell), cell.status, quantity(cell.decay_rate_1_s, "1/s"), slowest(cell) ? at(design, slowest(cell)) : "\u2013", cell.reason ?? ""]);
  return { columns: [design.grid.axes.map(({ name }) => words(name)).join("; "), "verdict", "decay rate proved", "slowest pole found", "reason"], rows };
}

function span(values, index, unit) {
  return values.length === 1 ? quantity(values[0], unit) : `${number(values[index])} to ${quantity(values[index + 1], unit)}`;
}

function at(design, found) {
  const place = design.grid.axes.map(({ name }) => quantity(found[name], unitOf(name))).join(", ");
  return `${number(found.largest_real_part)} 1/s at ${place}`;
}

/** Borders of the cells along an axis; an axis of one value has a band about it. */
function borders(values) {
  return values.length > 1 ? values : [values[0] - 1, values[0] + 1];
}

function cells(rows, columns, found) {
  const [y, x] = [borders(rows.values), borders(columns.values)];
  const field = () => y.slice(1).map(() => x.slice(1).map(() => null));
  const [z, text] = [field(), field()];
  for (const { index: [i, j], status, decay_rate_1_s: rate } of found) {
    z[i][j] = VERDICTS.indexOf(status);
    text[i][j] = `${LETTERS[status]}${rate === null ? "" : ` ${number(rate, 3)} 1/s`}`;
  }
  const bar = { thickness: 14, tickvals: [0, 1, 2, 3], ticktext: VERDICTS.map((verdict) => `${LETTERS[verdict]} ${verdict}`) };
  return {
    type: "heatmap", name: "cell", z, x, y, text, texttemplate: x.length <= 9 ? "%{text}" : "", hovertemplate: "%{text}<extra></extra>",
    textfont: { color: "#15202b" }, colorscale: SCALE, zmin: -0.5, zmax: 3.5, colorbar: bar, xgap: 2, ygap: 2, hoverongaps: false,
  };
}

function points(design) {
  const [rows, columns] = design.grid.axes;
  const all = rows.values.flatMap((y) => columns.values.map((x) => [x, y]));
  return {
    name: "points of the grid", meta: "points", mode: "markers", x: all.map(([x]) => x), y: all.map(([, y]) => y), cliponaxis: false,
    marker: { symbol: "circle", color: "#15202b", size: 11, line: { width: 1.5, color: "#ffffff" } },
    hovertemplate: "point %{pointNumber}: %{y}, %{x}<extra></extra>",
  };
}

function refutations(rows, columns, found) {
  const shown = found.filter(({ counterexample }) => counterexample).map(({ counterexample }) => counterexample);
  if (!shown.length) return [];
  const text = shown.map((one) => `pole at ${number(one.largest_real_part)} 1/s`);
  return [{
    name: "not stable here", mode: "markers", x: shown.map((one) => one[columns.name]), y: shown.map((one) => one[rows.name]), text, cliponaxis: false,
    marker: { symbol: "x", color: "#15202b", size: 13 }, hovertemplate: "%{text} at %{y}, %{x}<extra></extra>",
  }];
}

function chosen(design, point) {
  const [rows, columns] = design.grid.axes;
  const [i, j] = placeOf(design, point);
  return {
    name: "chosen point", mode: "markers", x: [columns.values[j]], y: [rows.values[i]], hoverinfo: "skip", cliponaxis: false,
    marker: { symbol: "square-open", color: "#d55e00", size: 20, line: { width: 3.5 } },
  };
}
