/** The actuators' limits as lines of a plot. */


const STYLES = { aileron: ["--series-1", "dash"], tab: ["--series-2", "dot"] };

/**
 * Lines at plus and minus each limit, with their names; a limit farther off than `reach` is left out.
 * @param {Object<string, {deflection_deg: ?number, rate_deg_s: ?number, torque_n_m: ?number, power_w: ?number}>} limits by surface
 * @param {string} field which limit
 * @param {number} reach largest value shown
 * @returns {{shapes: Object[], annotations: Object[]}}
 */
export function limitLines(limits, field, reach) {
  const found = Object.entries(limits).map(([surface, own]) => [surface, own?.[field] ?? null]).filter(([, limit]) => limit !== null && limit <= reach);
  const shapes = found.flatMap(([surface, limit]) => {
    const [name, dash] = STYLES[surface];
    return [limit, -limit].map((y) => ({ type: "line", xref: "paper", x0: 0, x1: 1, y0: y, y1: y, line: { color: name, width: 1.2, dash } }));
  });
  const heights = [...new Set(found.map(([, limit]) => limit))];
  const names = (height) => found.filter(([, limit]) => limit === height).map(([surface]) => surface).join(" and ");
  const annotations = heights.map((limit) => ({ xref: "paper", x: 1, xanchor: "right", y: limit, yanchor: "bottom", text: `limit of ${names(limit)}`, showarrow: false, font: { size: 10, color: "--muted" } }));
  return { shapes, annotations };
}

/**
 * The limits of the actuators that a controller commands.
 * @param {Object} design
 * @param {string} name of the controller
 * @returns {Object<string, Object>} by surface
 */
export function limitsOf(design, name) {
  const { tab, aileron } = design.request.actuators;
  const { kind } = design.controllers.find((one) => one.name === name);
  return kind === "lqr" ? { aileron: aileron.limits, tab: tab.limits } : { tab: tab.limits };
}

/**
 * Largest size in lists of numbers.
 * @param {...(?number)[]} lists
 * @returns {number} 0 without any
 */
export function largest(...lists) {
  return lists.flat().reduce((most, value) => Math.max(most, Math.abs(value ?? 0)), 0);
}
