/** Text of an input to a value and back. Text that is no number stays as it was typed: the service says what is wrong with it. */

/**
 * @param {string} text
 * @returns {number|string|undefined} undefined for an empty field
 */
export function scalarOf(text) {
  const bare = text.trim().replace(/^\u2212/, "-");
  if (bare === "") return undefined;
  const value = Number(bare);
  return Number.isFinite(value) ? value : text;
}

/**
 * @param {*} value
 * @returns {string}
 */
export function textOf(value) {
  if (value === undefined || value === null) return "";
  return typeof value === "object" ? JSON.stringify(value) : String(value);
}

/**
 * Numbers between commas or blanks; lines are rows.
 * @param {string} text
 * @param {{flat: boolean, nested: boolean}} form `flat`: one list; `nested`: rows, even of one line; neither: by the lines
 * @returns {Array|undefined} undefined for an empty field
 */
export function numbersOf(text, { flat, nested }) {
  const lines = text.split(/[;\n]/).map((line) => line.trim()).filter((line) => line);
  if (!lines.length) return undefined;
  const rows = lines.map((line) => line.split(/[\s,]+/).filter((one) => one).map(scalarOf));
  if (flat) return rows.flat();
  return nested || rows.length > 1 ? rows : rows[0];
}

/**
 * @param {*} value
 * @returns {string}
 */
export function numbersText(value) {
  if (!Array.isArray(value)) return textOf(value);
  if (value.some(Array.isArray)) return value.map((row) => (Array.isArray(row) ? row.map(textOf).join(", ") : textOf(row))).join("\n");
  return value.map(textOf).join(", ");
}
