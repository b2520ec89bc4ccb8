/** A root locus as traces of a plot, and its poles at any gain. */

import { number } from "../format.js";

const NEAR = 4; // the plot first shows so many times the middle distance of the chosen poles from the origin

/**
 * Closed-loop poles at a gain, on the branches between their samples.
 * @param {Object} locus answer of the study `root_locus`
 * @param {number} gain within the locus's gains, or the nearest of them is taken
 * @returns {{re: number, im: number}[]} [1/s], one a branch
 */
export function polesAt({ gains, branches }, gain) {
  const rising = gains.at(-1) > gains[0];
  const after = gains.findIndex((one) => (rising ? one >= gain : one <= gain));
  if (after === 0) return branches.map((branch) => branch[0]);
  if (after < 0) return branches.map((branch) => branch.at(-1));
  const part = (gain - gains[after - 1]) / (gains[after] - gains[after - 1]);
  const between = (a, b) => a + part * (b - a);
  return branches.map((branch) => ({ re: between(branch[after - 1].re, branch[after].re), im: between(branch[after - 1].im, branch[after].im) }));
}

/**
 * Half the width of what is shown first: about the poles that matter.
 * @param {Object} locus
 * @returns {number} [1/s]
 */
export function extentOf(locus) {
  const sizes = polesAt(locus, locus.chosen_gain).map(({ re, im }) => Math.hypot(re, im)).sort((a, b) => a - b);
  const middle = sizes[Math.floor((sizes.length - 1) / 2)] || sizes.at(-1) || 1;
  return 1.15 * Math.max(...sizes.filter((size) => size <= NEAR * middle), middle);
}

/**
 * Traces of a locus.
 * @param {Object} locus
 * @param {{gain: number, closed: ?{re: number, im: number}[], damping: number, extent: number}} shown the gain that is flown, the poles with all
 *   loops closed where they are others, the damping ratio of the line, the half width of the plot [1/s]
 * @returns {Object[]}
 */
export function locusTraces(locus, { gain, closed, damping, extent }) {
  const markers = (name, points, marker, more = {}) => ({ name, mode: "markers", x: points.map((p) => p.re), y: points.map((p) => p.im), marker, ...more });
  const crossings = locus.crossings.flatMap(({ gain: k, omega_rad_s: omega }) => [omega, -omega].slice(0, omega === 0 ? 1 : 2).map((im) => ({ re: 0, im, k })));
  const breakaways = locus.breakaways.map(({ gain: k, at }) => ({ ...at, k }));
  const told = (points, what) => ({ text: points.map(({ k }) => `${what} at gain ${number(k)}`), hoverinfo: "text" });
  const traces = [
    branches(locus),
    ray(`damping ratio ${damping}`, damping, 30 * extent),
    asymptotes(locus, 30 * extent),
    markers("open-loop poles", locus.branches.map((branch) => branch[0]), { symbol: "x-thin", size: 9, color: "--ink", line: { width: 1.8, color: "--ink" } }),
    markers("zeros", locus.arrivals.map(({ at }) => at), { symbol: "circle-open", size: 9, color: "--ink" }),
    markers("crossings", crossings, { symbol: "diamond-open", size: 9, color: "--bad" }, told(crossings, "imaginary axis")),
    markers("breakaways", breakaways, { symbol: "square-open", size: 8, color: "--series-3" }, told(breakaways, "branches meet")),
    markers("poles at this gain", polesAt(locus, gain), { symbol: "circle", size: 9, color: "--series-2", line: { width: 1, color: "--surface" } }),
  ];
  if (closed) traces.push(markers("all loops closed", closed, { symbol: "triangle-up-open", size: 10, color: "--series-5", line: { width: 1.6 } }));
  return traces.filter(({ x }) => x.length > 0);
}

/** One line for all branches, with gaps between them. */
function branches({ gains, branches: all }) {
  const joined = (read) => all.flatMap((branch, k) => [...branch.map((pole, i) => read(pole, gains[i])), ...(k < all.length - 1 ? [null] : [])]);
  return {
    name: "branches",
    mode: "lines",
    x: joined((pole) => pole.re),
    y: joined((pole) => pole.im),
    customdata: joined((_, gain) => gain),
    hovertemplate: "%{x:.4g} %{y:+.4g}i<br>gain %{customdata:.4g}<extra></extra>",
    line: { color: "--series-1", dash: "solid", width: 1.6 },
  };
}

function ray(name, damping, length) {
  const [re, im] = [-damping * length, Math.sqrt(1 - damping ** 2) * length];
  return { name, mode: "lines", x: [re, 0, re], y: [im, 0, -im], hoverinfo: "skip", line: { color: "--line-strong", dash: "dash", width: 1.2 } };
}

function asymptotes({ asymptotes: { centroid, angles_deg: angles } }, length) {
  const ends = centroid === null ? [] : angles.map((angle) => (angle * Math.PI) / 180);
  const along = (from, read) => ends.flatMap((angle) => [from, from + (length + Math.abs(centroid)) * read(angle), null]);
  return { name: "asymptotes", mode: "lines", x: along(centroid, Math.cos), y: along(0, Math.sin), hoverinfo: "skip", line: { color: "--line-strong", dash: "dot", width: 1.2 } };
}
