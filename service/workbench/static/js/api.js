/**
 * Requests to the service. Addresses are relative to the page, so that the workbench works below any path of a proxy.
 */

import { askForKey, keyHeaders } from "./key.js";

/**
 * A refused request: the problem document (RFC 9457) that the service answered, or what else went wrong.
 * @property {number} status HTTP status; 0 when no answer came
 * @property {string} code short name of the problem
 * @property {string} detail the problem in words
 * @property {{pointer: string, detail: string, unit: ?string, allowed: ?string}[]} errors the fields it is about
 */
export class ApiProblem extends Error {
  constructor(status, { code = "unknown", detail = "", title = "", errors = [] } = {}) {
    super(detail || title || `the service answered ${status}`);
    this.name = "ApiProblem";
    this.status = status;
    this.code = code;
    this.detail = this.message;
    this.errors = errors;
  }
}

/**
 * Absolute address of a path of the service or of a link in its answers.
 * @param {string} path e.g. `v1/designs` or `/v1/designs/..`
 * @param {Object<string, *>} [query] parameters; null and undefined are left out, arrays are repeated
 * @returns {string}
 */
export function url(path, query = {}) {
  const address = new URL(path.replace(/^\/+/, ""), document.baseURI);
  address.hash = "";
  for (const [name, value] of Object.entries(query)) {
    for (const one of Array.isArray(value) ? value : [value]) {
      if (one !== null && one !== undefined) address.searchParams.append(name, String(one));
    }
  }
  return address.href;
}

/** How often a job is asked whether it has ended [ms]. */
const JOB_PACE = 300;

/**
 * GET a JSON document; where a job does the work, its result once it has ended.
 * @param {string} path
 * @param {{signal?: AbortSignal, query?: Object<string, *>}} [options]
 * @returns {Promise<*>}
 * @throws {ApiProblem}
 */
export async function get(path, { signal, query } = {}) {
  return finished(await ask(url(path, query), { signal }), signal);
}

/**
 * POST a JSON document and read the JSON answer; where a job does the work, its result once it has ended.
 * @param {string} path
 * @param {*} body
 * @param {{signal?: AbortSignal, query?: Object<string, *>, headers?: Object<string, string>}} [options]
 * @returns {Promise<*>}
 * @throws {ApiProblem}
 */
export async function post(path, body, options = {}) {
  return finished(await postRaw(path, JSON.stringify(body), options), options.signal);
}

/**
 * POST text that is JSON already; answers the response itself, for its status and headers.
 * @param {string} path
 * @param {string} text
 * @param {{signal?: AbortSignal, query?: Object<string, *>, headers?: Object<string, string>}} [options]
 * @returns {Promise<Response>}
 * @throws {ApiProblem}
 */
export async function postRaw(path, text, { signal, query, headers = {} } = {}) {
  return ask(url(path, query), {
    method: "POST",
    body: text,
    headers: { "Content-Type": "application/json", ...headers },
    signal,
  });
}

/**
 * DELETE a resource.
 * @param {string} path
 * @param {{signal?: AbortSignal}} [options]
 * @returns {Promise<Response>}
 * @throws {ApiProblem}
 */
export async function remove(path, { signal } = {}) {
  return ask(url(path), { method: "DELETE", signal });
}

/**
 * The body of any answer as text: a file, a page.
 * @param {string} path
 * @param {{signal?: AbortSignal, query?: Object<string, *>}} [options]
 * @returns {Promise<Response>} its `text()`, `blob()` and headers
 * @throws {ApiProblem}
 */
export async function file(path, { signal, query } = {}) {
  return settled(await ask(url(path, query), { signal }), signal);
}

/** The document of an answer. A job that nobody waits for any more is cancelled. */
async function finished(response, signal) {
  return (await settled(response, signal)).json();
}

/** The answer itself, be it given at once or by a job. */
async function settled(response, signal) {
  if (response.status !== 202) return response;
  let job = await response.json();
  const { links } = job;
  try {
    while (["queued", "running", "cancelling"].includes(job.state)) {
      await new Promise((resolve) => window.setTimeout(resolve, JOB_PACE));
      job = await (await ask(url(links.self), { signal })).json();
    }
  } catch (error) {
    if (error.name === "AbortError") remove(links.self).catch(() => {}); // it may have ended meanwhile
    throw error;
  }
  if (job.state === "succeeded") return ask(url(links.result), { signal });
  throw new ApiProblem(job.error?.status ?? 0, job.error ?? { code: job.state, detail: `the job was ${job.state}` });
}

async function ask(address, options) {
  let response;
  try {
    response = await fetch(address, { credentials: "same-origin", ...options, headers: { ...options.headers, ...keyHeaders() } });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new ApiProblem(0, { code: "no_answer", detail: "the service did not answer; is it running?" });
  }
  if (response.ok) return response;
  const refused = new ApiProblem(response.status, await problem(response));
  if (response.status === 401 && (await askForKey(refused.detail))) return ask(address, options);
  throw refused;
}

async function problem(response) {
  const type = response.headers.get("Content-Type") ?? "";
  if (!type.includes("json")) return { title: `${response.status} ${response.statusText}` };
  return response.json().catch(() => ({}));
}
