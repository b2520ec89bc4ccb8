/** A field over the grid as a map of equal cells; a click chooses a point. */

import { number } from "../format.js";
import { placeOf, pointName } from "../grid.js";
import * as plot from "../plot.js";
import { categoriesOf, categoryAxis, frameAt } from "./envelope_axes.js";

/**
 * Draw a field with its numbers in the cells.
 * @param {Element} el
 * @param {Object} design
 * @param {number} point the chosen one: it is framed
 * @param {{title: string, z: (?number)[][], text?: string[][], scale?: *, range?: Object, showScale: boolean}} field as of `fieldOf`
 * @param {{of: string, onPoint: function(number): void}} options `of`: whose field it is, in words
 * @returns {Promise<void>}
 */
export function drawField(el, design, point, field, { of, onPoint }) {
  const [rows, columns] = design.grid.axes;
  const [i, j] = placeOf(design, point);
  const [x, y] = [categoriesOf(columns), categoriesOf(rows)];
  const shown = field.text ? "%{text}" : "%{z:.4~r}";
  const heat = {
    type: "heatmap",
    z: field.z,
    x,
    y,
    text: field.text,
    texttemplate: columns.values.length <= 12 ? shown : "",
    hovertemplate: `%{y}, %{x}: ${shown}<extra></extra>`,
    hoverongaps: false,
    colorscale: field.scale ?? plot.FIELD,
    ...field.range,
    showscale: field.showScale,
    colorbar: { title: { text: field.title, side: "right" }, thickness: 14 },
    xgap: 1,
    ygap: 1,
    name: field.title,
  };
  const here = field.text ? field.text[i][j].replace("<br>", ", ") : number(field.z[i][j]);
  const label = `${field.title} of ${of} over the grid; chosen is ${pointName(design, point)}: ${here}`;
  const layout = { xaxis: categoryAxis(columns), yaxis: categoryAxis(rows), shapes: [frameAt([i, j])] };
  const pick = (picked) => onPoint(y.indexOf(picked.y) * columns.values.length + x.indexOf(picked.x));
  return plot.draw(el, [heat], layout, { label, onPick: pick, height: Math.min(560, 170 + 60 * rows.values.length) });
}
