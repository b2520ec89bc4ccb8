/** Where a newcomer begins: open a shipped example, a stored design, or go to Define. */

import { design } from "../designing.js";
import { h, live, message } from "../dom.js";

/**
 * Show the ways to a design.
 * @param {Element} el
 * @param {{api: Object, state: Object}} context
 * @returns {{unmount: function(): void}}
 */
export function mountStart(el, { api, state }) {
  const ended = new AbortController();
  const { signal } = ended;
  const examples = h("div", {});
  const stored = h("div", {});
  const intro = "Gainfield designs every controller of a tab-driven aileron at every point of a flight envelope, judges each, and writes the gain schedules as files.";
  el.append(
    h("div", { class: "stack start" },
      h("h2", {}, "Open a design"),
      h("p", { class: "muted" }, intro),
      h("h3", {}, "Shipped examples"), examples,
      h("h3", {}, "Designs on this server"), stored),
  );
  show(examples, () => api.get("v1/examples", { signal }), (found) => h("div", { class: "cards" }, Object.entries(found).map(card)));
  show(stored, () => api.get("v1/designs", { signal, query: { limit: 20 } }), listed);
  return { unmount: () => ended.abort() };

  async function show(place, ask, draw) {
    message(place, "loading", "Loading");
    try {
      place.replaceChildren(draw(await ask()));
    } catch (problem) {
      if (problem.name !== "AbortError") message(place, "refused", problem.detail ?? problem.message);
    }
  }

  function card([name, request]) {
    const { geometry, controllers } = request;
    const facts = `Chord ${geometry.chord_m} m, span ${geometry.span_m} m; hinges at ${geometry.aileron_hinge} and ${geometry.tab_hinge} of the chord.`;
    const kinds = `Controllers: ${controllers.map((one) => one.name).join(", ")}.`;
    const open = h("button", { type: "button", class: "primary", onclick: () => make(open, request) }, "Open", h("span", { class: "hidden-text" }, ` ${name}`));
    const edit = h("button", { type: "button", onclick: () => state.set({ draft: request, panel: "define" }) }, "Change it first", h("span", { class: "hidden-text" }, ` (${name})`));
    return h("section", { class: "surface card", "aria-label": name },
      h("div", { class: "stack" }, h("h4", {}, name.replaceAll("_", " ")), h("p", { class: "small muted" }, `${facts} ${kinds}`)),
      h("div", { class: "row" }, open, edit));
  }

  async function make(button, request) {
    button.disabled = true;
    live("Designing");
    try {
      await design({ api, state }, JSON.stringify(request), signal);
      live("");
    } catch (problem) {
      if (problem.name !== "AbortError") live(problem.detail ?? problem.message);
    } finally {
      button.disabled = false;
    }
  }

  function listed({ items }) {
    if (!items.length) return h("p", { class: "muted" }, "None yet.");
    const entry = (item) => h("li", {}, h("a", { href: `#/explore?design=${encodeURIComponent(item.id)}` }, item.name), " ", h("span", { class: "muted small" }, when(item.created_at)));
    return h("ul", { class: "stored" }, items.map(entry));
  }
}

function when(time) {
  return new Date(time).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
}
