/** The events of one job. */

import { ended } from "./job_row.js";

/**
 * Follow a job until it has ended; the browser connects again by itself where the stream breaks.
 * @param {Object} api
 * @param {string} id
 * @param {function(Object): void} changed told of the job's document
 * @returns {{id: string, end: function(): void}}
 */
export function followJob(api, id, changed) {
  const stream = new EventSource(api.url(`v1/jobs/${encodeURIComponent(id)}/events`));
  const end = () => stream.close();
  const take = ({ data }) => {
    const job = JSON.parse(data);
    if (ended(job)) end();
    changed(job);
  };
  stream.addEventListener("message", take);
  stream.addEventListener("job", take);
  return { id, end };
}
