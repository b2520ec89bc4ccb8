/**
 * The address of what is shown: `#/explore/<view>?design=<id>&point=3&controller=lqr&<parameters of the view>`.
 */

const SHARED = ["design", "point", "controller"];
/** Panels that show a grid point. */
const POINTED = ["explore", "compare"];

/**
 * The part of the address behind `#` that shows this state.
 * @param {import("./state.js").State} state
 * @returns {string} starting with `#/`
 */
export function addressOf(state) {
  const query = new URLSearchParams();
  if (state.designId) query.set("design", state.designId);
  if (state.designId && POINTED.includes(state.panel)) query.set("point", String(state.point));
  if (state.designId && state.controller) query.set("controller", state.controller);
  for (const [name, value] of Object.entries(state.params)) {
    if (value !== null && value !== undefined && !SHARED.includes(name)) query.set(name, String(value));
  }
  const path = state.panel === "explore" ? `explore/${state.view}` : state.panel;
  const text = query.toString();
  return `#/${path}${text ? `?${text}` : ""}`;
}

/**
 * The state that an address asks for.
 * @param {string} hash `location.hash`
 * @param {{panels: string[], views: string[]}} known ids that exist
 * @returns {Object} a patch for the store; what the address does not say has its first value
 */
export function stateOf(hash, { panels, views }) {
  const [path, text = ""] = hash.replace(/^#\/?/, "").split("?");
  const [panel, view] = path.split("/");
  const query = new URLSearchParams(text);
  const point = Number.parseInt(query.get("point") ?? "0", 10);
  const params = Object.fromEntries([...query].filter(([name]) => !SHARED.includes(name)));
  return {
    panel: panels.includes(panel) ? panel : "explore",
    view: views.includes(view) ? view : views[0],
    designId: query.get("design"),
    point: Number.isInteger(point) && point >= 0 ? point : 0,
    controller: query.get("controller"),
    params,
  };
}

/**
 * Keep the address and the state together; back and forward work.
 * @param {ReturnType<import("./state.js").createState>} state
 * @param {{panels: string[], views: string[]}} known
 * @param {function(Object, Object): Object} placed point and controller of what an address asks for, in a design that is loaded
 */
export function follow(state, known, placed) {
  const read = () => {
    const wanted = stateOf(window.location.hash, known);
    const { design } = state.get();
    state.set(design?.id === wanted.designId ? { ...wanted, ...placed(design, wanted) } : wanted);
  };
  const write = () => {
    const now = state.get();
    const address = addressOf(now);
    if (address === window.location.hash) return;
    const shown = stateOf(window.location.hash, known);
    const moved = ["panel", "view", "designId"].some((key) => shown[key] !== now[key]); // another place: back returns here
    window.history[moved ? "pushState" : "replaceState"](null, "", address);
  };
  read();
  state.subscribe(["panel", "view", "designId", "point", "controller", "params"], write);
  window.addEventListener("hashchange", read);
  window.addEventListener("popstate", read);
  window.history.replaceState(null, "", addressOf(state.get()));
}
