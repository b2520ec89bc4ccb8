/** The section of a request drawn to scale: aileron and tab at the trim, hinges, centres of mass, and which way is positive. */

import { h } from "../dom.js";
import { quantity } from "../format.js";
import { outline, sectionOf, turned } from "./shape.js";

const DEGREE = Math.PI / 180;

/**
 * Draw the section of a request; says instead what is missing.
 * @param {Element} el emptied first
 * @param {?Object} request a design request, as far as it is written
 */
export function drawSection(el, request) {
  const facts = factsOf(request ?? {});
  if (typeof facts === "string") {
    el.replaceChildren(h("p", { class: "message empty" }, facts));
    return;
  }
  const whole = picture(facts, { left: -0.16, right: 1.1, up: 0.22, down: 0.2, details: false });
  const aft = picture(facts, { left: facts.hinges[0] - 0.05, right: 1.04, ...heights(facts), details: true });
  el.replaceChildren(
    h("div", { role: "img", "aria-label": inWords(facts) }, whole, aft),
    h("p", { class: "small muted" }, caption(facts)));
}

function factsOf(request) {
  const { geometry = {}, inertia = {}, trim = {}, reference = {} } = request;
  const { aileron_hinge: xa, tab_hinge: xt, chord_m: chord } = geometry;
  const fraction = (value) => typeof value === "number" && value > 0 && value < 1;
  if (!fraction(xa) || !fraction(xt) || xa >= xt) return "The section is drawn when the hinges are parts of the chord, the tab's behind the aileron's.";
  if (!(typeof chord === "number" && chord > 0)) return "The section is drawn when the chord is a length.";
  const number = (value) => (typeof value === "number" ? value : 0);
  const solved = [["aileron", trim.aileron_deg], ["tab", trim.tab_deg]].filter(([, value]) => value !== undefined && typeof value !== "number").map(([name]) => name);
  return {
    section: sectionOf(request.aerodynamics), chord, hinges: [xa, xt], solved,
    alpha: number(trim.alpha_deg), aileron: number(trim.aileron_deg), tab: number(trim.tab_deg),
    step: number(reference.aileron_deg),
    centres: [number(inertia.aileron?.cg_offset_m), number(inertia.tab?.cg_offset_m)],
  };
}

function heights({ hinges: [xa, xt], aileron, tab, step }) {
  const reach = (1 - xa) * Math.sin(Math.min(Math.abs(aileron) + Math.abs(step), 80) * DEGREE) + (1 - xt) * Math.sin(Math.min(Math.abs(tab), 80) * DEGREE);
  const room = Math.max(reach + 0.02, (1 - xa) * 0.3);
  return { up: room, down: room };
}

function picture(facts, { left, right, up, down, details }) {
  const scale = 1000 / (right - left);
  const at = ([x, z]) => [(x - left) * scale, (up - z) * scale];
  const path = (points, closed = true) => `M${points.map((point) => at(point).map((one) => one.toFixed(1)).join(" ")).join("L")}${closed ? "Z" : ""}`;
  const { section, hinges: [xa, xt], aileron, tab, step } = facts;
  const hingeA = [xa, section.camber(xa)];
  const hingeT = turned([[xt, section.camber(xt)]], hingeA, aileron * DEGREE)[0];
  const onAileron = (points, more = 0) => turned(points, hingeA, (aileron + more) * DEGREE);
  const onTab = (points, more = 0) => onAileron(turned(points, [xt, section.camber(xt)], tab * DEGREE), more);
  const shape = (points, kind) => h("svg:path", { d: path(points), class: `section-${kind}` });
  return h("svg:svg", { viewBox: `0 0 1000 ${((up + down) * scale).toFixed(0)}`, class: "section", "aria-hidden": "true" },
    step && details ? [shape(onAileron(outline(section, xa, xt), step), "ghost"), shape(onTab(outline(section, xt, 1), step), "ghost")] : null,
    shape(outline(section, 0, xa), "wing"), shape(onAileron(outline(section, xa, xt)), "aileron"), shape(onTab(outline(section, xt, 1)), "tab"),
    [hingeA, hingeT].map((place) => hinge(at(place), details ? 7 : 5)),
    details ? centres(facts, at, hingeA, hingeT) : flow(facts, at),
    details ? arcs(facts, at, hingeA) : null,
    scaleBar(facts, scale, (up + down) * scale));
}

function hinge([x, y], radius) {
  return h("svg:circle", { cx: x, cy: y, r: radius, class: "section-hinge" });
}

