"""Limits of actuators: stops, rates, torques and powers are kept, and nothing is lost where they are met."""

import numpy as np
import pytest

from design.lqr.structures import Structure
from design.manoeuvre import doublet, step
from design.simulation.anti_windup import anti_windup_gain
from design.simulation.request import SimulationRequest
from design.simulation.simulate import simulate
from model.actuators import Actuator, ActuatorLimits
from tests.design.simulation.simulated_cases import SERVO, one, plant, tab_only, torque_loop

LAG = Actuator(torque_loop_bandwidth=400.0)
AGGRESSIVE = {"K_p": 1.0, "K_d": 0.03, "K_i": 10.0}


@pytest.mark.parametrize(
    ("kind", "command", "actuator"),
    [
        ("negative_feedback", "deflection", SERVO),
        ("negative_feedback", "rate", SERVO),
        ("positive_feedback", "deflection", Actuator(SERVO.servo_bandwidth)),
        ("positive_feedback", "rate", Actuator()),
    ],
)
def test_tab_loops_keep_their_limits(kind, command, actuator):
    p = plant()
    loop = tab_only(p, kind, command, actuator, **AGGRESSIVE)
    limits = ActuatorLimits(deflection=0.03, rate=0.7)
    asked = SimulationRequest(0.4, 201, limits={"tab": limits})
    found = simulate(p.nonlinear, loop, doublet(np.array([0.2]), 0.15), asked)
    assert np.isfinite(found.outputs).all()
    assert np.isfinite(found.states).all()
    assert np.all(found.codes == "completed")
    assert np.abs(found.output("dt")).max() <= limits.deflection
    assert np.abs(found.output("dt_rate")).max() <= limits.rate * (1.0 + 1e-12)
    assert np.all(found.demand[0].peak_deflection <= limits.deflection)
    assert np.all(found.demand[0].peak_rate <= limits.rate * (1.0 + 1e-12))
    assert np.all(found.time_at_limit[..., 0, 0] > 0.05)  # the deflection
    assert np.all(found.at_limit[..., 0, 1].any(axis=-1))  # the rate


@pytest.mark.parametrize("structure", [Structure(), Structure(tab=LAG, aileron=LAG)], ids=["ideal", "lagged"])
def test_torque_loops_keep_their_limits(structure):
    p = plant(floating=True)
    loop = torque_loop(p, structure)
    limits = {
        "tab": ActuatorLimits(deflection=0.1, rate=2.0, torque=0.05, power=0.06),
        "aileron": ActuatorLimits(deflection=0.12, rate=1.5, torque=1.5, power=1.5),
    }
    found = simulate(p.nonlinear, loop, doublet(np.array([0.1]), 0.15), SimulationRequest(0.4, 201, limits=limits))
    assert np.isfinite(found.outputs).all()
    assert np.all(found.codes == "completed")
    reached = set()
    for i, (name, angle, torque) in enumerate((("tab", "dt", "T_t"), ("aileron", "da", "T_a"))):
        assert np.abs(found.output(angle)).max() <= limits[name].deflection * (1.0 + 1e-15)
        assert np.abs(found.output(f"{angle}_rate")).max() <= limits[name].rate * (1.0 + 1e-12)
        governed = found.held[..., i] >= 4
        driving = np.where(governed, 0.0, np.abs(found.output(torque)))
        assert driving.max() <= limits[name].torque * (1.0 + 1e-12)
        reached |= {(name, k) for k in range(4) if found.at_limit[..., i, k].any()}
    assert len(reached) >= 5
    assert found.held.max() >= 4


def test_a_stop_is_inelastic_and_takes_the_energy():
    p = plant(floating=True)
    loop = torque_loop(p)
    limits = {"aileron": ActuatorLimits(deflection=float(np.abs(p.trim.state[1, 2, 2])) + 0.05)}
    points, flown = one(p, loop)
    asked = SimulationRequest(0.1, 2001, limits=limits)
    found = simulate(points, flown, step(np.array([0.1])), asked)
    hit = int(np.argmax(found.held[:, 1] == 2))
    assert hit > 0
    before, after = found.output("da_rate")[hit - 1], found.output("da_rate")[hit]
    assert before > 0.5
    assert after == 0.0
    assert found.output("da")[hit] == limits["aileron"].deflection
    assert found.energy.stops[hit] > 0.0
    # The tab goes on: nothing but the stop's impulse on the aileron changed its rate.
    J = p.model.inertia[1, 2]
    change = found.output("dt_rate")[hit] - found.output("dt_rate")[hit - 1]
    assert change == pytest.approx(J[0, 1] / J[0, 0] * before, rel=0.1)
    np.testing.assert_allclose(found.energy.residual, 0.0, atol=2e-3 * found.energy.kinetic.max())


