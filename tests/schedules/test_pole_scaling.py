"""Scaled poles: the numbers, the branches over the grid, and how near they come together."""

from dataclasses import replace

import numpy as np
import pytest

from schedules.pole_scaling import ScaledPoles, pole_scaling


@pytest.fixture(scope="module")
def plant(wind_tunnel_envelope):
    return wind_tunnel_envelope.plant


def _moving(shape):
    """Poles of six branches that move over a grid, farther than they are apart."""
    i, j = np.meshgrid(*(np.linspace(0.0, 1.0, k) for k in shape), indexing="ij")
    pair = -2.0 - 0.4 * i + 1j * (6.0 + 2.0 * j)
    other = -4.0 + 0.4 * i + 1j * (5.0 - 3.0 * j)
    return np.stack([pair, pair.conj(), other, other.conj(), -1.0 - j + 0j, -9.0 + 3.0 * i + 0j], axis=-1)


def _with_poles(designed, poles):
    return replace(designed, assessment=replace(designed.assessment, poles=poles))


def test_closed_loop_poles_are_those_of_the_design(wind_tunnel_envelope, plant):
    q = plant.grid.condition.dynamic_pressure
    for designed in wind_tunnel_envelope.controllers:
        found = pole_scaling(plant, designed)
        assert found.reference_pressure == pytest.approx(np.exp(np.mean(np.log(q))), rel=1e-12)
        np.testing.assert_allclose(found.frequency, np.sqrt(-plant.servo_tab.F[..., 1, 0]), rtol=1e-12)
        for scaled, unit in (
            (found.closed_by_frequency, found.frequency),
            (found.closed_by_pressure, np.sqrt(q / found.reference_pressure)),
        ):
            back = scaled.poles * unit[..., None]
            one, other = (np.sort_complex(np.round(p, 6)) for p in (back, designed.assessment.poles))
            np.testing.assert_allclose(one, other, atol=2e-6)


def test_open_loop_poles_are_those_of_the_servo_tab(wind_tunnel_envelope, plant):
    """Over omega_n: ``-zeta -+ j sqrt(1 - zeta^2)``; zeta goes with the root of the density alone."""
    found = pole_scaling(plant, wind_tunnel_envelope.controllers[0])
    zeta = plant.servo_tab.damping_ratio
    upper = -zeta + 1j * np.sqrt(1.0 - zeta**2)
    expected = np.stack([upper.conj(), upper], axis=-1)
    np.testing.assert_allclose(found.open_by_frequency.poles, expected, rtol=1e-9)
    centre = expected.reshape(-1, 2).mean(axis=0)
    spread = np.abs(expected.reshape(-1, 2) - centre).max(axis=0) / np.abs(centre)
    np.testing.assert_allclose(found.open_by_frequency.collapse.spread, spread, rtol=1e-6)
    # At one altitude nothing is left but rounding.
    for row in found.open_by_frequency.poles:
        np.testing.assert_allclose(row, np.broadcast_to(row[0], row.shape), rtol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_branches_do_not_depend_on_the_order_of_the_poles(wind_tunnel_envelope, plant, seed):
    rng, shape = np.random.default_rng(seed), plant.grid.shape
    true = _moving(shape) * np.sqrt(plant.grid.condition.dynamic_pressure)[..., None]
    mixed = rng.permuted(true, axis=-1)
    mixed[0, 0] = true[0, 0]
    designed = _with_poles(wind_tunnel_envelope.controllers[0], mixed)
    found = pole_scaling(plant, designed).closed_by_frequency.poles
    np.testing.assert_allclose(found, true / pole_scaling(plant, designed).frequency[..., None], rtol=1e-12)


@pytest.mark.parametrize("missing", [[(0, 0)], [(0, 1), (1, 1)], [(0, 1), (1, 0), (1, 1), (1, 2)], [(0, 0), (1, 1)]])
def test_branches_go_around_holes_and_on_to_islands(wind_tunnel_envelope, plant, missing):
    rng = np.random.default_rng(7)
    true = _moving(plant.grid.shape) * np.sqrt(plant.grid.condition.dynamic_pressure)[..., None]
    mixed = rng.permuted(true, axis=-1)
    for point in missing:
        mixed[point] = np.nan
    known = np.isfinite(mixed).all(axis=-1)
    first = tuple(np.argwhere(known)[0])
    mixed[first] = true[first]
    found = pole_scaling(plant, _with_poles(wind_tunnel_envelope.controllers[0], mixed))
    np.testing.assert_allclose(
        found.closed_by_frequency.poles[known], true[known] / found.frequency[known][:, None], rtol=1e-12
    )
    assert np.isnan(found.closed_by_frequency.poles[~known]).all()
    assert np.isfinite(found.closed_by_frequency.collapse.spread).all()


def test_collapse_of_known_poles():
    """A branch at -1, -1, -4 and one that stays: centre -2, farthest 2 away, at the last point."""
    poles = np.array([[-1.0, -5.0], [np.nan, np.nan], [-1.0, -5.0], [-4.0, -5.0]], dtype=complex)
    found = ScaledPoles(poles).collapse
    np.testing.assert_allclose(found.centre, [-2.0, -5.0])
    np.testing.assert_allclose(found.spread, [1.0, 0.0])
    np.testing.assert_allclose(found.rms_spread, [np.sqrt((1.0 + 1.0 + 4.0) / 3.0) / 2.0, 0.0])
    assert found.point[0] == 3


def test_a_design_with_larger_spread_than_the_plant_has_a_servo_that_does_not_scale(wind_tunnel_envelope, plant):
    found = pole_scaling(plant, wind_tunnel_envelope.controller("nf"))
    assert found.open_by_frequency.collapse.spread.max() < 0.05
    assert found.closed_by_frequency.collapse.spread.max() > 0.3
