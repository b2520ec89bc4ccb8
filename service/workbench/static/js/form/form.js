/** A form generated from a JSON schema over a document: objects are groups, unions are selects, lists can grow. */

import { h } from "../dom.js";
import { unitOf, words } from "../format.js";
import { at } from "../pointer.js";
import { renderItems } from "./items.js";
import { input, yesOrNo } from "./inputs.js";
import { clearProblem, complain, problemPlace } from "./problems.js";
import { alternatives, firstValue, matching, range, resolve } from "./schema.js";

/**
 * A form in an element.
 * @param {Element} el
 * @param {{root: Object, schema: Object, read: function(): Object, write: function(string, *): void}} options `root`: the OpenAPI
 *   document; `read`: the document that is edited; `write`: told the pointer and the new value, undefined to take the field away
 * @returns {{render: function(): void}} draws the whole form anew from the document
 */
export function createForm(el, { root, schema, read, write }) {
  const kept = new Map(); // what was entered under an alternative that is not chosen now
  const closed = new Set(); // groups that the reader has closed
  const form = { root, read, write, kept, closed, object, field, redraw };
  const render = () => {
    const held = el.contains(document.activeElement) ? document.activeElement.id : "";
    el.replaceChildren(...object(resolve(root, schema), ""));
    if (held) document.getElementById(held)?.focus();
  };
  return { render };

  /** The fields of an object. */
  function object(own, pointer) {
    const required = own.required ?? [];
    const entries = Object.entries(own.properties).toSorted(([one], [other]) => (other === "name") - (one === "name")); // what it is called comes first
    return entries.map(([name, node]) => field(name, node, `${pointer}/${name}`, required.includes(name)));
  }

  /** Draw one field anew in its place and give it the focus back. */
  function redraw(name, node, pointer, required, focus) {
    el.querySelector(`[data-pointer="${pointer}"]`).replaceWith(field(name, node, pointer, required));
    document.getElementById(focus)?.focus();
  }

  function field(name, node, pointer, required) {
    const own = resolve(root, node);
    const choices = foldedChoices(root, node);
    const value = at(read(), pointer);
    const chosen = choices[0].kind === "items" ? choices[0] : matching(root, choices, value ?? (own.default === undefined ? value : own.default));
    if (choices.length === 1 && chosen.kind === "word") return h("div", { "data-pointer": pointer, hidden: true });
    const place = { name, node, own, pointer, required, choices, chosen, value };
    if (chosen.kind === "items") return group(place, [renderItems(form, place, redraw)]);
    if (choices.every(({ kind }) => kind === "object" || kind === "null")) return objects(place);
    return row(place);
  }

  /** A field that is an object, or one of several, or none. */
  function objects(place) {
    const { choices, chosen, pointer, value, required } = place;
    const choice = choices.length > 1 ? h("div", { class: "field" }, h("label", { for: `choice${pointer}` }, words(place.name)), h("div", { class: "entry" }, choiceOf(place))) : null;
    const absent = value === undefined && (required || choices.length > 1) && place.own.default === undefined;
    const inside = chosen.kind === "object" && !(absent && choices.length > 1) ? object(chosen.schema, pointer) : [];
    return group(place, [choice, inside]);
  }

  function group({ name, own, pointer, required, value, chosen }, content) {
    const open = !closed.has(pointer) && (required || value !== undefined || chosen.kind === "items");
    const toggle = () => (details.open ? closed.delete(pointer) : closed.add(pointer));
    const top = pointer.split("/").length === 2;
    const heading = h(top ? "h3" : "h4", {}, words(name));
    const details = h("details", { class: "group", "data-pointer": pointer, open, ontoggle: toggle },
      h("summary", {}, heading, own.description ? h("span", { class: "help" }, plain(own.description)) : null),
      problemPlace(pointer), h("div", { class: "group-body" }, content));
    return details;
  }

  /** A field with one control, or a select of what it may be and then its control. */
  function row(place) {
    const { name, own, pointer, chosen, value, choices } = place;
    const id = `field${pointer}`;
    const several = choices.length > 1;
    const only = choices.every(({ kind }) => kind === "word" || kind === "null");
    const editor = only ? null : editorOf(place, value, id);
    const unit = ["number", "numbers"].includes(chosen.kind) ? (chosen.schema.unit ?? own.unit ?? unitOf(name)) : "1";
    const helpText = [plain(own.description ?? ""), chosen.kind === "number" ? range(chosen.schema) : ""].filter((text) => text).map((text) => text.replace(/\.$/, "")).join("; ");
    const control = [several ? choiceOf(place) : null, editor, unit !== "1" && editor ? h("span", { class: "unit" }, unit.replace("^2", "\u00b2")) : null];
    const labelled = editor ? id : `choice${pointer}`;
    const nested = chosen.kind === "object" ? h("div", { class: "nested" }, object(chosen.schema, pointer)) : null;
    return h("div", { class: "field", "data-pointer": pointer },
      h("label", { for: labelled, title: name }, words(name)), h("div", { class: "entry" }, control),
      h("p", { class: "help", id: `help${pointer}` }, helpText), problemPlace(pointer), nested);
  }

  function editorOf({ name, node, own, chosen, pointer, required }, value, id) {
    if (chosen.kind === "object" || chosen.kind === "word" || chosen.kind === "null") return null;
    const nullable = alternatives(root, node).some(({ kind }) => kind === "null");
    const change = (entered) => {
      clearProblem(pointer);
      const emptied = nullable && (required || (own.default !== null && own.default !== undefined)) ? null : undefined;
      write(pointer, entered === undefined ? emptied : entered);
    };
    const describedBy = `help${pointer} error${pointer}`;
    const place = { id, name, required: required && !nullable, describedBy, change, complain: (text) => complain(pointer, text) };
    if (chosen.kind === "boolean") return yesOrNo(value ?? own.default ?? false, place);
    return input({ ...chosen, schema: { default: own.default, ...chosen.schema } }, value, place);
  }

  /** A select of what a field may be; what was entered under another choice comes back with it. */
  function choiceOf({ name, node, own, pointer, required, choices, chosen, value }) {
    const unset = value === undefined && own.default === undefined && !choices.some(({ kind }) => kind === "null" || kind === "number");
    const options = choices.map((one, index) => h("option", { value: index, selected: !unset && one === chosen }, one.label));
    const id = `choice${pointer}`;
    const control = h("select", { id, "aria-label": `${words(name)}: kind`, "aria-describedby": `error${pointer}`, onchange: choose }, unset ? h("option", { value: "", selected: true }, "choose") : null, options);
    return control;

    function choose() {
      const next = choices[Number(control.value)];
      const former = at(read(), pointer);
      kept.set(`${pointer} ${chosen.label}`, former);
      const back = kept.get(`${pointer} ${next.label}`);
      write(pointer, back !== undefined && next.kind !== "word" ? back : firstValue(root, next, former));
      redraw(name, node, pointer, required, id);
    }
  }
}

/** What a field may be; an empty field stands for "none" where it can be a number, a list or text. */
function foldedChoices(root, node) {
  const choices = alternatives(root, node);
  const emptied = choices.some(({ kind }) => ["number", "numbers", "text", "json"].includes(kind));
  return emptied ? choices.filter(({ kind }) => kind !== "null") : choices;
}

/** A description without the marks of its markup. */
function plain(text) {
  return text.replaceAll("`", "").split("\n\n")[0];
}
