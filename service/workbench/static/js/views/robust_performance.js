/** Gains of every point flown at every other: which the schedule needs, and how far one set of gains reaches. */

import { viewContext } from "./context.js";
import { perturbedPlants } from "./perturbed_plants.js";
import { offer } from "./slow_study.js";

const FIGURES = [
  { value: "held", label: "Stable and within specs" },
  { value: "damping_ratio", label: "Damping ratio" },
  { value: "largest_real_part", label: "Largest real part [1/s]" },
  { value: "settling_time_s", label: "Settling time [s]" },
  { value: "overshoot_percent", label: "Overshoot [%]" },
];
const SPECS = [{ value: "request", label: "of the request" }, { value: "spec_pack", label: "of the spec pack" }, { value: "none", label: "none but stability" }];
const HELD_SCALE = [[0, "#d55e00"], [0.33, "#d55e00"], [0.33, "#f0e442"], [0.66, "#f0e442"], [0.66, "#0072b2"], [1, "#0072b2"]];
/** Points whose pairs are flown at once; more are begun by a button. */
const QUICK_POINTS = 60;

export default { id: "robust", title: "Robust performance", group: "envelope", needs: ["controller"], mount };

function mount(el, context) {
  const { api, state, plot, dom, format, grid, param, setParam, show } = context;
  const { h } = dom;
  const choice = h("div", { class: "row" });
  const said = h("p", {});
  const picture = h("div", {});
  const perturbed = h("div", { class: "stack" });
  el.append(h("h4", {}, "Each point's gains at every other point"), choice, said, picture, perturbed);
  choice.append(
    dom.select("Show", FIGURES, figure(), (value) => setParam("figure", value)),
    dom.select("Specs", SPECS, specs(), (value) => setParam("specs", value)),
  );
  const own = viewContext({ api, state });
  const plants = perturbedPlants(perturbed, own);
  let last = null; // {key, answer}
  start();
  return { update, unmount };

  function unmount() {
    own.end();
    plants.unmount();
    plot.forget(picture);
  }

  function update(changed) {
    if (changed.has("point") && changed.size === 1) return;
    start();
    if (changed.has("controller")) plants.reset();
  }

  function figure() {
    const wanted = param("figure", "held");
    return FIGURES.some(({ value }) => value === wanted) ? wanted : "held";
  }

  function specs() {
    const wanted = param("specs", "request");
    return SPECS.some(({ value }) => value === wanted) ? wanted : "request";
  }

  function start() {
    const { design, designId, controller } = state.get();
    const key = `${controller} ${specs()}`;
    const path = `v1/designs/${designId}/controllers/${encodeURIComponent(controller)}/cross-flight`;
    const begin = () => show(picture, async (signal) => {
      if (last?.key !== key) last = { key, answer: await api.get(path, { signal, query: { specs: specs() } }) };
      return last.answer;
    }, draw);
    const count = grid.pointCount(design);
    said.textContent = "";
    if (count <= QUICK_POINTS || last?.key === key) begin();
    else offer(picture, { label: `Fly ${count * count} pairs`, words: "Every point's gains at every other point: some 0.1 ms a pair." }, begin);
  }

  function draw(answer) {
    const { pairs, reason } = answer;
    if (!pairs) return dom.message(picture, "empty", reason ?? "There is nothing to fly.");
    const count = grid.pointCount(state.get().design);
    const names = Array.from({ length: count }, (_, index) => `${index}`);
    const held = figure() === "held";
    const heading = FIGURES.find(({ value }) => value === figure()).label;
    const level = (i, j) => (pairs.stable[i][j] === null ? null : pairs.held[i][j] ? 2 : pairs.stable[i][j] ? 1 : 0);
    const z = held ? pairs.stable.map((row, i) => row.map((_, j) => level(i, j))) : pairs[figure()];
    const text = held ? z.map((row) => row.map((value) => (value === null ? "\u2013" : ["unstable", "misses", "held"][value]))) : undefined;
    const shown = held ? "%{text}" : "%{z:.3~r}";
    const heat = {
      type: "heatmap", name: heading, z, x: names, y: names, text, texttemplate: count <= 12 ? shown : "", hovertemplate: `gains of point %{y} at point %{x}: ${shown}<extra></extra>`,
      colorscale: held ? HELD_SCALE : plot.FIELD, ...(held ? { zmin: 0, zmax: 2 } : {}), showscale: !held, colorbar: { title: { text: heading, side: "right" }, thickness: 14 }, xgap: 1, ygap: 1, hoverongaps: false,
    };
    const axis = (text_) => ({ title: { text: text_ }, type: "category", showgrid: false, zeroline: false, nticks: 20 });
    tell(answer);
    const label = `${heading} of the gains of each point of controller ${state.get().controller}, flown at every point. ${said.textContent}`;
    const onPick = ({ x }) => state.set({ point: Number(x) });
    return plot.draw(picture, [heat], { xaxis: axis("flown at point"), yaxis: { ...axis("gains of point"), autorange: "reversed" } }, { label, onPick, height: Math.min(640, 180 + 42 * count) });
  }

  function tell({ best, worst_pair: worst, specs: judged, reason }) {
    const parts = [];
    if (best) parts.push(`The gains of ${grid.pointName(state.get().design, best.point)} hold the most points: ${best.points_held} of ${best.points_flown}.`);
    if (worst) parts.push(`Worst: the gains of point ${worst.design} at point ${worst.flown}, damping ratio ${format.number(worst.damping_ratio)}.`);
    const left = judged.filter((spec) => !spec.judged).map(({ spec }) => format.words(spec));
    if (!judged.length) parts.push("No specs but stability.");
    if (left.length) parts.push(`Not judged away from the design: ${left.join(", ")}.`);
    if (reason) parts.push(reason);
    said.textContent = parts.join(" ");
  }
}
