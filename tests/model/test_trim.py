from dataclasses import dataclass

import numpy as np
import pytest

from model import examples
from model.aerodynamics import Aerodynamics
from model.hinge_moments.expansion import HingeMoments, every_angle
from model.motion import acceleration
from model.system import TabAileron
from model.trim import LARGEST_TRIM_ANGLE, HeldTorque, TrimRequest, trim


@dataclass(frozen=True)
class SaturatingSource:
    """The tab's hold on the aileron saturates: it can never balance an offset above `power`."""

    offset: float
    power: float = 0.05

    def at(self, alpha, dt, da):
        alpha, dt, da = np.broadcast_arrays(*(np.asarray(v, float) for v in (alpha, dt, da)))
        aileron = self.offset + self.power * np.tanh(2.0 * dt) + 0.08 * da
        slope = 2.0 * self.power / np.cosh(2.0 * dt) ** 2
        zero = np.zeros_like(dt)
        rows = [[zero, zero + 0.01, zero], [zero, slope, zero + 0.08]]
        gradient = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
        return HingeMoments(np.stack([0.01 * dt, aileron], axis=-1), gradient)

    def covers(self, alpha, dt, da):
        return every_angle(alpha, dt, da)

    domain = "every angle"


def with_source(source):
    tunnel = examples.wind_tunnel()
    return TabAileron(tunnel.geometry, tunnel.inertia, Aerodynamics(source))


def test_torques_hold_the_angles_still(example, grid):
    result = trim(example, grid.condition, TrimRequest(0.08, aileron=0.1, tab=-0.05))
    np.testing.assert_array_equal(result.state, np.broadcast_to([-0.05, 0.0, 0.1, 0.0], (*grid.shape, 4)))
    np.testing.assert_array_equal(result.residual, np.zeros(grid.shape))
    np.testing.assert_array_equal(result.alpha, np.full(grid.shape, 0.08))
    assert np.all(result.reached)
    still = acceleration(example, grid.condition, result.alpha, result.state, result.torque)
    stirred = acceleration(example, grid.condition, result.alpha, result.state, np.zeros(2))
    assert np.max(np.abs(still)) < 1e-11 * np.max(np.abs(stirred))


def test_torques_are_the_hinge_moments_times_the_load(grid):
    system = examples.wind_tunnel()
    result = trim(system, grid.condition, TrimRequest(0.08, aileron=0.1, tab=-0.05))
    C_H = system.aerodynamics.source.at(0.08, -0.05, 0.1).value
    load = grid.condition.dynamic_pressure * 0.6**2 * 0.8
    np.testing.assert_allclose(result.torque, load[..., None] * C_H, rtol=1e-13)


def test_tab_can_carry_the_aileron(example, grid):
    result = trim(example, grid.condition, TrimRequest(0.05, aileron=0.1, tab="zero_aileron_torque"))
    moments = example.aerodynamics.source.at(0.05, result.state[..., 0], 0.1)
    assert np.all(result.reached)
    np.testing.assert_array_equal(result.torque[..., 1], 0.0)
    assert np.max(np.abs(moments.value[..., 1])) < 1e-16
    load = grid.condition.dynamic_pressure * example.geometry.chord**2 * example.geometry.span
    assert np.all(result.residual < 1e-14 * load)


def test_linear_tab_angle_is_the_closed_form(grid):
    system = examples.wind_tunnel_23012()
    source = system.aerodynamics.source
    result = trim(system, grid.condition, TrimRequest(0.05, aileron=0.1, tab="zero_aileron_torque"))
    by_alpha, by_tab, by_aileron = source.gradient[1]
    expected = -(source.offset[1] + by_alpha * 0.05 + by_aileron * 0.1) / by_tab
    np.testing.assert_allclose(result.state[..., 0], expected, rtol=1e-13)


