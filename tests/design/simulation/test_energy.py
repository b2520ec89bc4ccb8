"""Work in is work out: kinetic energy against the work of actuators, air and what the servo-tab model leaves out."""

import numpy as np
import pytest

from design.lqr.structures import Structure
from design.manoeuvre import doublet, rate_limited_step
from design.simulation.request import Freeplay, SimulationRequest
from design.simulation.simulate import simulate
from model.actuators import Actuator, ActuatorLimits
from tests.design.simulation.simulated_cases import SERVO, one, plant, tab_only, torque_loop

LAG = Actuator(torque_loop_bandwidth=400.0)


@pytest.mark.parametrize("kind", ["thesis", "unsteady"])
@pytest.mark.parametrize("of", ["torques", "lagged", "tab", "first order", "ideal rate"])
def test_balance(kind, of):
    p = plant(kind)
    loops = {
        "torques": lambda: torque_loop(p),
        "lagged": lambda: torque_loop(p, Structure(tab=LAG, aileron=LAG)),
        "tab": lambda: tab_only(p),
        "first order": lambda: tab_only(p, "positive_feedback", actuator=Actuator(SERVO.servo_bandwidth)),
        "ideal rate": lambda: tab_only(p, "positive_feedback", "rate", Actuator()),
    }
    manoeuvre = rate_limited_step(np.array([0.1]), 2.0)
    found = simulate(*one(p, loops[of]()), manoeuvre, SimulationRequest(0.15, 76, 1e-8))
    balance = found.energy
    largest = np.abs(balance.actuators).max() + np.abs(balance.air).max()
    assert np.abs(balance.residual).max() < 1e-6 * largest
    out, back = (sum(getattr(d, name) for d in found.demand) for name in ("energy_out", "energy_back"))
    names = ("tab", "aileron") if of in ("torques", "lagged") else ("tab",)
    net = balance.actuators[-1][: len(names)].sum()
    np.testing.assert_allclose(out - back, net, rtol=1e-9, atol=1e-9 * largest)
    if of in ("torques", "lagged"):
        assert not balance.reaction.any()


def test_balance_of_a_tab_with_freeplay_and_of_limits():
    p = plant()
    asked = SimulationRequest(0.15, 76, 1e-8, freeplay=Freeplay(0.004, 60.0, 0.01))
    found = simulate(*one(p, tab_only(p)), doublet(np.array([0.1]), 0.05), asked)
    largest = np.abs(found.energy.actuators).max() + np.abs(found.energy.air).max()
    assert np.abs(found.energy.residual).max() < 1e-4 * largest
    limits = {"tab": ActuatorLimits(torque=0.02), "aileron": ActuatorLimits(power=0.5)}
    asked = SimulationRequest(0.15, 76, 1e-8, limits=limits)
    found = simulate(*one(p, torque_loop(p)), doublet(np.array([0.05]), 0.05), asked)
    largest = np.abs(found.energy.actuators).max() + np.abs(found.energy.air).max()
    assert np.abs(found.energy.residual).max() < 1e-4 * largest


def test_power_out_and_back_of_a_known_course():
    """Demand of samples against sums over a far finer simulation."""
    p = plant()
    points, loop = one(p, torque_loop(p))
    manoeuvre = doublet(np.array([0.1]), 0.05)
    found = simulate(points, loop, manoeuvre, SimulationRequest(0.15, 151))
    fine = simulate(points, loop, manoeuvre, SimulationRequest(0.15, 12001, substeps=1))
    for i, (torque, rate) in enumerate((("T_t", "dt_rate"), ("T_a", "da_rate"))):
        power = fine.output(torque) * fine.output(rate)
        steps = np.diff(fine.time)
        out = np.sum(np.maximum(0.5 * (power[1:] + power[:-1]), 0.0) * steps)
        demand = found.demand[i]
        np.testing.assert_allclose(demand.energy_out, out, rtol=3e-3)
        np.testing.assert_allclose(demand.peak_power, np.abs(power).max(), rtol=1e-3)
        np.testing.assert_allclose(demand.peak_torque, np.abs(fine.output(torque)).max(), rtol=1e-4)
        np.testing.assert_allclose(demand.peak_rate, np.abs(fine.output(rate)).max(), rtol=5e-5)
