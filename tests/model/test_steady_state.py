from dataclasses import dataclass, replace

import numpy as np
import pytest

from model import examples
from model.actuators import ActuatorLimits
from model.hinge_moments.expansion import HingeMoments, every_angle
from model.hinge_moments.interpolant import fit_interpolant
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
from model.motion import required_torque
from model.steady_state import deflection_map, float_line, steady_state_map, tab_line, tab_only_equilibrium

ALPHA = float(np.deg2rad(5.0))
AILERON = np.deg2rad(np.linspace(-12.0, 12.0, 7))
TAB = np.deg2rad(np.linspace(-15.0, 15.0, 11))
LIMITS = ActuatorLimits(deflection=float(np.deg2rad(25.0)), torque=0.08)


@dataclass(frozen=True)
class Plain:
    """A linear source of given derivatives [[C_Ht,dt, C_Ht,da], [C_Ha,dt, C_Ha,da]], known for small tab angles."""

    derivatives: tuple[tuple[float, float], tuple[float, float]]
    known_tab: float = np.inf
    domain = "small tab angles"

    def at(self, alpha, dt, da):
        alpha, dt, da = np.broadcast_arrays(*(np.asarray(v, float) for v in (alpha, dt, da)))
        K = np.array(self.derivatives)
        value = np.stack([dt, da], axis=-1) @ K.T
        gradient = np.concatenate([np.zeros((2, 1)), K], axis=-1)
        return HingeMoments(value, np.broadcast_to(gradient, (*alpha.shape, 2, 3)))

    def covers(self, alpha, dt, da):
        return every_angle(alpha, dt, da) & (np.abs(dt) <= self.known_tab)


def with_source(source):
    tunnel = examples.wind_tunnel_23012()
    return replace(tunnel, aerodynamics=replace(tunnel.aerodynamics, source=source))


@pytest.fixture(scope="module")
def xfoil():
    """Hinge moments of NACA 23012 by Xfoil, interpolated smoothly: known to 20 degrees."""
    return with_source(fit_interpolant(xfoil_naca23012(), "cubic"))


@pytest.fixture(params=["thin_aerofoil", "polynomial", "xfoil"])
def system(request, polynomial_system, xfoil):
    if request.param == "thin_aerofoil":
        return examples.wind_tunnel_23012()
    return polynomial_system if request.param == "polynomial" else xfoil


def coefficients(system, dt, da):
    return system.aerodynamics.source.at(ALPHA, dt, da).value


def test_map_is_the_torque_that_holds_each_pair_of_angles(system, grid):
    found = deflection_map(system, grid.condition, ALPHA, AILERON, TAB)
    assert found.torque.shape == found.coefficients.shape == (*grid.shape, 7, 11, 2)
    for m, n in ((0, 0), (3, 10), (6, 4)):
        state = np.array([TAB[n], 0.0, AILERON[m], 0.0])
        held = required_torque(system, grid.condition, ALPHA, state, np.zeros(2))
        np.testing.assert_allclose(found.torque[..., m, n, :], held, rtol=1e-13)
        np.testing.assert_allclose(found.total_torque[..., m, n], np.hypot(held[..., 0], held[..., 1]), rtol=1e-13)
    load = grid.condition.dynamic_pressure * 0.6**2 * 0.8
    np.testing.assert_allclose(found.torque, load[..., None, None, None] * found.coefficients, rtol=1e-13)
    assert np.all(found.covered)
    assert (found.aileron, found.tab) == (tuple(AILERON), tuple(TAB))


def test_map_holds_the_compressibility_and_the_incidence_of_each_point(grid):
    system, alpha = examples.airliner_aileron(), np.linspace(0.0, 0.1, 4)
    found = deflection_map(system, grid.condition, alpha, AILERON, TAB)
    value = system.aerodynamics.source.at(alpha[2], TAB[4], AILERON[1]).value
    factor = 1.0 / np.sqrt(1.0 - grid.condition.mach[:, 2] ** 2)
    np.testing.assert_allclose(found.coefficients[:, 2, 1, 4], factor[:, None] * value, rtol=1e-13)


