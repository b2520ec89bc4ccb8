/** Torque and speed as a picture: the cloud, its hull, the limits of the design and the lines of candidates. */

/**
 * Traces over torque [N m] and rate [deg/s].
 * @param {{hull: Object[], cloud: Object[], limits: ?Object, candidates: Object[], pointName: function(number): string}} shown hull and cloud: `{torque_n_m, rate_deg_s, point}`
 * @returns {Object[]}
 */
export function torqueSpeedTraces({ hull, cloud, limits, candidates, pointName }) {
  const series = (list) => ({
    x: list.map(({ torque_n_m: torque }) => torque),
    y: list.map(({ rate_deg_s: rate }) => rate),
    customdata: list.map(({ point }) => point),
    text: list.map(({ point }) => pointName(point)),
    hovertemplate: "%{x:.4~r} N m, %{y:.4~r} deg/s<br>%{text}<extra></extra>",
  });
  return [
    { name: "hull over all points", mode: "lines", ...series([...hull, ...hull.slice(0, 1)]), line: { width: 2.2, dash: "solid" }, fill: "toself", fillcolor: "rgba(0, 114, 178, 0.08)" },
    { name: "manoeuvre at the points", mode: "markers", ...series(cloud), marker: { size: 4, symbol: "circle" } },
    ...limitsOf(limits),
    ...candidates.map(lineOf),
  ];
}

/** The rectangle of the design's own limits, where both are numbers; one alone is a pair of lines. */
function limitsOf(limits) {
  const [torque, rate] = [limits?.torque_n_m, limits?.rate_deg_s].map((limit) => (typeof limit === "number" ? limit : null));
  const style = { name: "limits of the design", mode: "lines", line: { width: 1.6, dash: "longdash" }, hoverinfo: "name" };
  if (torque !== null && rate !== null) return [{ ...style, x: [-torque, torque, torque, -torque, -torque], y: [-rate, -rate, rate, rate, -rate] }];
  if (torque !== null) return [{ ...style, name: "torque limit of the design", x: [torque, -torque], y: [0, 0], mode: "markers", marker: { symbol: "line-ns-open", size: 40, line: { width: 2 } } }];
  if (rate !== null) return [{ ...style, name: "rate limit of the design", x: [0, 0], y: [rate, -rate], mode: "markers", marker: { symbol: "line-ew-open", size: 40, line: { width: 2 } } }];
  return [];
}

/** Where a motor behind its gear can work: torque falls with rate, from stall to no load, in all four quadrants alike. */
function lineOf({ name, gear_ratio: ratio, enough, at_surface: { stall_torque_n_m: stall, no_load_rate_deg_s: rate } }) {
  return { name: `${name}, gear ${Number(ratio.toPrecision(3))}: ${enough ? "enough" : "not enough"}`, mode: "lines", x: [stall, 0, -stall, 0, stall], y: [0, rate, 0, -rate, 0] };
}
