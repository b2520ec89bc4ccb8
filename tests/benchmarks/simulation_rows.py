"""Non-linear simulation against python-control: the LQR of the case with total hinge moments and limited torques.

Both follow a step of 10 degrees for a second and give the same six signals at the same 1001 times. Ours takes a
thousand steps of Runge and Kutta; the peer is `ct.input_output_response` at its defaults, point by point, with a
right-hand side in numpy as its users write it. At 1000 points the peer's time is taken of 25 and multiplied.
"""

from __future__ import annotations

from typing import Any

import control as ct
import numpy as np

from design.loop import Loop
from design.manoeuvre import step
from design.simulation.plant import NonlinearPlant
from design.simulation.request import SimulationRequest
from design.simulation.simulate import simulate
from model.actuators import ActuatorLimits
from model.arrays import FloatArray
from tests.benchmarks.cases import DURATION, STEP, Case
from tests.benchmarks.measure import Row

#: Samples and steps.
SAMPLES = 1001
#: What each actuator can give, as a part of the largest peak torque over the points: some points reach the tab's.
LIMITED = {"tab": 0.8, "aileron": 1.6}


def simulation_rows(c: Case) -> list[Row]:
    """Both sizes of grid."""
    return [_row(c, 1, 3.0), _row(c, 40, 20.0)]


def _row(c: Case, copies: int, goal: float) -> Row:
    everywhere = np.ones(c.plant.grid.shape, dtype=bool)
    condition = c.plant.grid.condition.take(everywhere)
    one = NonlinearPlant.of(c.plant.system, condition, c.plant.trim.take(everywhere), c.plant.model.take(everywhere))
    manoeuvre = step(np.array([STEP]))
    free = simulate(one, c.loop, manoeuvre, SimulationRequest(DURATION, 101))
    limits = {
        name: ActuatorLimits(torque=LIMITED[name] * float(np.max(demand.peak_torque)))
        for name, demand in zip(c.loop.inputs, free.demand, strict=True)
    }
    asked = SimulationRequest(DURATION, SAMPLES, substeps=1, limits=limits, anti_windup=0.0)
    index = np.tile(np.arange(25), copies)
    plant, loop = one.take(index), c.loop.take(index)

    def ours() -> FloatArray:
        return simulate(plant, loop, manoeuvre, asked).outputs

    def theirs() -> FloatArray:
        return control_simulations(c, limits)

    def agree(mine: FloatArray, other: FloatArray) -> None:
        assert np.isfinite(mine).all()
        scale = np.abs(other).max(axis=(0, 1))
        assert np.max(np.abs(mine[:25] - other) / scale) < 2e-2  # the peer's own tolerance is a thousandth

    return Row(
        f"non-linear step, {25 * copies} points, 1000 steps",
        "ct.input_output_response",
        goal,
        ours,
        theirs,
        agree,
        copies,
    )


def control_simulations(c: Case, limits: dict[str, ActuatorLimits]) -> FloatArray:
    """Outputs (25, T, 6) of 25 points, by python-control."""
    time = np.linspace(0.0, DURATION, SAMPLES)
    return np.array([_control_simulation(c, c.loop.take(i), i, limits, time) for i in range(25)])


def _control_simulation(c: Case, loop: Loop, i: int, limits: dict[str, ActuatorLimits], time: FloatArray) -> FloatArray:
    """Outputs (T, 6) of one point: equations of motion, clipped torques, integral, in plain numpy."""
    system, q = c.plant.system, c.plant.grid.condition.dynamic_pressure.ravel()[i]
    V, trim = c.plant.grid.condition.airspeed.ravel()[i], c.plant.trim
    g, source = system.geometry, system.aerodynamics.source
    load, alpha = q * g.chord**2 * g.span, trim.alpha.ravel()[i]
    rest, T0 = trim.state.reshape(25, 4)[i], trim.torque.reshape(25, 2)[i]
    moments = source.at(0.0, 0.0, 0.0)
    C0, G = moments.value + moments.gradient[:, 0] * alpha, moments.gradient[:, 1:]
    inverse, K, N = np.linalg.inv(system.inertia_matrix), loop.K, loop.N[:, 0]
    most = np.array([limits["tab"].torque, limits["aileron"].torque])
    ca, own = g.aileron_chord / V, g.tab_chord / V / 4.0

    def torque(x: FloatArray, r: float) -> FloatArray:
        return np.clip(N * r - K @ x + T0, -most, most)

    def update(_: float, x: FloatArray, u: FloatArray, __: dict[str, Any]) -> FloatArray:
        dt, da = x[0] + rest[0], x[2] + rest[2]
        angles = np.array([dt + np.cos(dt) * ca * x[3] + own * x[1], da + 0.25 * ca * x[3]])
        acceleration = inverse @ (torque(x, u[0]) - load * (C0 + G @ angles))
        return np.array([x[1], acceleration[0], x[3], acceleration[1], u[0] - x[2]])

    def output(_: float, x: FloatArray, u: FloatArray, __: dict[str, Any]) -> FloatArray:
        T = torque(x, u[0])
        return np.array([x[2] + rest[2], x[0] + rest[0], x[3], x[1], T[0], T[1]])

    peer = ct.nlsys(update, output, inputs=1, outputs=6, states=5)
    found = ct.input_output_response(peer, time, np.full((1, len(time)), STEP), np.zeros(5))
    return np.asarray(found.outputs.T)
