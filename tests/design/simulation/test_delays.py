"""Transport delays: against the method of steps where the plant is linear, against scipy with a limit in the loop."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from design.lqr.structures import Structure
from design.manoeuvre import step
from design.simulation.request import SimulationRequest
from design.simulation.simulate import simulate
from model.actuators import Actuator, ActuatorLimits
from tests.design.delay.method_of_steps import outputs
from tests.design.simulation.simulated_cases import SERVO, air_of, one, plant, tab_only, torque_loop


@pytest.mark.parametrize("kind", ["torques", "tab", "first order"])
def test_linear_loops_follow_the_method_of_steps(kind):
    p = plant("quasi_steady")
    late = Actuator(delay=0.002)
    if kind == "torques":
        loop = torque_loop(p, Structure(tab=late, aileron=late))
    elif kind == "tab":
        loop = tab_only(p, actuator=replace(SERVO, delay=0.012))
    else:
        loop = tab_only(p, "positive_feedback", actuator=Actuator(SERVO.servo_bandwidth, delay=0.012))
    points, flown = one(p, loop)
    size = np.array([0.1])
    found = simulate(points, flown, step(size), SimulationRequest(0.1, 101, 1e-8))
    names = [name for name in loop.outputs if name not in ("T_t",) or kind != "first order"]
    rows = [loop.outputs.index(name) for name in names]
    off_corners = np.abs(np.remainder(found.time / loop.delay[0] + 0.5, 1.0) - 0.5) > 1e-6
    exact = outputs(flown, size, found.time[off_corners])
    scale = np.abs(exact).max(axis=0)[rows]
    ours = found.outputs[off_corners][:, rows]
    assert np.max(np.abs(ours - exact[:, rows]) / scale) < 2e-6


def test_delay_and_limit_together():
    """Method of steps by scipy, the servo's rate limited: a history of dense outputs."""
    p, index, delay, limit = plant(), (1, 2), 0.015, 0.5
    points, loop = one(p, tab_only(p, actuator=replace(SERVO, delay=delay), K_i=8.0))
    size, K, (a_0, a_1) = 0.1, loop.K[0], -loop.A[1, :2]
    air, rest, T0 = air_of(p, index), p.trim.state[index], p.trim.torque[index][1]
    J = p.model.inertia[index]
    pieces = []

    def f(t, y):
        k = round(np.floor(t / delay - 1e-9)) - 1
        v = -K @ pieces[k](t - delay) if k >= 0 and pieces else 0.0
        wanted = np.clip(a_0 / a_1 * (v - y[0]), -limit, limit)
        M = air(y[0] + rest[0], y[1], y[2] + rest[2], y[3])
        return np.array([y[1], a_1 * (wanted - y[1]), y[3], (M[1] + T0) / J[1, 1], size - y[2], 600.0 * (y[2] - y[5])])

    y, duration = np.zeros(6), 10 * delay
    for k in range(10):
        done = solve_ivp(f, (k * delay, (k + 1) * delay), y, "DOP853", dense_output=True, rtol=1e-9, atol=1e-12)
        pieces.append(done.sol)
        y = done.y[:, -1]
    asked = SimulationRequest(duration, 101, 1e-8, limits={"tab": ActuatorLimits(rate=limit)}, anti_windup=0.0)
    found = simulate(points, loop, step(np.array([size])), asked)
    exact = np.array([pieces[min(int(t / delay), 9)](t) for t in found.time])
    assert found.time_at_limit[0, 1] > 0.01
    scale = np.abs(exact).max(axis=0)
    assert np.max(np.abs(found.states - exact) / scale) < 5e-5


def test_two_delays_and_steps_no_longer_than_either():
    p = plant()
    structure = Structure(tab=Actuator(delay=0.0004), aileron=Actuator(delay=0.002))
    points, loop = one(p, torque_loop(p, structure))
    rough = simulate(points, loop, step(np.array([0.1])), SimulationRequest(0.1, 51, 1e-4))
    fine = simulate(points, loop, step(np.array([0.1])), SimulationRequest(0.1, 51, 1e-8))
    assert rough.substeps * 2e-3 / 51 <= 0.0004
    scale = np.abs(fine.outputs).max(axis=0)
    assert np.max(np.abs(rough.outputs - fine.outputs) / scale) < 1e-3
    # Without the delay it is another response.
    plain = simulate(points, replace(loop, delay=(0.0, 0.0)), step(np.array([0.1])), SimulationRequest(0.1, 51))
    assert np.abs(plain.output("dt")[-1] - fine.output("dt")[-1]) > 1e-4 * scale[loop.outputs.index("dt")]
