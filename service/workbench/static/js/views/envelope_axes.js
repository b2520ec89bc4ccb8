/** The grid's axes as axes of a plot, and fields over the grid as lines or cells. */

import { number, quantity, title, unitOf, words } from "../format.js";

const MARK = "#d55e00";

/** Colour scale of markers on the page's own ground: every shade has contrast on white and on the dark theme. */
export const MARKER_SCALE = [[0, "#c98500"], [0.33, "#d1556b"], [0.67, "#9a5cc0"], [1, "#2f7fc9"]];

/**
 * The values of an axis as categories: cells of equal size, however the values are spaced.
 * @param {{name: string, values: number[]}} axis of a design's grid
 * @returns {string[]}
 */
export function categoriesOf({ values }) {
  return values.map((value) => number(value, 7));
}

/**
 * Layout of an axis of categories.
 * @param {{name: string}} axis
 * @returns {Object}
 */
export function categoryAxis({ name }) {
  return { title: { text: title(name) }, type: "category", showgrid: false, zeroline: false };
}

/**
 * Layout of an axis with the grid's values as its ticks, in proportion.
 * @param {{name: string, values: number[]}} axis
 * @returns {Object}
 */
export function valueAxis({ name, values }) {
  const few = values.length <= 12 ? { tickvals: values, ticktext: values.map((value) => number(value)) } : {};
  return { title: { text: title(name) }, zeroline: false, ...few };
}

/**
 * A frame around the chosen point, in a plot with axes of categories.
 * @param {number[]} place row and column of the point
 * @returns {Object} a shape of Plotly
 */
export function frameAt([i, j]) {
  return { type: "rect", x0: j - 0.5, x1: j + 0.5, y0: i - 0.5, y1: i + 0.5, line: { width: 4, color: MARK } };
}

/**
 * A field as lines over the last axis, one for each value of the first.
 * @param {{axes: Object[]}} grid of a design
 * @param {(?number)[][]} values in the grid's shape
 * @param {string} [of] what the names of the lines begin with
 * @returns {Object[]} traces with gaps where there is no value
 */
export function linesOf({ axes: [rows, columns] }, values, of = "") {
  const name = (row) => `${of}${words(rows.name)} ${quantity(rows.values[row], unitOf(rows.name))}`;
  return values.map((y, row) => ({ name: name(row), x: columns.values, y, mode: "lines+markers", connectgaps: false }));
}
