/** Save an answer as a file. */

import { h } from "./dom.js";

/**
 * Save an answer under the name that the service gives it.
 * @param {Response} response
 * @returns {Promise<string>} the name
 */
export async function saveFile(response) {
  const said = response.headers.get("Content-Disposition")?.match(/filename="([^"]+)"/)?.[1];
  const last = new URL(response.url).pathname.split("/").at(-1);
  const name = said ?? (last.includes(".") ? last : `${last}.${extension(response)}`);
  saveBlob(name, await response.blob());
  return name;
}

/**
 * Save bytes under a name.
 * @param {string} name
 * @param {Blob} blob
 */
export function saveBlob(name, blob) {
  const address = URL.createObjectURL(blob);
  h("a", { href: address, download: name }).click();
  window.setTimeout(() => URL.revokeObjectURL(address), 1000); // the browser reads it after the click
}

function extension(response) {
  return (response.headers.get("Content-Type") ?? "").includes("html") ? "html" : "json";
}
