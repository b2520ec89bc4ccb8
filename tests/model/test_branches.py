import itertools
from itertools import permutations

import numpy as np

from model.branches import branch_places, continuous_branches, successors

RNG = np.random.default_rng(11)


def sorted_lists(values):
    """The last axis by real part, then by imaginary part: an order that swaps pairs as they pass each other."""
    return np.take_along_axis(values, np.lexsort((values.imag, values.real), axis=-1), axis=-1)


def test_matching_is_the_assignment_of_least_squares():
    values = RNG.normal(size=(40, 2, 4)) + 1j * RNG.normal(size=(40, 2, 4))
    follows = successors(values)
    for n in range(40):
        first, second = values[n]
        costs = {p: np.sum(np.abs(first - second[list(p)]) ** 2) for p in itertools.permutations(range(4))}
        assert np.sum(np.abs(first - second[follows[n, 0]]) ** 2) <= min(costs.values()) * (1 + 1e-9)


def test_branches_undo_a_shuffle():
    t = np.linspace(0.0, 1.0, 60)
    curves = np.stack([-1 + t + 2j * t, 1 - t**2 + 2j, -3 - 1j * t, 4 * t - 5j + 0 * t])
    shuffled = np.stack([RNG.permutation(column) for column in curves.T])[None]
    branches = continuous_branches(shuffled)[0]
    start = [int(np.argmin(np.abs(curves[:, 0] - value))) for value in branches[:, 0]]
    np.testing.assert_array_equal(branches, curves[start])


def test_a_growing_pattern_is_followed_whatever_the_step():
    pattern = np.array([-15.6 + 114.7j, -15.6 - 114.7j, 0.4 + 26.5j, 0.4 - 26.5j])
    values = np.stack([RNG.permutation(scale * pattern) for scale in (1.0, 7.0, 50.0, 0.3)])[None]
    branches = continuous_branches(values)[0]
    np.testing.assert_allclose(branches / np.array([1.0, 7.0, 50.0, 0.3]), np.repeat(branches[:, :1], 4, axis=1))


def test_places_say_where_each_branch_lies():
    values = RNG.normal(size=(3, 20, 4)) + 1j * RNG.normal(size=(3, 20, 4))
    places = branch_places(values)
    np.testing.assert_array_equal(np.sort(places, axis=-1), np.broadcast_to(np.arange(4), places.shape))
    taken = np.take_along_axis(values, places, axis=-1)
    np.testing.assert_array_equal(np.swapaxes(taken, 1, 2), continuous_branches(values))


def test_batched_equals_single():
    values = RNG.normal(size=(6, 15, 4)) + 1j * RNG.normal(size=(6, 15, 4))
    for n in range(6):
        np.testing.assert_array_equal(continuous_branches(values)[n], continuous_branches(values[n : n + 1])[0])


def test_crossing_paths_are_followed():
    """Two pairs that pass each other, sorted at every step: the sorting swaps them, the branches do not."""
    k = np.linspace(0.0, 1.0, 101)
    first, second = -2.0 + k + 1.0j, -1.0 - k + 3.0j
    paths = np.stack([first, np.conj(first), second, np.conj(second)], axis=-1)
    found = continuous_branches(sorted_lists(paths)[None])[0]
    start = sorted_lists(paths)[0]
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
    values = sorted_lists(np.cumsum(rng.standard_normal((4, 50, 6)) + 1j * rng.standard_normal((4, 50, 6)), axis=1))
    found = continuous_branches(values)
    np.testing.assert_array_equal(sorted_lists(np.swapaxes(found, 1, 2)), values)
