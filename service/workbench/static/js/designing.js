/** Have a request designed, and show what comes of it: the design, or the job that makes it. */

/**
 * @param {{api: Object, state: Object}} context
 * @param {string} text the design request as JSON
 * @param {AbortSignal} signal
 * @returns {Promise<void>} when the panel that shows the design or its job is chosen
 * @throws {ApiProblem} the request is refused
 */
export async function design({ api, state }, text, signal) {
  const response = await api.postRaw("v1/designs", text, { signal });
  const document = await response.json();
  if (response.status === 202) state.set({ panel: "jobs", params: { job: document.id } });
  else state.set({ design: document, designId: document.id, params: {}, panel: "explore" });
}
