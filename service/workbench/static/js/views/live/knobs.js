/**
 * What can be moved of a controller at a point: its gains, or the weights of a regulator.
 * @typedef {Object} Knob
 * @property {string} id name in the address
 * @property {string} label
 * @property {string} unit "1" for none
 * @property {number} value as designed
 * @property {?(string|number)[]} path where it stands in the controller's request; null: it is no part of the request
 */

import { unitOf, words } from "../../format.js";

const TORQUES = ["T_t", "T_a"];

/**
 * The knobs of a controller.
 * @param {Object} controller of a narrowed request
 * @param {Object} designed the same controller in the design's document
 * @returns {Knob[]}
 */
export function knobsOf(controller, designed) {
  if (controller.kind === "lqr") return weightKnobs(controller.weights, ["weights"], statesOf(designed));
  return designed.gains.map(({ name, unit }) => ({ id: name, label: name, unit, value: controller.gains[name], path: ["gains", name] }));
}

function weightKnobs(weights, path, states) {
  if (weights.rule === "bryson") return numbers(weights, path);
  if (weights.rule === "explicit") return [...diagonal(weights.Q, [...path, "Q"], "Q", states), ...diagonal(weights.R, [...path, "R"], "R", TORQUES)];
  if (weights.rule === "output") return [...diagonal(weights.W_y, [...path, "W_y"], "W", weights.outputs), ...diagonal(weights.W_u, [...path, "W_u"], "W", TORQUES)];
  return [...weightKnobs(weights.base, [...path, "base"], states), ...numbers({ ...weights, base: null }, path)];
}

function numbers(fields, path) {
  const own = Object.entries(fields).filter(([, value]) => typeof value === "number");
  return own.map(([name, value]) => ({ id: name, label: `${words(name)}${priced(name) ? "" : ", largest"}`, unit: unitFor(name), value, path: [...path, name] }));
}

/** Prices and parts are no largest values. */
function priced(name) {
  return name.endsWith("_price") || name === "part";
}

/** Integrals are of angles over time, though their fields end as rates do. */
function unitFor(name) {
  if (name.endsWith("_integral_deg_s")) return "deg s";
  return name.endsWith("_price") ? "1/W" : unitOf(name);
}

function diagonal(matrix, path, letter, names) {
  return matrix.map((row, k) => {
    const name = names[k] ?? String(k + 1);
    return { id: `${letter}_${name}`, label: `${letter} of ${name}`, unit: "1", value: row[k], path: [...path, k, k] };
  });
}

/** States in their order, as the gains of the tab's torque name them. */
function statesOf(designed) {
  return designed.gains.map(({ name }) => name.match(/^K_T_t_(.+)$/)?.[1]).filter(Boolean);
}
