/** Values that were moved, put into the request that is being written. */

import { withValue } from "./narrow.js";

/**
 * The draft with the moved values of a controller in it.
 * @param {?Object} draft the request that is being written
 * @param {Object} design
 * @param {Object} controller of a narrowed request, with the moved values
 * @returns {Object} a draft; the design's own request where the draft has no such controller
 */
export function taken(draft, design, controller) {
  const has = draft?.controllers?.some((one) => one.name === controller.name && one.kind === controller.kind);
  const base = structuredClone(has ? draft : design.request);
  const place = base.controllers.findIndex((one) => one.name === controller.name);
  const part = partOf(controller);
  return withValue(base, ["controllers", place, part], structuredClone(controller[part]));
}

/** Which part of a controller's request is moved. @param {Object} controller @returns {"weights"|"gains"} */
export function partOf(controller) {
  return controller.kind === "lqr" ? "weights" : "gains";
}
