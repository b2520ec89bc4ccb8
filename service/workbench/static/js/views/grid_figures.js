/** Figures of a design over its grid: gains, outcomes, verdicts and the air, as fields to be drawn. */

import { number, title } from "../format.js";

const CATEGORY_SCALE = [[0, "#0072b2"], [0.5, "#0072b2"], [0.5, "#e69f00"], [1, "#e69f00"]];

/**
 * The figures that the map can be coloured by.
 * @param {Object} controller of a design
 * @returns {{value: string, label: string, group: string}[]}
 */
export function figureOptions(controller) {
  return [
    ...controller.gains.map(({ name, unit }) => ({ value: `gain.${name}`, label: unit === "1" ? name : `${name} [${unit}]`, group: "Gain" })),
    { value: "outcome", label: "Outcome", group: "Outcome" },
    { value: "reduced_frequency", label: "Reduced frequency of the fastest mode", group: "Outcome" },
    ...controller.verdicts.map(({ spec }) => ({ value: `verdict.${spec}`, label: title(spec), group: "Verdict" })),
  ];
}

/**
 * One figure as a field.
 * @param {Object} controller of a design
 * @param {string} id of `figureOptions`
 * @param {?Object} judged answer of the controller's `verdicts` route; needed for verdicts only
 * @returns {{title: string, z: (?number)[][], text: string[][], scale?: *, range?: Object, showScale: boolean}}
 */
export function fieldOf(controller, id, judged) {
  const [kind, name] = id.split(/\.(.*)/);
  if (kind === "gain") {
    const gain = controller.gains.find((one) => one.name === name);
    return numbers(gain.unit === "1" ? name : `${name} [${gain.unit}]`, gain.values);
  }
  if (kind === "verdict") return verdict(judged.verdicts.find((one) => one.spec === name));
  if (kind === "reduced_frequency") return numbers("reduced frequency", controller.reduced_frequency);
  return categories("outcome", controller.outcomes.map((row) => row.map((outcome) => [outcome === "ok" ? 0 : 1, outcome.replaceAll("_", " ")])));
}

/** Whether a figure needs the controller's verdicts. @param {string} id @returns {boolean} */
export function needsVerdicts(id) {
  return id.startsWith("verdict.");
}

function numbers(heading, values) {
  return { title: heading, z: values, text: values.map((row) => row.map((value) => number(value))), showScale: true };
}

function verdict({ spec, values, passes }) {
  const words = { true: "met", false: "missed", null: "not judged" };
  const cells = values.map((row, i) => row.map((value, j) => [passes[i][j] ? 0 : 1, `${number(value)}<br>${words[passes[i][j]]}`]));
  return categories(title(spec), cells);
}

function categories(heading, cells) {
  return {
    title: heading,
    z: cells.map((row) => row.map(([value]) => value)),
    text: cells.map((row) => row.map(([, text]) => text)),
    scale: CATEGORY_SCALE,
    range: { zmin: 0, zmax: 1 },
    showScale: false,
  };
}
