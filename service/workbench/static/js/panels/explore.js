/** Explore: the list of views, the chosen controller and grid point, and one view. */

import * as dom from "../dom.js";
import { pointName, pointOptions } from "../grid.js";
import { VIEWS } from "../views/index.js";
import { viewContext } from "../views/context.js";
import { mountStart } from "./start.js";

const { h } = dom;
const GROUPS = { envelope: "Over the envelope", point: "At a point" };
const SHARED = ["design", "point", "controller", "params"];

export default { id: "explore", title: "Explore", mount };

function mount(el, { api, state }) {
  let parts = null;
  const ends = [state.subscribe(["design", "designId", "designProblem"], show), state.subscribe(["view", "point", "controller", "params"], update)];
  show();
  return { unmount };

  function unmount() {
    ends.forEach((end) => end());
    parts?.unmount();
  }

  function show() {
    const { design, designId, designProblem } = state.get();
    parts?.unmount();
    parts = null;
    if (!designId) parts = mountStart(dom.clear(el), { api, state });
    else if (designProblem) refused(designProblem);
    else if (!design) dom.message(el, "loading", "Loading the design");
    else parts = mountDesign(dom.clear(el), { api, state });
  }

  function update(changed) {
    parts?.update?.(changed);
  }

  function refused(problem) {
    dom.message(el, "refused", problem.detail);
    el.append(h("p", {}, h("button", { type: "button", onclick: () => state.set({ designId: null }) }, "Open another design")));
  }
}

function mountDesign(el, { api, state }) {
  const list = h("nav", { class: "surface view-list", "aria-label": "Views" });
  const bar = h("div", { class: "surface design-bar" });
  const place = h("section", { class: "surface view stack" });
  el.append(h("div", { class: "explore" }, list, h("div", { class: "stack" }, bar, place)));
  let view = null;
  showList();
  showBar();
  showView();
  return { update, unmount: () => view.unmount() };

  function update(changed) {
    if (changed.has("view")) {
      showList();
      showBar();
      showView();
      return;
    }
    if (changed.has("point") || changed.has("controller")) showBar();
    if (SHARED.some((key) => changed.has(key))) view.update(changed);
  }

  function current() {
    return VIEWS.find((one) => one.id === state.get().view);
  }

  function showList() {
    const entry = (one) => h("li", {}, h("a", { href: `#/explore/${one.id}`, "aria-current": one === current() ? "true" : null, onclick: (event) => choose(event, one) }, one.title));
    const group = ([id, title]) => {
      const own = VIEWS.filter((one) => one.group === id);
      return own.length ? [h("h2", {}, title), h("ul", {}, own.map(entry))] : [];
    };
    const held = list.contains(document.activeElement);
    dom.clear(list).append(...Object.entries(GROUPS).flatMap(group));
    if (held) list.querySelector("[aria-current]").focus();
  }

  function choose(event, one) {
    if (event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    const { design, controller } = state.get();
    const fits = ({ kind }) => !one.kind || kind === one.kind;
    const chosen = design.controllers.find(({ name }) => name === controller);
    state.set({ view: one.id, params: {}, controller: (fits(chosen) ? chosen : design.controllers.find(fits) ?? chosen).name });
  }

  function showBar() {
    const { design, controller, point } = state.get();
    const needs = current().needs;
    const held = bar.contains(document.activeElement) ? document.activeElement.dataset.role : null;
    dom.clear(bar).append(h("h2", {}, design.name));
    if (needs.includes("controller")) {
      const names = design.controllers.map(({ name, kind }) => ({ value: name, label: `${name} (${kind.replaceAll("_", " ")})` }));
      bar.append(dom.select("Controller", names, controller, (name) => state.set({ controller: name })));
      bar.lastChild.control.dataset.role = "controller";
    }
    if (needs.includes("point")) {
      bar.append(dom.select("Point", pointOptions(design), String(point), (index) => state.set({ point: Number(index) })));
      bar.lastChild.control.dataset.role = "point";
      bar.lastChild.control.title = pointName(design, point);
    }
    bar.append(h("button", { type: "button", class: "quiet", onclick: () => state.set({ designId: null, params: {} }) }, "Open another"));
    if (held) bar.querySelector(`[data-role="${held}"]`)?.focus();
  }

  function showView() {
    view?.unmount();
    const chosen = current();
    dom.clear(place);
    place.setAttribute("aria-label", chosen.title);
    place.append(h("h3", {}, chosen.title));
    const body = place.appendChild(h("div", { class: "stack" }));
    const context = viewContext({ api, state });
    const made = chosen.mount(body, context);
    view = {
      update: made.update,
      unmount: () => {
        context.end();
        made.unmount();
      },
    };
  }
}
