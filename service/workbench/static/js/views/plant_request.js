/** The plant part of a design's request, for the routes that ask about the plant alone. */

import { placeOf } from "../grid.js";

const PARTS = ["geometry", "inertia", "aerodynamics", "atmosphere", "trim"];

/**
 * The plant of a design, at one of its points only.
 * @param {Object} design
 * @param {number} point flat row-major index
 * @returns {Object} `geometry inertia aerodynamics atmosphere trim grid`, the grid of one point
 */
export function plantAt(design, point) {
  const place = placeOf(design, point);
  const parts = Object.fromEntries(PARTS.map((part) => [part, design.request[part]]));
  const grid = Object.fromEntries(design.grid.axes.map(({ name, values }, axis) => [name, [values[place[axis]]]]));
  return { ...parts, grid };
}

/**
 * The plant of a design over its whole grid.
 * @param {Object} design
 * @returns {Object} `geometry inertia aerodynamics atmosphere trim grid`
 */
export function plantOf(design) {
  return Object.fromEntries([...PARTS, "grid"].map((part) => [part, design.request[part]]));
}

/**
 * Every number of the plant but its tables, by JSON pointer.
 * @param {Object} design
 * @returns {{pointer: string, value: number}[]}
 */
export function numbersOfPlant(design) {
  return PARTS.flatMap((part) => leaves(design.request[part], `/${part}`));
}

function leaves(value, pointer) {
  if (typeof value === "number") return [{ pointer, value }];
  if (value === null || typeof value !== "object" || Array.isArray(value)) return [];
  return Object.entries(value).flatMap(([name, part]) => leaves(part, `${pointer}/${name}`));
}
