/** Steady state over both deflections: hinge torques as contours, with the lines on which a torque vanishes (seed Fig 2.14). */

import { plantAt } from "./plant_request.js";

const PLANES = { T_a_n_m: "aileron hinge torque [N m]", T_t_n_m: "tab hinge torque [N m]", total_torque_n_m: "both torques, root of squares [N m]", C_Ha: "C_Ha", C_Ht: "C_Ht" };
const LINES = { zero_aileron_torque: "no aileron torque", zero_tab_torque: "no tab torque", least_torque: "least torque" };

export default { id: "statics", title: "Steady-state map", group: "envelope", needs: ["point"], mount };

function mount(el, { api, state, plot, dom, format, grid, param, setParam, show }) {
  const { h } = dom;
  const choice = h("div", { class: "row" });
  const picture = h("div", {});
  const facts = h("div", {});
  el.append(choice, picture, facts);
  const planes = Object.entries(PLANES).map(([value, label]) => ({ value, label }));
  choice.append(
    dom.select("Colour by", planes, plane(), (value) => setParam("plane", value)),
    dom.numberField("Deflections to", reach(), { unit: "deg", min: 1, max: 60 }, (value) => setParam("reach", String(value))),
  );
  update();
  return { update, unmount: () => plot.forget(picture) };

  function plane() {
    const wanted = param("plane", "T_a_n_m");
    return wanted in PLANES ? wanted : "T_a_n_m";
  }

  function reach() {
    const wanted = Number(param("reach", "20"));
    return wanted >= 1 && wanted <= 60 ? wanted : 20;
  }

  function update() {
    const { design, point } = state.get();
    const angles = { from: -reach(), to: reach(), count: 33 };
    const limits = { tab: plain(design, "tab", ["deflection_deg", "torque_n_m"]), aileron: plain(design, "aileron", ["deflection_deg"]) };
    const body = { ...plantAt(design, point), deflections: { aileron_deg: angles, tab_deg: angles }, limits };
    dom.clear(facts);
    show(picture, (signal) => api.post("v1/steady-state-maps", body, { signal }), draw);
  }

  function draw({ deflections, points: [found] }) {
    const { design, point } = state.get();
    if (!found.plane) return dom.message(picture, "empty", found.reason ?? found.outcome.replaceAll("_", " "));
    const heading = PLANES[plane()];
    const z = found.plane[plane()];
    // Rows of the answer are ailerons; the tab is what is commanded, so it runs along x.
    const field = { type: "contour", name: heading, x: deflections.tab_deg, y: deflections.aileron_deg, z, colorscale: plot.FIELD, connectgaps: false, colorbar: { title: { text: heading, side: "right" }, thickness: 14 } };
    const lines = Object.entries(LINES).map(([name, title]) => ({ name: title, mode: "lines", x: found[name].tab_deg, y: found[name].aileron_deg }));
    const free = found.free.aileron_deg === null ? [] : [{ name: "both surfaces free", mode: "markers", x: [found.free.tab_deg], y: [found.free.aileron_deg], marker: { symbol: "star", size: 14, color: "#15202b", line: { color: "#ffffff", width: 1 } } }];
    const span = [-reach(), reach()];
    const layout = { xaxis: { title: { text: "tab [deg]" }, range: span }, yaxis: { title: { text: "aileron [deg]" }, range: span }, uirevision: `${plane()} ${reach()}` };
    const label = `${heading} over tab and aileron deflections at ${grid.pointName(design, point)}; the tab alone holds the aileron from ${end(found.reachable.lower)} to ${end(found.reachable.upper)}`;
    tell(found);
    return plot.draw(picture, [field, ...lines.map(inked), ...free], layout, { label, height: 520 });
  }

  function tell({ reachable, free, tab_only: line }) {
    const middle = Math.floor(line.gain.length / 2);
    const rows = [
      ["least aileron held by the tab alone", format.quantity(reachable.lower?.aileron_deg, "deg"), format.quantity(reachable.lower?.tab_deg, "deg"), reachable.lower?.limit ?? ""],
      ["largest aileron held by the tab alone", format.quantity(reachable.upper?.aileron_deg, "deg"), format.quantity(reachable.upper?.tab_deg, "deg"), reachable.upper?.limit ?? ""],
      ["both surfaces free", format.quantity(free.aileron_deg, "deg"), format.quantity(free.tab_deg, "deg"), free.reason ?? ""],
    ];
    dom.clear(facts).append(
      dom.table("Equilibria", ["", "aileron", "tab", "set by"], rows),
      h("p", { class: "muted" }, `Aileron per tab at ${format.quantity(line.aileron_deg[middle], "deg")} of aileron: ${format.number(line.gain[middle])}`),
    );
  }

  function end(found) {
    return found ? format.quantity(found.aileron_deg, "deg") : "no angle";
  }

  /** Lines over a field stand out from its dark and its light end, and in the legend of both themes. */
  function inked(line, index) {
    return { ...line, line: { color: ["#d55e00", "#56b4e9", "#cc79a7"][index], dash: ["solid", "dash", "dot"][index], width: 3 } };
  }
}

/** Limits of an actuator that are a number; one that varies over the grid is not given as such, and is left out. */
function plain(design, name, wanted) {
  const limits = design.request.actuators?.[name]?.limits ?? {};
  return Object.fromEntries(wanted.filter((limit) => typeof limits[limit] === "number").map((limit) => [limit, limits[limit]]));
}
