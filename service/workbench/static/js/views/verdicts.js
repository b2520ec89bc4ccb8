/** Verdicts: every spec of every controller at its worst, and what stands in the way where a point has no gains. */

import { asked, askedBy, judged } from "../spec_words.js";
import { blockedAt } from "./blocked.js";

const SHOWN = [{ value: "all", label: "every spec" }, { value: "missed", label: "missed ones only" }];

export default { id: "verdicts", title: "Verdicts", group: "envelope", needs: ["point"], mount };

function mount(el, { api, state, dom, format, grid, param, setParam, show }) {
  const { h } = dom;
  const choice = h("div", { class: "row" });
  const tables = h("div", { class: "stack" });
  el.append(choice, tables);
  choice.append(dom.select("Show", SHOWN, only(), (value) => setParam("show", value)));
  let verdicts = null; // of every controller
  const points = new Map(); // index -> document
  update();
  return { update, unmount: () => {} };

  function only() {
    return param("show", "all") === "missed" ? "missed" : "all";
  }

  function update() {
    choice.firstChild.control.value = only();
    show(tables, ask, draw);
  }

  async function ask(signal) {
    const { design, designId } = state.get();
    const of = ({ name }) => api.get(`v1/designs/${designId}/controllers/${encodeURIComponent(name)}/verdicts`, { signal });
    verdicts ??= await Promise.all(design.controllers.map(of));
    const explained = pointToExplain();
    if (explained !== null && !points.has(explained)) points.set(explained, await api.get(`v1/designs/${designId}/points/${explained}`, { signal }));
    return explained === null ? null : points.get(explained);
  }

  /** The chosen point where a controller has no gains there; else the first such point. */
  function pointToExplain() {
    const lacking = (index) => verdicts.some(({ outcomes }) => outcomes.flat()[index] !== "ok");
    const { design, point } = state.get();
    const all = Array.from({ length: grid.pointCount(design) }, (_, index) => index);
    return [point, ...all].find(lacking) ?? null;
  }

  function draw(document_) {
    const held = tables.contains(document.activeElement) ? document.activeElement.dataset.role : null;
    dom.clear(tables).append(...verdicts.map(ofController), ...(document_ ? [inTheWay(document_)] : []));
    if (held) tables.querySelector(`[data-role="${held}"]`)?.focus();
  }

  function ofController({ name, kind, verdicts: all, outcomes }) {
    const missed = all.filter(({ passed }) => !passed);
    const shown = only() === "missed" ? missed : all;
    const ok = outcomes.flat().filter((outcome) => outcome === "ok").length;
    const count = outcomes.flat().length;
    const tag = !ok ? ["bad", "no gains at any point"] : missed.length ? ["bad", `${missed.length} of ${all.length} missed`] : ["good", `all ${all.length} met`];
    const gains = ok && ok < count ? [h("span", { class: "tag warn" }, `${count - ok} of ${count} points have no gains`)] : [];
    const heading = h("div", { class: "row" }, h("h4", {}, name === kind ? name : `${name} (${format.words(kind)})`), h("span", { class: `tag ${tag[0]}` }, tag[1]), gains);
    const columns = ["spec", "asked by", "limit", "worst value", "distance", "where", "points met", "verdict"];
    const content = shown.length ? h("div", { class: "scroll-x" }, dom.table(`Verdicts of ${name}`, columns, shown.map((one) => row(name, one)))) : h("p", { class: "muted" }, all.length ? "None is missed." : "Nothing is asked of it.");
    return h("section", { class: "stack", "aria-label": `Verdicts of ${name}` }, heading, content);
  }

  function row(name, verdict) {
    const { spec, source, unit, worst_value: worst, worst_point: where, points_judged: count, points_passed: met, passed, reason } = verdict;
    const at = (field) => (where === null ? null : field.flat()[where]);
    const varies = new Set(verdict.limits.flat().filter((limit) => limit !== null)).size > 1;
    const distance = at(verdict.distances);
    const state_ = !count ? ["warn", "not judged"] : passed ? ["good", "met"] : ["bad", "missed"];
    return [
      judged(spec),
      askedBy(source),
      `${asked(spec, at(verdict.limits) ?? verdict.limit, unit)}${varies ? ", there" : ""}`,
      format.quantity(worst, unit),
      distance === null ? format.NONE : `${format.quantity(Math.abs(distance), unit, 3)} ${distance < 0 ? "outside" : "inside"}`,
      where === null ? format.NONE : placeButton(where, () => state.set({ point: where, controller: name, view: "map", params: { figure: `verdict.${source}.${spec}` } }), "map"),
      `${met} of ${count}`,
      h("span", {}, h("span", { class: `tag ${state_[0]}` }, state_[1]), reason ? ` ${reason}` : ""),
    ];
  }

  function placeButton(point, onclick, where) {
    const { design } = state.get();
    const name = grid.pointName(design, point);
    const [first, ...rest] = name.split(": ");
    return h("button", { type: "button", class: "quiet", onclick, title: `${where === "map" ? "On the map: " : ""}${name}`, "data-role": where === "map" ? null : `point ${point}` }, first, h("span", { class: "muted small" }, ` ${rest.join(": ").replace(/[a-z]+( [a-z]+)* (?=[\d\u2212])/g, "")}`));
  }

  /** Points without gains, why, and what would help. */
  function inTheWay(document_) {
    const { design } = state.get();
    const lacking = verdicts.flatMap(({ name, outcomes, reasons }) => outcomes.flat().flatMap((outcome, index) => (outcome === "ok" ? [] : [[
      placeButton(index, () => state.set({ point: index }), "here"), name, h("span", { class: "tag bad" }, outcome.replaceAll("_", " ")), reasons.flat()[index] ?? "",
    ]])));
    const explained = document_.controllers.filter(({ outcome }) => outcome !== "ok").map(blockedAt);
    const title = grid.pointName(design, document_.index);
    return h("section", { class: "stack", "aria-label": "Points without gains" },
      h("h4", {}, "Points without gains"),
      h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Points without gains" }, dom.table("Points without gains", ["point", "controller", "outcome", "reason"], lacking)),
      h("h4", {}, `What stands in the way at ${title}`), explained);
  }
}
