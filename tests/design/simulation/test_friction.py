"""Coulomb friction: exact sticking, break-away, rest off the reference within the band (seed Fig 7.13, 8.1, 8.2)."""

from dataclasses import replace

import numpy as np
import pytest

from design.manoeuvre import ramp, step
from design.simulation.request import Friction, SimulationRequest
from design.simulation.simulate import simulate
from model.motion import required_torque
from tests.design.simulation.simulated_cases import one, plant, tab_only, torque_loop

STATIC, KINETIC = 0.15, 0.1


def test_nothing_moves_before_break_away_and_the_tab_is_deflected_by_then():
    """Fig 7.13: the tab deflects well before the aileron begins to move."""
    p = plant(floating=True)
    points, loop = one(p, tab_only(p))
    asked = SimulationRequest(0.4, 801, friction={"aileron": Friction(STATIC, KINETIC)})
    found = simulate(points, loop, ramp(np.array([0.2])), asked)
    moving = np.abs(found.output("da_rate")) > 0.0
    begin = int(np.argmax(moving))
    assert begin > 5
    np.testing.assert_array_equal(found.output("da")[:begin], found.output("da")[0])
    # The tab's hinge moment on the resting aileron is the break-away torque then.
    by_tab = np.abs(p.model.static_stiffness[1, 2][1, 0] * found.states[:, 0])
    damping = np.abs(p.model.damping[1, 2][1, 0] * found.output("dt_rate"))
    assert by_tab[begin - 1] - damping[begin - 1] < STATIC
    assert by_tab[begin] + damping[begin] > 0.99 * STATIC
    assert np.abs(found.states[begin, 0]) > 0.005


def test_steady_state_error_lies_within_the_band():
    """Fig 8.1, 8.2: without an integral the aileron comes to rest where friction holds it."""
    p = plant(floating=True)
    points, loop = one(p, torque_loop(p))
    friction = {"aileron": Friction(0.2, 0.15)}
    K = loop.K.copy()
    K[:, 4] = 0.0
    flown = replace(loop, K=K)
    found = simulate(points, flown, step(np.array([0.05])), SimulationRequest(0.6, 301, friction=friction))
    free = simulate(points, flown, step(np.array([0.05])), SimulationRequest(0.6, 301))
    error = found.output("da")[-1] - free.output("da")[-1]
    assert found.held[-1, 1] == 1
    assert found.output("da_rate")[-1] == 0.0
    assert np.ptp(found.output("da")[-50:]) == 0.0
    # At rest the torque that is missing to the free loop's rest is borne by friction, less than it can hold.
    stiffness = K[1, 2] - p.model.stiffness[1, 2][1, 1]
    assert abs(error) > 1e-4
    assert abs(stiffness * error) < 1.5 * 0.2


def test_an_integral_hunts_about_its_reference():
    """With break-away above kinetic friction the integral winds up while the aileron sticks, for ever."""
    p = plant(floating=True)
    points, loop = one(p, tab_only(p, K_p=0.5, K_i=6.0))
    friction = {"aileron": Friction(1.0, 0.3)}
    found = simulate(points, loop, step(np.array([0.05])), SimulationRequest(3.0, 601, 1e-4, friction=friction))
    error = found.output("da") - (points.angles[1] + 0.05)
    stuck = found.held[:, 1] == 1
    assert 0.8 < stuck.mean() < 0.99
    for begin in (200, 400):
        late = error[begin : begin + 200]
        assert late.min() < -0.01
        assert late.max() > 0.01
        # Off the reference by less than what friction can hold against the aileron's stiffness.
        assert np.abs(late).max() < 1.5 * 1.0 / abs(p.model.stiffness[1, 2][1, 1])


