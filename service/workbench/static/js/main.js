/** Start: the store, the address, the panels. */

import * as api from "./api.js";
import { clear, h, live, message } from "./dom.js";
import { PANELS } from "./panels/index.js";
import { follow } from "./permalink.js";
import { createState } from "./state.js";
import * as theme from "./theme.js";
import { VIEWS } from "./views/index.js";

const state = createState({
  panel: "explore",
  view: VIEWS[0].id,
  designId: null,
  design: null,
  designProblem: null,
  point: 0,
  controller: null,
  params: {},
  draft: null,
});
const main = document.getElementById("main");
let mounted = null;
let loading = null;

theme.install();
drawNavigation();
state.subscribe(["designId"], loadDesign);
state.subscribe(["panel"], showPanel);
state.subscribe(["panel", "designId"], markNavigation);
follow(state, { panels: PANELS.map((panel) => panel.id), views: VIEWS.map((view) => view.id) }, placed);
if (!mounted) showPanel();
if (!state.get().designId) markNavigation();

function drawNavigation() {
  const links = PANELS.map((panel) => h("a", { href: `#/${panel.id}`, "data-panel": panel.id, onclick: (event) => open(event, panel.id) }, panel.title));
  document.getElementById("panels").append(...links);
}

function open(event, panel) {
  if (event.ctrlKey || event.metaKey || event.shiftKey) return;
  event.preventDefault();
  state.set({ panel, params: {} });
  main.focus({ preventScroll: true });
}

function markNavigation() {
  const { panel, design } = state.get();
  for (const link of document.querySelectorAll("#panels a")) {
    if (link.dataset.panel === panel) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  const title = PANELS.find((one) => one.id === panel).title;
  document.title = `${design ? `${design.name}: ` : ""}${title} \u2013 Gainfield`;
}

function showPanel() {
  mounted?.unmount();
  const el = clear(main).appendChild(h("div", {}));
  mounted = PANELS.find((panel) => panel.id === state.get().panel).mount(el, { api, state });
}

async function loadDesign() {
  const { designId, design } = state.get();
  loading?.abort();
  if (!designId) return state.set({ design: null, designProblem: null });
  if (design?.id === designId) return settle(design);
  loading = new AbortController();
  state.set({ design: null, designProblem: null });
  try {
    settle(await api.get(`v1/designs/${encodeURIComponent(designId)}`, { signal: loading.signal }));
  } catch (problem) {
    if (problem.name !== "AbortError") state.set({ designProblem: problem });
  }
  return undefined;
}

/** Take a design in. */
function settle(design) {
  state.set({ design, designProblem: null, ...placed(design, state.get()) });
  markNavigation();
}

/** Point and controller that are asked for, where the design has them; else its first. */
function placed(design, { point, controller }) {
  const points = design.grid.shape.reduce((product, count) => product * count, 1);
  const names = design.controllers.map((one) => one.name);
  return { point: point < points ? point : 0, controller: names.includes(controller) ? controller : names[0] };
}

window.addEventListener("unhandledrejection", ({ reason }) => live(reason?.message ?? String(reason)));
window.addEventListener("error", ({ message: text }) => message(main, "refused", `The page failed: ${text}. Load it again.`));
