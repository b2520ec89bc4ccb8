/**
 * The views of the Explore panel, in the order of the list.
 * A view: `{id, title, group: "point" | "envelope", needs: ("point" | "controller")[], mount(el, context) -> {update(changed), unmount()}}`;
 * `kind`: of the only controllers that it is for, if it is not for all of them.
 * It draws itself once when it is mounted; `update` follows a change of point, controller or parameters.
 */

import bode from "./bode.js";
import eigenvalueSweeps from "./eigenvalue_sweeps.js";
import gainSurfaces from "./gain_surfaces.js";
import gridMap from "./grid_map.js";
import nichols from "./nichols.js";
import phasePlane from "./phase_plane.js";
import plant from "./plant.js";
import pointWeights from "./point_weights.js";
import poleMap from "./pole_map.js";
import response from "./response.js";
import robustPerformance from "./robust_performance.js";
import rootLocus from "./root_locus.js";
import steadyState from "./steady_state.js";
import torqueSpeed from "./torque_speed.js";
import verdicts from "./verdicts.js";
import weights from "./weights.js";

/** @type {Object[]} */
export const VIEWS = [
  gridMap, verdicts, gainSurfaces, weights, poleMap, robustPerformance, torqueSpeed, eigenvalueSweeps, steadyState, phasePlane,
  rootLocus, pointWeights, bode, nichols, response, plant,
];
