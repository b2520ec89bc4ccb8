/** The plant at a point: air, trim, hinge moments, servo-tab, linear model and open-loop poles. */

import { matrixText } from "./matrix_text.js";
import { poleTable } from "./point_figures.js";

const TORQUES = { T_t_n_m: "torque of the tab", T_a_n_m: "torque of the aileron", residual_n_m: "residual torque" };

export default { id: "plant", title: "Plant at the point", group: "point", needs: ["point"], mount };

function mount(el, { api, state, plot, dom, format, param, setParam, show }) {
  const { h } = dom;
  const place = h("div", { class: "stack" });
  const picture = h("div", {});
  el.append(place);
  let plant = null;
  update(new Set(["point"]));
  return { update, unmount: () => plot.forget(picture) };

  function update(changed) {
    if (plant && !["point", "design"].some((key) => changed.has(key))) return void drawText();
    const { designId, point } = state.get();
    return void show(place, (signal) => api.get(`v1/designs/${designId}/points/${point}`, { signal }), draw);
  }

  function draw(found) {
    plant = found;
    if (!found.linear_model) {
      dom.message(place, "refused", found.reason ?? found.outcome.replaceAll("_", " "));
      return undefined;
    }
    const { trim, hinge_moments: moments, servo_tab: servo, linear_model: model } = found;
    const fields = (document) => Object.entries(document).map(([name, value]) => [TORQUES[name] ?? format.words(name), format.quantity(value, format.unitOf(name))]);
    const symbols = (document, unit) => Object.entries(document).map(([name, value]) => [name, format.quantity(value, unit)]);
    dom.clear(place).append(
      h("div", { class: "four" },
        block("Air", fields(found.air)),
        block("Trim", fields(trim)),
        block("Hinge moments", [...symbols(moments.values, "1"), ...symbols(moments.derivatives, "1/rad")]),
        block("Servo-tab: the aileron driven by the tab alone", servoFacts(servo))),
      h("div", { class: "live-pair" },
        h("div", { class: "stack" }, h("h4", {}, "Open-loop poles"), picture, poleTable(found.poles, "Open-loop poles")),
        h("div", { class: "stack" }, h("h4", {}, "Linear model: x\u2019 = A x + B u, y = C x + D u, in SI and radians"), ...["A", "B", "C", "D"].map((name) => matrix(name, model)), text())),
    );
    drawText();
    const poles = { name: "open-loop poles", mode: "markers", x: found.poles.map(({ re }) => re), y: found.poles.map(({ im }) => im), marker: { symbol: "x-thin", size: 11, line: { width: 2 } } };
    const least = found.poles.reduce((most, { re }) => Math.max(most, re), -Infinity);
    return plot.sPlane(picture, [poles], { label: `Open-loop poles: the largest real part is ${format.number(least)} 1/s`, height: 320, layout: { margin: { l: 60, r: 12, t: 12, b: 44 } } });
  }

  function block(title, pairs) {
    return h("section", { class: "stack", "aria-label": title }, h("h4", {}, title), h("dl", { class: "facts" }, pairs.map(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])));
  }

  function servoFacts(servo) {
    const listed = (values) => values.map((value) => format.number(value)).join(", ");
    const facts = [["numerator", listed(servo.numerator)], ["denominator", listed(servo.denominator)]];
    const numbers = [["steady gain", servo.dc_gain, "1"], ["zero", servo.zero, "rad/s"], ["natural frequency", servo.omega_n_rad_s, "rad/s"], ["damping ratio", servo.damping_ratio, "1"]];
    return [...facts, ...numbers.map(([name, value, unit]) => [name, format.quantity(value, unit)]), ...(servo.reason ? [["reason", servo.reason]] : [])];
  }

  function matrix(name, model) {
    const rows = name === "A" || name === "B" ? model.states : model.outputs;
    const columns = name === "A" || name === "C" ? model.states : model.inputs;
    const cells = model[name].map((row, k) => [rows[k], ...row.map((value) => format.number(value, 5))]);
    return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": `Matrix ${name}` }, dom.table(`Matrix ${name}`, [name, ...columns], cells));
  }

  /** The model as text to be taken elsewhere. */
  function text() {
    const languages = [{ value: "matlab", label: "MATLAB" }, { value: "numpy", label: "NumPy" }];
    const choice = dom.select("As text for", languages, language(), (value) => setParam("language", value));
    const area = h("textarea", { class: "model-text", readonly: true, rows: 8, spellcheck: "false", "aria-label": "Linear model as text" });
    return h("div", { class: "stack" }, h("div", { class: "row" }, choice, h("button", { type: "button", onclick: () => copy(area) }, "Copy")), area);
  }

  function language() {
    return param("language", "matlab") === "numpy" ? "numpy" : "matlab";
  }

  function drawText() {
    const area = place.querySelector(".model-text");
    if (area) area.value = matrixText(plant.linear_model, language(), plant.coordinates);
  }

  /** Where the page may not write the clipboard (no secure connection), the text is marked to be copied by hand. */
  async function copy(area) {
    try {
      await navigator.clipboard.writeText(area.value);
      dom.live("The linear model is in the clipboard.");
    } catch {
      area.focus();
      area.select();
      dom.live("The text is marked; press Ctrl and C to copy it.");
    }
  }
}
