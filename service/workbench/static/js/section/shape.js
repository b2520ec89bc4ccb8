/** Shapes of sections: mean line and thickness of NACA sections, as points in parts of the chord, x aft, z up. */

const FIVE_DIGIT = { 210: [0.058, 361.4], 220: [0.126, 51.64], 230: [0.2025, 15.957], 240: [0.29, 6.643], 250: [0.391, 3.23] };
const DRAWN_THICKNESS = 0.12;

/**
 * The section that a request names, ready to be drawn.
 * @param {Object} aerodynamics of a design request
 * @returns {{name: string, thickness: number, camber: function(number): number}} `camber`: height of the mean line at x, both in chords
 */
export function sectionOf(aerodynamics) {
  const section = aerodynamics?.source === "thin_aerofoil" ? (aerodynamics.section ?? "symmetric") : "symmetric";
  if (Array.isArray(section)) return { name: `mean line of ${section.length} points`, thickness: DRAWN_THICKNESS, camber: through(section) };
  const digits = String(section).trim().match(/^(?:NACA[ _-]?)?(\d{4,5})$/i)?.[1];
  if (digits?.length === 4) return { name: `NACA ${digits}`, thickness: Number(digits.slice(2)) / 100, camber: fourDigit(digits) };
  if (digits && FIVE_DIGIT[digits.slice(0, 3)]) return { name: `NACA ${digits}`, thickness: Number(digits.slice(3)) / 100, camber: fiveDigit(digits) };
  return { name: "symmetric", thickness: DRAWN_THICKNESS, camber: () => 0 };
}

/**
 * The outline of a section between two places of the chord, from the upper side at the first round to the lower side.
 * @param {{thickness: number, camber: function(number): number}} section
 * @param {number} from
 * @param {number} to
 * @returns {[number, number][]}
 */
export function outline(section, from, to) {
  const count = 60;
  const places = Array.from({ length: count + 1 }, (_, index) => from + ((to - from) * (1 - Math.cos((Math.PI * index) / count))) / 2);
  const side = (sign) => (x) => [x, section.camber(x) + sign * halfThickness(x, section.thickness)];
  return [...places.map(side(1)), ...places.toReversed().map(side(-1))];
}

/**
 * Points turned about a hinge, trailing edge up positive.
 * @param {[number, number][]} points
 * @param {[number, number]} hinge
 * @param {number} angle [rad]
 * @returns {[number, number][]}
 */
export function turned(points, [hx, hz], angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return points.map(([x, z]) => [hx + c * (x - hx) - s * (z - hz), hz + s * (x - hx) + c * (z - hz)]);
}

function halfThickness(x, t) {
  return 5 * t * (0.2969 * Math.sqrt(x) - 0.126 * x - 0.3516 * x ** 2 + 0.2843 * x ** 3 - 0.1036 * x ** 4);
}

function fourDigit(digits) {
  const [m, p] = [Number(digits[0]) / 100, Number(digits[1]) / 10];
  if (m === 0 || p === 0) return () => 0;
  return (x) => (x < p ? (m / p ** 2) * (2 * p * x - x ** 2) : (m / (1 - p) ** 2) * (1 - 2 * p + 2 * p * x - x ** 2));
}

function fiveDigit(digits) {
  const [m, k] = FIVE_DIGIT[digits.slice(0, 3)];
  return (x) => (x < m ? (k / 6) * (x ** 3 - 3 * m * x ** 2 + m ** 2 * (3 - m) * x) : ((k * m ** 3) / 6) * (1 - x));
}

function through(points) {
  const sorted = points.filter((point) => Array.isArray(point) && point.every(Number.isFinite)).toSorted((one, other) => one[0] - other[0]);
  return (x) => {
    const next = sorted.findIndex(([px]) => px >= x);
    if (next <= 0) return (next === 0 ? sorted[0] : sorted.at(-1))?.[1] ?? 0;
    const [[x0, z0], [x1, z1]] = [sorted[next - 1], sorted[next]];
    return x1 === x0 ? z1 : z0 + ((z1 - z0) * (x - x0)) / (x1 - x0);
  };
}
