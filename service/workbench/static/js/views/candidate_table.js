/** A small table of actuators that can be bought, typed in by the reader. */

import { clear, h, uniqueId } from "../dom.js";

const FIELDS = [
  { name: "stall_torque_n_m", label: "stall torque", unit: "N m" },
  { name: "no_load_rate_deg_s", label: "no-load rate", unit: "deg/s" },
  { name: "continuous_torque_n_m", label: "continuous torque", unit: "N m", optional: true },
  { name: "power_w", label: "power", unit: "W", optional: true },
  { name: "rotor_inertia_kg_m2", label: "rotor inertia", unit: "kg m\u00b2", optional: true },
  { name: "gear_low", label: "gear from", unit: "1" },
  { name: "gear_high", label: "to", unit: "1" },
  { name: "efficiency", label: "efficiency", unit: "1", optional: true },
];

/**
 * The table. Rows are plain objects of `name` and the fields above, numbers or null.
 * @param {Object[]} rows
 * @param {function(Object[]): void} onChange told of all rows after every change
 * @returns {HTMLElement}
 */
export function candidateTable(rows, onChange) {
  const el = h("div", { class: "stack" });
  let kept = rows.map((row) => ({ ...row }));
  draw();
  return el;

  function draw() {
    const head = h("tr", {}, h("th", { scope: "col" }, "name"), FIELDS.map(({ label, unit }) => h("th", { scope: "col" }, unit === "1" ? label : `${label} [${unit}]`)), h("th", { scope: "col" }, ""));
    const table = h("table", { class: "candidates" }, h("caption", { class: "hidden-text" }, "Candidates"), h("thead", {}, head), h("tbody", {}, kept.map(entry)));
    const add = h("button", { type: "button", onclick: () => change([...kept, { ...kept.at(-1), name: freeName() }]) }, "Add a candidate");
    clear(el).append(h("div", { class: "scroll" }, table), h("div", {}, add));
  }

  function entry(row, index) {
    const edit = (name, value) => {
      kept = kept.map((one, place) => (place === index ? { ...one, [name]: value } : one));
      onChange(kept);
    };
    const named = h("input", { id: uniqueId("candidate"), value: row.name, maxlength: 200, "aria-label": `Name of candidate ${index + 1}`, onchange: () => edit("name", named.value) });
    const cells = FIELDS.map((field) => h("td", {}, cell(field, row, edit)));
    const remove = h("button", { type: "button", class: "quiet", disabled: kept.length === 1, "aria-label": `Take ${row.name} away`, onclick: () => change(kept.filter((_, place) => place !== index)) }, "\u00d7");
    return h("tr", {}, h("td", {}, named), cells, h("td", {}, remove));
  }

  function cell({ name, label, optional }, row, edit) {
    const control = h("input", {
      type: "number", step: "any", class: "number", value: row[name] ?? "", "aria-label": `${label} of ${row.name}`, placeholder: optional ? "\u2013" : null,
      onchange: () => edit(name, Number.isFinite(control.valueAsNumber) ? control.valueAsNumber : null),
    });
    return control;
  }

  function change(next) {
    kept = next;
    draw();
    onChange(kept);
  }

  function freeName() {
    const names = new Set(kept.map(({ name }) => name));
    let number = kept.length + 1;
    while (names.has(`motor ${number}`)) number += 1;
    return `motor ${number}`;
  }
}

/**
 * Rows as the service takes them; what is left empty is left out, and then has its default.
 * @param {Object[]} rows
 * @returns {Object[]}
 */
export function candidatesOf(rows) {
  return rows.map(({ gear_low: low, gear_high: high, ...row }) => {
    const given = Object.entries(row).filter(([, value]) => value !== null && value !== undefined);
    return { ...Object.fromEntries(given), gear_ratio: low === high || high === null ? low : { low, high } };
  });
}

/**
 * A first candidate that is about large enough.
 * @param {{peak_torque_n_m: {value: number}, peak_rate_deg_s: {value: number}}} envelope what is asked of the actuator
 * @returns {Object}
 */
export function firstCandidate({ peak_torque_n_m: torque, peak_rate_deg_s: rate }) {
  const two = (value) => Number(value.toPrecision(2));
  return {
    name: "motor 1", stall_torque_n_m: two(torque.value / 5), no_load_rate_deg_s: two(rate.value * 20), continuous_torque_n_m: null, power_w: null,
    rotor_inertia_kg_m2: null, gear_low: 1, gear_high: 60, efficiency: 0.9,
  };
}