def test_the_holding_torque_is_what_the_equations_need():
    p = plant(floating=True)
    points, loop = one(p, torque_loop(p))
    friction = {"aileron": Friction(0.3, 0.2), "tab": Friction(0.004, 0.003)}
    found = simulate(points, loop, step(np.array([0.03])), SimulationRequest(0.5, 501, friction=friction))
    total = np.stack([found.output(name) for name in ("dt", "dt_rate", "da", "da_rate")], axis=-1)
    stuck = (found.held == 1).all(axis=-1)
    assert stuck.any()
    condition = p.condition.take((1, 2))
    needed = required_torque(p.system, condition, p.trim.alpha[1, 2], total[stuck], np.zeros(2))
    given = np.stack([found.output("T_t")[stuck], found.output("T_a")[stuck]], axis=-1)
    assert np.all(np.abs(needed - given) <= np.array([0.004, 0.3]) * (1.0 + 1e-6))
    assert np.all(found.output("da_rate")[found.held[:, 1] == 1] == 0.0)


def test_a_block_with_friction_against_the_closed_form():
    """Without air a ramped torque breaks an inertia away; it then follows ``J d'' = T - kinetic``."""
    p = plant(floating=True)
    points, loop = one(p, torque_loop(p))
    model = points.model
    quiet = replace(
        points, load=np.zeros(()), gradient=np.zeros((2, 2)),
        model=replace(model, stiffness=np.zeros((2, 2)), damping=np.zeros((2, 2))),
    )  # fmt: skip
    A = loop.A.copy()
    A[[1, 3], :] = 0.0
    K, N, E = np.zeros_like(loop.K), np.zeros_like(loop.N), np.zeros_like(loop.E)
    N[1, 0] = 1.0  # the reference is the torque of the aileron
    flown = replace(loop, A=A, K=K, N=N, E=E)
    # A tab of more friction than it feels: the aileron is alone with J_aa.
    friction = {"aileron": Friction(0.5, 0.3), "tab": Friction(10.0, 10.0)}
    T0 = float(model.input_offset[1])
    assert abs(T0) < 1e-9
    slope = 2.0
    asked = SimulationRequest(0.3, 301, substeps=4, friction=friction)
    found = simulate(quiet, flown, ramp(np.array([slope])), asked)
    away, J = 0.5 / slope, float(model.inertia[1, 1])
    t = np.maximum(found.time - away, 0.0)
    exact = (0.5 * slope * t**2 + (0.5 - 0.3) * t) / J
    late = 0.001 / 4 * 0.2 / J  # break-away is noticed at the end of a step
    assert np.abs(found.output("da_rate") - exact).max() < 1.5 * late
    assert np.all(found.output("dt_rate") == 0.0)


def test_friction_stops_a_swing_exactly_between_two_steps():
    """The rate comes to zero within a step; sticking leaves exactly zero, and steps of another length agree."""
    p = plant(floating=True)
    points, loop = one(p, torque_loop(p))
    friction = {"aileron": Friction(0.4, 0.4), "tab": Friction(0.01, 0.01)}
    at_rest = []
    for substeps in (4, 8, 16):
        asked = SimulationRequest(0.4, 201, substeps=substeps, friction=friction)
        found = simulate(points, loop, step(np.array([0.05])), asked)
        assert np.isfinite(found.outputs).all()
        at_rest.append(found.output("da"))
    assert np.abs(at_rest[2] - at_rest[1]).max() < 1e-4
    assert np.abs(at_rest[2] - at_rest[1]).max() < np.abs(at_rest[1] - at_rest[0]).max() + 1e-6


@pytest.mark.parametrize("kind", ["torque", "tab"])
def test_friction_takes_energy_and_the_balance_holds(kind):
    p = plant(floating=True)
    points, loop = one(p, torque_loop(p) if kind == "torque" else tab_only(p))
    friction = {"aileron": Friction(0.05, 0.04), "tab": Friction(0.003, 0.002)}
    found = simulate(points, loop, step(np.array([0.1])), SimulationRequest(0.3, 301, 1e-8, friction=friction))
    assert found.energy.friction[-1] < 0.0
    assert np.all(np.diff(found.energy.friction) <= 1e-9)
    assert np.abs(found.energy.residual).max() < 1e-3 * np.abs(found.energy.friction[-1])


def test_friction_that_cannot_be():
    for static, kinetic in ((0.1, 0.2), (-0.1, -0.1), (float("inf"), 0.1)):
        with pytest.raises(ValueError, match="friction"):
            Friction(static, kinetic)
