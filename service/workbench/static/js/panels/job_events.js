/** The events of one job. */

import { keyHeaders } from "../key.js";
import { ended } from "./job_row.js";

/** Events are named by the state that the job is in then. */
const STATES = ["queued", "running", "cancelling", "cancelled", "failed", "succeeded"];
/** Between two looks at a job where its events cannot be followed [ms]. */
const PAUSE = 1000;

/**
 * Follow a job until it has ended; the browser connects again by itself where the stream breaks.
 * @param {Object} api
 * @param {string} id
 * @param {function(Object): void} changed told of the job's document
 * @returns {{id: string, end: function(): void}}
 */
export function followJob(api, id, changed) {
  const path = `v1/jobs/${encodeURIComponent(id)}`;
  // The browser's own reader of events sends no headers, and so no key.
  return { id, end: keyHeaders().Authorization ? lookAgain(api, path, changed) : listen(api.url(`${path}/events`), changed) };
}

function listen(address, changed) {
  const stream = new EventSource(address);
  const end = () => stream.close();
  const take = ({ data }) => {
    const job = JSON.parse(data);
    if (ended(job)) end();
    changed(job);
  };
  for (const name of STATES) stream.addEventListener(name, take);
  return end;
}

function lookAgain(api, path, changed) {
  const gone = new AbortController();
  const look = async () => {
    try {
      const job = await api.get(path, { signal: gone.signal });
      changed(job);
      if (!ended(job)) timer = window.setTimeout(look, PAUSE);
    } catch (problem) {
      if (problem.name !== "AbortError") timer = window.setTimeout(look, PAUSE);
    }
  };
  let timer = window.setTimeout(look, PAUSE);
  return () => {
    gone.abort();
    window.clearTimeout(timer);
  };
}