def test_nonlinear_source_is_solved(grid, polynomial_system):
    result = trim(polynomial_system, grid.condition, TrimRequest(0.1, aileron=-0.3, tab="zero_aileron_torque"))
    value = polynomial_system.aerodynamics.source.at(0.1, result.state[..., 0], -0.3).value
    assert np.all(result.reached)
    assert np.max(np.abs(value[..., 1])) < 1e-15
    assert abs(result.state[0, 0, 0]) > 0.05


@pytest.mark.parametrize("offset", [0.02, 0.049])
def test_saturating_tab_is_solved_while_it_can(grid, offset):
    result = trim(with_source(SaturatingSource(offset)), grid.condition, TrimRequest(0.0, 0.0, "zero_aileron_torque"))
    assert np.all(result.reached)
    np.testing.assert_allclose(result.state[..., 0], -np.arctanh(offset / 0.05) / 2.0, rtol=1e-10)


@pytest.mark.parametrize("source", [SaturatingSource(0.08), SaturatingSource(0.02, 0.0), SaturatingSource(-0.08)])
def test_unreachable_trim_is_flagged_with_what_is_left(grid, source):
    system = with_source(source)
    result = trim(system, grid.condition, TrimRequest(0.0, 0.0, "zero_aileron_torque"))
    assert not np.any(result.reached)
    assert np.all(np.isfinite(result.state))
    assert np.all(np.abs(result.state[..., 0]) <= LARGEST_TRIM_ANGLE)
    load = grid.condition.dynamic_pressure * 0.6**2 * 0.8
    left = source.at(0.0, result.state[..., 0], 0.0).value[..., 1]
    np.testing.assert_allclose(result.residual, load * np.abs(left), rtol=1e-12)
    assert np.all(np.abs(left) > 0.01)


def test_linear_tab_angle_beyond_a_right_angle_is_no_trim(grid):
    result = trim(examples.wind_tunnel(), grid.condition, TrimRequest(1.5, -1.5, "zero_aileron_torque"))
    assert not np.any(result.reached)
    assert np.all(result.residual > 0)


def balanced(system, condition, result):
    """Torques really needed at the angles of a trim, over the load (*G, 2) [-]."""
    factor = system.aerodynamics.amplification(condition.mach)[..., None]
    return factor * system.aerodynamics.source.at(result.alpha, result.state[..., 0], result.state[..., 2]).value


def load_of(system, condition):
    return condition.dynamic_pressure * system.geometry.chord**2 * system.geometry.span


RULES = {
    "zero tab torque": TrimRequest(0.05, 0.1, "zero_tab_torque"),
    "floating aileron": TrimRequest(0.05, "zero_aileron_torque", 0.1),
    "held tab torque": TrimRequest(0.05, 0.02, HeldTorque("tab", 0.05), 1.4),
    "held aileron torque, by the tab": TrimRequest(0.05, 0.02, HeldTorque("aileron", -0.7), 1.5),
    "held aileron torque, by the aileron": TrimRequest(0.05, HeldTorque("aileron", 0.4), 0.03, 1.5, 1.5),
    "aileron where the tab is free": TrimRequest(0.02, HeldTorque("tab"), 0.03),
    "both free": TrimRequest(0.05, "zero_aileron_torque", "zero_tab_torque"),
    "both held": TrimRequest(0.05, HeldTorque("aileron", 0.3), HeldTorque("tab", -0.02), 1.5, 1.5),
}


# The polynomial source has no free pair of angles below 77 degrees.
@pytest.mark.parametrize(
    ("source", "rule"),
    [("thin_aerofoil", rule) for rule in RULES] + [("polynomial", rule) for rule in RULES if rule != "both free"],
)
def test_torques_asked_for_are_held(source, rule, grid, polynomial_system):
    request = RULES[rule]
    system = examples.wind_tunnel_23012() if source == "thin_aerofoil" else polynomial_system
    result = trim(system, grid.condition, request)
    assert np.all(result.reached)
    assert np.all(result.reason == np.array(None))
    load = load_of(system, grid.condition)
    needed = load[..., None] * balanced(system, grid.condition, result)
    for held in (request.tab_torque, request.aileron_torque):
        if held is not None:
            row = 0 if held.surface == "tab" else 1
            np.testing.assert_array_equal(result.torque[..., row], held.torque)
            np.testing.assert_allclose(needed[..., row], held.torque, atol=1e-13 * load.max())
    assert np.all(result.residual < 1e-13 * load)
    np.testing.assert_allclose(result.torque, needed, atol=1e-13 * load.max())
    for index in np.ndindex(grid.shape):
        point, single = result.take(index), trim(system, grid.condition.take(index), request)
        np.testing.assert_array_equal(point.state, single.state)
        np.testing.assert_allclose(point.torque, single.torque, rtol=1e-12, atol=1e-14)


