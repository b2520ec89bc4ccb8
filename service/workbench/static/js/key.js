/** The key of the one who asks, where the service wants one; kept for this tab of the browser and no longer. */

import { h } from "./dom.js";

const NAME = "gainfield-key";

let asking = null;

/**
 * Headers that show the key.
 * @returns {Object<string, string>}
 */
export function keyHeaders() {
  const key = window.sessionStorage.getItem(NAME);
  return key ? { Authorization: `Bearer ${key}` } : {};
}

/**
 * Ask for a key, of several that want one at the same time once.
 * @param {string} reason why one is wanted, in words
 * @returns {Promise<boolean>} whether there is one now
 */
export function askForKey(reason) {
  asking ??= asked(reason).finally(() => {
    asking = null;
  });
  return asking;
}

function asked(reason) {
  return new Promise((resolve) => {
    const field = h("input", { type: "password", id: "api-key", autocomplete: "off", spellcheck: "false" });
    const taken = h("button", { type: "submit", class: "primary" }, "Use this key");
    const given_up = h("button", { type: "button", onclick: () => dialog.close() }, "Not now");
    const form = h("form", { class: "stack" },
      h("h2", {}, "A key is needed"), h("p", {}, reason),
      h("p", {}, h("label", { for: "api-key" }, "API key "), field),
      h("p", { class: "muted" }, "It is kept until this tab is closed."),
      h("div", { class: "row" }, taken, given_up));
    const dialog = h("dialog", { class: "surface", "aria-label": "A key is needed" }, form);
    let found = false;
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      found = field.value.trim() !== "";
      if (!found) return field.focus();
      window.sessionStorage.setItem(NAME, field.value.trim());
      return dialog.close();
    });
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(found);
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}
