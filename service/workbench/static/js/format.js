/** Numbers, units and names in words. */

const UNITS = [
  ["_kg_m2", "kg m\u00b2"], ["_kg_m3", "kg/m\u00b3"], ["_m_s2", "m/s\u00b2"], ["_m_s", "m/s"], ["_rad_s", "rad/s"], ["_deg_s2", "deg/s\u00b2"],
  ["_deg_s", "deg/s"], ["_n_m_s", "N m s"], ["_n_m", "N m"], ["_pa_s", "Pa s"], ["_pa", "Pa"], ["_kg", "kg"], ["_hz", "Hz"], ["_deg", "deg"],
  ["_db", "dB"], ["_percent", "%"], ["_1_s", "1/s"], ["_m", "m"], ["_s", "s"], ["_k", "K"], ["_w", "W"], ["_j", "J"],
];

/** What stands where there is no number. */
export const NONE = "\u2013";

/**
 * A number with so many significant digits.
 * @param {?number} value
 * @param {number} [digits]
 * @returns {string} a dash for null
 */
export function number(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return NONE;
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(digits - 1).replace("e+", "e").replace("-", "\u2212").replace("e-", "e\u2212");
  return String(Number(value.toPrecision(digits))).replace("-", "\u2212");
}

/**
 * A number and its unit.
 * @param {?number} value
 * @param {string} unit "1" is left out
 * @param {number} [digits]
 * @returns {string}
 */
export function quantity(value, unit, digits = 4) {
  const text = number(value, digits);
  return text === NONE || !unit || unit === "1" ? text : `${text} ${unit}`;
}

/**
 * A complex number of the wire.
 * @param {?{re: number, im: number}} value
 * @returns {string}
 */
export function complex(value) {
  if (!value) return NONE;
  if (value.im === 0) return number(value.re);
  return `${number(value.re)} ${value.im < 0 ? "\u2212" : "+"} ${number(Math.abs(value.im))}i`;
}

/**
 * The unit that a field's name ends in.
 * @param {string} name e.g. `peak_rate_deg_s` or `settling_time_s_max`
 * @returns {string} "1" when it ends in none
 */
export function unitOf(name) {
  return split(name)[1];
}

/**
 * A field's name in words, without its unit.
 * @param {string} name e.g. `peak_rate_deg_s`
 * @returns {string} e.g. "peak rate"
 */
export function words(name) {
  return split(name)[0].replaceAll("_", " ");
}

/**
 * A field's name in words with its unit, for axes and labels.
 * @param {string} name e.g. `dynamic_pressure_pa`
 * @returns {string} e.g. "dynamic pressure [Pa]"
 */
export function title(name) {
  const [, unit] = split(name);
  return unit === "1" ? words(name) : `${words(name)} [${unit}]`;
}

function split(name) {
  const sense = name.match(/_(min|max)$/);
  const bare = sense ? name.slice(0, sense.index) : name;
  const ending = UNITS.find(([suffix]) => bare.endsWith(suffix) && bare.length > suffix.length);
  if (!ending) return [name, "1"];
  return [bare.slice(0, -ending[0].length) + (sense ? sense[0] : ""), ending[1]];
}
