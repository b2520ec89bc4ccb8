/** One figure of two controllers as maps beside each other, and their difference. */

import * as plot from "../plot.js";
import { categoriesOf, categoryAxis, frameAt } from "../views/envelope_axes.js";
import { commonAxes, fieldsOf, placeOf } from "./figures.js";

/** Less, equal, more: told apart by the colour-blind, and by the numbers in the cells. */
const DIFFERENCE = [[0, "#2f7fc9"], [0.5, "#e9edf1"], [1, "#c98500"]];

/**
 * Draw the three maps.
 * @param {{heading: Element, picture: Element}[]} places of this, the other and the difference
 * @param {Object} answer of the comparison
 * @param {string} figure id of `figureOptions`
 * @param {number} point flat index of the chosen point in this design's grid
 * @param {{names: string[], onPoint: function(number): void}} options `names` of the two controllers in words
 * @returns {Promise<void[]>}
 */
export function drawMaps(places, answer, figure, point, { names, onPoint }) {
  const fields = fieldsOf(answer, figure);
  const [rows, columns] = commonAxes(answer);
  const both = [...fields.value, ...fields.other].flat().filter((value) => value !== null);
  const most = Math.max(...fields.difference.flat().map((value) => Math.abs(value ?? 0)), 1e-12);
  const scale = both.length ? { zmin: Math.min(...both), zmax: Math.max(...both) } : {};
  const [this_, other] = names;
  const headings = fields.carried ? [`${this_} on the plant of ${other}`, `${other} on the plant of ${this_}`] : names;
  const maps = [
    { heading: headings[0], z: fields.value, colorscale: plot.FIELD, ...scale },
    { heading: headings[1], z: fields.other, colorscale: plot.FIELD, ...scale },
    { heading: "difference, second less first", z: fields.difference, colorscale: DIFFERENCE, zmin: -most, zmax: most },
  ];
  const chosen = answer.points.find((one) => one.point === point);
  const layout = { xaxis: categoryAxis(columns), yaxis: categoryAxis(rows), shapes: chosen ? [frameAt(placeOf(answer, chosen))] : [] };
  const onPick = ({ x, y }) => {
    const place = [categoriesOf(rows).indexOf(y), categoriesOf(columns).indexOf(x)];
    const found = answer.points.find((one) => placeOf(answer, one).every((index, axis) => index === place[axis]));
    if (found) onPoint(found.point);
  };
  return Promise.all(maps.map(({ heading, ...field }, index) => {
    places[index].heading.textContent = heading;
    const heat = {
      type: "heatmap", name: `${fields.title}, ${heading}`, x: categoriesOf(columns), y: categoriesOf(rows), hoverongaps: false, xgap: 1, ygap: 1, showscale: false,
      texttemplate: columns.values.length <= 8 ? "%{z:.4~r}" : "", hovertemplate: "%{y}, %{x}: %{z:.4~r}<extra></extra>", ...field,
    };
    const label = `${fields.title}, ${heading}, at ${answer.points.length} common points${both.length ? "" : "; there is no number"}`;
    return plot.draw(places[index].picture, [heat], layout, { label, onPick, height: Math.min(480, 150 + 60 * rows.values.length) });
  }));
}