def test_a_servo_of_little_torque_is_late():
    p = plant()
    points, loop = one(p, tab_only(p, **AGGRESSIVE))
    manoeuvre = step(np.array([0.1]))
    free = simulate(points, loop, manoeuvre, SimulationRequest(0.2, 101))
    most = 0.6 * float(free.demand[0].peak_torque)
    for limits in (ActuatorLimits(torque=most), ActuatorLimits(power=0.4 * float(free.demand[0].peak_power))):
        found = simulate(points, loop, manoeuvre, SimulationRequest(0.2, 101, limits={"tab": limits}))
        what = 2 if limits.torque else 3
        assert found.time_at_limit[0, what] > 0.001
        limit = limits.torque or limits.power
        assert found.demand[0].peak_torque <= limit * (1 + 1e-9) if limits.torque else True
        assert found.demand[0].peak_power <= limit * (1 + 1e-9) if limits.power else True
        assert not np.allclose(found.output("dt"), free.output("dt"), atol=1e-4)
        assert np.abs(found.energy.residual).max() < 1e-4 * found.energy.kinetic.max()


def test_a_drive_without_acceleration_says_what_it_is_not_held_to():
    p = plant()
    points, loop = one(p, tab_only(p, "positive_feedback", "rate", Actuator()))
    limits = ActuatorLimits(torque=1e-4, power=1e-6)
    found = simulate(points, loop, step(np.array([0.1])), SimulationRequest(0.2, 101, limits={"tab": limits}))
    assert found.unenforced == ("tab torque", "tab power")
    # Of an aileron that nothing drives only the stops are there.
    servo, limits = one(p, tab_only(p))[1], {"aileron": ActuatorLimits(deflection=0.3, torque=5.0)}
    assert simulate(points, servo, step(np.array([0.1])), SimulationRequest(0.01, limits=limits)).unenforced == (
        "aileron torque",
    )
    assert found.time_at_limit[0, 2] > 0.05
    with pytest.raises(ValueError, match="moves at any rate"):
        simulate(*one(p, tab_only(p, actuator=Actuator())), step(np.array([0.1])), SimulationRequest(0.2))


@pytest.mark.parametrize("kind", ["torque", "tab"])
def test_anti_windup_reduces_overshoot(kind):
    p = plant(floating=True)
    if kind == "tab":
        loop = tab_only(p, **AGGRESSIVE)
        limits = {"tab": ActuatorLimits(rate=0.15)}
    else:
        loop = torque_loop(p)
        limits = {"aileron": ActuatorLimits(rate=0.4)}
    points, flown = one(p, loop)
    size = 0.1

    def overshoot(rate):
        asked = SimulationRequest(1.2, 301, limits=limits, anti_windup=rate)
        found = simulate(points, flown, step(np.array([size])), asked)
        assert found.codes[()] == "completed"
        return (found.output("da") - points.angles[1]).max() / size - 1.0, found

    without, _ = overshoot(0.0)
    ruled, found = overshoot(None)
    assert without > 0.05
    assert ruled < 0.6 * without
    gain = anti_windup_gain(flown, None)
    np.testing.assert_array_equal(found.anti_windup_gain, gain)
    speed = np.abs(np.linalg.eigvals(flown.closed)).min()
    np.testing.assert_allclose(gain @ -flown.K[:, [flown.states.index("int_a")]], speed, rtol=1e-12)


def test_requests_that_cannot_be():
    for wrong in (
        {"duration": 0.0}, {"samples": 1}, {"tolerance": 0.0}, {"substeps": 0}, {"anti_windup": -1.0},
        {"limits": {"rudder": ActuatorLimits()}}, {"limits": {"tab": ActuatorLimits(rate=-1.0)}},
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r".+"):
            SimulationRequest(**{"duration": 1.0, **wrong})
    p = plant()
    points, loop = one(p, torque_loop(p))
    with pytest.raises(ValueError, match="references r_a"):
        simulate(points, loop, step(np.zeros(2)), SimulationRequest(1.0))
    with pytest.raises(ValueError, match="over a grid"):
        simulate(p.nonlinear, loop, step(np.zeros(1)), SimulationRequest(1.0))
