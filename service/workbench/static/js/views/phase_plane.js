/** Phase plane of a state feedback: the step, and the surfaces let go from an ellipse of angles (seed Fig 5.8). */

const PLANES = [
  { value: "angles", label: "tab over aileron", axes: ["aileron_deg", "tab_deg"] },
  { value: "aileron", label: "aileron rate over aileron", axes: ["aileron_deg", "aileron_rate_deg_s"] },
  { value: "tab", label: "tab rate over tab", axes: ["tab_deg", "tab_rate_deg_s"] },
  { value: "torques", label: "tab torque over aileron torque", axes: ["aileron_torque_n_m", "tab_torque_n_m"] },
];
/** Samples of all trajectories together, below what the service takes; of one, as many as look smooth. */
const ALL_SAMPLES = 4800;
const MOST_SAMPLES = 401;

export default { id: "phase", title: "Phase plane", group: "envelope", needs: ["controller", "point"], kind: "lqr", mount };

function mount(el, { api, state, plot, dom, format, grid, param, setParam, show }) {
  const { h } = dom;
  const picture = h("div", {});
  const choice = h("div", { class: "row" },
    dom.select("Plane", PLANES, plane().value, (value) => setParam("plane", value)),
    dom.slider("Starts on the ellipse", starts(), { min: 0, max: 24, step: 1 }, (value) => setParam("starts", String(value))));
  el.append(choice, picture);
  update();
  return { update, unmount: () => plot.forget(picture) };

  function plane() {
    const wanted = param("plane", "angles");
    return PLANES.find(({ value }) => value === wanted) ?? PLANES[0];
  }

  function starts() {
    const wanted = Number.parseInt(param("starts", "12"), 10);
    return wanted >= 0 && wanted <= 24 ? wanted : 12;
  }

  function update() {
    const { designId, controller, point } = state.get();
    const path = `v1/designs/${designId}/controllers/${encodeURIComponent(controller)}/phase-plane`;
    show(picture, (signal) => api.get(path, { signal, query: { point, starts: starts(), samples: Math.min(MOST_SAMPLES, Math.floor(ALL_SAMPLES / (starts() + 1))) } }), draw);
  }

  function draw(answer) {
    const { design, controller, point } = state.get();
    const [x, y] = plane().axes;
    const times = answer.step?.time_s ?? answer.free[0]?.trajectory.time_s ?? [];
    const hover = { text: times.map((time) => `${format.quantity(time, "s")}`), hovertemplate: "%{text}<br>%{x:.4~r}, %{y:.4~r}<extra>%{fullData.name}</extra>" };
    const free = answer.free.map(({ trajectory, aileron_start_deg: a, tab_start_deg: t }, index) => ({
      ...hover, name: index ? `let go at ${format.number(a)}, ${format.number(t)} deg` : `let go (aileron ${format.number(a)}, tab ${format.number(t)} deg, ..)`,
      x: trajectory[x], y: trajectory[y], mode: "lines", line: { width: 1.2, dash: "solid", color: "--line-strong" }, showlegend: index === 0,
    }));
    const begun = { name: "begins", mode: "markers", x: answer.free.map(({ trajectory }) => trajectory[x][0]), y: answer.free.map(({ trajectory }) => trajectory[y][0]), marker: { symbol: "circle-open", size: 7, color: "--line-strong" } };
    const step = answer.step ? [
      { ...hover, name: "reference step", x: answer.step[x], y: answer.step[y], mode: "lines", line: { width: 3, dash: "solid", color: "#d55e00" } },
      { name: "end of the step", mode: "markers", x: [answer.step[x].at(-1)], y: [answer.step[y].at(-1)], marker: { symbol: "square", size: 10, color: "#d55e00" } },
    ] : [];
    const label = `Phase plane of controller ${controller} at ${grid.pointName(design, point)}: ${plane().label}, the reference step and ${answer.free.length} starts on an ellipse`;
    const layout = { xaxis: { title: { text: format.title(x) }, zeroline: true }, yaxis: { title: { text: format.title(y) }, zeroline: true }, uirevision: plane().value };
    return plot.draw(picture, [...free, ...(free.length ? [begun] : []), ...step], layout, { label, height: 520 });
  }
}
