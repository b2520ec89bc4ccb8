from dataclasses import dataclass

import numpy as np
import pytest

from model import examples
from model.aerodynamics import Aerodynamics
from model.hinge_moments.expansion import HingeMoments
from model.motion import acceleration
from model.system import TabAileron
from model.trim import LARGEST_TRIM_ANGLE, TrimRequest, trim


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


@pytest.mark.parametrize("tab", [-0.05, "zero_aileron_torque"])
def test_batched_equals_single(example, grid, tab):
    request = TrimRequest(0.08, aileron=0.1, tab=tab)
    result = trim(example, grid.condition, request)
    for i, j in np.ndindex(grid.shape):
        point, single = result.take((i, j)), trim(example, grid.condition.take((i, j)), request)
        for name in ("alpha", "state", "residual", "reached"):
            np.testing.assert_array_equal(getattr(point, name), getattr(single, name))
        np.testing.assert_allclose(point.torque, single.torque, rtol=1e-13)


@pytest.mark.parametrize("angles", [(np.nan,), (0.0, np.inf), (0.0, 0.0, np.nan), (0.0, 0.0, "float")])
def test_impossible_requests_are_refused(angles):
    with pytest.raises(ValueError, match=r"trim angles|tab must be"):
        TrimRequest(*angles)
