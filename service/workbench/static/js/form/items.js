/** A list of objects in a form: its entries can be added, doubled, moved away. */

import { h } from "../dom.js";
import { words } from "../format.js";
import { at } from "../pointer.js";
import { alternatives, firstValue, matching } from "./schema.js";

/**
 * The entries of a list and what makes more.
 * @param {Object} form see `createForm`
 * @param {{name: string, node: Object, pointer: string, required: boolean, own: Object}} place
 * @param {function(string, Object, string, boolean, string): void} redraw
 * @returns {Node[]}
 */
export function renderItems(form, { name, node, pointer, required, own }, redraw) {
  const { root, read, write } = form;
  const choices = alternatives(root, own.items);
  const one = words(name).replace(/s$/, "");
  const items = () => at(read(), pointer) ?? [];
  const found = items();
  const entries = (Array.isArray(found) ? found : []).map(entry);
  const buttons = choices.map((choice) => h("button", { type: "button", id: `add${pointer}/${choice.label}`, onclick: () => add(firstValue(root, choice)) }, `Add ${choice.label}`));
  return [entries, h("div", { class: "row" }, buttons)];

  function add(item) {
    const named = "name" in item || !choices.some((choice) => choice.schema.properties.name) ? item : { name: freeName(item.kind ?? one), ...item };
    write(pointer, [...items(), named]);
    redraw(name, node, pointer, required, `field${pointer}/${items().length - 1}/name`);
  }

  function freeName(wish) {
    const taken = new Set(items().map((item) => item?.name));
    const names = [wish, ...Array.from({ length: taken.size + 1 }, (_, index) => `${wish}_${index + 2}`)];
    return names.find((candidate) => !taken.has(candidate));
  }

  function entry(item, index) {
    const below = `${pointer}/${index}`;
    const chosen = matching(root, choices, item);
    const label = `${one} ${item?.name ?? index + 1}`;
    const double = () => add({ ...item, ...(at(read(), below)), name: freeName(`${at(read(), below).name ?? one}`) });
    const drop = () => {
      write(pointer, items().filter((_, other) => other !== index));
      redraw(name, node, pointer, required, `add${pointer}/${choices[0].label}`);
    };
    const change = () => {
      const next = choices[Number(kind.value)];
      write(below, firstValue(root, next, at(read(), below)));
      redraw(name, node, pointer, required, `choice${below}`);
    };
    const options = choices.map((choice, place) => h("option", { value: place, selected: choice === chosen }, choice.label));
    const kind = h("select", { id: `choice${below}`, onchange: change }, options);
    const kindRow = choices.length > 1 ? h("div", { class: "field" }, h("label", { for: kind.id }, "kind"), h("div", { class: "entry" }, kind)) : null;
    const actions = h("div", { class: "row" },
      h("button", { type: "button", class: "quiet", onclick: double }, "Double", h("span", { class: "hidden-text" }, ` ${label}`)),
      h("button", { type: "button", class: "quiet", onclick: drop }, "Remove", h("span", { class: "hidden-text" }, ` ${label}`)));
    return h("fieldset", { class: "item", "data-pointer": below },
      h("legend", {}, label), h("div", { class: "problems", id: `error${below}` }), actions, kindRow, form.object(chosen.schema, below));
  }
}
