/** Points of a design's grid: flat row-major indices, and their flight conditions in words. */

import { quantity, unitOf, words } from "./format.js";

/**
 * Number of points.
 * @param {Object} design
 * @returns {number}
 */
export function pointCount(design) {
  return design.grid.shape.reduce((product, count) => product * count, 1);
}

/**
 * Flat index to indices along the axes.
 * @param {Object} design
 * @param {number} point
 * @returns {number[]}
 */
export function placeOf(design, point) {
  const [, columns] = design.grid.shape;
  return [Math.floor(point / columns), point % columns];
}

/**
 * A point in words: its values on the grid's axes.
 * @param {Object} design
 * @param {number} point
 * @returns {string} e.g. "point 3: altitude 0 m, dynamic pressure 1531 Pa"
 */
export function pointName(design, point) {
  const place = placeOf(design, point);
  const values = design.grid.axes.map(({ name, values: grid }, axis) => `${words(name)} ${quantity(grid[place[axis]], unitOf(name))}`);
  return `point ${point}: ${values.join(", ")}`;
}

/**
 * Every point as an option of a select.
 * @param {Object} design
 * @returns {{value: string, label: string}[]}
 */
export function pointOptions(design) {
  return Array.from({ length: pointCount(design) }, (_, point) => {
    const place = placeOf(design, point);
    const values = design.grid.axes.map(({ name, values: grid }, axis) => quantity(grid[place[axis]], unitOf(name)));
    return { value: String(point), label: `${point}: ${values.join(", ")}` };
  });
}
