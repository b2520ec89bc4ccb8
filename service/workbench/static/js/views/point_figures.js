/** Figures of a controller at a point in tables and words: margins, step, poles, verdicts. */

import { h, table } from "../dom.js";
import { complex, number, quantity, unitOf, words } from "../format.js";
import { asked, askedBy, judged } from "../spec_words.js";

const MARGINS = ["gain_margin_up_db", "gain_margin_down_db", "phase_margin_deg", "delay_margin_s", "disk_margin", "sensitivity_peak", "crossover_rad_s"];
const ROUNDING = 1e-9; // what stays of a figure that is nought
const STEP = ["rise_time_s", "settling_time_s", "overshoot_percent", "undershoot_percent", "peak_time_s", "steady_state_error_deg", "bandwidth_rad_s"];

/**
 * The controller's figures as moved beside those as designed.
 * @param {Object} now controller of the study `point`
 * @param {Object} designed the same as designed
 * @returns {Element}
 */
export function figureTable(now, designed) {
  const margins = Object.keys(now.margins).flatMap((loop) => MARGINS.map((name) => [`${loop}: ${words(name)}`, name, now.margins[loop], designed.margins[loop]]));
  const step = now.step ? STEP.map((name) => [words(name), name, now.step, designed.step]) : [];
  const rows = [...margins, ...step].map(([label, name, mine, first]) => [label, cell(mine, name), cell(first, name), shownUnit(name)]);
  const damping = ["least damping ratio", number(leastDamping(now.poles)), number(leastDamping(designed.poles)), ""];
  return table(`Margins and step of ${now.name}`, ["figure", "now", "designed", "unit"], [damping, ...rows]);
}

/**
 * Why figures have no value, in words.
 * @param {Object} controller of the study `point`
 * @returns {Element}
 */
export function reasonList(controller) {
  const said = (where, reasons) => Object.entries(reasons).map(([name, reason]) => `${where}${words(name)}: ${reason}`);
  const all = [...Object.entries(controller.margins).flatMap(([loop, { reasons }]) => said(`${loop}, `, reasons)), ...(controller.step ? said("", controller.step.reasons) : [])];
  return h("ul", { class: "reasons small muted" }, all.map((text) => h("li", {}, text)));
}

/**
 * The verdicts that matter first, in one line.
 * @param {Object} controller of the study `point`
 * @returns {Element}
 */
export function verdictLine({ verdicts }) {
  const missed = verdicts.filter(({ passed }) => !passed);
  const said = missed.map(({ spec, value, limit, unit }) => `${judged(spec)} ${quantity(value, unit)} (limit ${quantity(limit, unit)})`);
  const tag = missed.length ? h("span", { class: "tag bad" }, `${missed.length} of ${verdicts.length} missed`) : h("span", { class: "tag good" }, `all ${verdicts.length} met`);
  return h("p", { class: "small" }, tag, missed.length ? ` ${[...new Set(said)].join("; ")}` : "");
}

/**
 * Every verdict in words.
 * @param {Object} controller of a point
 * @returns {Element}
 */
export function verdictTable({ name, verdicts }) {
  const rows = verdicts.map(({ spec, limit, unit, source, value, distance, passed }) => [
    judged(spec),
    asked(spec, limit, unit),
    quantity(value, unit),
    h("span", { class: `tag ${passed ? "good" : "bad"}` }, passed ? "met" : "missed"),
    distance === null ? "" : `by ${quantity(Math.abs(distance), unit)}`,
    askedBy(source),
  ]);
  return table(`Verdicts of ${name} at this point`, ["spec", "asked", "found", "verdict", "distance", "asked by"], rows);
}

/**
 * Poles with their damping.
 * @param {{re: number, im: number}[]} poles [1/s]
 * @param {string} caption
 * @returns {Element}
 */
export function poleTable(poles, caption) {
  const upper = poles.filter(({ im }) => im >= 0).sort((a, b) => Math.hypot(a.re, a.im) - Math.hypot(b.re, b.im));
  const rows = upper.map(({ re, im }) => {
    const size = Math.hypot(re, im);
    return [complex({ re, im }).replace("+", "\u00b1"), number(size), number(size ? -re / size : null), number(size / (2 * Math.PI)), number(re < 0 ? -1 / re : null)];
  });
  return table(caption, ["pole [1/s]", "natural frequency [rad/s]", "damping ratio", "[Hz]", "time constant [s]"], rows);
}

/** Smallest damping ratio of poles. @param {?{re: number, im: number}[]} poles @returns {?number} */
export function leastDamping(poles) {
  return poles?.length ? Math.min(...poles.map(({ re, im }) => (re === 0 && im === 0 ? 1 : -re / Math.hypot(re, im)))) : null;
}

/** The step's figures alone. @param {Object} controller @returns {Element} */
export function stepTable({ name, step }) {
  return table(`Step of ${name}`, ["figure", "value", "unit"], STEP.map((figure) => [words(figure), cell(step, figure), shownUnit(figure)]));
}

function cell(figures, name) {
  const value = figures?.[name] ?? null;
  if (value === null) return number(null);
  if (Math.abs(value) < ROUNDING) return number(0);
  return number(name === "delay_margin_s" ? 1e3 * value : value);
}

function shownUnit(name) {
  const unit = name === "delay_margin_s" ? "ms" : unitOf(name);
  return unit === "1" ? "" : unit;
}
