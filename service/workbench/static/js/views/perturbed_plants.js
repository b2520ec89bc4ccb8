/** The gains flown on plants that are not quite the model: corners of a box or random draws, begun by the reader. */

const METHODS = [{ value: "corners", label: "all corners" }, { value: "monte_carlo", label: "Monte Carlo" }];

/**
 * The form, and the table of what it found.
 * @param {Element} el
 * @param {Object} context as of `viewContext`; its own
 * @returns {{reset: function(): void, unmount: function(): void}}
 */
export function perturbedPlants(el, { api, state, dom, format, grid, plot, param, setParam, show }) {
  const { h } = dom;
  const change = (name, fallback) => {
    const wanted = Number(param(name, fallback));
    return wanted >= 0 && wanted <= 99 ? wanted : Number(fallback);
  };
  const method = () => (param("method", "corners") === "monte_carlo" ? "monte_carlo" : "corners");
  const draws = () => {
    const wanted = Number.parseInt(param("draws", "200"), 10);
    return wanted >= 1 && wanted <= 10_000 ? wanted : 200;
  };
  const form = h("div", { class: "row" });
  const result = h("div", {});
  const picture = h("div", {});
  el.append(h("h4", {}, "Plants that differ from the model"), form, result, picture);
  form.append(
    dom.select("Plants", METHODS, method(), (value) => setParam("method", value)),
    dom.numberField("hinge-moment derivatives off by", change("hinge_moment_percent", "20"), { unit: "%", min: 0, max: 99 }, (value) => setParam("hinge_moment_percent", String(value))),
    dom.numberField("inertias off by", change("inertia_percent", "10"), { unit: "%", min: 0, max: 99 }, (value) => setParam("inertia_percent", String(value))),
    dom.numberField("draws", draws(), { min: 1, max: 10_000, step: 1 }, (value) => setParam("draws", String(value))),
    h("button", { type: "button", class: "primary", onclick: fly }, "Fly them"),
  );
  return { reset, unmount: () => plot.forget(picture) };

  function reset() {
    plot.forget(picture);
    dom.clear(picture);
    dom.clear(result);
  }

  function fly() {
    const { designId, controller } = state.get();
    const path = `v1/designs/${designId}/controllers/${encodeURIComponent(controller)}/robust-performance`;
    const query = { method: method(), hinge_moment_percent: change("hinge_moment_percent", "20"), inertia_percent: change("inertia_percent", "10"), draws: method() === "monte_carlo" ? draws() : null };
    reset();
    show(result, (signal) => api.get(path, { signal, query }), draw);
  }

  function draw(answer) {
    const { design } = state.get();
    const part = (value) => (value === null ? format.NONE : `${format.number(100 * value, 3)} %`);
    const factors = (worst) => Object.entries(worst.factors).map(([name, factor]) => `${name} \u00d7${format.number(factor, 3)}`).join(", ");
    const rows = Object.entries(answer.figures).map(([name, { unit, nominal, worst_of_all: worst }]) => [
      `${format.words(name)}${unit === "1" ? "" : ` [${unit}]`}`,
      worst ? format.number(nominal.flat()[worst.point]) : format.NONE,
      worst ? format.number(worst.value) : format.NONE,
      worst ? h("span", { title: grid.pointName(design, worst.point) }, `point ${worst.point}`) : "",
      worst ? factors(worst) : "",
    ]);
    const bound = (found) => (found.at_least === null ? "" : ` (at least ${part(found.at_least)} of all plants, confidence ${part(answer.confidence)})`);
    const { stable, held } = answer.everywhere;
    dom.clear(result).append(
      h("p", {}, `${answer.cases} plants. Stable at every point: ${part(stable.part)}${bound(stable)}. Held at every point: ${part(held.part)}${bound(held)}.`),
      h("div", { class: "scroll" }, dom.table("Worst of all plants and points", ["figure", "of the model there", "worst", "at", "plant"], rows)),
    );
    const values = answer.held.part;
    return drawPart(values);
  }

  /** Part of the plants that is held, at each point. */
  function drawPart(values) {
    const { grid: { axes: [rows, columns] } } = state.get().design;
    const text = (value) => format.number(value, 6);
    const field = {
      type: "heatmap", name: "part of the plants held", z: values, x: columns.values.map(text), y: rows.values.map(text), texttemplate: columns.values.length <= 12 ? "%{z:.0%}" : "",
      colorscale: plot.FIELD, zmin: 0, zmax: 1, colorbar: { title: { text: "part held", side: "right" }, thickness: 14, tickformat: ".0%" }, xgap: 1, ygap: 1, hovertemplate: "%{y}, %{x}: %{z:.1%}<extra></extra>",
    };
    const axis = (name) => ({ title: { text: format.title(name) }, type: "category", showgrid: false, zeroline: false });
    return plot.draw(picture, [field], { xaxis: axis(columns.name), yaxis: axis(rows.name) }, { label: "Part of the plants that each point's gains hold", height: Math.min(460, 150 + 50 * rows.values.length) });
  }
}
