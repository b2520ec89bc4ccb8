/** The control for one value: `{el, control}` told of changes by the form. */

import { h } from "../dom.js";
import { numbersOf, numbersText, scalarOf, textOf } from "./entries.js";
import { inRange, range } from "./schema.js";

/**
 * @param {import("./schema.js").Alternative} alternative
 * @param {*} value
 * @param {{id: string, required: boolean, describedBy: string, change: function(*): void, complain: function(string): void}} place
 * @returns {HTMLElement} the control itself
 */
export function input(alternative, value, place) {
  const shared = { id: place.id, "aria-describedby": place.describedBy, autocomplete: "off", spellcheck: "false" };
  const fallback = alternative.schema.default;
  const makers = {
    number: () => line(numberInput(alternative.schema, place), value, { ...shared, class: "number", inputmode: "decimal" }, fallback, place),
    text: () => line((text) => place.change(text === "" ? undefined : text), value, { ...shared, maxlength: alternative.schema.maxLength }, fallback, place),
    words: () => line((text) => place.change(text.split(/[\s,]+/).filter((one) => one)), Array.isArray(value) ? value.join(", ") : value, shared, fallback, place),
    numbers: () => numbersInput(alternative, value, shared, place),
    json: () => jsonInput(value, shared, place),
  };
  return makers[alternative.kind]();
}

/**
 * A yes-or-no field.
 * @param {boolean} value
 * @param {{id: string, describedBy: string, change: function(boolean): void}} place
 * @returns {HTMLElement}
 */
export function yesOrNo(value, place) {
  const control = h("input", { type: "checkbox", id: place.id, "aria-describedby": place.describedBy, checked: value, onchange: () => place.change(control.checked) });
  return control;
}

function line(read, value, attributes, fallback, { required }) {
  const placeholder = required ? "required" : fallback === undefined || fallback === null ? null : String(fallback);
  const control = h("input", { ...attributes, type: "text", placeholder, value: textOf(value), oninput: () => read(control.value) });
  return control;
}

function numberInput(schema, { change, complain }) {
  return (text) => {
    const value = scalarOf(text);
    change(value);
    if (typeof value === "string") complain("is not a number");
    else if (value !== undefined && !inRange(schema, value)) complain(`must be ${schema.type === "integer" ? "a whole number, " : ""}${range(schema)}`);
  };
}

function numbersInput(alternative, value, shared, { change, complain }) {
  const rows = Array.isArray(value) && value.some(Array.isArray) ? Math.min(value.length, 8) : 1;
  const read = () => {
    const numbers = numbersOf(control.value, alternative);
    change(numbers);
    if (numbers?.flat().some((one) => typeof one === "string")) complain("numbers between commas; each line is a row");
  };
  const control = h("textarea", { ...shared, rows: alternative.flat ? 1 : Math.max(2, rows), oninput: read, value: numbersText(value) });
  return control;
}

function jsonInput(value, shared, { change, complain }) {
  const read = () => {
    if (control.value.trim() === "") return change(undefined);
    try {
      change(JSON.parse(control.value));
    } catch (error) {
      complain(`is not JSON: ${error.message}; the request keeps its last value`);
    }
    return undefined;
  };
  const control = h("textarea", { ...shared, rows: 3, oninput: read, value: value === undefined ? "" : JSON.stringify(value) });
  return control;
}
