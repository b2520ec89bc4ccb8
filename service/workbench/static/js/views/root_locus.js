/** The root locus of a loop; a gain moves the poles along the branches, the step and the margins follow. */

import { drawStep } from "./live/step_plot.js";
import { liveController } from "./live/live.js";
import { AT_POINT } from "./live/scope.js";
import { extentOf, locusTraces, polesAt } from "./locus_traces.js";
import { figureTable, reasonList, verdictLine } from "./point_figures.js";

const STUDIES = ["point", "root_locus", "response"];
const SAMPLES = 301;
const GAINS = 301; // on a locus that is drawn anew with every move; poles between them are found along the branches

export default { id: "root-locus", title: "Root locus", group: "point", needs: ["controller", "point"], mount };

function mount(el, context) {
  const { state, plot, dom, format, param, setParam } = context;
  const { h } = dom;
  const choice = h("div", { class: "row" });
  el.append(choice);
  const live = liveController(el, context, { scope: AT_POINT, studies: STUDIES, query, extra, moving, onMove, onAnswer });
  const picture = h("div", {});
  const words = h("div", { class: "small" });
  const step = h("div", {});
  const figures = h("div", { class: "stack" });
  live.body.append(h("div", { class: "live-pair" }, h("div", { class: "stack" }, picture, words), h("div", { class: "stack" }, h("h4", {}, "Step response"), step, figures)));
  let shown = null; // the locus that is drawn, and what is drawn on it
  live.start();
  return { update, unmount };

  function unmount() {
    live.unmount();
    plot.forget(picture);
    plot.forget(step);
  }

  function update(changed) {
    const loop = param("loop", null);
    if (changed.has("params") && shown && loop !== shown.asked) {
      shown = null;
      live.start();
      return;
    }
    if (changed.has("controller") || changed.has("point") || changed.has("design")) {
      shown = null;
      dom.clear(choice);
    }
    live.update(changed);
    if (shown) drawLocus(live.values());
  }

  /** A loop of another controller is no loop of this one. */
  function wantedLoop() {
    const { design, controller } = state.get();
    const own = design.controllers.find((one) => one.name === controller);
    const names = [...own.gains.map(({ name }) => name), "tab", "aileron"];
    const asked = param("loop", null);
    return names.includes(asked) && (own.kind !== "lqr" || ["tab", "aileron"].includes(asked)) ? asked : null;
  }

  function query() {
    return { loop: wantedLoop(), samples: SAMPLES, gains: GAINS };
  }

  /** Where a loop is opened at an actuator, a factor on it moves the poles. */
  function extra() {
    const { design, controller } = state.get();
    const own = design.controllers.find((one) => one.name === controller);
    const loop = wantedLoop() ?? (own.kind === "lqr" ? "tab" : null);
    return ["tab", "aileron"].includes(loop) ? [{ id: "factor", label: `factor on the loop ${loop}`, unit: "1", value: 1, path: null }] : [];
  }

  /** Along its own branches a gain needs no new locus. */
  function moving(id) {
    return id === shown?.locus.loop ? ["point", "response"] : STUDIES;
  }

  function gainOf(values) {
    return values[shown.locus.loop] ?? values.factor ?? shown.locus.chosen_gain;
  }

  /** The branches of other gains follow with the answer. */
  function onMove(values) {
    if (shown && gainOf(values) !== shown.gain) drawLocus(values);
  }

  async function onAnswer({ now, designed, problems, values }) {
    if (now.root_locus) {
      const { locus = null, extent } = shown ?? {};
      shown = { asked: param("loop", null), locus: now.root_locus, extent: locus ? extent : extentOf(now.root_locus), closed: null, gain: null };
      if (!locus) drawChoice();
    }
    if (shown && now.point) shown.closed = now.point.controllers[0].poles;
    const drawn = [];
    if (shown && (now.root_locus || staged())) drawn.push(drawLocus(values));
    if (!shown) dom.message(picture, "refused", problems.root_locus.detail);
    const [mine, first] = [now.point.controllers[0], designed.point.controllers[0]];
    if (now.response) drawn.push(drawStep(step, plot, { now: now.response, designed: designed.response, step: first.step }));
    dom.clear(figures).append(verdictLine(mine), figureTable(mine, first), reasonList(mine));
    await Promise.all(drawn);
  }

  /** Whether loops are closed after the one that is shown. */
  function staged() {
    const { loop, loops } = shown.locus;
    const stages = loops.filter((name) => !["tab", "aileron"].includes(name));
    return stages.includes(loop) && loop !== stages.at(-1);
  }

  function drawChoice() {
    const { loops } = shown.locus;
    const label = (loop) => (["tab", "aileron"].includes(loop) ? `whole loop, opened at the ${loop}` : `gain ${loop}`);
    const damping = dom.numberField("Damping line", dampingLine(), { min: 0.01, max: 0.99, step: 0.01 }, (value) => setParam("damping", String(value)));
    dom.clear(choice).append(dom.select("Loop", loops.map((loop) => ({ value: loop, label: label(loop) })), shown.locus.loop, (loop) => setParam("loop", loop)), damping);
  }

  function dampingLine() {
    const asked = Number(param("damping", ""));
    if (asked >= 0.01 && asked <= 0.99) return asked;
    return shown.locus.constant_damping.damping_ratio;
  }

  function drawLocus(values) {
    const { locus, closed, extent } = shown;
    const gain = gainOf(values);
    shown.gain = gain;
    const whole = ["tab", "aileron"].includes(locus.loop);
    const others = staged() ? closed : null;
    const traces = locusTraces(locus, { gain, closed: others, damping: dampingLine(), extent });
    const poles = polesAt(locus, gain);
    const unstable = poles.filter(({ re }) => re > 0).length;
    const label = `Root locus of loop ${locus.loop} of ${locus.name}: at gain ${format.number(gain)} ${unstable ? `${unstable} of ${poles.length} poles are unstable` : `all ${poles.length} poles are stable`}`;
    tell(locus, gain, { unstable, whole, others });
    return plot.sPlane(picture, traces, {
      label,
      layout: {
        xaxis: { title: { text: "real part [1/s]" }, range: [-1.35 * extent, 0.45 * extent] },
        yaxis: { title: { text: "imaginary part [rad/s]" }, range: [-0.95 * extent, 0.95 * extent], scaleanchor: "x", scaleratio: 1 },
        legend: { orientation: "h", y: -0.16, yanchor: "top", x: 0 },
        margin: { l: 60, r: 12, t: 12, b: 40 },
        uirevision: `${locus.name} ${locus.loop} ${state.get().point}`,
      },
      height: 560,
    });
  }

  /** The locus in words and numbers. */
  function tell(locus, gain, { unstable, whole, others }) {
    const { number } = format;
    const { constant_damping: damped } = locus;
    const listed = (items, none) => (items.length ? items.join("; ") : none);
    const facts = [
      ["gain", `${number(gain)} (as designed ${number(whole ? 1 : live.designedValue(locus.loop))}): ${unstable ? `${unstable} unstable` : "stable"}`],
      ["feedback", locus.sign > 0 ? "negative" : "positive (0-degree locus)"],
      ["imaginary axis at", listed(locus.crossings.map((one) => `gain ${number(one.gain)}, ${number(one.omega_rad_s)} rad/s`), "no gain")],
      ["branches meet at", listed(locus.breakaways.map((one) => `gain ${number(one.gain)}, ${format.complex(one.at)}`), "no gain")],
      [`damping ratio ${damped.damping_ratio} at`, listed(damped.gains.map((one) => `gain ${number(one.gain)}, ${number(one.omega_n_rad_s)} rad/s`), "no gain")],
      ["asymptotes", locus.asymptotes.centroid === null ? "none" : `from ${number(locus.asymptotes.centroid)} under ${locus.asymptotes.angles_deg.map((angle) => number(angle)).join(", ")} deg`],
    ];
    const notes = [];
    if (whole) notes.push("The factor is on the whole loop and moves the poles only; step and margins are those of the gains or weights.");
    if (others) notes.push("Loops are closed one after the other: triangles are the poles with all of them closed.");
    dom.clear(words).append(h("dl", { class: "facts locus-facts" }, facts.map(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])), ...notes.map((text) => h("p", { class: "muted" }, text)));
  }
}