/** Centres of mass: aft of each body's own hinge, along its own chord. */
function centres({ chord, centres: offsets, aileron, tab }, at, hingeA, hingeT) {
  const places = [[hingeA, offsets[0], aileron], [hingeT, offsets[1], aileron + tab]];
  return places.map(([[x, z], offset, angle]) => {
    const along = offset / chord;
    const [cx, cy] = at([x + along * Math.cos(angle * DEGREE), z + along * Math.sin(angle * DEGREE)]);
    const mark = h("svg:path", { d: `M${cx - 11} ${cy}h22M${cx} ${cy - 11}v22`, class: "section-centre" });
    return [h("svg:circle", { cx, cy, r: 8, class: "section-centre" }), mark];
  });
}

/** The arc from the aileron's zero to where it is positive. */
function arcs({ hinges: [xa], step }, at, hingeA) {
  const radius = (1 - xa) * 1.01;
  const to = (angle) => at([hingeA[0] + radius * Math.cos(angle), hingeA[1] + radius * Math.sin(angle)]);
  const size = Math.max(Math.min(Math.abs(step) || 12, 40), 8) * DEGREE;
  const [[x0, y0], [x1, y1]] = [to(0), to(size)];
  const r = Math.hypot(x1 - at(hingeA)[0], y1 - at(hingeA)[1]);
  const tip = `M${x1 - 9} ${y1 + 15}L${x1} ${y1}L${x1 + 9} ${y1 + 14}`;
  return [h("svg:path", { d: `M${x0} ${y0}A${r} ${r} 0 0 0 ${x1} ${y1}`, class: "section-arc" }), h("svg:path", { d: tip, class: "section-arc" }), text(x1 - 14, y1 - 10, "trailing edge up: positive", "end")];
}

/** The air that comes at the angle of attack. */
function flow({ alpha, section }, at) {
  const [c, s] = [Math.cos(alpha * DEGREE), Math.sin(alpha * DEGREE)];
  const nose = [-0.025, section.camber(0) - 0.025 * Math.tan(alpha * DEGREE)];
  const [[x0, y0], [x1, y1]] = [at([nose[0] - 0.11 * c, nose[1] - 0.11 * s]), at(nose)];
  const [ux, uy] = [(x1 - x0) / Math.hypot(x1 - x0, y1 - y0), (y1 - y0) / Math.hypot(x1 - x0, y1 - y0)];
  const tip = `M${x1 - 16 * ux - 8 * uy} ${y1 - 16 * uy + 8 * ux}L${x1} ${y1}L${x1 - 16 * ux + 8 * uy} ${y1 - 16 * uy - 8 * ux}`;
  return [h("svg:path", { d: `M${x0} ${y0}L${x1} ${y1}`, class: "section-arc" }), h("svg:path", { d: tip, class: "section-arc" }), text(x0, Math.max(y0, y1) + 40, `alpha ${quantity(alpha, "deg")}`, "start")];
}

function scaleBar({ chord }, scale, height) {
  const room = (300 / scale) * chord;
  const step = 10 ** Math.floor(Math.log10(room));
  const length = [5, 2, 1].map((times) => times * step).find((one) => one <= room);
  const width = (length / chord) * scale;
  const y = height - 12;
  return [h("svg:path", { d: `M12 ${y - 8}v8h${width}v-8`, class: "section-arc" }), text(24 + width, y, quantity(length, "m"), "start")];
}

function text(x, y, words, anchor) {
  return h("svg:text", { x, y, "text-anchor": anchor, class: "section-text" }, words);
}

function caption({ section, chord, hinges, step, solved, aileron, tab }) {
  const distance = hinges.map((hinge) => quantity(hinge * chord, "m"));
  const unknown = solved.length ? ` The ${solved.join(" and the ")} angle is solved for, and drawn at zero.` : "";
  const ghost = step ? ` Dashed: after the reference step of ${quantity(step, "deg")}.` : "";
  return `${section.name}, chord ${quantity(chord, "m")}; hinges ${distance[0]} and ${distance[1]} behind the leading edge. At the trim: aileron ${quantity(aileron, "deg")}, tab ${quantity(tab, "deg")} from the aileron.${ghost}${unknown} Angles and hinge moments are positive trailing edge up; a centre of mass is positive aft of its hinge. Circles are hinges, crossed circles centres of mass.`;
}

function inWords(facts) {
  const [a, t] = facts.centres;
  return `Section drawn to scale. ${caption(facts)} Centre of mass of the aileron ${quantity(a, "m")} and of the tab ${quantity(t, "m")} aft of its own hinge. Angle of attack ${quantity(facts.alpha, "deg")}.`;
}
