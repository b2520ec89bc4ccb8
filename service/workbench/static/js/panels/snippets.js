/** A request as a command and as a program. */

/**
 * A command line for any shell with curl.
 * @param {string} address of the route
 * @param {string} text JSON
 * @returns {string}
 */
export function asCurl(address, text) {
  return `curl -sS -X POST '${address}' -H 'Content-Type: application/json' --data-binary @- <<'JSON'\n${text}\nJSON\n`;
}

/**
 * A program for Python's own library.
 * @param {string} address of the route
 * @param {*} request
 * @returns {string}
 */
export function asPython(address, request) {
  return [
    "import json",
    "import urllib.request",
    "",
    `body = ${literal(request, "")}`,
    "request = urllib.request.Request(",
    `    ${JSON.stringify(address)},`,
    "    data=json.dumps(body).encode(),",
    '    headers={"Content-Type": "application/json"},',
    ")",
    "with urllib.request.urlopen(request) as answer:",
    "    design = json.load(answer)",
    'print(design["id"], design["outcomes"])',
    "",
  ].join("\n");
}

function literal(value, indent) {
  const inner = `${indent}    `;
  if (value === null) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (typeof value !== "object") return JSON.stringify(value);
  if (Array.isArray(value)) {
    if (value.every((one) => one === null || typeof one !== "object")) return `[${value.map((one) => literal(one, "")).join(", ")}]`;
    return `[\n${value.map((one) => `${inner}${literal(one, inner)},\n`).join("")}${indent}]`;
  }
  return `{\n${Object.entries(value).map(([name, one]) => `${inner}${JSON.stringify(name)}: ${literal(one, inner)},\n`).join("")}${indent}}`;
}
