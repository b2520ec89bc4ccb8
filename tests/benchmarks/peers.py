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
from design.tracking import TrackingPlant
from design.weights import ExplicitWeights
from model.arrays import FloatArray
from model.flight import FlightCondition
from model.motion import acceleration
from model.trim import Trim
from schedules.analysis import PlantEnvelope
from tests.benchmarks.cases import DURATION, GAINS, SAMPLES, STEP


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


def control_whole(plant: PlantEnvelope, weights: ExplicitWeights, loop_of: Any) -> bytes:
    """The whole request point by point: linear model (analytic, given), LQR, locus, margins, step, peaks, JSON."""
    answer = []
    for index in np.ndindex(plant.grid.shape):
        model = plant.model.take(index)
        A5, B5 = np.zeros((5, 5)), np.zeros((5, 2))
        A5[:4, :4], A5[4, 2], B5[:4] = model.A, -1.0, model.B
        K, _, poles = ct.lqr(A5, B5, weights.Q, weights.R, method="scipy")
        loop: Loop = loop_of(model, K)
        cut = loop.cut("tab")
        gains = np.concatenate([[0.0], np.geomspace(0.01, 100.0, GAINS - 1)])
        loci = ct.root_locus_map(ct.ss(cut.A, cut.b[:, None], cut.c[None, :], 0), gains=gains).loci
        found = [ct.margin(ct.ss(c.A, c.b[:, None], c.c[None, :], 0)) for c in (loop.cut(name) for name in loop.inputs)]
        system = ct.ss(loop.closed, loop.reference_input, loop.closed_outputs, loop.reference_feedthrough)
        time = np.linspace(0.0, DURATION, SAMPLES)
        outputs = ct.forced_response(system, time, np.full(SAMPLES, STEP)).outputs
        peaks = np.max(np.abs(outputs + loop.offset[:, None]), axis=1)
        answer.append(
            {
                "K": K.tolist(), "poles": [[p.real, p.imag] for p in poles], "gains": gains.tolist(),
                "loci": [[[z.real, z.imag] for z in row] for row in loci],
                "margins": [[float(v) for v in m] for m in found],
                "time": time.tolist(), "outputs": outputs.tolist(), "peaks": peaks.tolist(),
            }
        )  # fmt: skip
    return json.dumps(answer).encode()
