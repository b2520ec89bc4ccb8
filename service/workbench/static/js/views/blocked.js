/** Why a controller has no gains at a point, and which relaxation alone would be enough, in words. */

import { h } from "../dom.js";
import { quantity } from "../format.js";
import { asked, judged } from "../spec_words.js";

/**
 * What blocks a controller at a point.
 * @param {Object} controller of a point's document, without gains
 * @returns {Element}
 */
export function blockedAt({ name, outcome, reason, infeasibility }) {
  const lead = h("p", {}, h("strong", {}, name), ": ", h("span", { class: "tag bad" }, outcome.replaceAll("_", " ")), reason && !infeasibility ? ` ${reason}` : "");
  return h("div", { class: "stack" }, lead, infeasibility ? explained(infeasibility) : null);
}

function explained({ blocking, relaxations, nearest_design_misses: missed }) {
  const first = blocking === null ? h("p", {}, "No single spec is in the way: relaxing one of them alone is not enough.") : h("p", {}, `In the way first: ${judged(blocking)}. Any one of these alone would be enough:`);
  const relaxed = ({ spec, unit, limit, reachable, relaxation_percent: percent }) => {
    const share = percent === null ? "" : `, ${quantity(percent, "%", 3)} laxer`;
    return h("li", {}, `${judged(spec)} ${asked(spec, reachable, unit)} in place of ${quantity(limit, unit)}${share}`);
  };
  const near = ({ spec, unit, limit, nearest }) => h("li", {}, `${judged(spec)}: ${quantity(nearest, unit)}, asked is ${asked(spec, limit, unit)}`);
  return h("div", { class: "stack" }, first,
    relaxations.length ? h("ul", { class: "reasons" }, relaxations.map(relaxed)) : null,
    missed.length ? [h("p", {}, "The nearest design misses:"), h("ul", { class: "reasons" }, missed.map(near))] : null);
}
