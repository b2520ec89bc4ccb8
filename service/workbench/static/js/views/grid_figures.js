/** Figures of a design over its grid: gains, figures of the closed loop, verdicts, actuators, proof, as fields to be drawn. */

import { number, title, words } from "../format.js";

const CATEGORY_SCALE = [[0, "#0072b2"], [0.5, "#0072b2"], [0.5, "#e69f00"], [1, "#e69f00"]];
const CLOSED_LOOP = ["decay_rate_1_s", "damping_ratio"];
const STEP = ["rise_time_s", "settling_time_s", "overshoot_percent", "undershoot_percent", "peak_time_s", "steady_state_error_deg", "bandwidth_rad_s"];
const MARGINS = ["gain_margin_up_db", "gain_margin_down_db", "phase_margin_deg", "delay_margin_s", "disk_margin", "sensitivity_peak", "crossover_rad_s"];
const ACTUATOR = [
  "peak_torque_n_m", "rms_torque_n_m", "holding_torque_n_m", "peak_rate_deg_s", "peak_deflection_deg", "peak_acceleration_deg_s2",
  "peak_power_w", "rms_power_w", "energy_out_j", "energy_back_j",
];

/** Where the figures of a group come from: a path below the controller, asked for with the first of them. */
const SOURCES = {
  value: "verdicts",
  verdict: "verdicts",
  loop: "figures",
  step: "figures",
  margin: "figures",
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
    ...CLOSED_LOOP.map((name) => ({ value: `loop.${name}`, label: capital(title(name)), group: "Closed loop" })),
    { value: "reduced_frequency", label: "Reduced frequency of the fastest mode", group: "Closed loop" },
    ...STEP.map((name) => ({ value: `step.${name}`, label: capital(title(name)), group: "Step response" })),
    ...actuators.flatMap((loop) => MARGINS.map((name) => ({ value: `margin.${loop}.${name}`, label: `${capital(title(name))}, ${loop}`, group: `Margins, loop cut at the ${loop}` }))),
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
 * @returns {{title: string, z: (?number)[][], text?: string[][], scale?: *, range?: Object, showScale: boolean, note?: string}}
 */
export function fieldOf(controller, id, answer) {
  const [kind, name] = id.split(/\.(.*)/);
  if (kind === "gain") {
    const gain = controller.gains.find((one) => one.name === name);
    return numbers(gain.unit === "1" ? name : `${name} [${gain.unit}]`, gain.values);
  }
  if (kind === "reduced_frequency") return numbers("reduced frequency", controller.reduced_frequency);
  if (kind === "loop") return figure(name, answer[name], answer);
  if (kind === "step") return figure(name, answer.step?.[name] ?? none(controller), answer);
  if (kind === "margin") return ofALoop(name, answer, controller);
  if (kind === "value") return numbers(bare(name), answer.verdicts.find(({ spec }) => spec === name).values);
  if (kind === "actuator") return ofAnActuator(name, answer.actuators);
  if (kind === "verdict") return verdict(answer.verdicts.find(({ spec, source }) => name === `${source}.${spec}`));
  return categories("outcome", controller.outcomes.map((row) => row.map((outcome) => [outcome === "ok" ? 0 : 1, outcome.replaceAll("_", " ")])));
}

function numbers(heading, z) {
  return { title: heading, z, showScale: true };
}

function ofALoop(id, answer, controller) {
  const [loop, name] = id.split(".");
  return { ...figure(name, answer.margins[loop]?.[name] ?? none(controller), answer), title: `${title(name)}, ${loop}` };
}

/** A figure, and what it means where the controller has gains and the figure has no number. */
function figure(name, z, { outcomes, null_means: meanings }) {
  const missing = z.some((row, i) => row.some((value, j) => value === null && outcomes[i][j] === "ok"));
  return { ...numbers(title(name), z), note: missing && meanings[name] ? `Where there is no number: ${meanings[name]}.` : "" };
}

/** A field without a number, of a controller that has gains nowhere. */
function none({ outcomes }) {
  return outcomes.map((row) => row.map(() => null));
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

function capital(text) {
  return text[0].toUpperCase() + text.slice(1);
}

/** What a spec judges, without the sense of its limit. */
function bare(spec) {
  return title(spec.replace(/_(min|max)$/, ""));
}
