import numpy as np
import pytest

from design.frequency import locus_poles
from design.frequency.locus_poles import poles_along
from design.frequency.poles import pole_order
from model.branches import continuations, squared_gaps, successors
from tests.design.siso_loops import stabilised


def rank_one(count, order, seed):
    loop = stabilised(count, order, seed)
    return loop.A, loop.b[:, :, None] * loop.c[:, None, :]


def eigenvalues(A, M, gains):
    return pole_order(np.linalg.eigvals(A[:, None] - gains[:, :, None, None] * M[:, None]).astype(complex))


@pytest.mark.parametrize("order", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("count", [2, 12, 13, 40, 300])
def test_poles_are_the_eigenvalues(order, count):
    A, M = rank_one(10, order, seed=order)
    gains = np.concatenate([[0.0], np.geomspace(1e-2, 1e2, count - 1)]) * np.ones((10, 1))
    found, expected = poles_along(A, M, gains), eigenvalues(A, M, gains)
    closed = A[:, None] - gains[:, :, None, None] * M[:, None]
    size = np.linalg.norm(closed, axis=(-2, -1))[..., None]
    # Where poles meet, an eigenvalue is only known to the square root of the rounding: the residual decides.
    far = np.abs(np.sort_complex(found) - np.sort_complex(expected)) > 1e-9 * size
    identity = np.eye(order)
    for i in np.argwhere(far):
        p, k, j = i
        residual = np.linalg.svd(np.sort_complex(found)[p, k, j] * identity - closed[p, k], compute_uv=False)
        assert residual[-1] < 1e-12 * size[p, k, 0]
    assert far.mean() < 0.01


def test_most_poles_come_without_an_eigenvalue_problem(monkeypatch):
    solved = []
    eigvals = np.linalg.eigvals

    def counted(matrices):
        solved.append(int(np.prod(matrices.shape[:-2])))
        return eigvals(matrices)

    A, M = rank_one(20, 5, seed=9)
    gains = np.concatenate([[0.0], np.geomspace(1e-2, 1e2, 299)]) * np.ones((20, 1))
    monkeypatch.setattr(locus_poles.np.linalg, "eigvals", counted)
    poles_along(A, M, gains)
    assert sum(solved) < 0.1 * gains.size


def test_lists_keep_their_places_and_pairs_are_exact():
    A, M = rank_one(15, 6, seed=4)
    gains = np.geomspace(1e-2, 1e2, 200) * np.ones((15, 1))
    found = poles_along(A, M, gains)
    np.testing.assert_array_equal(found[:, 0], pole_order(found[:, 0]))
    in_place = np.all(successors(found) == np.arange(6), axis=-1)
    assert in_place.mean() > 0.9
    assert np.all(np.isin(np.conj(found[found.imag != 0.0]), found))


@pytest.mark.parametrize("order", [4, 5, 6, 7])
def test_digits_away_from_multiple_poles(order):
    """Section with actuator: every pole at every gain to 1e-10 of itself, wherever the next one is a hundredth away."""
    rng = np.random.default_rng(order)
    A, M = np.zeros((8, order, order)), np.zeros((8, order, order))
    for i in range(8):
        size = 10.0 ** rng.uniform(0.0, 2.0, order // 2)
        for j, w in enumerate(size):
            A[i, 2 * j : 2 * j + 2, 2 * j : 2 * j + 2] = [[0.0, w], [-w, -2.0 * rng.uniform(0.02, 1.5) * w]]
        if order % 2:
            A[i, -1, -1] = -rng.uniform(5.0, 50.0)
        b, c = rng.standard_normal((2, order))
        M[i] = np.outer(b, c) / np.abs(b @ np.linalg.solve(A[i], c)) * rng.uniform(0.5, 2.0)
    gains = np.concatenate([[0.0], np.geomspace(1e-2, 1e1, 299)]) * np.ones((8, 1))
    found, expected = poles_along(A, M, gains), eigenvalues(A, M, gains)
    follows = continuations(found.reshape(-1, order), expected.reshape(-1, order))
    expected = np.take_along_axis(expected.reshape(-1, order), follows, axis=-1).reshape(found.shape)
    gap = np.sqrt(np.moveaxis(squared_gaps(np.moveaxis(expected, -1, 0)), 0, -1))
    away = gap > 1e-2 * np.abs(expected)
    assert away.mean() > 0.9
    np.testing.assert_allclose(found[away], expected[away], rtol=1e-10, atol=0.0)


def test_gains_far_apart_and_close_together_in_one_locus():
    """Even steps from 0, which pass all that happens at low gains in the first few; and both signs in one list."""
    A, M = rank_one(12, 5, seed=21)
    for gains in (np.linspace(0.0, 1e3, 200), np.linspace(-3.0, 30.0, 200), -np.geomspace(1e-6, 1e6, 100)):
        k = gains * np.ones((12, 1))
        found, expected = poles_along(A, M, k), eigenvalues(A, M, k)
        size = np.abs(expected).max(axis=-1, keepdims=True)
        far = np.abs(pole_order(found) - expected) > 1e-8 * size
        assert far.mean() < 0.02
        np.testing.assert_allclose(found.sum(axis=-1), expected.sum(axis=-1), atol=1e-10 * size.max())


def test_poles_that_do_not_move_and_multiple_ones():
    """An integral and two equal lags beside the loop: all equal poles at every gain, each time exactly."""
    A, M = rank_one(6, 3, seed=22)
    wide, feedback = np.zeros((6, 6, 6)), np.zeros((6, 6, 6))
    wide[:, :3, :3], feedback[:, :3, :3] = A, M
    wide[:, [3, 4, 5], [3, 4, 5]] = [0.0, -2.0, -2.0]
    wide[:, 3, :3] = 1.0
    gains = np.geomspace(1e-2, 1e2, 120) * np.ones((6, 1))
    found, expected = poles_along(wide, feedback, gains), eigenvalues(A, M, gains)
    for pole, times in ((0.0, 1), (-2.0, 2)):
        assert np.all((np.abs(found - pole) < 1e-12).sum(axis=-1) >= times)
    np.testing.assert_allclose(found.sum(axis=-1), expected.sum(axis=-1) - 4.0, atol=1e-9)


def test_poles_that_all_but_touch_are_not_mixed_up():
    """A pair that passes a real pole at a distance far below the steps between the gains."""
    for distance in (1e-3, 1e-6, 1e-9):
        A = np.diag([-1.0, -1.0 + distance, -3.0])
        M = np.outer([1.0, 0.5, 0.3], [0.2, 1e-3, 1.0])
        gains = np.linspace(0.0, 4.0, 61)[None]
        found = poles_along(A[None], M[None], gains)
        expected = eigenvalues(A[None], M[None], gains)
        np.testing.assert_allclose(pole_order(found), expected, rtol=0.0, atol=1e-9)


def test_falling_gains_and_grid_equal_points():
    A, M = rank_one(5, 4, seed=2)
    gains = np.geomspace(1e-2, 1e2, 150) * np.linspace(1.0, 2.0, 5)[:, None]
    found = poles_along(A, M, gains)
    falling = poles_along(A, M, gains[:, ::-1])[:, ::-1]
    np.testing.assert_allclose(np.sort_complex(falling), np.sort_complex(found), rtol=0.0, atol=1e-6)
    for i in range(5):
        one = poles_along(A[i : i + 1], M[i : i + 1], gains[i : i + 1])[0]
        np.testing.assert_allclose(found[i], one, rtol=0.0, atol=1e-10)
