from itertools import permutations

import numpy as np

from design.frequency.branches import continuous_branches, successors
from design.frequency.poles import pole_order


def test_crossing_paths_are_followed():
    """Two pairs that pass each other, sorted at every step: the sorting swaps them, the branches do not."""
    k = np.linspace(0.0, 1.0, 101)
    first, second = -2.0 + k + 1.0j, -1.0 - k + 3.0j
    paths = np.stack([first, np.conj(first), second, np.conj(second)], axis=-1)
    found = continuous_branches(pole_order(paths)[None])[0]
    start = pole_order(paths)[0]
    for branch, at in zip(found, start, strict=True):
        path = paths[:, np.argmin(np.abs(paths[0] - at))]
        np.testing.assert_array_equal(branch, path)


def test_conflicts_get_the_least_total_squared_distance():
    rng = np.random.default_rng(0)
    values = rng.standard_normal((20, 6, 5)) + 1j * rng.standard_normal((20, 6, 5))
    follows = successors(values)
    squared = np.abs(values[:, :-1, :, None] - values[:, 1:, None, :]) ** 2
    every = np.array(list(permutations(range(5))))
    for i in np.ndindex(20, 5):
        best = squared[i][np.arange(5), every].sum(axis=-1).min()
        assert sorted(follows[i]) == list(range(5))
        np.testing.assert_allclose(squared[i][np.arange(5), follows[i]].sum(), best, rtol=1e-9)


def test_real_poles_do_not_overtake_each_other():
    values = np.array([[[-1.0, 0.0], [0.0, 1.0], [1.0, 2.0]]], dtype=complex)
    np.testing.assert_array_equal(continuous_branches(values)[0], [[-1.0, 0.0, 1.0], [0.0, 1.0, 2.0]])


def test_poles_that_meet_are_followed_in_their_order():
    meeting = np.array([[[-1.2, -0.8], [-1.0 - 0.1j, -1.0 + 0.1j]]])
    np.testing.assert_array_equal(continuous_branches(meeting)[0], [[-1.2, -1.0 - 0.1j], [-0.8, -1.0 + 0.1j]])
    np.testing.assert_array_equal(successors(meeting[:, ::-1])[0], [[0, 1]])


def test_every_branch_holds_each_value_once():
    rng = np.random.default_rng(1)
    values = pole_order(np.cumsum(rng.standard_normal((4, 50, 6)) + 1j * rng.standard_normal((4, 50, 6)), axis=1))
    found = continuous_branches(values)
    np.testing.assert_array_equal(pole_order(np.swapaxes(found, 1, 2)), values)
