/** Figures of a design over its grid: gains, figures of the closed loop, verdicts, actuators, proof, as fields to be drawn. */

import { number, title, words } from "../format.js";

const CATEGORY_SCALE = [[0, "#0072b2"], [0.5, "#0072b2"], [0.5, "#e69f00"], [1, "#e69f00"]];
const CLOSED_LOOP = { decay_rate_1_s: "Decay rate [1/s]", damping_ratio: "Damping ratio", settling_time_s: "Settling time [s]", overshoot_percent: "Overshoot [%]" };
const ACTUATOR = [
  "peak_torque_n_m", "rms_torque_n_m", "holding_torque_n_m", "peak_rate_deg_s", "peak_deflection_deg", "peak_acceleration_deg_s2",
  "peak_power_w", "rms_power_w", "energy_out_j", "energy_back_j",
];

/** Where the figures of a group come from: a path below the controller, asked for with the first of them. */
const SOURCES = {
  value: "verdicts",
  verdict: "verdicts",
  loop: "robust-performance?hinge_moment_percent=0&inertia_percent=0&C_Ha_da_percent=1", // its nominal figures; the one change is the least it takes
  actuator: "actuator-requirements",
};

/**
 * The figures that the map can be coloured by.
 * @param {Object} controller of a design
 * @returns {{value: string, label: string, group: string}[]}
 */
export function figureOptions(controller) {
  const judged = [...new Set(controller.verdicts.map(({ spec }) => spec))];
  const actuators = controller.kind === "lqr" ? ["tab", "aileron"] : ["tab"];
  return [
    ...controller.gains.map(({ name, unit }) => ({ value: `gain.${name}`, label: unit === "1" ? name : `${name} [${unit}]`, group: "Gain" })),
    ...Object.entries(CLOSED_LOOP).map(([name, label]) => ({ value: `loop.${name}`, label, group: "Closed loop" })),
    { value: "reduced_frequency", label: "Reduced frequency of the fastest mode", group: "Closed loop" },
    ...judged.map((spec) => ({ value: `value.${spec}`, label: bare(spec), group: "Margins and peaks that are judged" })),
    ...actuators.flatMap((name) => ACTUATOR.map((figure) => ({ value: `actuator.${name}.${figure}`, label: `${title(figure)}, ${name}`, group: `Actuator: ${name}` }))),
    { value: "outcome", label: "Outcome", group: "Outcome and proof" },
    { value: "proof", label: "Proof between the grid lines", group: "Outcome and proof" },
    ...controller.verdicts.map(({ spec, source }) => ({ value: `verdict.${source}.${spec}`, label: `${title(spec)} (${words(source)})`, group: "Verdict" })),
  ];
}

/**
 * What must be asked for to draw a figure.
 * @param {string} id of `figureOptions`
 * @returns {?string} path below the controller, query included; null where the design's document has it
 */
export function sourceOf(id) {
  return SOURCES[id.split(".")[0]] ?? null;
}

/**
 * One figure as a field.
 * @param {Object} controller of a design
 * @param {string} id of `figureOptions`, but `proof`
 * @param {?Object} answer that of the path that `sourceOf` names
 * @returns {{title: string, z: (?number)[][], text?: string[][], scale?: *, range?: Object, showScale: boolean, reasons?: (?string)[][]}}
 */
export function fieldOf(controller, id, answer) {
  const [kind, name] = id.split(/\.(.*)/);
  if (kind === "gain") {
    const gain = controller.gains.find((one) => one.name === name);
    return numbers(gain.unit === "1" ? name : `${name} [${gain.unit}]`, gain.values);
  }
  if (kind === "reduced_frequency") return numbers("reduced frequency", controller.reduced_frequency);
  if (kind === "loop") return ofTheLoop(name, answer.figures);
  if (kind === "value") return numbers(bare(name), answer.verdicts.find(({ spec }) => spec === name).values);
  if (kind === "actuator") return ofAnActuator(name, answer.actuators);
  if (kind === "verdict") return verdict(answer.verdicts.find(({ spec, source }) => name === `${source}.${spec}`));
  return categories("outcome", controller.outcomes.map((row) => row.map((outcome) => [outcome === "ok" ? 0 : 1, outcome.replaceAll("_", " ")])));
}

function numbers(heading, z) {
  return { title: heading, z, showScale: true };
}

function ofTheLoop(name, figures) {
  if (name !== "decay_rate_1_s") return numbers(CLOSED_LOOP[name].toLowerCase(), figures[name].nominal);
  return numbers("decay rate [1/s]", figures.largest_real_part.nominal.map((row) => row.map((value) => (value === null ? null : -value))));
}

function ofAnActuator(name, actuators) {
  const [actuator, figure] = name.split(".");
  return numbers(`${title(figure)}, ${actuator}`, actuators[actuator][figure]);
}

function verdict({ spec, values, passes }) {
  const said = { true: "met", false: "missed", null: "not judged" };
  const cells = values.map((row, i) => row.map((value, j) => [passes[i][j] === null ? null : Number(!passes[i][j]), `${number(value)}<br>${said[passes[i][j]]}`]));
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

/** What a spec judges, without the sense of its limit. */
function bare(spec) {
  return title(spec.replace(/_(min|max)$/, ""));
}
