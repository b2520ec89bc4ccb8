/** Jobs: long work with its progress, what can be cancelled, and what came of it. */

import { clear, h, live, message } from "../dom.js";
import { saveFile } from "../save.js";
import { followJob } from "./job_events.js";
import { ended, jobRow } from "./job_row.js";

const PAUSE = 3000; // ms between looks at the list while something runs

export default { id: "jobs", title: "Jobs", mount };

function mount(el, { api, state }) {
  const gone = new AbortController();
  const { signal } = gone;
  const rows = new Map(); // id -> row
  const list = h("tbody", {});
  const place = h("div", { class: "stack" });
  let timer = 0;
  let followed = null;
  el.append(h("div", { class: "stack" },
    h("div", { class: "surface design-bar" }, h("h2", {}, "Jobs"), h("button", { type: "button", onclick: refresh }, "Look again")),
    h("div", { class: "surface" }, place)));
  message(place, "loading", "Loading");
  refresh();
  return { unmount };

  function unmount() {
    gone.abort();
    window.clearTimeout(timer);
    followed?.end();
  }

  async function refresh() {
    window.clearTimeout(timer);
    try {
      const { items } = await api.get("v1/jobs", { signal });
      draw(items);
      const active = items.filter((job) => !ended(job));
      follow(active);
      if (active.length) timer = window.setTimeout(refresh, PAUSE);
    } catch (problem) {
      if (problem.name !== "AbortError") message(place, "refused", problem.detail ?? problem.message);
    }
  }

  function draw(jobs) {
    if (!jobs.length) {
      message(place, "empty", "No jobs. Designs above the limit of work in line, and whatever is asked for with Prefer: respond-async, become jobs.");
      return;
    }
    for (const id of rows.keys()) if (!jobs.some((job) => job.id === id)) forget(id);
    jobs.forEach((job, index) => {
      const row = rowOf(job);
      if (list.children[index] !== row.el) list.insertBefore(row.el, list.children[index] ?? null);
    });
    if (!list.isConnected) {
      const columns = ["Job", "State", "Progress", "Rate", "Time left", "Result", "Action"];
      const head = h("tr", {}, columns.map((name) => h("th", { scope: "col" }, name)));
      clear(place).append(h("table", { class: "files" }, h("caption", { class: "hidden-text" }, "Jobs, newest first"), h("thead", {}, head), list));
    }
  }

  function rowOf(job) {
    const row = rows.get(job.id) ?? jobRow(job, { chosen: job.id === state.get().params.job, open, cancel });
    rows.set(job.id, row);
    row.update(job);
    return row;
  }

  function forget(id) {
    rows.get(id).el.remove();
    rows.delete(id);
  }

  /** One job at a time is followed by its events: each takes a connection, of which browsers have few. */
  function follow(active) {
    const wanted = active.find((job) => job.id === state.get().params.job) ?? active.at(-1);
    if (followed?.id === wanted?.id) return;
    followed?.end();
    followed = wanted ? followJob(api, wanted.id, changed) : null;
  }

  function changed(job) {
    rows.get(job.id)?.update(job);
    if (!ended(job)) return;
    live(`Job ${job.kind}: ${job.state}`);
    followed = null;
    refresh();
  }

  async function cancel(job) {
    try {
      await api.remove(`v1/jobs/${encodeURIComponent(job.id)}`, { signal });
      if (ended(job)) forget(job.id);
      live(ended(job) ? "Removed" : "Asked to cancel");
      refresh();
    } catch (problem) {
      if (problem.name !== "AbortError") live(problem.detail ?? problem.message);
    }
  }

  async function open(job) {
    const design = job.result.match(/^\/v1\/designs\/([^/?]+)$/)?.[1];
    if (design) return state.set({ designId: design, panel: "explore", params: {} });
    try {
      live(`Saved ${await saveFile(await api.file(job.result, { signal }))}`);
    } catch (problem) {
      if (problem.name !== "AbortError") live(problem.detail ?? problem.message);
    }
    return undefined;
  }
}
