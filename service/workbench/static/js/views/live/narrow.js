/** A design's request narrowed to one controller at one grid point: what previews are asked with. */

import { placeOf } from "../../grid.js";

/**
 * The request of one controller at one point. Values that vary over the grid become those of the point.
 * @param {Object} design document of a design
 * @param {number} point flat index
 * @param {string} name of the controller; with gains (not a regulator), all of them are given as they were designed
 * @returns {Object} a design request with a grid of one point
 */
export function narrowed(design, point, name) {
  const place = placeOf(design, point);
  const { request } = design;
  const grid = Object.fromEntries(design.grid.axes.map((axis, k) => [axis.name, [axis.values[place[k]]]]));
  const here = (part) => atPlace(part, Object.keys(grid), place);
  const wanted = here(request.controllers.find((one) => one.name === name));
  const controller = wanted.kind === "lqr" ? wanted : { ...wanted, gains: gainsAt(design, name, place), smoothing: null };
  const followsTab = wanted.reference === "aileron_and_tab";
  const reference = followsTab ? request.reference : { ...request.reference, tab_deg: 0 };
  return { ...request, grid, reference, spec_pack: here(request.spec_pack), controllers: [controller] };
}

/**
 * The gains of a controller at a place of the grid.
 * @param {Object} design
 * @param {string} name of the controller
 * @param {number[]} place indices along the axes
 * @returns {Object<string, ?number>} SI and radians
 */
export function gainsAt(design, name, [i, j]) {
  const { gains } = design.controllers.find((one) => one.name === name);
  return Object.fromEntries(gains.map((gain) => [gain.name, gain.values[i][j]]));
}

/**
 * A copy of a document with one value changed.
 * @param {Object|Array} document
 * @param {(string|number)[]} path from the top
 * @param {*} value
 * @returns {Object|Array}
 */
export function withValue(document, [key, ...rest], value) {
  const inner = rest.length ? withValue(document[key], rest, value) : value;
  return Array.isArray(document) ? document.map((one, k) => (k === key ? inner : one)) : { ...document, [key]: inner };
}

/** Every `{axis, values}` in a part of a request as the number that it is at the place. */
function atPlace(part, axes, place) {
  if (Array.isArray(part)) return part.map((one) => atPlace(one, axes, place));
  if (part === null || typeof part !== "object") return part;
  if (Array.isArray(part.values) && "axis" in part) {
    return part.axis === null ? part.values[place[0]][place[1]] : part.values[place[axes.indexOf(part.axis)]];
  }
  return Object.fromEntries(Object.entries(part).map(([key, value]) => [key, atPlace(value, axes, place)]));
}
