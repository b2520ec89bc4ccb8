"""The same work by python-control and scipy, point by point, as their users write it.

`ct.lqr` is called with its scipy back end: slycot is not among the product's dependencies.
"""

from __future__ import annotations

import json
from typing import Any

import control as ct
import numpy as np
from scipy.linalg import solve, solve_continuous_are

from design.loop import Loop
from design.lqr.tracking import TrackingPlant
from design.lqr.weights import ExplicitWeights
from model.arrays import FloatArray
from model.flight import FlightCondition
from model.motion import acceleration
from model.system import TabAileron
from model.trim import Trim
from schedules.analysis import PlantEnvelope
from tests.benchmarks.cases import DURATION, GAINS, SAMPLES, STEP

#: Where `ct.disk_margins` looks [rad/s].
FREQUENCIES = np.geomspace(0.1, 1e4, 400)


def numpy_linear_models(system: TabAileron, condition: FlightCondition) -> FloatArray:
    """State matrices point by point, as a script does it: thesis damping about neutral surfaces, in numpy."""
    g, gradient = system.geometry, system.aerodynamics.source.at(0.0, 0.0, 0.0).gradient
    J, G = system.inertia_matrix, gradient[:, 1:]
    ca, ct = g.aileron_chord, g.tab_chord
    matrices = []
    for V, q in zip(condition.airspeed, condition.dynamic_pressure, strict=True):
        load = q * g.chord**2 * g.span
        rates = np.array([[ct / 4, ca], [0.0, ca / 4]]) / V  # induced angles of tab and aileron by dt', da'
        K, D = -load * G, -load * G @ rates
        A = np.zeros((4, 4))
        A[0, 1] = A[2, 3] = 1.0
        A[np.ix_([1, 3], [0, 2])], A[np.ix_([1, 3], [1, 3])] = np.linalg.solve(J, K), np.linalg.solve(J, D)
        matrices.append(A)
    return np.array(matrices)


def scipy_lqr(plant: TrackingPlant, weights: ExplicitWeights) -> FloatArray:
    """Gain, residual and eigenvalues of each point: what our certificate also holds."""
    gains = []
    for A, B in zip(plant.A, plant.B, strict=True):
        X = solve_continuous_are(A, B, weights.Q, weights.R)
        K = solve(weights.R, B.T @ X)
        np.linalg.norm(A.T @ X + X @ A - X @ B @ K + weights.Q)
        np.linalg.eigvals(A - B @ K)
        gains.append(K)
    return np.array(gains)


def control_lqr(plant: TrackingPlant, weights: ExplicitWeights) -> FloatArray:
    """Gain of each point by `ct.lqr`."""
    return np.array(
        [ct.lqr(A, B, weights.Q, weights.R, method="scipy")[0] for A, B in zip(plant.A, plant.B, strict=True)]
    )


def control_linearise_lqr(plant: PlantEnvelope, weights: ExplicitWeights) -> FloatArray:
    """Linearise the equations of motion by `ct.linearize`, add the integrator, then `ct.lqr`."""
    gains = []
    for index in np.ndindex(plant.grid.shape):
        condition, trim = plant.grid.condition.take(index), plant.trim.take(index)
        A, B = _linearised(plant, condition, trim)
        A5, B5 = np.zeros((5, 5)), np.zeros((5, 2))
        A5[:4, :4], A5[4, 2], B5[:4] = A, -1.0, B
        gains.append(ct.lqr(A5, B5, weights.Q, weights.R, method="scipy")[0])
    return np.array(gains)


def _linearised(plant: PlantEnvelope, condition: FlightCondition, trim: Trim) -> tuple[FloatArray, FloatArray]:
    def update(t: float, x: FloatArray, u: FloatArray, params: dict[str, Any]) -> FloatArray:
        dt2, da2 = acceleration(plant.system, condition, trim.alpha, x, u)
        return np.array([x[1], dt2, x[3], da2])

    system = ct.nlsys(update, None, states=4, inputs=2, outputs=4)
    linear = ct.linearize(system, trim.state, trim.torque)
    return linear.A, linear.B


def control_loci(loop: Loop, gains: FloatArray) -> list[FloatArray]:
    """Root locus of the tab's cut at each point over the given gains, by `ct.root_locus_map`."""
    cut = loop.cut("tab")
    return [
        ct.root_locus_map(ct.ss(A, b[:, None], c[None, :], 0), gains=k).loci
        for A, b, c, k in zip(cut.A, cut.b, cut.c, gains, strict=True)
    ]


def control_margins(loop: Loop) -> FloatArray:
    """Phase margin [deg] of both cuts at each point, by `ct.margin`."""
    found = []
    for name in loop.inputs:
        cut = loop.cut(name)
        systems = (ct.ss(A, b[:, None], c[None, :], 0) for A, b, c in zip(cut.A, cut.b, cut.c, strict=True))
        found.append([ct.margin(system)[1] for system in systems])
    return np.array(found)


