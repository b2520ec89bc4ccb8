/** Sliders and number fields of what can be moved; sliders are logarithmic about the designed value. */

import { clear, h, uniqueId } from "../../dom.js";
import { number, quantity } from "../../format.js";

const DECADES = 1.5;
const STEP = 0.01;
const NARROW = 8; // characters of a label that fit the narrow column

/**
 * Draw the knobs.
 * @param {Element} el emptied first
 * @param {import("./knobs.js").Knob[]} knobs
 * @param {{title: string, onMove: function(string, number): void, actions: Element[]}} options `onMove` is told id and value while it moves
 * @returns {{show: function(Object<string, number>): void}} `show` puts values by id
 */
export function knobPanel(el, knobs, { title, onMove, actions }) {
  const rows = knobs.map((knob) => row(knob, (value) => onMove(knob.id, value)));
  const group = h("div", { class: knobs.some(({ label }) => label.length > NARROW) ? "knobs wide" : "knobs", role: "group", "aria-label": title }, rows.map((one) => one.el));
  clear(el).append(h("h4", {}, title), group, h("div", { class: "row" }, actions));
  return { show: (values) => rows.forEach((one, k) => one.show(values[knobs[k].id])) };
}

function row(knob, onMove) {
  const id = uniqueId("knob");
  const size = Math.abs(knob.value) || 1;
  const sign = knob.value < 0 ? -1 : 1;
  const slide = () => {
    const value = rounded(sign * size * 10 ** range.valueAsNumber);
    field.value = String(value);
    range.setAttribute("aria-valuetext", quantity(value, knob.unit));
    onMove(value);
  };
  const type = () => {
    const value = field.valueAsNumber;
    if (!Number.isFinite(value)) return field.setAttribute("aria-invalid", "true");
    field.removeAttribute("aria-invalid");
    slideTo(value);
    return onMove(value);
  };
  const slideTo = (value) => {
    const part = value * sign > 0 ? Math.log10(Math.abs(value) / size) : -DECADES;
    range.value = String(Math.min(Math.max(part, -DECADES), DECADES));
    range.setAttribute("aria-valuetext", quantity(value, knob.unit));
  };
  const range = h("input", { type: "range", min: -DECADES, max: DECADES, step: STEP, "aria-label": `${knob.label}, slider`, "data-knob": knob.id, oninput: slide });
  const field = h("input", { id, type: "number", class: "number", step: "any", "data-field": knob.id, onchange: type });
  const name = h("label", { for: id, title: `as designed ${number(knob.value)}` }, knob.label);
  const unit = h("span", { class: "unit" }, knob.unit === "1" ? "" : knob.unit);
  const show = (value) => {
    if (document.activeElement !== field || field.valueAsNumber !== value) field.value = String(rounded(value));
    field.removeAttribute("aria-invalid");
    slideTo(value);
  };
  show(knob.value);
  return { el: h("div", { class: "knob" }, name, range, field, unit), show };
}

/** To five significant digits, as fields and the address show it. */
function rounded(value) {
  return Number(value.toPrecision(5));
}
