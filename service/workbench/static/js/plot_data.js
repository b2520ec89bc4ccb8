/** The numbers of a plot as a table and as a file: what stands in for the picture. */

import { h, table } from "./dom.js";
import { number } from "./format.js";
import { saveBlob } from "./save.js";

const SHOWN_ROWS = 300;

/**
 * A disclosure with the numbers of a plot, made when it is opened.
 * @param {{traces: Object[], layout: Object, label: string}} plot
 * @returns {HTMLDetailsElement}
 */
export function dataOf({ traces, layout, label }) {
  const open = () => {
    if (!details.open || details.childElementCount > 1) return;
    const { columns, rows } = numbersOf(traces, layout);
    const shown = rows.slice(0, SHOWN_ROWS).map((row) => row.map((cell) => (typeof cell === "number" ? number(cell, 6) : String(cell ?? "\u2013"))));
    const left = rows.length > SHOWN_ROWS ? `The first ${SHOWN_ROWS} of ${rows.length} rows; the file has all.` : null;
    const save = h("button", { type: "button", onclick: () => saveAs("data.csv", [columns, ...rows]) }, "Save as CSV");
    const scroll = h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": `Data: ${label}` }, table(label, columns, shown));
    details.append(h("div", { class: "row small" }, save, left), scroll);
  };
  const details = h("details", { ontoggle: open }, h("summary", {}, "Data"));
  return details;
}

/**
 * Columns and rows of traces: one row a sample or a cell.
 * @param {Object[]} traces
 * @param {Object} layout
 * @returns {{columns: string[], rows: (string|number|null)[][]}}
 */
export function numbersOf(traces, layout) {
  const axis = (key, fallback) => layout[key]?.title?.text ?? fallback;
  const columns = ["series", axis("xaxis", "x"), axis("yaxis", "y")];
  const fields = traces.some((trace) => trace.z);
  const rows = traces.flatMap((trace, index) => {
    const name = trace.name ?? `${index + 1}`;
    if (trace.z) return trace.z.flatMap((row, i) => [...row].map((z, j) => [name, trace.x?.[j] ?? j, trace.y?.[i] ?? i, plain(trace.text?.[i]?.[j]) ?? z]));
    return [...(trace.y ?? trace.x ?? [])].map((y, i) => [name, trace.x?.[i] ?? i, y].concat(fields ? [null] : []));
  });
  return { columns: fields ? [...columns, "value"] : columns, rows };
}

/** Text of a plot on one line. */
function plain(text) {
  return typeof text === "string" ? text.replaceAll("<br>", " ") : text;
}

/**
 * Save rows as a file of comma-separated values.
 * @param {string} name
 * @param {(string|number|null)[][]} rows
 */
export function saveAs(name, rows) {
  const cell = (value) => (/[",\n]/.test(String(value ?? "")) ? `"${String(value).replaceAll('"', '""')}"` : String(value ?? ""));
  const text = rows.map((row) => row.map(cell).join(",")).join("\r\n");
  saveBlob(name, new Blob([text], { type: "text/csv" }));
}
