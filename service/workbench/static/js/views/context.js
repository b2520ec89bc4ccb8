/** What a view is given. */

import * as dom from "../dom.js";
import * as format from "../format.js";
import * as grid from "../grid.js";
import * as plot from "../plot.js";

/**
 * The context of one mounted view.
 * @param {{api: Object, state: Object}} shared
 * @returns {{api: Object, state: Object, dom: Object, format: Object, grid: Object, plot: Object, signal: function(): AbortSignal,
 *   param: function(string, string): string, setParam: function(string, ?string): void,
 *   show: function(Element, function(AbortSignal): Promise<*>, function(*): void): Promise<void>, end: function(): void}}
 */
export function viewContext({ api, state }) {
  let current = new AbortController();

  /** A signal for the requests of the state that is shown now; those of the state before are aborted. */
  const signal = () => {
    current.abort();
    current = new AbortController();
    return current.signal;
  };

  /** A parameter of this view, as it stands in the address. */
  const param = (name, fallback) => state.get().params[name] ?? fallback;

  /** Put a parameter of this view into the address; the view's `update` follows. */
  const setParam = (name, value) => state.set({ params: { ...state.get().params, [name]: value } });

  /**
   * Ask for something and draw it; until then, or where it is refused, say so in place. Answers of an older state never arrive.
   * @param {Element} el where the result goes
   * @param {function(AbortSignal): Promise<*>} ask
   * @param {function(*): void} draw told of the answer; the message in `el` is gone by then
   */
  const show = async (el, ask, draw) => {
    const own = signal();
    if (!el.querySelector(".plot-canvas")) dom.message(el, "loading", "Computing");
    el.setAttribute("aria-busy", "true");
    try {
      const answer = await ask(own);
      if (own.aborted) return;
      if (el.querySelector(":scope > .message")) dom.clear(el);
      await draw(answer);
    } catch (problem) {
      if (problem.name === "AbortError" || own.aborted) return;
      dom.message(el, "refused", problem.detail ?? problem.message);
    } finally {
      if (!own.aborted) el.removeAttribute("aria-busy");
    }
  };

  return { api, state, dom, format, grid, plot, signal, param, setParam, show, end: () => current.abort() };
}
