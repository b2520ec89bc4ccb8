/** Light or dark: the system's choice, or the reader's, which this browser keeps. */

const KEY = "gainfield-theme";
const read = new Map(); // custom properties of the theme that is shown: reading one makes the browser work out styles
const DARK = window.matchMedia("(prefers-color-scheme: dark)");

/** Set up the switch in the header; a `themechange` event of the document follows every change. */
export function install() {
  const control = document.getElementById("theme");
  control.value = kept();
  apply();
  control.addEventListener("change", () => {
    keep(control.value);
    apply();
  });
  DARK.addEventListener("change", apply);

  function apply() {
    const theme = control.value === "auto" ? (DARK.matches ? "dark" : "light") : control.value;
    if (document.documentElement.dataset.theme === theme) return;
    document.documentElement.dataset.theme = theme;
    read.clear();
    document.dispatchEvent(new CustomEvent("themechange"));
  }
}

/**
 * A custom property of the style sheet as it is now.
 * @param {string} name e.g. `--ink`
 * @returns {string}
 */
export function colour(name) {
  if (!read.has(name)) read.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return read.get(name);
}

function kept() {
  try {
    const value = window.localStorage.getItem(KEY);
    return ["light", "dark"].includes(value) ? value : "auto";
  } catch {
    return "auto"; // storage may be forbidden; the choice then lasts as long as the page
  }
}

function keep(value) {
  try {
    window.localStorage.setItem(KEY, value);
  } catch {
    // as above
  }
}
