/** The request that is being written, kept by this browser until the window is closed: nothing typed is lost. */

const KEY = "gainfield-draft";

/**
 * The text that was kept.
 * @returns {?string}
 */
export function keptText() {
  try {
    return window.sessionStorage.getItem(KEY);
  } catch {
    return null; // storage may be forbidden; the text then lasts as long as the page
  }
}

/**
 * Keep the text, valid JSON or not.
 * @param {string} text
 */
export function keepText(text) {
  try {
    window.sessionStorage.setItem(KEY, text);
  } catch {
    // as above
  }
}

/**
 * JSON, or where it stops being JSON.
 * @param {string} text
 * @returns {{value: *, problem: ?string}}
 */
export function parsed(text) {
  try {
    const value = JSON.parse(text);
    const object = value !== null && typeof value === "object" && !Array.isArray(value);
    return object ? { value, problem: null } : { value: undefined, problem: "a design request is an object: { .. }" };
  } catch (error) {
    return { value: undefined, problem: placed(error.message, text) };
  }
}

function placed(message, text) {
  const position = message.match(/position (\d+)/)?.[1];
  const reason = message.replace(/ in JSON at position.*| \(line.*| at line.*/s, "").replace(/^JSON\.parse: /, "");
  const before = position === undefined ? (message.includes("end of JSON") ? text : null) : text.slice(0, Number(position));
  if (before === null) return message;
  const lines = before.split("\n");
  return `line ${lines.length}, column ${lines.at(-1).length + 1}: ${reason}`;
}
