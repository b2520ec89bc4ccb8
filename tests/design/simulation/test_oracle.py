"""The same loops written out with `model.motion` and integrated by scipy to 1e-11."""

import numpy as np
import pytest

from design.lqr.structures import Structure
from design.manoeuvre import doublet, rate_limited_step, sine, step
from design.simulation.request import SimulationRequest
from design.simulation.simulate import simulate
from model.actuators import Actuator, ActuatorLimits
from tests.design.simulation.simulated_cases import SERVO, air_of, followed, one, plant, tab_only, torque_loop

INDEX = (1, 2)
BANDWIDTH = 350.0


def _torque_equations(p, loop, manoeuvre, limits, lagged):
    air, J = air_of(p, INDEX), p.model.inertia[INDEX]
    K, N = loop.K[INDEX], loop.N[INDEX]
    trim, rest = p.trim.torque[INDEX], p.trim.state[INDEX]
    torque = np.array([limits[s].torque or np.inf for s in ("tab", "aileron")])
    power = np.array([limits[s].power or np.inf for s in ("tab", "aileron")])

    def f(t, y):
        x = y[:5]
        r = manoeuvre.at(np.array(t))
        u = N @ r - K @ y
        speed = np.maximum(np.abs(x[[1, 3]]), 1e-300)
        most = np.minimum(torque, power / speed)
        if lagged:
            target = np.clip(u + trim, -most, most) - trim
            change = BANDWIDTH * (target - y[5:])
            T = np.clip(y[5:] + trim, -most, most)
        else:
            change, T = np.zeros(0), np.clip(u + trim, -most, most)
        totals = rest + x[:4]
        acceleration = np.linalg.solve(J, T + air(*totals))
        return np.concatenate([[x[1], acceleration[0], x[3], acceleration[1], r[0] - x[2]], change])

    return f


@pytest.mark.parametrize("kind", ["thesis", "table"])
@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("lagged", [False, True])
def test_torque_loops(kind, limited, lagged):
    p = plant(kind)
    drive = Actuator(torque_loop_bandwidth=BANDWIDTH)
    loop = torque_loop(p, Structure(tab=drive, aileron=drive) if lagged else None)
    manoeuvre = rate_limited_step(np.array([0.1]), 1.0)
    free = simulate(*one(p, loop), manoeuvre, SimulationRequest(0.2))
    tab, aileron = free.demand
    limits = {"tab": ActuatorLimits(), "aileron": ActuatorLimits()}
    if limited:
        limits = {
            "tab": ActuatorLimits(torque=0.8 * float(tab.peak_torque), power=0.7 * float(tab.peak_power)),
            "aileron": ActuatorLimits(power=0.8 * float(aileron.peak_power)),
        }
    asked = SimulationRequest(0.15, 76, 1e-8 if limited else 1e-7, limits=limits, anti_windup=0.0)
    found = simulate(*one(p, loop), manoeuvre, asked)
    assert found.codes[()] == "completed"
    f = _torque_equations(p, loop, manoeuvre, limits, lagged)
    exact = followed(f, np.zeros(len(loop.states)), (0.1, 0.15), found.time)
    scale = np.abs(exact).max(axis=0)
    # A limit that is met or left within a step costs its order; without limits the method is of order four.
    assert np.max(np.abs(found.states - exact) / scale) < (1e-4 if limited else 1e-6)
    if limited:
        assert np.all(found.time_at_limit[:, 3] > 0.002)
        assert found.demand[0].peak_torque <= limits["tab"].torque * (1.0 + 1e-12)


def _servo_equations(p, loop, manoeuvre, limits):
    air, J = air_of(p, INDEX), p.model.inertia[INDEX]
    K, (a_0, a_1) = loop.K[INDEX][0], -loop.A[INDEX][1, :2]
    T0, rest, cut = p.trim.torque[INDEX][1], p.trim.state[INDEX], 600.0
    speed, travel = limits.rate or np.inf, limits.deflection or np.inf

    def f(t, y):
        dt, dt_rate, da, da_rate, _, filtered = y
        v = np.clip(-K @ y + rest[0], -travel, travel) - rest[0]
        wanted = np.clip(a_0 / a_1 * (v - dt), -speed, speed)
        M = air(dt + rest[0], dt_rate, da + rest[2], da_rate)
        return np.array(
            [dt_rate, a_1 * (wanted - dt_rate), da_rate, (M[1] + T0) / J[1, 1],
             manoeuvre.at(np.array(t))[0] - da, cut * (da - filtered)]
        )  # fmt: skip

    return f


