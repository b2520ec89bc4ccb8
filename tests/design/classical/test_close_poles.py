"""Two poles about to meet: the walls against the poles' own damping ratios, and against finite differences."""

import numpy as np
import pytest

from design.classical.close_poles import SAME, close_pole_walls
from design.classical.pole_figures import Poles

LIMIT = 0.5
RAY = np.exp(1j * (np.pi - np.arccos(LIMIT)))


def _through(first, second, delta, count):
    """Families whose polynomials at z = 0 have the upper poles given, and their mirror images; three unknowns."""
    rng = np.random.default_rng(count)
    rows = np.zeros((count, 4, 5))
    for i in range(count):
        pairs = np.array([first[i], second[i]])
        rows[i, 0] = np.poly(np.concatenate([pairs, pairs.conj()])).real
        rows[i, 1:, 1:] = rng.standard_normal((3, 4)) * delta
    return rows


def _walls(rows, z, limit=LIMIT):
    poles = Poles.of(rows, np.zeros(len(rows)), z)
    size = np.full(len(rows), limit)
    one = np.ones(len(rows))
    walls, rise = close_pole_walls(poles, poles.least[:2], size, one, one)
    return walls, rise, poles


def test_no_wall_is_overstepped_when_both_are_damped_enough_and_only_then():
    rng = np.random.default_rng(0)
    middle = (1.0 + 0.1 * rng.standard_normal(400)) * RAY * np.exp(0.1j * rng.standard_normal(400))
    half = 0.2 * rng.random(400) * np.exp(2j * np.pi * rng.random(400))
    rows = _through(middle + half, middle - half, 1.0, 400)
    walls, _, poles = _walls(rows, np.zeros((400, 3)))
    kept = np.all(~walls.exists | (walls.value <= 0.0), axis=0)
    damped = poles.damping_ratio >= LIMIT
    assert 50 < damped.sum() < 350
    # Of those one behind the other only a few of endlessly many walls are asked for: none too many, and few too few.
    assert np.all(kept[damped])
    assert np.mean(kept[~damped]) < 0.05


@pytest.mark.parametrize("apart", [0.2, 1e-2, 1e-3, 0.0])
def test_their_derivatives_stay_finite_and_right_as_the_poles_meet(apart):
    """Along the ray, and just inside it: where each pole by itself moves infinitely fast."""
    count, h = 12, 1e-6
    middle = np.full(count, RAY * np.exp(0.02j))
    rows = _through(middle + apart * RAY, middle - apart * RAY, 0.3, count)
    here, rise, poles = _walls(rows, np.zeros((count, 3)))
    shown = here.exists & ~np.isclose(here.value, 0.0, atol=1e-9)
    assert np.all(np.abs(here.gradient) < 1e3)
    if apart <= SAME:
        return
    assert np.all(np.abs(poles.first[np.arange(count), poles.least[0]]).max(axis=-1) > 0.1 / apart * 1e-1)
    scale = np.abs(poles.s[np.arange(count), poles.least[:2]].mean(axis=0))
    for j in range(3):
        z = np.zeros((count, 3))
        z[:, j] = h
        # The size of the mean is taken as it is: what is compared is free of it.
        up, down = (_walls(rows, sign * z)[0] for sign in (1.0, -1.0))
        there = shown & up.exists & down.exists
        slope = (up.value - down.value) / (2 * h)
        error = np.abs(slope - here.gradient[..., j]) - 3.0 * np.abs(here.value) / scale
        assert np.all(error[there] < 2e-2 * np.abs(slope[there]) + 2e-2)
    tighter, looser = (_walls(rows, np.zeros((count, 3)), LIMIT + sign * h)[0] for sign in (1.0, -1.0))
    slope = (tighter.value - looser.value) / (2 * h)
    sine = np.abs(slope - rise) - np.abs(here.value)  # the walls' common factor goes with the ray, too
    assert np.all(sine[shown] < 1e-3 * np.abs(slope[shown]) + 1e-3)
