/** Messages at the fields they are about. */

import { h } from "../dom.js";

/**
 * Where the messages of a field go.
 * @param {string} pointer
 * @returns {HTMLElement}
 */
export function problemPlace(pointer) {
  return h("div", { class: "problems", id: `error${pointer}` });
}

/**
 * Say at a field what is wrong with it.
 * @param {string} pointer of the field
 * @param {string} text
 */
export function complain(pointer, text) {
  document.getElementById(`error${pointer}`).replaceChildren(h("p", {}, text));
  controlOf(pointer)?.setAttribute("aria-invalid", "true");
}

/**
 * Take the messages of a field away.
 * @param {string} pointer
 */
export function clearProblem(pointer) {
  document.getElementById(`error${pointer}`)?.replaceChildren();
  controlOf(pointer)?.removeAttribute("aria-invalid");
}

/**
 * Place the fields of a problem document, open what hides them, and move the focus to the first.
 * @param {Element} el the form
 * @param {{pointer: string, detail: string, allowed: ?string}[]} errors
 */
export function showProblems(el, errors) {
  clearAll(el);
  for (const error of errors) {
    const pointer = nearest(error.pointer);
    if (pointer === null) continue;
    const place = document.getElementById(`error${pointer}`);
    const where = pointer === error.pointer ? "" : `${error.pointer.slice(pointer.length + 1)}: `;
    place.append(h("p", {}, `${where}${error.detail}${error.allowed ? `; allowed: ${error.allowed}` : ""}`));
    controlOf(pointer)?.setAttribute("aria-invalid", "true");
    for (let up = place.closest("details"); up; up = up.parentElement.closest("details")) up.open = true;
  }
  const first = el.querySelector(".problems > p");
  if (first) focus(el, first.parentElement.id.slice("error".length));
}

function clearAll(el) {
  for (const place of el.querySelectorAll(".problems")) place.replaceChildren();
  for (const control of el.querySelectorAll('[aria-invalid="true"]')) control.removeAttribute("aria-invalid");
}

/** The field that a pointer names, or the one around it. */
function nearest(pointer) {
  for (let own = pointer; own; own = own.slice(0, own.lastIndexOf("/"))) {
    if (document.getElementById(`error${own}`)) return own;
  }
  return null;
}

function focus(el, pointer) {
  const control = controlOf(pointer) ?? el.querySelector(`[data-pointer="${pointer}"] summary, [data-pointer="${pointer}"] input, [data-pointer="${pointer}"] button`);
  control?.focus();
  control?.scrollIntoView({ block: "center" });
}

function controlOf(pointer) {
  return document.getElementById(`field${pointer}`) ?? document.getElementById(`choice${pointer}`);
}
