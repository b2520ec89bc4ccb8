/** What two controllers are compared by, as fields over the grid points that both have. */

import { title, words } from "../format.js";

const CARRIED = { nu_gap: "Nu-gap between the two plants", stability_margin: "Generic stability margin" };

/**
 * The figures that may be drawn.
 * @param {Object} answer of the comparison, with one common point at least
 * @returns {{value: string, label: string, group: string}[]}
 */
export function figureOptions({ points }) {
  const { gains, figures } = points[0];
  return [
    ...figures.map(({ name }) => ({ value: `figures.${name}`, label: sentence(title(name)), group: "Margins, step and requirements" })),
    ...gains.map(({ name, unit }) => ({ value: `gains.${name}`, label: withUnit(name, unit), group: "Gain" })),
    ...Object.entries(CARRIED).map(([name, label]) => ({ value: `carried.${name}`, label, group: "Gains carried to the other plant" })),
  ];
}

/**
 * One figure of both and its difference over the common points.
 * @param {Object} answer of the comparison
 * @param {string} id of `figureOptions`
 * @returns {{title: string, carried: boolean, value: (?number)[][], other: (?number)[][], difference: (?number)[][]}} null where the grids have no common point or the figure no value
 */
export function fieldsOf(answer, id) {
  const [kind, name] = id.split(/\.(.*)/);
  const triple = kind === "carried" ? carriedAt(name) : sideBySide(kind, name);
  const rows = answer.points.map(triple);
  const pick = (part) => onGrid(answer, rows.map((row) => row[part]));
  const heading = kind === "gains" ? withUnit(name, answer.points[0].gains.find((one) => one.name === name).unit) : kind === "carried" ? words(name) : title(name);
  return { title: heading, carried: kind === "carried", value: pick("value"), other: pick("other"), difference: pick("difference") };
}

/**
 * The axes of the common points.
 * @param {Object} answer of the comparison, with one common point at least
 * @returns {{name: string, values: number[]}[]} first rows, then columns
 */
export function commonAxes({ points }) {
  return Object.keys(points[0].coordinates).map((name) => ({ name, values: [...new Set(points.map((point) => point.coordinates[name]))].sort((one, other) => one - other) }));
}

/**
 * Row and column of a common point.
 * @param {Object} answer
 * @param {Object} point of the answer
 * @returns {number[]}
 */
export function placeOf(answer, { coordinates }) {
  return commonAxes(answer).map(({ name, values }) => values.indexOf(coordinates[name]));
}

function sideBySide(kind, name) {
  return (point) => point[kind].find((one) => one.name === name);
}

function carriedAt(name) {
  return ({ on_other_plant: mine, other_on_this_plant: theirs }) => {
    const [value, other] = [mine[name], theirs[name]];
    return { value, other, difference: value === null || other === null ? null : other - value };
  };
}

function onGrid(answer, values) {
  const [rows, columns] = commonAxes(answer);
  const field = rows.values.map(() => columns.values.map(() => null));
  answer.points.forEach(({ coordinates }, index) => {
    field[rows.values.indexOf(coordinates[rows.name])][columns.values.indexOf(coordinates[columns.name])] = values[index];
  });
  return field;
}

function withUnit(name, unit) {
  return unit === "1" ? name : `${name} [${unit}]`;
}

function sentence(text) {
  return text[0].toUpperCase() + text.slice(1);
}
