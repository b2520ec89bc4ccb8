"""What is left of a step response: its values between samples, its zeros, and what lies beyond the horizon."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm

from design.worst_case.kernel import in_one_row, samples_of

LAGS = np.array([1.0, 2.0, 3.0])


def of_lags(weights):
    """g is the sum of weights times ``exp(-k t)``, k = 1, 2, 3."""
    return samples_of(-np.diag(LAGS), np.ones(3), np.atleast_2d(weights))


def test_values_and_areas_between_the_samples_are_those_of_the_matrix_exponential():
    rng = np.random.default_rng(3)
    A = rng.standard_normal((5, 5)) * np.geomspace(1.0, 100.0, 5)[:, None]
    A -= (np.linalg.eigvals(A).real.max() + 2.0) * np.eye(5)
    b, C = rng.standard_normal(5), rng.standard_normal((2, 5))
    samples = samples_of(A, b, C)
    time = np.concatenate([[0.0, 1.0], rng.uniform(0.0, 1.0, 30), 10.0 ** rng.uniform(-6.0, 0.0, 30)])
    row = rng.integers(0, 2, time.size)
    value, area = samples.at(row, time)
    inverse = np.linalg.inv(A)
    for k, (o, t) in enumerate(zip(row, time, strict=True)):
        E, T = expm(A * samples.horizon[0] * t), samples.horizon[0]
        scale = np.abs(samples.value[o]).max()
        np.testing.assert_allclose(value[k], -C[o] @ inverse @ E @ b, atol=1e-9 * scale)
        np.testing.assert_allclose(area[k], -C[o] @ inverse @ inverse @ (E - np.eye(5)) @ b / T, atol=1e-9 * scale)


def test_pairs_of_zeros_between_two_samples_are_found():
    """``e^-t (1 - e^-t / u)(1 - e^-t / w)``: two zeros, closer together than samples are."""
    for u, w in ((0.5, 0.51), (0.3, 0.3002), (0.9, 0.9001)):
        found = of_lags([1.0, -(1.0 / u + 1.0 / w), 1.0 / (u * w)])
        zeros = np.sort(-np.log([u, w])) / found.horizon[0]
        np.testing.assert_allclose(found.zeros[0, :2], zeros, rtol=1e-6)
        assert np.all(found.zeros[0, 2:] == 1.0)
        assert np.all(np.isin(found.zeros, found.nodes))


def test_a_double_zero_is_none():
    np.testing.assert_array_equal(of_lags([1.0, -4.0, 4.01]).zeros.size, 0)


def test_what_lies_beyond_is_bounded():
    found = of_lags([[1.0, 0.0, 0.0], [1.0, -3.0, 2.0], [0.0, 0.0, 1.0]])
    T = found.horizon[0]
    for o, weights in enumerate(([1.0, 0.0, 0.0], [1.0, -3.0, 2.0], [0.0, 0.0, 1.0])):
        rest = quad(lambda t, w=weights: abs(np.dot(w, np.exp(-LAGS * (T + t)))), 0.0, 30.0)[0]
        area = quad(lambda t, w=weights: abs(np.dot(w / LAGS, np.exp(-LAGS * (T + t)))), 0.0, 30.0)[0]
        assert rest <= found.beyond[o] <= 1e-8
        assert area <= found.area_beyond[o] * T


def test_crossings_are_found_between_any_two_places_at_any_level():
    found = of_lags([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    T, level = found.horizon[0], np.array([1.0, 0.7, 1e-3, 1e-7, 0.2])
    row = np.array([0, 0, 0, 0, 1])
    wanted = -np.log(np.where(row == 0, level, 3.0 * level)) / np.where(row == 0, 1.0, 3.0) / T
    place = found.crossing(row, np.zeros(5), np.ones(5), np.where(row == 0, level, -level))
    np.testing.assert_allclose(place, wanted, atol=1e-9)


def test_rows_of_several_points_stand_one_after_the_other():
    first, second = of_lags([[1.0, 0.0, 0.0]]), of_lags([[1.0, -2.0 / 0.5, 1.0 / 0.25 - 0.001], [0.0, 1.0, 0.0]])
    both = in_one_row([first, second])
    assert both.zeros.shape == (3, second.zeros.shape[-1])
    np.testing.assert_array_equal(both.value[1:], second.value)
    np.testing.assert_array_equal(both.horizon, [20.0, 20.0, 20.0])
    time = np.array([0.01, 0.2])
    alone = first.at(np.array([0]), time[:1])[0][0]
    np.testing.assert_allclose(both.at(np.array([0, 2]), time)[0][0], alone, rtol=1e-14)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_nodes_hold_all_that_gamma_turns_at(sign):
    found = of_lags([sign, -5.0 * sign, 3.0 * sign])
    dense = found.at(np.zeros(100_001, dtype=np.int64), np.linspace(0.0, 1.0, 100_001) ** 3)[0]
    value = found.at(np.zeros(found.nodes.size, dtype=np.int64), found.nodes[0])[0]
    np.testing.assert_allclose(np.abs(np.diff(value)).sum(), np.abs(np.diff(dense)).sum(), rtol=1e-8)