def test_linear_angles_are_the_closed_forms(grid):
    system = examples.wind_tunnel_23012()
    source = system.aerodynamics.source
    load = load_of(system, grid.condition)
    constant = source.offset + source.gradient[:, 0] * 0.05
    K = source.gradient[:, 1:]

    def angles(request):
        return trim(system, grid.condition, request).state[..., 0::2]

    tab = (0.05 / load - constant[0] - K[0, 1] * 0.02) / K[0, 0]
    np.testing.assert_allclose(angles(RULES["held tab torque"])[..., 0], tab, rtol=1e-12)
    aileron = -(constant[1] + K[1, 0] * 0.1) / K[1, 1]
    np.testing.assert_allclose(angles(RULES["floating aileron"])[..., 1], aileron, rtol=1e-12)
    wanted = np.stack([-0.02 / load, 0.3 / load], axis=-1) - constant
    both = np.linalg.solve(K, wanted[..., None])[..., 0]
    np.testing.assert_allclose(angles(RULES["both held"]), both, rtol=1e-11, atol=1e-13)


def test_least_torque_is_the_least(grid, polynomial_system):
    for system in (examples.wind_tunnel_23012(), polynomial_system):
        result = trim(system, grid.condition, TrimRequest(0.08, 0.1, "least_torque"))
        size = np.sum(result.torque**2, axis=-1)
        assert np.all(result.reached)
        for tab in np.linspace(-1.5, 1.5, 301):
            other = trim(system, grid.condition, TrimRequest(0.08, 0.1, float(tab)))
            assert np.all(np.sum(other.torque**2, axis=-1) >= size * (1 - 1e-12))
    system = examples.wind_tunnel_23012()
    source = system.aerodynamics.source
    constant = source.at(0.08, 0.0, 0.1).value
    by_tab = source.gradient[:, 1]
    expected = -constant @ by_tab / (by_tab @ by_tab)
    result = trim(system, grid.condition, TrimRequest(0.08, 0.1, "least_torque"))
    np.testing.assert_allclose(result.state[..., 0], expected, rtol=1e-13)
    stopped = trim(system, grid.condition, TrimRequest(0.08, 0.1, "least_torque", tab_limit=0.01))
    assert np.all(stopped.reached)
    np.testing.assert_array_equal(stopped.state[..., 0], np.sign(expected) * 0.01)


def test_angles_may_vary_over_the_grid(grid, polynomial_system):
    alpha, aileron = np.linspace(0.0, 0.1, 4), np.linspace(-0.2, 0.2, 5)[:, None]
    for tab in (0.05, "zero_aileron_torque", "least_torque", HeldTorque("tab", np.linspace(0.0, 0.02, 4))):
        result = trim(polynomial_system, grid.condition, TrimRequest(alpha, aileron, tab))
        assert np.all(result.reached)
        for i, j in np.ndindex(grid.shape):
            own = HeldTorque("tab", tab.torque[j]) if isinstance(tab, HeldTorque) else tab
            request = TrimRequest(alpha[j], aileron[i, 0], own)
            single = trim(polynomial_system, grid.condition.take((i, j)), request)
            np.testing.assert_allclose(result.state[i, j], single.state, rtol=1e-13)


