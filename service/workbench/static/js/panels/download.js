/** Download: the gain schedules of a design in every format the service writes, proofs, the design itself and its report. */

import { clear, h, live, message, select } from "../dom.js";
import { words } from "../format.js";
import { saveFile } from "../save.js";
import { FORMATS } from "./formats.js";

const ROUTE = "/v1/designs/{id}/schedules/{controller}.{suffix}";

export default { id: "download", title: "Download", mount };

function mount(el, { api, state }) {
  const ended = new AbortController();
  const { signal } = ended;
  let options = null;
  const end = state.subscribe(["design", "designProblem", "params", "controller"], show);
  show();
  return { unmount };

  function unmount() {
    end();
    ended.abort();
  }

  async function show() {
    const { design, designId, designProblem } = state.get();
    if (!designId) return noDesign();
    if (designProblem) return message(el, "refused", designProblem.detail);
    if (!design) return message(el, "loading", "Loading the design");
    try {
      options ??= optionsOf(await api.get("openapi.json", { signal }));
      draw();
    } catch (problem) {
      if (problem.name !== "AbortError") message(el, "refused", problem.detail ?? problem.message);
    }
    return undefined;
  }

  function noDesign() {
    message(el, "empty", "There is no design open: its files are downloaded here.");
    el.append(h("p", { class: "row" }, h("button", { type: "button", class: "primary", onclick: () => state.set({ panel: "explore" }) }, "Open a design")));
  }

  function draw() {
    const { design, controller } = state.get();
    const held = el.contains(document.activeElement) ? document.activeElement.dataset.role : null;
    const names = design.controllers.map(({ name, kind }) => ({ value: name, label: `${name} (${words(kind)})` }));
    const choice = marked(select("Controller", names, controller, (name) => state.set({ controller: name })), "controller");
    const choices = options.map((option) => marked(select(option.label, option.values, value(option.name), (chosen) => choose(option.name, chosen)), option.name));
    const help = options.map(({ label, description }) => [h("dt", {}, label), h("dd", {}, description)]);
    clear(el).append(h("div", { class: "stack" },
      h("div", { class: "surface design-bar" }, h("h2", {}, `Files of ${design.name}`), choice),
      h("section", { class: "surface stack", "aria-label": "Gain schedule" },
        h("h3", {}, `Gain schedule of ${controller}`), missing(design, controller),
        h("div", { class: "row" }, choices),
        h("details", { class: "small" }, h("summary", {}, "What the choices mean"), h("dl", { class: "meanings" }, help)),
        files(`Files of the schedule of ${controller}`, Object.entries(design.links.schedules[controller]).map(scheduleFile))),
      h("section", { class: "surface stack", "aria-label": "About the design" }, h("h3", {}, "About the design"), files("Files about the design", others(design, controller)))));
    if (held) el.querySelector(`[data-role="${held}"]`)?.focus();
  }

  function value(name) {
    return state.get().params[name] ?? "";
  }

  function choose(name, chosen) {
    state.set({ params: { ...state.get().params, [name]: chosen || null } });
  }

  function scheduleFile([suffix, link]) {
    const { title, purpose, everywhere } = FORMATS[suffix] ?? { title: suffix, purpose: "The schedule in this format.", everywhere: false };
    const query = Object.fromEntries(options.map(({ name }) => [name, value(name) || null]));
    if (!everywhere) query.fill = null; // these files say where there is no gain, and take no rule for it
    return { title, suffix, purpose, link, query };
  }

  /** One row a file; a refusal is said in its row. */
  function files(caption, list) {
    const rows = list.map(({ title, suffix, purpose, link, query }) => {
      const said = h("p", { class: "problems", role: "alert" });
      const button = h("button", { type: "button", onclick: () => save(button, said, link, query) }, `Download .${suffix}`, h("span", { class: "hidden-text" }, `: ${title}`));
      return h("tr", {}, h("th", { scope: "row" }, title), h("td", {}, purpose, said), h("td", {}, button));
    });
    const head = h("tr", {}, ["File", "What it is for", "Save"].map((name) => h("th", { scope: "col" }, name)));
    return h("table", { class: "files" }, h("caption", { class: "hidden-text" }, caption), h("thead", {}, head), h("tbody", {}, rows));
  }

  async function save(button, said, link, query) {
    said.textContent = "";
    button.disabled = true;
    live("Writing the file");
    try {
      live(`Saved ${await saveFile(await api.file(link, { signal, query }))}`);
    } catch (problem) {
      if (problem.name === "AbortError") return;
      live("");
      said.textContent = problem.detail ?? problem.message;
    } finally {
      button.disabled = false;
      button.focus();
    }
  }

  function others(design, controller) {
    const { links } = design;
    const found = [{ title: "Design", suffix: "json", purpose: "The request, the grid, the air, all gains, outcomes and verdicts, and links to everything else.", link: links.self }];
    const proof = links.certificate?.[controller];
    if (proof) found.push({ title: `Proof for ${controller}`, suffix: "json", purpose: "What proves the loop stable in every cell between the grid points, to be checked by python -m schedules.verify.", link: proof });
    if (links.report) found.push({ title: "Report", suffix: "html", purpose: "The design in one page to read, print and pass on.", link: links.report });
    return found;
  }
}

/** How many points have no gains: files that need a number everywhere then need a rule. */
function missing(design, controller) {
  const { outcomes } = design.controllers.find((one) => one.name === controller);
  const count = outcomes.flat().filter((outcome) => outcome !== "ok").length;
  if (!count) return h("p", { class: "muted" }, "Every point of the grid has gains.");
  return h("p", {}, h("span", { class: "tag warn" }, `${count} of ${outcomes.flat().length} points have no gains`), " C, MATLAB scripts, JSBSim and DAVE-ML need a number everywhere: choose where it comes from.");
}

/** The choices that the route takes: its query parameters that are words. */
function optionsOf(root) {
  const parameters = root.paths[ROUTE].get.parameters.filter((one) => one.in === "query");
  return parameters.map(({ name, description, schema }) => {
    const allowed = [schema, ...(schema.anyOf ?? [])].flatMap((one) => one.enum ?? (one.const === undefined ? [] : [one.const]));
    const first = { value: "", label: schema.default === undefined ? "none" : words(schema.default) };
    const rest = allowed.filter((one) => one !== schema.default).map((one) => ({ value: one, label: words(one) }));
    const label = words(name);
    return { name, description, label: label[0].toUpperCase() + label.slice(1), values: [first, ...rest] };
  });
}

function marked(control, role) {
  control.control.dataset.role = role;
  return control;
}
