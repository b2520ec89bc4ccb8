/** One job as a row of the table. */

import { clear, h } from "../dom.js";
import { NONE, number } from "../format.js";

const ENDED = ["cancelled", "failed", "succeeded"];
const TONES = { succeeded: "good", failed: "bad", cancelled: "warn", cancelling: "warn" };

/**
 * Whether nothing more will happen to a job.
 * @param {{state: string}} job
 * @returns {boolean}
 */
export function ended(job) {
  return ENDED.includes(job.state);
}

/**
 * A row that follows its job.
 * @param {Object} first the job's document
 * @param {{chosen: boolean, open: function(Object): void, cancel: function(Object): void}} options
 * @returns {{el: HTMLElement, update: function(Object): void}}
 */
export function jobRow(first, { chosen, open, cancel }) {
  const name = `${first.kind} ${first.id.slice(0, 8)}`;
  const bar = h("progress", { "aria-label": `Progress of ${name}` });
  const count = h("span", { class: "small number" });
  const [stateCell, rate, left, result, action] = Array.from({ length: 5 }, () => h("td", {}));
  const el = h("tr", { "aria-current": chosen ? "true" : null, "data-job": first.id },
    h("th", { scope: "row" }, first.kind, " ", h("code", { class: "small muted" }, first.id.slice(0, 8))),
    stateCell, h("td", {}, h("div", { class: "row" }, bar, count)), rate, left, result, action);
  let shown = null;
  return { el, update };

  function update(job) {
    const { done, total, rate_1_s: speed, time_left_s: time } = job.progress;
    bar.max = total || 1;
    bar.value = done;
    count.textContent = `${done}/${total}`;
    rate.textContent = speed ? `${number(speed, 3)} 1/s` : NONE;
    left.textContent = ended(job) || time === null || time === undefined ? NONE : duration(time);
    if (shown === job.state) return;
    shown = job.state;
    clear(stateCell).append(h("span", { class: `tag ${TONES[job.state] ?? ""}` }, job.state));
    clear(result).append(...outcome(job));
    const held = action.contains(document.activeElement);
    clear(action).append(...actions(job));
    if (held) action.querySelector("button")?.focus();
  }

  function outcome(job) {
    if (job.state === "failed") return [h("span", { class: "problems" }, job.error?.detail ?? "no reason given")];
    if (job.state !== "succeeded" || !job.result) return [NONE];
    const design = job.result.startsWith("/v1/designs/");
    return [h("button", { type: "button", class: "primary", onclick: () => open(job) }, design ? "Open the design" : "Save the result", h("span", { class: "hidden-text" }, ` of ${name}`))];
  }

  function actions(job) {
    if (job.state === "cancelling") return [];
    return [h("button", { type: "button", onclick: () => cancel(job) }, ended(job) ? "Remove" : "Cancel", h("span", { class: "hidden-text" }, ` ${name}`))];
  }
}

function duration(seconds) {
  if (seconds < 60) return `${Math.ceil(seconds)} s`;
  const minutes = Math.ceil(seconds / 60);
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}