@pytest.mark.parametrize("kind", ["thesis", "table"])
@pytest.mark.parametrize(
    "limits",
    [ActuatorLimits(), ActuatorLimits(rate=0.8), ActuatorLimits(deflection=0.03)],
    ids=["none", "rate", "deflection"],
)
def test_tab_loops(kind, limits):
    p = plant(kind)
    servo = Actuator(SERVO.servo_bandwidth, 0.7 if limits.deflection is None else 0.3)
    loop = tab_only(p, actuator=servo, K_i=8.0)
    manoeuvre = doublet(np.array([0.12]), 0.06)
    if limits.deflection is not None:
        free = simulate(*one(p, loop), manoeuvre, SimulationRequest(0.15, 51)).demand[0]
        limits = ActuatorLimits(deflection=0.6 * float(free.peak_deflection))
    limited = limits != ActuatorLimits()
    asked = SimulationRequest(0.15, 51, 1e-7 if limited else 3e-8, limits={"tab": limits}, anti_windup=0.0)
    found = simulate(*one(p, loop), manoeuvre, asked)
    exact = followed(_servo_equations(p, loop, manoeuvre, limits), np.zeros(6), (0.06, 0.12, 0.15), found.time)
    if limits.deflection is not None:
        # The servo overshoots its command and meets the stop, of which these equations know nothing.
        touched = int(np.argmax(np.abs(exact[:, 0] + p.trim.state[INDEX][0]) > limits.deflection))
        assert found.held[:, 0].any()
        assert np.abs(found.output("dt")).max() <= limits.deflection
        np.testing.assert_allclose(found.states[:touched], exact[:touched], atol=1e-5 * np.abs(exact).max())
        return
    scale = np.abs(exact).max(axis=0)
    assert np.max(np.abs(found.states - exact) / scale) < (2e-5 if limited else 1e-6)
    if limits.rate is not None:
        assert found.time_at_limit[0, 1] > 0.01
        assert np.abs(found.output("dt_rate")).max() <= limits.rate


@pytest.mark.parametrize("manoeuvre", [step(np.array([0.1])), sine(np.array([0.1]), 20.0)], ids=["step", "sine"])
def test_outputs_are_those_of_the_equations(manoeuvre):
    p = plant("table")
    loop = tab_only(p)
    found = simulate(*one(p, loop), manoeuvre, SimulationRequest(0.1, 26, 1e-7))
    f = _servo_equations(p, loop, manoeuvre, ActuatorLimits())
    exact = followed(f, np.zeros(6), (0.1,), found.time)
    air, J = air_of(p, INDEX), p.model.inertia[INDEX]
    rest = p.trim.state[INDEX]
    torque = []
    for t, y in zip(found.time, exact, strict=True):
        rates = f(t, y)
        M = air(y[0] + rest[0], y[1], y[2] + rest[2], y[3])
        torque.append(J[0, 0] * rates[1] + J[0, 1] * rates[3] - M[0])
    np.testing.assert_allclose(found.output("T_t"), torque, atol=2e-6 * np.abs(torque).max())
    np.testing.assert_allclose(found.output("dt_command"), exact @ -loop.K[INDEX][0] + rest[0], atol=1e-7)
    np.testing.assert_allclose(found.output("T_a"), p.trim.torque[INDEX][1])


def test_estimate_of_the_error_is_one():
    p = plant()
    loop = torque_loop(p)
    manoeuvre = rate_limited_step(np.array([0.1]), 1.0)
    rough = SimulationRequest(0.15, 51, substeps=2, estimate_error=True)
    found = simulate(*one(p, loop), manoeuvre, rough)
    fine = simulate(*one(p, loop), manoeuvre, SimulationRequest(0.15, 51, substeps=32))
    error = np.abs(found.outputs - fine.outputs).max(axis=-2)
    assert np.all(found.substeps == 4)
    assert np.all(error < found.error_estimate)
    assert np.all(found.error_estimate < 60.0 * error + 1e-12)  # 15 times for a method of order four
