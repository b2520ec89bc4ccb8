/** JSON pointers (RFC 6901): read and change one place of a document; documents are never changed, a new one is answered. */

/**
 * The steps of a pointer.
 * @param {string} pointer e.g. `/controllers/0/name`
 * @returns {string[]}
 */
export function steps(pointer) {
  return pointer.split("/").slice(1).map((step) => step.replaceAll("~1", "/").replaceAll("~0", "~"));
}

/**
 * A pointer one step further.
 * @param {string} pointer
 * @param {string|number} step
 * @returns {string}
 */
export function join(pointer, step) {
  return `${pointer}/${String(step).replaceAll("~", "~0").replaceAll("/", "~1")}`;
}

/**
 * What stands at a pointer.
 * @param {*} document
 * @param {string} pointer
 * @returns {*} undefined where there is nothing
 */
export function at(document, pointer) {
  return steps(pointer).reduce((value, step) => (value === null || value === undefined ? undefined : value[step]), document);
}

/**
 * The document with another value at a pointer; objects on the way are made.
 * @param {*} document
 * @param {string} pointer
 * @param {*} value undefined takes the field away
 * @returns {*}
 */
export function put(document, pointer, value) {
  const [step, ...rest] = steps(pointer);
  if (step === undefined) return value;
  const below = rest.length ? put(document?.[step] ?? {}, rest.map((one) => join("", one)).join(""), value) : value;
  if (Array.isArray(document)) return document.flatMap((item, index) => (String(index) === step ? (below === undefined ? [] : [below]) : [item])).concat(Number(step) >= document.length ? [below] : []);
  const copy = document !== null && typeof document === "object" ? { ...document } : {};
  if (below === undefined) delete copy[step];
  else copy[step] = below;
  return copy;
}
