/** Studies that take more than a second are begun by the reader. */

import { clear, h } from "../dom.js";

/**
 * Say what a study would compute and offer to begin it.
 * @param {Element} el emptied first
 * @param {{words: string, label: string}} offer what is computed, and what the button says
 * @param {function(): void} begin
 */
export function offer(el, { words, label }, begin) {
  const button = h("button", { type: "button", class: "primary", onclick: begin }, label);
  clear(el).append(h("div", { class: "row" }, button, h("span", { class: "muted" }, words)));
}
