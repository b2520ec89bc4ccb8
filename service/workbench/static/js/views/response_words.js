/** What of the actuators' limits a response exceeds or reaches, in words. */

import { quantity } from "../format.js";

/**
 * The four quantities of an actuator that may be limited: its signal, the field of its limit, unit.
 * @type {{id: string, title: string, field: string, unit: string}[]}
 */
export const QUANTITIES = [
  { id: "deflection", title: "Deflection", field: "deflection_deg", unit: "deg" },
  { id: "rate", title: "Rate", field: "rate_deg_s", unit: "deg/s" },
  { id: "torque", title: "Torque", field: "torque_n_m", unit: "N m" },
  { id: "power", title: "Power", field: "power_w", unit: "W" },
];

/**
 * A quantity of a surface over time; power is torque times rate.
 * @param {Object} response
 * @param {"aileron"|"tab"} surface
 * @param {string} id of `QUANTITIES`
 * @returns {(?number)[]} in the quantity's unit
 */
export function series({ signals }, surface, id) {
  const [angle, torque] = surface === "tab" ? ["dt", "T_t_n_m"] : ["da", "T_a_n_m"];
  if (id === "deflection") return signals[`${angle}_deg`];
  if (id === "rate") return signals[`${angle}_rate_deg_s`];
  if (id === "torque") return signals[torque];
  const rate = signals[`${angle}_rate_deg_s`];
  return signals[torque].map((value, k) => (value === null || rate[k] === null ? null : (value * rate[k] * Math.PI) / 180));
}

/**
 * One sentence for each limit: kept or exceeded by the linear response, and reached by the simulated one or not.
 * @param {Object[]} verdicts of the controller at the point; those about the actuators' limits hold peaks between the samples too
 * @param {?Object} simulated response, null where there is none
 * @returns {{text: string, kept: boolean}[]}
 */
export function limitWords(verdicts, simulated) {
  return verdicts.filter(({ source }) => source === "limits").map(({ spec, limit, value, unit, passed }) => {
    const [surface, id] = spec.split("_");
    const peak = value === null ? "is not finite" : `asks for ${quantity(value, unit)}`;
    const against = passed ? "within" : value === null ? "beyond" : `${quantity(100 * (value / limit - 1), "%", 3)} over`;
    const held = timeAt(simulated, surface, id);
    const flown = held === null ? "" : held > 0 ? `; simulated, it is at the limit for ${quantity(1e3 * held, "ms", 3)}` : "; simulated, it is never reached";
    const name = `${id[0].toUpperCase()}${id.slice(1)}`;
    return { text: `${name} of the ${surface}: the linear response ${peak}, ${against} the limit of ${quantity(limit, unit)}${flown}.`, kept: passed && !(held > 0) };
  });
}

/** How long a simulated response is at a limit [s]; null where that is not known. */
function timeAt(response, surface, id) {
  const flags = response?.simulation?.limits_reached?.[surface]?.[id];
  if (!flags) return null;
  const { time_s: time } = response;
  return (flags.filter(Boolean).length * (time.at(-1) - time[0])) / (time.length - 1);
}
