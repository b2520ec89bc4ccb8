/** Define: a design request as a form, as JSON and as a drawing, kept together, and the button that designs it. */

import { design } from "../designing.js";
import { h, live, message } from "../dom.js";
import { keepText, keptText, parsed } from "../draft.js";
import { createForm } from "../form/form.js";
import { showProblems } from "../form/problems.js";
import { put } from "../pointer.js";
import { drawSection } from "../section/drawing.js";
import { asCurl, asPython } from "./snippets.js";
import { startSelect } from "./starting.js";

const PAUSE = 250; // ms that typing rests before the other half follows

export default { id: "define", title: "Define", mount };

function mount(el, { api, state }) {
  const ended = new AbortController();
  const { signal } = ended;
  message(el, "loading", "Loading the form");
  begin().catch((problem) => {
    if (problem.name !== "AbortError") message(el, "refused", problem.detail ?? problem.message);
  });
  return { unmount: () => ended.abort() };

  async function begin() {
    const [root, examples] = await Promise.all([api.get("openapi.json", { signal }), api.get("v1/examples", { signal })]);
    const { draft, design: shown } = state.get();
    const first = draft ?? shown?.request ?? Object.values(examples)[0];
    const text = (draft ? null : keptText()) ?? JSON.stringify(first, null, 2);
    el.replaceChildren();
    mountEditor(el, { api, state, signal, root, examples, text, first });
  }
}

function mountEditor(el, { api, state, signal, root, examples, text, first }) {
  const node = root.paths["/v1/designs"].post.requestBody.content["application/json"].schema;
  let draft = parsed(text).value ?? first;
  let applied = text; // what the draft and the form were made of
  let timer = 0;
  const problem = h("div", { class: "problems", id: "json-problem", role: "alert" });
  const json = h("textarea", { id: "json", class: "json", spellcheck: "false", autocomplete: "off", "aria-describedby": "json-problem", value: text, oninput: typed, onchange: () => later(readJson, 0) });
  const summary = h("div", { role: "alert" });
  const drawing = h("div", { class: "stack" });
  const place = h("form", { class: "stack form", novalidate: true, "aria-label": "Design request", onsubmit: submit });
  const copied = h("textarea", { class: "json", rows: 8, readonly: true, hidden: true, "aria-label": "Text to copy" });
  const submitButton = h("button", { type: "submit", class: "primary", form: "request" }, "Design");
  place.id = "request";
  const bar = h("div", { class: "surface design-bar define-bar" },
    h("h2", {}, "Define a design"), startSelect({ api, state, signal, examples, start }), submitButton,
    h("button", { type: "button", onclick: () => copy("a curl command", asCurl(api.url("v1/designs"), json.value)) }, "Copy as curl"),
    h("button", { type: "button", onclick: () => copy("a Python program", asPython(api.url("v1/designs"), draft)) }, "Copy as Python"));
  const form = createForm(place, { root, schema: node, read: () => draft, write });
  el.append(h("div", { class: "stack" }, bar, summary, copied, h("div", { class: "define" },
    h("div", { class: "surface" }, place),
    h("div", { class: "stack beside" },
      h("section", { class: "surface stack", "aria-label": "Section" }, h("h3", {}, "Section"), drawing),
      h("section", { class: "surface stack", "aria-label": "JSON" }, h("label", { for: "json" }, h("h3", {}, "Request as JSON")), problem, json)))));
  signal.addEventListener("abort", () => window.clearTimeout(timer));
  show();

  /** Take a document in from outside: form, text and drawing follow. */
  function start(document) {
    const former = json.value;
    json.value = JSON.stringify(document, null, 2);
    readJson();
    summary.replaceChildren(h("p", { class: "row" }, "The form starts anew.", h("button", { type: "button", class: "quiet", onclick: () => bringBack(former) }, "Bring back what was there")));
  }

  function bringBack(former) {
    json.value = former;
    summary.replaceChildren();
    readJson();
    json.focus();
  }

  function write(pointer, value) {
    const behind = json.value !== applied; // the text says more than the form shows
    draft = put(behind ? parsed(json.value).value : draft, pointer, value);
    json.value = JSON.stringify(draft, null, 2);
    applied = json.value;
    keep();
    later(() => (behind ? show() : drawSection(drawing, draft)));
  }

  function typed() {
    place.inert = parsed(json.value).problem !== null;
    keepText(json.value);
    later(readJson);
  }

  function readJson() {
    window.clearTimeout(timer);
    const { value, problem: wrong } = parsed(json.value);
    complainOfJson(wrong);
    keepText(json.value);
    if (wrong || json.value === applied) return;
    draft = value;
    applied = json.value;
    keep();
    show();
  }

  function show() {
    complainOfJson(parsed(json.value).problem);
    form.render();
    drawSection(drawing, draft);
  }

  function keep() {
    keepText(json.value);
    state.set({ draft });
  }

  /** While the text is no JSON the form waits: a change there would write over what was typed here. */
  function complainOfJson(wrong) {
    place.inert = wrong !== null;
    if (wrong) {
      json.setAttribute("aria-invalid", "true");
      const back = () => bringBack(JSON.stringify(draft, null, 2));
      problem.replaceChildren(h("p", {}, `${wrong}. The form waits until this is JSON again.`), h("button", { type: "button", class: "quiet", onclick: back }, "Back to the last valid request"));
    } else {
      json.removeAttribute("aria-invalid");
      problem.replaceChildren();
    }
  }

  function later(action, pause = PAUSE) {
    window.clearTimeout(timer);
    timer = window.setTimeout(action, pause);
  }

  async function submit(event) {
    event.preventDefault();
    const wrong = parsed(json.value).problem;
    complainOfJson(wrong);
    if (wrong) return json.focus();
    submitButton.disabled = true;
    summary.replaceChildren();
    live("Designing");
    try {
      await design({ api, state }, json.value, signal);
      live("");
    } catch (refusal) {
      if (refusal.name !== "AbortError") refused(refusal);
    } finally {
      submitButton.disabled = false;
    }
    return undefined;
  }

  function refused({ detail, message: words, errors = [] }) {
    live("");
    const text = errors.length > 1 ? `${errors.length} fields are refused; each says why.` : (detail ?? words);
    summary.replaceChildren(h("p", { class: "message refused" }, text));
    showProblems(place, errors);
  }

  async function copy(what, content) {
    try {
      await navigator.clipboard.writeText(content);
      live(`Copied: ${what}`);
      copied.hidden = true;
    } catch {
      copied.hidden = false; // browsers give the clipboard to secure pages only
      copied.value = content;
      copied.select();
      live("Press Ctrl+C to copy the marked text");
    }
  }
}
