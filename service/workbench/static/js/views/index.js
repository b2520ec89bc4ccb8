/**
 * The views of the Explore panel, in the order of the list.
 * A view: `{id, title, group: "point" | "envelope", needs: ("point" | "controller")[], mount(el, context) -> {update(changed), unmount()}}`.
 * It draws itself once when it is mounted; `update` follows a change of point, controller or parameters.
 */

import gridMap from "./grid_map.js";

/** @type {Object[]} */
export const VIEWS = [gridMap];
