/** The step response beside what is moved. */

const CLIPPED = 3;
const SETTLED = 3;

/**
 * The part of a response in which something happens.
 * @param {Object} response
 * @param {?Object} step figures of the same
 * @returns {number[]} from, to [s]
 */
export function transient({ time_s: time }, step) {
  const settled = step?.settling_time_s ?? null;
  return [0, settled ? Math.min(time.at(-1), SETTLED * settled) : time.at(-1)];
}

/**
 * Draw the aileron's and the tab's response, and the aileron's as designed.
 * @param {Element} el
 * @param {Object} plot the module
 * @param {{now: Object, designed: Object, step: ?Object}} answers of the study `response`, and the designed step's figures
 * @returns {Promise<void>}
 */
export function drawStep(el, plot, { now, designed, step }) {
  const line = (response, signal, name, more) => ({ x: response.time_s, y: response.signals[signal], name, mode: "lines", ...more });
  const traces = [
    line(now, "da_deg", "aileron", { line: { width: 2.4 } }),
    line(now, "dt_deg", "tab", {}),
    line(designed, "da_deg", "aileron as designed", { line: { color: "--line-strong", width: 1.4 } }),
  ];
  const range = transient(designed, step);
  const layout = { xaxis: { title: { text: "time [s]" }, range }, yaxis: { title: { text: "deflection [deg]" }, ...clipped(now, designed) }, margin: { l: 56, r: 12, t: 12, b: 44 }, uirevision: String(range) };
  const end = now.signals.da_deg.at(-1);
  const label = `Response to the reference step of ${now.reference.aileron_deg} deg: the aileron ends at ${end === null ? "no finite angle" : `${end.toPrecision(4)} deg`} after ${now.time_s.at(-1)} s`;
  return plot.draw(el, traces, layout, { label, height: 300 });
}

/** Growing responses are cut where the designed one would not be seen any more. */
function clipped(now, designed) {
  const largest = (response) => Math.max(...["da_deg", "dt_deg"].flatMap((name) => response.signals[name].map((value) => (value === null ? 0 : Math.abs(value)))));
  const most = CLIPPED * Math.max(largest(designed), Math.abs(now.reference.aileron_deg));
  return largest(now) > most ? { range: [-most, most] } : {};
}