def test_lines_are_where_the_torques_vanish(system, grid):
    for rule, row in (("zero_aileron_torque", 1), ("zero_tab_torque", 0)):
        line = tab_line(system, grid.condition, ALPHA, AILERON, rule)
        assert line.reached.shape == (*grid.shape, 7)
        assert np.all(line.reached)
        np.testing.assert_array_equal(line.torque[..., row], 0.0)
        left = coefficients(system, line.state[..., 0], line.state[..., 2])[..., row]
        assert np.max(np.abs(left)) < 1e-15
        np.testing.assert_array_equal(line.state[..., 2], np.broadcast_to(AILERON, line.reached.shape))


def test_lines_of_the_linear_source_are_its_closed_forms(grid):
    source = examples.wind_tunnel_23012().aerodynamics.source
    constant, K = source.offset + source.gradient[:, 0] * ALPHA, source.gradient[:, 1:]
    expected = {
        "zero_aileron_torque": -(constant[1] + K[1, 1] * AILERON) / K[1, 0],
        "zero_tab_torque": -(constant[0] + K[0, 1] * AILERON) / K[0, 0],
        "least_torque": -((constant + K[:, 1] * AILERON[:, None]) @ K[:, 0]) / (K[:, 0] @ K[:, 0]),
    }
    for rule, tab in expected.items():
        line = tab_line(examples.wind_tunnel_23012(), grid.condition, ALPHA, AILERON, rule)
        np.testing.assert_allclose(line.state[..., 0], np.broadcast_to(tab, (*grid.shape, 7)), rtol=1e-12)


def test_least_torque_lies_in_the_valley_of_the_map(system, grid):
    fine = np.linspace(-1.5, 1.5, 1201)
    line = tab_line(system, grid.condition, ALPHA, AILERON, "least_torque")
    size = np.sqrt(np.sum(line.torque**2, axis=-1))
    plane = deflection_map(system, grid.condition, ALPHA, AILERON, fine).total_torque
    assert np.all(line.reached)
    assert np.all(size <= plane.min(axis=-1) * (1 + 1e-12))
    # The nearest of the fine angles is at most half a step away, where a torque has changed by its slope times that.
    slack = 0.2 * 0.5 * (fine[1] - fine[0]) * 0.6**2 * 0.8 * grid.condition.dynamic_pressure
    assert np.all(plane.min(axis=-1) - size <= slack[..., None])


def test_float_is_the_inverse_of_the_line_of_zero_aileron_torque(system, grid):
    line = tab_line(system, grid.condition, ALPHA, AILERON, "zero_aileron_torque")
    back = float_line(system, grid.condition, ALPHA, line.state[0, 0, :, 0])
    assert np.all(back.trim.reached)
    np.testing.assert_allclose(back.trim.state[..., 2], np.broadcast_to(AILERON, back.gain.shape), atol=1e-12)


def test_gain_is_the_slope_of_the_float(system, tunnel_condition):
    step = 1e-5
    line = float_line(system, tunnel_condition, ALPHA, 0.8 * TAB)
    up, down = (float_line(system, tunnel_condition, ALPHA, 0.8 * TAB + d).trim.state[..., 2] for d in (step, -step))
    # An interpolant's curvature jumps at the levels of its table: the difference there is good to a step.
    np.testing.assert_allclose(line.gain, (up - down) / (2.0 * step), rtol=1e-5)
    assert np.all(line.stable)


def test_float_of_a_section_without_stiffness_is_flagged(tunnel_condition):
    line = float_line(with_source(Plain(((0.01, 0.006), (0.12, -0.06)))), tunnel_condition, 0.0, TAB)
    assert np.all(line.trim.reached)
    assert not np.any(line.stable)
    np.testing.assert_allclose(line.gain, 2.0)
    none = float_line(with_source(Plain(((0.01, 0.006), (0.12, 0.0)))), tunnel_condition, 0.0, TAB)
    assert np.all(np.isnan(none.gain))
    np.testing.assert_array_equal(none.trim.reached, np.abs(TAB) < 1e-12)


def test_tab_only_equilibrium_and_its_limits(system, grid):
    found = tab_only_equilibrium(system, grid.condition, ALPHA, AILERON, LIMITS)
    trim = found.line.trim
    torque = trim.torque[..., 0]
    line = grid.condition.take((..., None))
    np.testing.assert_allclose(torque, required_torque(system, line, ALPHA, trim.state, np.zeros(2))[..., 0])
    np.testing.assert_array_equal(found.holds, trim.reached & (np.abs(torque) <= 0.08))
    assert np.any(found.holds)
    assert not np.all(found.holds)
    free = tab_only_equilibrium(system, grid.condition, ALPHA, AILERON)
    np.testing.assert_array_equal(free.holds, free.line.trim.reached)


