/** Two controllers in tables and words: what the requests differ in, one point's figures, and each on the other's plant. */

import { h, table } from "../dom.js";
import { number, quantity, title, unitOf } from "../format.js";

/**
 * Where the requests differ.
 * @param {Object} answer of the comparison
 * @param {string[]} names of the two designs
 * @returns {Element[]}
 */
export function differences({ request_differences: found, request_differences_in_all: count }, names) {
  if (!count) return [h("p", { class: "muted" }, "The two requests are the same.")];
  const said = (value, missing) => (missing ? "\u2013" : h("code", {}, JSON.stringify(value)));
  const rows = found.map(({ pointer, value, other, only_in: only }) => [h("code", {}, pointer), said(value, only === "other"), said(other, only === "this")]);
  const more = count > found.length ? h("p", { class: "muted" }, `The first ${found.length} of ${count} differences.`) : null;
  return [scroll("Differences of the requests", table("Differences of the requests", ["field", ...names], rows)), more].filter(Boolean);
}

/**
 * Gains and figures of both at one common point.
 * @param {Object} point of the answer
 * @param {string[]} names of the two controllers
 * @returns {Element}
 */
export function pointTable(point, names) {
  const gains = point.gains.map(({ name, unit, ...sides }) => [unit === "1" ? name : `${name} [${unit}]`, ...numbers(sides)]);
  const figures = point.figures.map(({ name, ...sides }) => [title(name), ...numbers(sides)]);
  return table("Gains and figures at the chosen point", ["figure", ...names, "difference", "[%]"], [...figures, ...gains]);
}

/**
 * Whether the gains of each hold on the other's plant, in words and point by point.
 * @param {Object} answer of the comparison, with one common point at least
 * @param {string[]} names of the two controllers
 * @param {function(number): void} onPoint told of a point that is chosen
 * @returns {Element[]}
 */
export function carriedOver(answer, [mine, theirs], onPoint) {
  const sentences = [said(answer.on_other_plant, mine, theirs), said(answer.other_on_this_plant, theirs, mine)];
  const rows = (side) => answer.points.map((one) => [
    h("button", { type: "button", class: "quiet", onclick: () => onPoint(one.point) }, `${one.point}: ${place(one.coordinates)}`), ...verdict(one[side]),
  ]);
  const half = (side, sentence, who) => {
    const caption = `Gains of ${who} carried to the other plant`;
    return h("div", { class: "stack" }, sentence, scroll(caption, table(caption, ["point", "nu-gap", "margin b", "holds"], rows(side))));
  };
  return [h("div", { class: "two-plots" }, half("on_other_plant", sentences[0], mine), half("other_on_this_plant", sentences[1], theirs))];
}

function said({ reason, points_flown: flown, points_stable: stable, points_held_by_margin: held, largest_nu_gap: gap, largest_nu_gap_point: where }, mine, theirs) {
  const lead = `Gains of ${mine} on the plant of ${theirs}: `;
  if (reason) return h("p", {}, lead, h("span", { class: "tag warn" }, "not flown"), ` ${reason}.`);
  const tag = stable === flown ? h("span", { class: "tag good" }, "stable") : h("span", { class: "tag bad" }, "unstable");
  return h("p", {}, lead, tag, ` at ${stable} of ${flown} common points; at ${held} the nu-gap is below the margin and proves it. Largest nu-gap ${number(gap)}, at point ${where}.`);
}

function verdict({ nu_gap: gap, stability_margin: margin, held_by_margin: held, stable }) {
  const [kind, words_] = stable === null ? ["", "not flown"] : !stable ? ["bad", "unstable"] : held ? ["good", "by the margin"] : ["warn", "by its poles only"];
  return [number(gap), number(margin), h("span", { class: `tag ${kind}` }, words_)];
}

function numbers({ value, other, difference }) {
  const share = difference === null || !value ? number(null) : number(100 * (difference / Math.abs(value)), 3);
  return [number(value), number(other), number(difference), share];
}

function place(coordinates) {
  return Object.entries(coordinates).map(([name, value]) => quantity(value, unitOf(name))).join(", ");
}

function scroll(label, content) {
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": label }, content);
}
