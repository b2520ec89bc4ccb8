/** What a JSON schema of the OpenAPI document says about one place: its alternatives, ranges and a first value. */

/**
 * A schema with its references followed; what stands beside a reference counts.
 * @param {Object} root the OpenAPI document
 * @param {Object} node
 * @returns {Object}
 */
export function resolve(root, node) {
  if (!node.$ref) return node;
  const { $ref, ...beside } = node;
  const target = $ref.split("/").slice(1).reduce((place, step) => place[step], root);
  return { ...resolve(root, target), ...beside };
}

/**
 * @typedef {Object} Alternative
 * @property {"null"|"number"|"word"|"text"|"boolean"|"object"|"numbers"|"words"|"items"|"json"} kind how it is edited
 * @property {string} label in words
 * @property {Object} schema
 * @property {*} [value] of a word: the word
 */

/**
 * The alternatives of a place, flat: unions in unions and the words of an enumeration are one list.
 * @param {Object} root
 * @param {Object} node
 * @returns {Alternative[]}
 */
export function alternatives(root, node) {
  const schema = resolve(root, node);
  const branches = schema.oneOf ?? schema.anyOf;
  if (branches) {
    const shared = schema.unit && schema.unit !== "1" ? { unit: schema.unit } : {};
    return branches.flatMap((branch) => alternatives(root, { ...shared, ...branch }));
  }
  if ("const" in schema) return [word(schema, schema.const)];
  if (schema.enum) return schema.enum.map((value) => word(schema, value));
  if (schema.type === "null") return [{ kind: "null", label: "none", schema }];
  if (schema.type === "number" || schema.type === "integer") return [{ kind: "number", label: "number", schema }];
  if (schema.type === "boolean") return [{ kind: "boolean", label: "yes or no", schema }];
  if (schema.type === "string") return [{ kind: "text", label: "text", schema }];
  if (schema.type === "array") return [list(root, schema)];
  if (schema.properties) return [{ kind: "object", label: objectLabel(root, schema), schema }];
  return [{ kind: "json", label: "JSON", schema }];
}

function word(schema, value) {
  return { kind: "word", label: String(value).replaceAll("_", " "), schema, value };
}

function list(root, schema) {
  const items = alternatives(root, schema.items ?? {});
  if (items.every((one) => one.kind === "object")) return { kind: "items", label: "list", schema };
  if (items.every((one) => one.kind === "text")) return { kind: "words", label: "list of names", schema };
  const numeric = (one) => one.kind === "number" || (one.kind === "numbers" && one.flat);
  if (items.every(numeric)) {
    const flat = items.every((one) => one.kind === "number");
    return { kind: "numbers", label: flat ? "list" : "rows of numbers", schema, flat, nested: items.every((one) => one.kind === "numbers") };
  }
  return { kind: "json", label: "rows", schema };
}

/** The word that tells one object of a union from the others, or its title in words. */
function objectLabel(root, schema) {
  const mark = Object.values(schema.properties).map((property) => resolve(root, property)).find((property) => "const" in property);
  const name = mark ? String(mark.const) : (schema.title ?? "object");
  const spaced = name.replaceAll("_", " ").replace(/([a-z])([A-Z])/g, "$1 $2").toLowerCase();
  if (mark) return spaced;
  if (schema.title?.endsWith("Span")) return "from, to, count";
  return schema.properties.values && schema.properties.axis ? "over the grid" : spaced;
}

/**
 * Which alternative a value is.
 * @param {Object} root
 * @param {Alternative[]} choices
 * @param {*} value
 * @returns {Alternative} the likeliest where it is none of them
 */
export function matching(root, choices, value) {
  const found = choices.find((one) => matches(root, one, value));
  if (value === undefined || value === null) return found ?? choices[0];
  return found ?? choices.find((one) => one.kind === "number") ?? choices.find((one) => one.kind !== "null") ?? choices[0];
}

function matches(root, { kind, schema, value: own }, value) {
  if (value === undefined || value === null) return kind === "null";
  if (kind === "word") return value === own;
  if (kind === "number") return typeof value === "number";
  if (kind === "boolean") return typeof value === "boolean";
  if (kind === "text") return typeof value === "string";
  if (["numbers", "words", "items", "json"].includes(kind)) return Array.isArray(value) || (kind === "json" && typeof value === "object");
  if (typeof value !== "object" || Array.isArray(value) || kind !== "object") return false;
  return Object.entries(schema.properties).every(([name, property]) => {
    const resolved = resolve(root, property);
    return !("const" in resolved) || !(schema.required ?? []).includes(name) || value[name] === resolved.const;
  });
}

/**
 * A first value of an alternative: what it must have, with what another value has under the same names.
 * @param {Object} root
 * @param {Alternative} alternative
 * @param {*} former
 * @returns {*} undefined where nothing can be said
 */
export function firstValue(root, { kind, schema, value }, former) {
  if (kind === "null") return null;
  if (kind === "word") return value;
  if (kind !== "object") return schema.default;
  const old = former !== null && typeof former === "object" && !Array.isArray(former) ? former : {};
  const entries = Object.entries(schema.properties).map(([name, property]) => {
    const resolved = resolve(root, property);
    const required = (schema.required ?? []).includes(name);
    if ("const" in resolved) return [name, required ? resolved.const : undefined];
    return [name, old[name] ?? (required ? firstOf(root, property) : undefined)];
  });
  return Object.fromEntries(entries.filter(([, one]) => one !== undefined));
}

function firstOf(root, property) {
  const [first] = alternatives(root, property);
  return first.kind === "object" ? firstValue(root, first) : resolve(root, property).examples?.[0];
}

/**
 * The range of a number in words.
 * @param {Object} schema
 * @returns {string} empty where there is none
 */
export function range(schema) {
  const { minimum, maximum, exclusiveMinimum, exclusiveMaximum } = schema;
  const low = minimum ?? exclusiveMinimum;
  const high = maximum ?? exclusiveMaximum;
  if (low === undefined && high === undefined) return "";
  if (high === undefined) return `${exclusiveMinimum === undefined ? "at least" : "above"} ${low}`;
  if (low === undefined) return `${exclusiveMaximum === undefined ? "at most" : "below"} ${high}`;
  const open = exclusiveMinimum !== undefined && exclusiveMaximum !== undefined ? "between " : exclusiveMinimum !== undefined ? "above " : "";
  const joint = open === "between " ? "and" : exclusiveMaximum !== undefined ? "to below" : "to";
  return `${open}${low} ${joint} ${high}`;
}

/**
 * Whether a number lies in the range of its schema.
 * @param {Object} schema
 * @param {number} value
 * @returns {boolean}
 */
export function inRange(schema, value) {
  const { minimum = -Infinity, maximum = Infinity, exclusiveMinimum = -Infinity, exclusiveMaximum = Infinity } = schema;
  const whole = schema.type !== "integer" || Number.isInteger(value);
  return whole && value >= minimum && value <= maximum && (value > exclusiveMinimum || exclusiveMinimum === -Infinity) && (value < exclusiveMaximum || exclusiveMaximum === Infinity);
}