def test_angles_beyond_the_deflection_limit_are_not_reached(grid):
    system, narrow = examples.wind_tunnel_23012(), ActuatorLimits(deflection=float(np.deg2rad(5.0)))
    found = tab_only_equilibrium(system, grid.condition, ALPHA, AILERON, narrow)
    wide = tab_only_equilibrium(system, grid.condition, ALPHA, AILERON)
    needed = np.abs(wide.line.trim.state[..., 0])
    np.testing.assert_array_equal(found.holds, needed <= np.deg2rad(5.0))
    assert np.any(needed > np.deg2rad(5.0))


def test_everything_at_once_equals_its_parts(system, grid):
    whole = steady_state_map(system, grid.condition, ALPHA, AILERON, TAB, LIMITS, LIMITS)
    line = tab_line(system, grid.condition, ALPHA, AILERON, "least_torque", LIMITS.deflection)
    np.testing.assert_array_equal(whole.least_torque.state, line.state)
    for rule in ("zero_aileron_torque", "zero_tab_torque"):
        line = tab_line(system, grid.condition, ALPHA, AILERON, rule, LIMITS.deflection)
        np.testing.assert_array_equal(getattr(whole, rule).state, line.state)
    floating = float_line(system, grid.condition, ALPHA, TAB, LIMITS.deflection)
    np.testing.assert_array_equal(whole.floating.trim.state, floating.trim.state)
    assert whole.reachable.reached.shape == whole.free.reached.shape == grid.shape


def test_both_lines_cross_where_both_surfaces_are_free(grid):
    system = examples.wind_tunnel_23012()
    free = steady_state_map(system, grid.condition, ALPHA, AILERON, TAB).free
    assert np.all(free.reached)
    at = free.state[0, 0, 2]
    for rule in ("zero_aileron_torque", "zero_tab_torque"):
        line = tab_line(system, grid.condition, ALPHA, np.array([at]), rule)
        np.testing.assert_allclose(line.state[..., 0, 0], free.state[..., 0], rtol=1e-11)


def test_batched_equals_single(system, grid):
    whole = steady_state_map(system, grid.condition, ALPHA, AILERON, TAB, LIMITS, LIMITS)
    for index in ((0, 0), (2, 3), (4, 1)):
        point = whole.take(index)
        single = steady_state_map(system, grid.condition.take(index), ALPHA, AILERON, TAB, LIMITS, LIMITS)
        np.testing.assert_allclose(point.deflections.torque, single.deflections.torque, rtol=1e-13)
        for name in ("zero_aileron_torque", "zero_tab_torque", "least_torque", "free"):
            np.testing.assert_array_equal(getattr(point, name).state, getattr(single, name).state)
        np.testing.assert_array_equal(point.floating.gain, single.floating.gain)
        for end in ("lower", "upper"):
            a, b = getattr(point.reachable, end), getattr(single.reachable, end)
            np.testing.assert_allclose([a.aileron, a.tab], [b.aileron, b.tab], rtol=1e-12)
            assert a.limit == b.limit.item()


def test_incidence_may_vary_over_the_grid(system, grid):
    alpha = np.linspace(0.02, 0.1, 4)
    lines = tab_line(system, grid.condition, alpha, AILERON, "zero_aileron_torque")
    for j in range(4):
        single = tab_line(system, grid.condition.take((1, j)), float(alpha[j]), AILERON, "zero_aileron_torque")
        np.testing.assert_array_equal(lines.state[1, j], single.state)


def test_angles_the_source_does_not_know_are_marked(tunnel_condition):
    narrow = with_source(Plain(((0.01, 0.006), (0.12, 0.08)), known_tab=0.1))
    found = deflection_map(narrow, tunnel_condition, 0.0, AILERON, TAB)
    np.testing.assert_array_equal(found.covered, np.broadcast_to(np.abs(TAB) <= 0.1, (7, 11)))
    line = tab_line(narrow, tunnel_condition, 0.0, AILERON, "zero_aileron_torque")
    np.testing.assert_array_equal(line.reached, np.abs(AILERON) * 0.08 / 0.12 <= 0.1)
    assert line.reason[0].endswith("hinge moments are known for small tab angles")
