/** What a request may start from: the shipped examples, and the designs of this server. */

import { h, live, uniqueId } from "../dom.js";

/**
 * A select of starting points; the stored designs follow when the server has told them.
 * @param {{api: Object, state: Object, signal: AbortSignal, examples: Object<string, Object>, start: function(Object): void}} options `start` is given a request
 * @returns {HTMLElement}
 */
export function startSelect({ api, state, signal, examples, start }) {
  const id = uniqueId("start");
  const option = (value, label) => h("option", { value }, label);
  const shipped = h("optgroup", { label: "Examples" }, Object.keys(examples).map((name) => option(`example ${name}`, name)));
  const stored = h("optgroup", { label: "Designs" });
  const control = h("select", { id, onchange: choose }, option("", "choose"), shipped);
  api.get("v1/designs", { signal, query: { limit: 20 } }).then(listed, () => {}); // without the list the examples remain
  return h("div", { class: "control" }, h("label", { for: id }, "Start from"), control);

  function listed({ items }) {
    if (items.length === 0) return;
    const current = state.get().designId;
    stored.append(...items.map((item) => option(`design ${item.id}`, `${item.name}${item.id === current ? " (shown)" : ""}, ${item.created_at.slice(0, 16).replace("T", " ")}`)));
    control.append(stored);
  }

  async function choose() {
    const [kind, name] = control.value.split(/ (.*)/);
    control.value = "";
    if (kind === "example") return start(examples[name]);
    try {
      if (kind === "design") start((await api.get(`v1/designs/${encodeURIComponent(name)}`, { signal })).request);
    } catch (problem) {
      if (problem.name !== "AbortError") live(problem.detail ?? problem.message);
    }
    return undefined;
  }
}
