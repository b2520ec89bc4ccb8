/** Curves of the loop opened at one actuator input, and where its margins are. */

const DEG = 180 / Math.PI;

/**
 * The loop opened at one input, all others closed: ``1/S - 1``, which is L itself where there is one input.
 * @param {Object} answer of the study `frequency_response`
 * @param {string} input actuator input
 * @returns {{omega: number[], re: (?number)[], im: (?number)[], db: (?number)[], phase: (?number)[]}} [rad/s], [dB], [deg] without jumps
 */
export function cutLoop({ omega_rad_s: omega, sensitivity }, input) {
  const { magnitude, phase_deg: angle } = sensitivity.find(({ from, to }) => from === input && to === input);
  const values = magnitude.map((size, k) => (size === null ? null : { re: Math.cos(angle[k] / DEG) / size - 1, im: -Math.sin(angle[k] / DEG) / size }));
  const read = (fn) => values.map((value) => (value ? fn(value) : null));
  const phase = unwrapped(read(({ re, im }) => Math.atan2(im, re) * DEG));
  return { omega, re: read(({ re }) => re), im: read(({ im }) => im), db: read(({ re, im }) => 20 * Math.log10(Math.hypot(re, im))), phase };
}

/**
 * A transfer of the answer in decibels.
 * @param {{omega_rad_s: number[]}} answer
 * @param {{magnitude: (?number)[], phase_deg: (?number)[]}} transfer
 * @returns {{omega: number[], db: (?number)[], phase: (?number)[]}}
 */
export function decibels({ omega_rad_s: omega }, { magnitude, phase_deg: phase }) {
  return { omega, db: magnitude.map((size) => (size ? 20 * Math.log10(size) : null)), phase };
}

/**
 * Where the margins of a loop lie on its curve.
 * @param {ReturnType<cutLoop>} curve
 * @param {Object} margins of the point's answer at the same input
 * @returns {{kind: "gain"|"phase"|"delay"|"disk", omega: number, db: number, phase: number, size: number, words: string}[]} `size`: what is left to the
 *   critical point, in the margin's own unit
 */
export function marginMarks(curve, margins) {
  const at = (omega) => ({ omega, db: between(curve, omega, "db"), phase: between(curve, omega, "phase") });
  const gains = margins.gain_margins.map(({ db, omega_rad_s: omega }) => ({ kind: "gain", ...at(omega), db: -db, size: db, words: `gain margin ${short(db)} dB` }));
  const phases = margins.phase_margins.map(({ deg, omega_rad_s: omega }) => ({ kind: "phase", ...at(omega), db: 0, size: deg, words: `phase margin ${short(Math.abs(deg))} deg${deg < 0 ? " of lead" : ""}` }));
  const marks = [...gains, ...phases];
  const delay = margins.delay_margin_s;
  const delayed = delay === null ? null : phases.find(({ omega, size }) => Math.abs((((size + 360) % 360) / DEG / omega) - delay) < 1e-3 * delay);
  if (delayed) marks.push({ ...delayed, kind: "delay", size: delay, words: `delay margin ${short(1e3 * delay)} ms` });
  if (margins.disk_margin) {
    const omega = curve.omega[nearest(curve)];
    marks.push({ kind: "disk", ...at(omega), size: margins.disk_margin, words: `disk margin ${short(margins.disk_margin)}` });
  }
  return marks;
}

/**
 * The disk about -1 that a loop with this disk margin stays out of; it cuts the real axis at -(2+m)/(2-m) and -(2-m)/(2+m).
 * @param {?number} margin less than 2
 * @returns {{re: number, im: number}[]} its circle; empty without a bounded disk
 */
export function diskCircle(margin) {
  if (!margin || margin >= 2) return [];
  const [far, near] = [(2 + margin) / (2 - margin), (2 - margin) / (2 + margin)];
  return circle(-(far + near) / 2, (far - near) / 2);
}

/**
 * A circle about a point of the real axis.
 * @param {number} centre
 * @param {number} radius
 * @returns {{re: number, im: number}[]}
 */
export function circle(centre, radius) {
  return Array.from({ length: 121 }, (_, k) => ({ re: centre + radius * Math.cos((k * Math.PI) / 60), im: radius * Math.sin((k * Math.PI) / 60) }));
}

/** Four digits. @param {number} value @returns {string} */
export function short(value) {
  return String(Number(value.toPrecision(4))).replace("-", "\u2212");
}

/** The sample nearest to the disk about -1: where |S - 1/2| = |(1 - L) / (1 + L)| / 2 is largest. */
function nearest({ re, im }) {
  const size = (k) => (re[k] === null ? -1 : Math.hypot(1 - re[k], im[k]) / Math.hypot(1 + re[k], im[k]));
  return re.reduce((best, _, k) => (size(k) > size(best) ? k : best), 0);
}

function between({ omega, ...curve }, wanted, name) {
  const after = omega.findIndex((one) => one >= wanted);
  if (after <= 0) return curve[name].at(after);
  const part = Math.log(wanted / omega[after - 1]) / Math.log(omega[after] / omega[after - 1]);
  return curve[name][after - 1] + part * (curve[name][after] - curve[name][after - 1]);
}

function unwrapped(angles) {
  let turn = 0;
  let last = null;
  return angles.map((angle) => {
    if (angle === null) return null;
    if (last !== null) turn -= 360 * Math.round((angle + turn - last) / 360);
    last = angle + turn;
    return last;
  });
}
