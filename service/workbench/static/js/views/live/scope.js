/**
 * Where a controller is looked at while it is moved.
 * @typedef {Object} Scope
 * @property {string} words
 * @property {string[]} of what of the state it depends on
 * @property {function(Object, Object, number): ?string} missing why there is nothing to move: of a design, one of its controllers, a flat index
 * @property {function(Object, Object, number): Object} request that a preview designs, with this controller alone; of the same
 */

import { placeOf } from "../../grid.js";
import { narrowed } from "./narrow.js";

/** The chosen point. @type {Scope} */
export const AT_POINT = {
  words: "at this point",
  of: ["design", "controller", "point"],
  missing: (design, controller, point) => {
    const [i, j] = placeOf(design, point);
    const outcome = controller.outcomes[i][j];
    return outcome === "ok" ? null : (controller.reasons[i][j] ?? outcome.replaceAll("_", " "));
  },
  request: (design, controller, point) => narrowed(design, point, controller.name),
};

/** The weights of a state feedback at the chosen point. @type {Scope} */
export const WEIGHTS_AT_POINT = { ...AT_POINT, missing: (design, controller, point) => unweighted(controller) ?? AT_POINT.missing(design, controller, point) };

/** The weights of a state feedback, which are the same at every point of the grid. @type {Scope} */
export const WEIGHTS_OVER_GRID = {
  words: "over the grid",
  of: ["design", "controller"],
  missing: (_, controller) => unweighted(controller),
  request: ({ request }, controller) => ({ ...request, controllers: request.controllers.filter(({ name }) => name === controller.name) }),
};

function unweighted({ name, kind }) {
  return kind === "lqr" ? null : `Controller ${name} is a ${kind.replaceAll("_", " ")} and has no weights; sliders of its gains are in the views at a point. Choose an lqr controller above.`;
}
