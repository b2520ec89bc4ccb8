"""Statistics of cases against plain loops, sorting and numpy's own least squares."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from schedules.case_statistics import distribution_of, influence_of

FLOWN = np.array([True, True, False])


def _figures(seed, cases=40, missing=0.2):
    rng = np.random.default_rng(seed)
    values, growth = rng.standard_normal((2, 3, cases))
    values[rng.random((3, cases)) < missing] = np.nan
    values[2] = growth[2] = np.nan
    return values, growth, rng.uniform(0.5, 1.5, (cases, 2))


@pytest.mark.parametrize("bad", ["small", "large"])
@pytest.mark.parametrize("missing", [0.0, 0.02, 0.2, 1.0])
def test_against_a_plain_loop(bad, missing):
    values, growth, factors = _figures(1, 37, missing)
    found = distribution_of(values, growth, FLOWN, factors, bad)
    sign = 1.0 if bad == "large" else -1.0
    for i in range(2):
        ranked = sorted(range(37), key=lambda d: (np.inf if np.isnan(v := values[i, d]) else sign * v, growth[i, d]))
        case = ranked[-1]
        if not np.isnan(values[i, case]):
            case = int(np.nanargmax(sign * values[i]))
        assert found.worst_case[i] == case
        np.testing.assert_array_equal(found.worst[i], values[i, case])
        np.testing.assert_array_equal(found.worst_factors[i], factors[case])
        filled = np.where(np.isnan(values[i]), sign * np.inf, values[i])
        for p, got in ((5, found.p05[i]), (50, found.p50[i]), (95, found.p95[i])):
            wanted = np.sort(filled)[int(np.ceil(37 * p / 100)) - 1]
            np.testing.assert_array_equal(got, wanted if np.isfinite(wanted) else np.nan)
    assert found.worst_case[2] == -1
    assert np.isnan([found.worst[2], *found.worst_factors[2], found.p05[2], found.p50[2], found.p95[2]]).all()


def test_percentiles_are_those_of_numpy_by_the_inverse_of_the_distribution():
    values, growth, factors = _figures(2, 101, 0.0)
    found = distribution_of(values[:2], growth[:2], FLOWN[:2], factors, "large")
    for p, got in ((5, found.p05), (50, found.p50), (95, found.p95)):
        np.testing.assert_array_equal(got, np.percentile(values[:2], p, axis=-1, method="inverted_cdf"))


def test_one_case():
    found = distribution_of(np.array([[2.0]]), np.zeros((1, 1)), np.array([True]), np.array([[1.1]]), "small")
    assert found.worst[0] == found.p05[0] == found.p50[0] == found.p95[0] == 2.0


@settings(max_examples=50)
@given(arrays(float, (2, 9), elements=st.floats(-1e6, 1e6) | st.just(np.nan)))
def test_the_worst_is_never_better_than_a_percentile(values):
    found = distribution_of(values, np.zeros((2, 9)), FLOWN[:2], np.ones((9, 1)), "large")
    for i in range(2):
        if np.isnan(values[i]).any():
            assert np.isnan(found.worst[i])
        else:
            assert found.worst[i] == values[i].max() >= found.p95[i] >= found.p50[i] >= found.p05[i] >= values[i].min()


def test_influence_is_numpys_least_squares():
    values, _, factors = _figures(3, 60, 0.3)
    factors = np.column_stack([factors, factors @ [0.9, 0.1] + 0.05 * np.random.default_rng(1).standard_normal(60)])
    values[:2] = 0.1 * values[:2] + factors @ [3.0, -2.0, 0.5] + 7.0 * factors[:, 0] ** 2
    found = influence_of(values, factors)
    for i in range(2):
        known = np.isfinite(values[i])
        x, y = factors[known], values[i, known]
        matrix = np.column_stack([np.ones(len(y)), x])
        fit = np.linalg.lstsq(matrix, y)[0]
        np.testing.assert_allclose(found.slope[i], fit[1:], rtol=1e-9)
        np.testing.assert_allclose(found.standardised[i], fit[1:] * x.std(axis=0) / y.std(), rtol=1e-9)
        np.testing.assert_allclose(found.explained[i], 1.0 - (y - matrix @ fit).var() / y.var(), rtol=1e-9)
    assert np.isnan([*found.slope[2], *found.standardised[2], found.explained[2]]).all()


def test_what_is_linear_is_found_exactly_and_explained_by_all():
    factors = np.random.default_rng(4).uniform(0.9, 1.1, (30, 3))
    found = influence_of((factors @ [5.0, 0.0, -0.2] + 100.0)[None], factors)
    np.testing.assert_allclose(found.slope[0], [5.0, 0.0, -0.2], atol=1e-11)
    assert found.explained[0] == pytest.approx(1.0, abs=1e-12)


def test_squares_add_up_at_corners():
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij")).reshape(3, 8).T
    factors = 1.0 + signs * [0.1, 0.2, 0.3]
    values = np.random.default_rng(5).standard_normal((4, 8))
    found = influence_of(values, factors)
    np.testing.assert_allclose(np.sum(found.standardised**2, axis=-1), found.explained, rtol=1e-12)
    effect = [[v[s > 0].mean() - v[s < 0].mean() for s in signs.T] for v in values]
    np.testing.assert_allclose(found.slope * [0.2, 0.4, 0.6], effect, rtol=1e-12)


def test_no_influence_where_cases_do_not_tell_it():
    factors = np.random.default_rng(6).uniform(0.9, 1.1, (12, 2))
    few = np.full((1, 12), np.nan)
    few[0, :3] = 1.0, 2.0, 4.0
    assert np.isnan(influence_of(few, factors).slope).all()
    together = np.column_stack([factors[:, 0], 2.0 * factors[:, 0]])
    assert np.isnan(influence_of(factors.sum(axis=-1)[None], together).slope).all()
    still = influence_of(np.full((1, 12), 0.7), factors)
    np.testing.assert_allclose(still.slope, 0.0, atol=1e-14)
    assert np.isnan(still.explained[0])
    assert np.isnan(still.standardised).all()


@given(st.floats(1e-9, 1e9), st.floats(-1e3, 1e3))
def test_the_unit_does_not_matter(scale, offset):
    rng = np.random.default_rng(7)
    factors, values = rng.uniform(0.9, 1.1, (20, 2)), rng.standard_normal((1, 20))
    one, other = influence_of(values, factors), influence_of(scale * (values + offset), factors)
    np.testing.assert_allclose(other.slope, scale * one.slope, rtol=1e-8, atol=1e-8 * scale)
    np.testing.assert_allclose(other.standardised, one.standardised, rtol=1e-8, atol=1e-8)
