/** Eigenvalues of the plant while one quantity varies: the coupled section, and the aileron with the tab imposed (seed Figs 2.8 to 2.13). */

import { MARKER_SCALE } from "./envelope_axes.js";
import { numbersOfPlant, plantAt } from "./plant_request.js";

const NAMED = { airspeed_m_s: "airspeed", density_kg_m3: "density", alpha_deg: "incidence", aileron_deg: "aileron angle", tab_deg: "tab angle", tab_chord_ratio: "tab chord / aileron chord" };
const MODELS = [{ value: "coupled", label: "aileron and tab" }, { value: "decoupled", label: "aileron, tab imposed" }];

export default { id: "sweeps", title: "Eigenvalue sweeps of the plant", group: "envelope", needs: ["point"], mount };

function mount(el, { api, state, plot, dom, format, grid, param, setParam, show }) {
  const { h } = dom;
  const choice = h("div", { class: "row" });
  const said = h("p", {});
  const result = h("div", { class: "two-plots" });
  el.append(choice, said, result);
  let known = null;
  let locus = null;
  let growth = null;
  controls();
  ask();
  return { update, unmount: forget };

  function forget() {
    if (locus) [locus, growth].forEach(plot.forget);
    locus = growth = null;
  }

  /** Everything that can be varied, with a range about what the design has. */
  function quantities() {
    const { design, point } = state.get();
    const [i, j] = grid.placeOf(design, point);
    const speed = design.air.airspeed_m_s[i][j];
    const density = design.air.density_kg_m3[i][j];
    const ranges = { airspeed_m_s: [0.1 * speed, 1.5 * speed], density_kg_m3: [0.3 * density, 1.5 * density], alpha_deg: [-5, 15], aileron_deg: [-20, 20], tab_deg: [-20, 20], tab_chord_ratio: [0.03, 0.47] };
    const named = Object.entries(NAMED).map(([name, label]) => ({ value: name, label, group: "Quantity", range: ranges[name], unit: name === "tab_chord_ratio" ? "1" : format.unitOf(name) }));
    const fields = numbersOfPlant(design).map(({ pointer, value }) => ({ value: pointer, label: pointer.slice(1).replaceAll("/", " / "), group: "Any number of the plant", range: about(value), unit: format.unitOf(pointer.split("/").at(-1)) }));
    return [...named, ...fields];
  }

  function quantity() {
    const wanted = param("vary", "airspeed_m_s");
    return known.find(({ value }) => value === wanted) ?? known[0];
  }

  function bound(name, index) {
    const wanted = Number(param(name, String(quantity().range[index])));
    return Number.isFinite(wanted) ? wanted : quantity().range[index];
  }

  function count() {
    const wanted = Number.parseInt(param("count", "60"), 10);
    return wanted >= 2 && wanted <= 500 ? wanted : 60;
  }

  function model() {
    return param("model", "coupled") === "decoupled" ? "decoupled" : "coupled";
  }

  function controls() {
    known = quantities();
    const { unit } = quantity();
    const rounded = (value) => Number(value.toPrecision(6));
    dom.clear(choice).append(
      dom.select("Vary", known, quantity().value, (value) => state.set({ params: { ...state.get().params, vary: value, from: null, to: null } })),
      dom.numberField("from", rounded(bound("from", 0)), { unit }, (value) => setParam("from", String(value))),
      dom.numberField("to", rounded(bound("to", 1)), { unit }, (value) => setParam("to", String(value))),
      dom.numberField("values", count(), { min: 2, max: 500, step: 1 }, (value) => setParam("count", String(value))),
      dom.select("Model", MODELS, model(), (value) => setParam("model", value)),
    );
    choice.querySelectorAll("input, select").forEach((control, index) => control.setAttribute("data-role", String(index)));
  }

  function update() {
    const role = choice.contains(document.activeElement) ? document.activeElement.dataset.role : null;
    controls();
    if (role) choice.querySelector(`[data-role="${role}"]`)?.focus();
    ask();
  }

  function ask() {
    const { design, point } = state.get();
    const { value } = quantity();
    const values = { from: bound("from", 0), to: bound("to", 1), count: count() };
    const vary = value.startsWith("/") ? { pointer: value, values } : { quantity: value, values };
    said.textContent = "";
    if (!(values.to > values.from)) {
      forget();
      dom.message(result, "empty", "The range must rise: `to` is larger than `from`.");
      return;
    }
    show(result, (signal) => api.post("v1/eigenvalue-sweeps", { ...plantAt(design, point), vary }, { signal }), draw);
  }

  function draw(answer) {
    const { varied, points: [swept] } = answer;
    const heading = `${quantity().label}${varied.unit === "1" ? "" : ` [${varied.unit}]`}`;
    const modes = swept[model()];
    if (!locus?.isConnected) {
      forget();
      [locus, growth] = [h("div", {}), h("div", {})];
      dom.clear(result).append(locus, growth);
    }
    const left = swept.reasons.filter(Boolean);
    said.textContent = `${swept.verdict.detail}${swept.verdict.mechanisms.length ? `; ${swept.verdict.mechanisms.join(", ").replaceAll("_", " ")}` : ""}.${left.length ? ` ${left.length} values are left out: ${left[0]}.` : ""}`;
    return Promise.all([drawLocus(modes, varied, heading, swept), drawGrowth(modes, varied, heading)]);
  }

  function drawLocus(modes, { values }, heading, swept) {
    const traces = modes.branches.map((branch, index) => ({
      name: `branch ${index + 1}`,
      mode: "lines+markers",
      x: branch.map((pole) => pole?.re ?? null),
      y: branch.map((pole) => pole?.im ?? null),
      text: values.map((value) => `${heading} ${format.number(value)}`),
      hovertemplate: "%{text}<br>%{x:.4~r}, %{y:.4~r}<extra></extra>",
      line: { width: 1.2, color: "--line-strong", dash: "solid" },
      marker: { color: values, coloraxis: "coloraxis", size: 5 },
      showlegend: false,
    }));
    const start = modes.branches.map((branch) => branch[0]);
    traces.push({ name: "first value", mode: "markers", x: start.map((pole) => pole?.re ?? null), y: start.map((pole) => pole?.im ?? null), marker: { symbol: "square-open", size: 11 } });
    const coloraxis = { colorscale: MARKER_SCALE, colorbar: { title: { text: heading, side: "right" }, thickness: 14 } };
    const label = `Eigenvalues of the plant while ${heading} goes from ${format.number(values[0])} to ${format.number(values.at(-1))}: ${swept.verdict.detail}`;
    return plot.sPlane(locus, traces, { label, layout: { coloraxis, uirevision: `${quantity().value} ${model()}` } });
  }

  function drawGrowth(modes, { values }, heading) {
    const traces = [
      { name: "largest real part [1/s]", x: values, y: modes.growth_1_s, showlegend: false },
      ...modes.omega_n_rad_s.map((y, index) => ({ name: `natural frequency of branch ${index + 1} [rad/s]`, x: values, y, yaxis: "y2", showlegend: modes.omega_n_rad_s.length <= 4 })),
    ];
    const layout = {
      xaxis: { title: { text: heading }, anchor: "y" },
      yaxis: { title: { text: "largest real part [1/s]" }, domain: [0, 0.46], zeroline: true },
      yaxis2: { title: { text: "natural frequency [rad/s]" }, domain: [0.54, 1], rangemode: "tozero" },
      uirevision: quantity().value,
    };
    return plot.draw(growth, traces, layout, { label: `Largest real part and natural frequencies over ${heading}`, height: 520 });
  }
}

/** A range about a value that is there. */
function about(value) {
  if (value === 0) return [-1, 1];
  return [0.5 * value, 1.5 * value].sort((one, other) => one - other);
}
