"""A dead band between the tab and its actuator: lost motion, and what the air makes of a tab that is loose."""

from dataclasses import replace

import numpy as np
import pytest

from design.manoeuvre import sine, step
from design.simulation.freeplay import link_torque, trim_stretch
from design.simulation.request import Freeplay, Friction, SimulationRequest
from design.simulation.simulate import simulate
from tests.design.simulation.simulated_cases import one, plant, tab_only, torque_loop

GAP = Freeplay(0.02, 80.0, 0.01)


def test_a_loose_tab_rests_against_its_load():
    p = plant()
    points, loop = one(p, tab_only(p, K_i=8.0))
    asked = SimulationRequest(1.0, 201, 1e-4, freeplay=GAP)
    found = simulate(points, loop, step(np.array([0.05])), asked)
    stretch, torque = found.output("dt_actuator") - found.output("dt"), found.output("T_t")
    loose = np.abs(stretch) <= 0.5 * GAP.gap
    assert np.all(torque[loose] == 0.0)
    # At rest the link bears the hinge moment of the tab, on the side to which the air presses it.
    angles = np.array([found.output("dt")[-1], found.output("da")[-1]]) - points.angles
    air = -points.load * (points.value[0] + points.gradient[0] @ angles)
    np.testing.assert_allclose(torque[-1], -air, rtol=2e-3)
    np.testing.assert_allclose(stretch[-1], trim_stretch(GAP, torque[-1]), rtol=1e-5)
    # The integral sees to the aileron all the same.
    np.testing.assert_allclose(found.output("da")[-1], 0.05, atol=1e-4)


def test_lost_motion_of_a_tab_that_the_air_does_not_load():
    """With the tab floating at trim its actuator moves half the gap before the link bears."""
    p = plant(floating=True)
    points, loop = one(p, tab_only(p))
    torque = float(points.model.input_offset[0])
    found = simulate(points, loop, sine(np.array([0.1]), 10.0), SimulationRequest(0.8, 401, 1e-4, freeplay=GAP))
    stretch = found.output("dt_actuator") - found.output("dt")
    loose = np.abs(stretch) < 0.5 * GAP.gap * (1 - 1e-9)
    np.testing.assert_allclose(stretch[0], trim_stretch(GAP, np.array(torque)), atol=1e-15)
    assert loose.any()
    assert (~loose).any()
    assert np.all(found.output("T_t")[loose] == 0.0)
    assert np.abs(stretch).max() < 0.5 * GAP.gap + 2.0 * np.abs(found.output("T_t")).max() / GAP.stiffness


def test_a_limit_cycle_grows_with_the_gap_alone():
    """About a rest without load everything scales with the gap: the cycle of twice the gap is twice as large."""
    p = plant("quasi_steady", floating=True)
    points, loop = one(p, tab_only(p, K_p=1.0, K_d=0.0, K_i=10.0))
    model = points.model
    free = replace(points, model=replace(model, input_offset=np.zeros(2)))
    sizes = []
    for gap in (0.004, 0.008):
        asked = SimulationRequest(0.6, 301, 1e-5, freeplay=Freeplay(gap, 60.0, 0.005))
        found = simulate(free, loop, step(np.array([10.0 * gap])), asked)
        sizes.append(found.states / gap)
    np.testing.assert_allclose(sizes[0], sizes[1], atol=1e-6 * np.abs(sizes[0]).max())


def test_a_loop_that_is_stable_without_gap_ends_in_a_limit_cycle_with_it():
    """Loose and without load the tab has its own way: a swing of a few gaps that neither dies nor grows."""
    p = plant("quasi_steady", floating=True)
    points, loop = one(p, tab_only(p, K_p=1.0, K_d=0.0, K_i=10.0))
    free = replace(points, model=replace(points.model, input_offset=np.zeros(2)))
    swings = {}
    for gap in (0.0, 0.004):
        asked = SimulationRequest(2.0, 401, 1e-4, freeplay=Freeplay(gap, 20.0))
        found = simulate(free, loop, step(np.array([0.04])), asked)
        swings[gap] = [np.ptp(found.output("da")[k : k + 60]) for k in (40, 220, 340)]
    assert swings[0.0][2] < 0.05 * swings[0.0][0]
    assert 0.97 < swings[0.004][2] / swings[0.004][1] < 1.03
    assert 2.0 * 0.004 < swings[0.004][2] < 10.0 * 0.004


def test_link_torque():
    stretch = np.array([-0.03, -0.01, 0.0, 0.009, 0.02])
    np.testing.assert_allclose(link_torque(GAP, stretch, np.zeros(5)), 80.0 * np.array([-0.02, 0.0, 0.0, 0.0, 0.01]))
    np.testing.assert_allclose(link_torque(GAP, stretch, np.ones(5))[[0, 4]], [-1.59, 0.81])
    for torque in (0.3, -0.3, 0.0):
        np.testing.assert_allclose(link_torque(GAP, trim_stretch(GAP, np.array([torque])), np.zeros(1)), torque)


def test_freeplay_that_cannot_be():
    for wrong in ((-1.0, 1.0), (0.1, 0.0), (0.1, 1.0, -1.0)):
        with pytest.raises(ValueError, match="freeplay"):
            Freeplay(*wrong)
    p = plant()
    with pytest.raises(ValueError, match="commanded"):
        simulate(*one(p, torque_loop(p)), step(np.zeros(1)), SimulationRequest(0.1, freeplay=GAP))
    friction = {"tab": Friction(0.1, 0.1)}
    with pytest.raises(ValueError, match="not simulated"):
        simulate(*one(p, tab_only(p)), step(np.zeros(1)), SimulationRequest(0.1, freeplay=GAP, friction=friction))
