/** Specs in words. */

import { quantity, words } from "./format.js";

const SOURCES = { request: "the request", spec_pack: "the spec pack", limits: "the actuators' limits" };

/**
 * What a spec judges.
 * @param {string} spec e.g. `gain_margin_db_min`
 * @returns {string} e.g. "gain margin"
 */
export function judged(spec) {
  return words(spec).replace(/[ _](min|max)$/, "");
}

/**
 * What a spec asks for.
 * @param {string} spec e.g. `gain_margin_db_min`
 * @param {?number} limit
 * @param {string} unit
 * @returns {string} e.g. "at least 6 dB"
 */
export function asked(spec, limit, unit) {
  return `${spec.endsWith("_min") ? "at least" : "at most"} ${quantity(limit, unit)}`;
}

/**
 * Who asks for it.
 * @param {string} source `request`, `spec_pack` or `limits`
 * @returns {string} e.g. "the spec pack"
 */
export function askedBy(source) {
  return SOURCES[source] ?? words(source);
}
