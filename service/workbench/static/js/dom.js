/** Elements, labelled controls and messages. */

const SVG = "http://www.w3.org/2000/svg";
let serial = 0;

/**
 * An element.
 * @param {string} tag name of the element; `svg:line` for one of SVG
 * @param {Object<string, *>} [attributes] `class`, `for`, ..; `on<event>` takes a listener; null, undefined and false are left out
 * @param {...(Node|string|number|null|Array)} children text is taken as text
 * @returns {Element}
 */
export function h(tag, attributes = {}, ...children) {
  const el = tag.startsWith("svg:") ? document.createElementNS(SVG, tag.slice(4)) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) el.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked" || name === "selected") el[name] = value;
    else el.setAttribute(name, value === true ? "" : String(value));
  }
  el.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false).map(asNode));
  return el;
}

function asNode(child) {
  return child instanceof Node ? child : document.createTextNode(String(child));
}

/**
 * Take everything out of an element.
 * @param {Element} el
 * @returns {Element} the same
 */
export function clear(el) {
  el.replaceChildren();
  return el;
}

/**
 * An id that nothing else in the page has.
 * @param {string} name
 * @returns {string}
 */
export function uniqueId(name) {
  serial += 1;
  return `${name}-${serial}`;
}

/**
 * Tell the reader, on the screen and to screen readers, what has happened; for eight seconds.
 * @param {string} text empty to take it away
 */
export function live(text) {
  const region = document.getElementById("status");
  region.textContent = text;
  window.setTimeout(() => {
    if (region.textContent === text) region.textContent = "";
  }, 8000);
}

/**
 * Show in place of a result why there is none.
 * @param {Element} el emptied first
 * @param {"loading"|"empty"|"refused"} kind
 * @param {string} text
 */
export function message(el, kind, text) {
  const role = kind === "refused" ? "alert" : "status";
  clear(el).append(h("p", { class: `message ${kind}`, role }, text));
}

/**
 * A labelled select.
 * @param {string} label
 * @param {{value: string, label: string, group?: string}[]} options
 * @param {string} value the chosen one
 * @param {function(string): void} onChange
 * @returns {HTMLElement} with `.control` the select element
 */
export function select(label, options, value, onChange) {
  const id = uniqueId("select");
  const chosen = options.some((option) => option.value === value) ? value : options[0]?.value;
  const entry = (option) => h("option", { value: option.value, selected: option.value === chosen }, option.label);
  const groups = [...new Set(options.map((option) => option.group))];
  const entries = groups.flatMap((group) => {
    const own = options.filter((option) => option.group === group).map(entry);
    return group ? [h("optgroup", { label: group }, own)] : own;
  });
  const control = h("select", { id, onchange: () => onChange(control.value) }, entries);
  return labelled(label, control);
}

/**
 * A labelled field for a number, with its unit.
 * @param {string} label
 * @param {?number} value
 * @param {{unit?: string, min?: number, max?: number, step?: number|"any"}} options
 * @param {function(number): void} onChange told of finite numbers within the range only
 * @returns {HTMLElement} with `.control` the input element
 */
export function numberField(label, value, { unit = "", min, max, step = "any" }, onChange) {
  const id = uniqueId("number");
  const change = () => {
    const number = control.valueAsNumber;
    const taken = Number.isFinite(number) && control.checkValidity();
    control.removeAttribute("aria-invalid");
    if (taken) onChange(number);
    else control.setAttribute("aria-invalid", "true");
  };
  const control = h("input", { id, type: "number", class: "number", value: value ?? "", min, max, step, onchange: change });
  return labelled(label, control, unitMark(unit));
}

/**
 * A labelled slider with its value and unit shown.
 * @param {string} label
 * @param {number} value
 * @param {{unit?: string, min: number, max: number, step: number|"any", format?: function(number): string}} options
 * @param {function(number): void} onInput told while it moves
 * @returns {HTMLElement} with `.control` the input element
 */
export function slider(label, value, { unit = "", min, max, step, format = String }, onInput) {
  const id = uniqueId("slider");
  const shown = h("output", { for: id }, format(value));
  const input = () => {
    shown.textContent = format(control.valueAsNumber);
    onInput(control.valueAsNumber);
  };
  const control = h("input", { id, type: "range", min, max, step, oninput: input });
  control.value = String(value);
  return labelled(label, control, shown, unitMark(unit));
}

/**
 * A labelled check box.
 * @param {string} label
 * @param {boolean} value
 * @param {function(boolean): void} onChange
 * @returns {HTMLElement} with `.control` the input element
 */
export function checkbox(label, value, onChange) {
  const id = uniqueId("check");
  const control = h("input", { id, type: "checkbox", checked: value, onchange: () => onChange(control.checked) });
  const el = h("div", { class: "control" }, control, h("label", { for: id }, label));
  el.control = control;
  return el;
}

/**
 * A table of figures.
 * @param {string} caption
 * @param {string[]} columns
 * @param {(string|number|Node)[][]} rows the first cell of a row is its heading; numbers are set to the right
 * @returns {HTMLElement}
 */
export function table(caption, columns, rows) {
  const numeric = (index) => rows.length > 0 && rows.every((row) => typeof row[index] === "number" || /^[\u2212\u2013-]?[\d.]*(e\u2212?\d+)?$/.test(row[index]));
  const kinds = columns.map((_, index) => (numeric(index) ? "number" : null));
  const head = h("tr", {}, columns.map((name, index) => h("th", { scope: "col", class: kinds[index] }, name)));
  const body = rows.map((row) => h("tr", {}, row.map((cell, index) => h(index ? "td" : "th", { scope: index ? null : "row", class: kinds[index] }, cell))));
  return h("table", {}, h("caption", { class: "hidden-text" }, caption), h("thead", {}, head), h("tbody", {}, body));
}

function labelled(label, control, ...more) {
  const el = h("div", { class: "control" }, h("label", { for: control.id }, label), control, more);
  el.control = control;
  return el;
}

function unitMark(unit) {
  return unit && unit !== "1" ? h("span", { class: "unit" }, unit) : null;
}