def test_an_unreachable_trim_says_which_equation_and_which_limit(grid):
    system = examples.wind_tunnel_23012()
    limit = float(np.deg2rad(3.0))
    short = trim(system, grid.condition, TrimRequest(0.08, 0.3, "zero_aileron_torque", tab_limit=limit))
    assert not np.any(short.reached)
    np.testing.assert_allclose(np.abs(short.state[..., 0]), limit)
    left = short.residual[0, 0]
    assert short.reason[0, 0] == (
        "aileron torque of 0 N m: no tab angle within +-3 deg does it; the nearest found, tab -3 deg, "
        f"aileron 17.19 deg, leaves {left:.4g} N m"
    )
    held = trim(system, grid.condition, TrimRequest(0.08, 0.0, HeldTorque("tab", 50.0)))
    assert not np.any(held.reached)
    assert held.reason[0, 0].startswith("tab torque of 50 N m: no tab angle within +-90 deg does it")
    both = TrimRequest(0.08, HeldTorque("aileron", 500.0), HeldTorque("tab", 50.0))
    words = trim(system, grid.condition, both).reason[1, 2]
    assert "tab torque of 50 N m and aileron torque of 500 N m: no tab angle within" in words
    assert "with an aileron angle within +-90 deg" in words


def test_torque_is_held_where_it_can_be(grid):
    # The same torque is small at a high dynamic pressure and out of reach at a low one.
    system = examples.wind_tunnel_23012()
    result = trim(system, grid.condition, TrimRequest(0.08, 0.0, HeldTorque("aileron", 20.0)))
    assert np.any(result.reached)
    assert not np.all(result.reached)
    np.testing.assert_array_equal(result.reached, result.reason == np.array(None))
    np.testing.assert_array_equal(result.reached, result.residual < 1e-9)


def test_a_trim_is_sought_where_the_source_knows_its_hinge_moments(grid):
    @dataclass(frozen=True)
    class Narrow(SaturatingSource):
        domain = "tab -10..10 deg"

        def covers(self, alpha, dt, da):
            return every_angle(alpha, dt, da) & (np.abs(np.rad2deg(dt)) <= 10.0)

    request = TrimRequest(0.0, 0.0, "zero_aileron_torque")
    inside = trim(with_source(Narrow(0.01)), grid.condition, request)
    assert np.all(inside.reached)
    beyond = trim(with_source(Narrow(0.03)), grid.condition, request)
    assert not np.any(beyond.reached)
    assert np.all(np.abs(np.rad2deg(beyond.state[..., 0])) <= 10.0)
    assert beyond.reason[0, 0].endswith("hinge moments are known for tab -10..10 deg")


@pytest.mark.parametrize("tab", [-0.05, "zero_aileron_torque", "zero_tab_torque", "least_torque"])
def test_batched_equals_single(example, grid, tab):
    request = TrimRequest(0.08, aileron=0.1, tab=tab)
    result = trim(example, grid.condition, request)
    for i, j in np.ndindex(grid.shape):
        point, single = result.take((i, j)), trim(example, grid.condition.take((i, j)), request)
        for name in ("alpha", "state", "residual", "reached"):
            np.testing.assert_array_equal(getattr(point, name), getattr(single, name))
        np.testing.assert_allclose(point.torque, single.torque, rtol=1e-13)


@pytest.mark.parametrize(
    "values",
    [
        (np.nan,),
        (0.0, np.inf),
        (0.0, 0.0, np.nan),
        (0.0, 0.0, "float"),
        (0.0, "zero_tab_torque"),
        (0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 1.0, 2.0),
        (0.0, "zero_aileron_torque", "zero_aileron_torque"),
        (0.0, HeldTorque("tab", 1.0), "zero_tab_torque"),
        (0.0, "zero_aileron_torque", "least_torque"),
        (np.array([0.0, np.nan]),),
    ],
    ids=str,
)
def test_impossible_requests_are_refused(values):
    with pytest.raises(ValueError, match=r"trim angles|must be|decide both|needs a given"):
        TrimRequest(*values)


@pytest.mark.parametrize("values", [("wing", 0.0), ("tab", np.nan)])
def test_impossible_torques_are_refused(values):
    with pytest.raises(ValueError, match=r"surface|finite"):
        HeldTorque(*values)
