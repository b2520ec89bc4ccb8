/** What the reference asks of an actuator over the whole envelope: torque and rate together, and which candidates are enough. */

import { candidatesOf, candidateTable, firstCandidate } from "./candidate_table.js";
import { viewContext } from "./context.js";
import { torqueSpeedTraces } from "./torque_speed_traces.js";

/** Peak, continuous, holding; then energy, and what the limits make of it. */
const REQUIREMENTS = [
  "peak_torque_n_m", "peak_rate_deg_s", "peak_deflection_deg", "peak_acceleration_deg_s2", "peak_power_w", "rms_torque_n_m", "rms_power_w", "rms_acceleration_deg_s2",
  "holding_torque_n_m", "energy_out_j", "energy_back_j", "needed_bandwidth_rad_s", "time_at_deflection_limit_s", "time_at_rate_limit_s", "time_at_torque_limit_s", "time_at_power_limit_s",
];

export default { id: "torque-speed", title: "Torque and speed of the actuators", group: "envelope", needs: ["controller"], mount };

function mount(el, context) {
  const { api, state, plot, dom, format, grid, param, setParam, show } = context;
  const { h } = dom;
  const judging = viewContext({ api, state });
  const choice = h("div", { class: "row" });
  const picture = h("div", {});
  const table = h("div", {});
  const rowsPlace = h("div", {});
  const verdict = h("div", {});
  const judge = h("button", { type: "button", class: "primary", onclick: select }, "Judge the candidates");
  const sizing = h("div", { class: "stack", hidden: true }, h("h4", {}, "Candidates"), rowsPlace, h("div", { class: "row" }, judge, h("span", { class: "muted" }, "Each at the gear ratio that leaves it most headroom; system factor and ground gust included.")), verdict);
  el.append(choice, h("div", { class: "plot-with-table" }, picture, table), sizing);
  let answer = null;
  let rows = null;
  let selected = null;
  ask();
  return { update, unmount };

  function unmount() {
    judging.end();
    plot.forget(picture);
  }

  function update(changed) {
    if (changed.has("controller")) ask();
    else if (answer) draw(answer);
  }

  function pathOf(study) {
    const { designId, controller } = state.get();
    return `v1/designs/${designId}/controllers/${encodeURIComponent(controller)}/${study}`;
  }

  /** The design's own reference, as a manoeuvre. */
  function ask() {
    const { duration_s, ...manoeuvre } = state.get().design.request.reference;
    answer = selected = null;
    sizing.hidden = true;
    dom.clear(choice);
    dom.clear(table);
    show(picture, (signal) => api.post(pathOf("actuator-requirements"), { manoeuvre, duration_s }, { signal }), (found) => {
      answer = found;
      return draw(found);
    });
  }

  function actuators() {
    return Object.keys(answer.linear.actuators);
  }

  function actuator() {
    const wanted = param("actuator", "tab");
    return actuators().includes(wanted) ? wanted : actuators()[0];
  }

  function draw(found) {
    const { design, controller } = state.get();
    const name = actuator();
    const { hull, cloud } = found.linear.torque_speed[name];
    if (choice.dataset.actuator !== name || !choice.firstChild) {
      choice.dataset.actuator = name;
      dom.clear(choice).append(dom.select("Actuator", actuators().map((value) => ({ value, label: value })), name, (value) => setParam("actuator", value)));
      startSizing(name);
    }
    const need = found.linear.envelope[name];
    tell(need, found.limits[name]);
    const traces = torqueSpeedTraces({ hull, cloud, limits: found.limits[name], candidates: selected?.candidates ?? [], pointName: (point) => grid.pointName(design, point) });
    const layout = { xaxis: { title: { text: "torque [N m]" }, zeroline: true }, yaxis: { title: { text: "rate [deg/s]" }, zeroline: true }, uirevision: `${controller} ${name}` };
    const label = `Torque and rate of the ${name} actuator over all points under controller ${controller}: peak ${format.quantity(need.peak_torque_n_m.value, "N m")}, ${format.quantity(need.peak_rate_deg_s.value, "deg/s")}`;
    return plot.draw(picture, traces, layout, { label, height: 520, onPick: ({ customdata }) => Number.isInteger(customdata) && state.set({ point: customdata }) });
  }

  function tell(need, limits) {
    const limitOf = (name) => (/^peak_(deflection|rate|torque|power)_/.test(name) ? limits?.[name.replace("peak_", "")] : null);
    const shown = REQUIREMENTS.filter((name) => need[name] && need[name].value !== null).map((name) => {
      const { value, point } = need[name];
      const limit = limitOf(name);
      const over = typeof limit === "number" && value > limit;
      const cell = over ? h("span", { class: "tag bad" }, `over ${format.number(limit)}`) : typeof limit === "number" ? format.number(limit) : "";
      const place = h("button", { type: "button", class: "quiet", title: grid.pointName(state.get().design, point), onclick: () => state.set({ point }) }, `point ${point}`);
      return [format.title(name).replace("rms ", "continuous (rms) "), format.number(value), cell, place];
    });
    dom.clear(table).append(dom.table("Requirement of the envelope", ["requirement", "worst", "limit", "set by"], shown));
  }

  function startSizing(name) {
    rows = rowsIn(param("candidates", "")) ?? [firstCandidate(answer.linear.envelope[name])];
    selected = null;
    sizing.hidden = false;
    dom.clear(verdict);
    dom.clear(rowsPlace).append(candidateTable(rows, (next) => {
      rows = next;
      setParam("candidates", JSON.stringify(rows));
    }));
  }

  function select() {
    const body = { actuator: actuator(), candidates: candidatesOf(rows) };
    judging.show(verdict, (signal) => api.post(pathOf("actuator-selection"), body, { signal }), (found) => {
      selected = found;
      judged(found);
      return draw(answer);
    });
  }

  function judged({ candidates }) {
    const headroom = (one, name) => (one.headroom[name] ? percent(one.headroom[name].value) : "\u2013");
    const names = ["torque", "static", "rate", "continuous", "power", "line"];
    const shown = candidates.map((one) => [
      one.name,
      h("span", { class: `tag ${one.enough ? "good" : "bad"}` }, one.enough ? "enough" : "not enough"),
      format.number(one.gear_ratio),
      ...names.map((name) => headroom(one, name)),
      one.capability === null ? "" : `${one.capability} at point ${one.point}`,
    ]);
    dom.clear(verdict).append(h("div", { class: "scroll" }, dom.table("Headroom of the candidates", ["candidate", "verdict", "gear ratio", ...names.map((name) => `${name} headroom`), "least headroom"], shown)));
  }

  function percent(value) {
    return value === null ? "\u2013" : `${format.number(100 * value, 3)} %`;
  }
}

/** Candidates of the address; null where there are none that can be read. */
function rowsIn(text) {
  try {
    const rows = JSON.parse(text);
    const good = Array.isArray(rows) && rows.length > 0 && rows.every((row) => row !== null && typeof row === "object" && typeof row.name === "string");
    return good ? rows : null;
  } catch {
    return null;
  }
}