def control_return_difference(loop: Loop) -> FloatArray:
    """Smallest singular value of ``I + L`` at each point and frequency, `ct.frequency_response` and an SVD each."""
    found = []
    for A, B, K in zip(loop.A, loop.B, loop.K, strict=True):
        response = ct.frequency_response(ct.ss(A, B, K, np.zeros((2, 2))), FREQUENCIES).frdata
        found.append(
            [np.linalg.svd(np.eye(2) + response[:, :, k], compute_uv=False)[-1] for k in range(FREQUENCIES.size)]
        )
    return np.array(found)


def control_all_margins(loop: Loop) -> FloatArray:
    """Phase margin, distance from -1 and disk margin of both cuts at each point.

    `ct.stability_margins` with all crossovers, and `ct.disk_margins` on 400 frequencies: what our margins hold,
    but for the peak being a sampled one.
    """
    found = []
    for name in loop.inputs:
        cut = loop.cut(name)
        systems = [ct.ss(A, b[:, None], c[None, :], 0) for A, b, c in zip(cut.A, cut.b, cut.c, strict=True)]
        found.append([_margins_of(system) for system in systems])
    return np.array(found)


def _margins_of(system: Any) -> list[float]:
    _, pm, sm, *_ = ct.stability_margins(system, returnall=True)
    disk, *_ = ct.disk_margins(system, FREQUENCIES)
    return [float(np.min(np.abs(pm))), float(np.min(np.abs(sm), initial=1.0)), float(disk)]


def control_steps(loop: Loop) -> FloatArray:
    """Largest magnitude of every output after the step, at each point, by `ct.forced_response`."""
    time = np.linspace(0.0, DURATION, SAMPLES)
    step = np.full(SAMPLES, STEP)
    peaks = []
    for p in range(loop.A.shape[0]):
        system = ct.ss(loop.closed[p], loop.reference_input[p], loop.closed_outputs[p], loop.reference_feedthrough[p])
        outputs = ct.forced_response(system, time, step).outputs + loop.offset[p][:, None]
        peaks.append(np.max(np.abs(outputs), axis=1))
    return np.array(peaks)


def control_whole(plant: PlantEnvelope, weights: ExplicitWeights, locus: bool = True) -> bytes:
    """The whole request point by point: LQR on the given linear model, locus, margins, step, metrics, peaks, JSON.

    Without `locus` neither the locus nor the samples of the step are written: what a design holds.
    """
    answer = []
    gains = np.concatenate([[0.0], np.geomspace(0.01, 100.0, GAINS - 1)])
    time = np.linspace(0.0, DURATION, SAMPLES)
    for index in np.ndindex(plant.grid.shape):
        model = plant.model.take(index)
        A, B = np.zeros((5, 5)), np.zeros((5, 2))
        A[:4, :4], A[4, 2], B[:4] = model.A, -1.0, model.B
        K, _, poles = ct.lqr(A, B, weights.Q, weights.R, method="scipy")
        cuts = [ct.ss(A - B[:, [1 - i]] @ K[[1 - i]], B[:, [i]], K[[i]], 0) for i in range(2)]
        found = [_margins_of(cut) for cut in cuts]
        system = _step_system(A, B, K)
        outputs = ct.forced_response(system, time, np.full(SAMPLES, STEP)).outputs
        peaks = np.max(np.abs(outputs), axis=1)
        metrics = ct.step_info(outputs[0], T=time, yfinal=STEP)
        bandwidth = ct.bandwidth(system[0, 0])
        point = {
            "K": K.tolist(), "poles": [[p.real, p.imag] for p in poles], "margins": found,
            "metrics": {k: float(v) for k, v in metrics.items()}, "bandwidth": bandwidth, "peaks": peaks.tolist(),
        }  # fmt: skip
        if locus:
            loci = ct.root_locus_map(cuts[0], gains=gains).loci
            point |= {
                "gains": gains.tolist(), "loci": [[[z.real, z.imag] for z in row] for row in loci],
                "time": time.tolist(), "outputs": outputs.tolist(),
            }  # fmt: skip
        answer.append(point)
    return json.dumps(answer).encode()


def _step_system(A: FloatArray, B: FloatArray, K: FloatArray) -> Any:
    """From r_a to angles, rates and torques, with the feed-forward that rests the aileron without torque."""
    dt, torque = np.linalg.solve(np.array([[A[1, 0], B[1, 0]], [A[3, 0], B[3, 0]]]), -A[[1, 3], 2])
    N = K[:, :4] @ np.array([dt, 0.0, 1.0, 0.0]) + np.array([torque, 0.0])
    E = np.array([0.0, 0.0, 0.0, 0.0, 1.0]) + B @ N
    C = np.vstack([np.eye(5)[[2, 0, 3, 1]], -K])
    return ct.ss(A - B @ K, E[:, None], C, np.concatenate([np.zeros(4), N])[:, None])
