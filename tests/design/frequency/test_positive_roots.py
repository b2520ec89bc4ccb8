import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.frequency.positive_roots import CUTS, never_positive, position_in_row, positive_roots

nan = np.nan


def of_roots(*rows):
    return np.array([np.poly(row).real for row in rows])


def listed(x):
    return x[~np.isnan(x)]


def test_known_roots():
    p = of_roots([0.5, 3.0, -1.0, 1e-3], [2.0, -2.0, -3.0, -4.0], [1j, -1j, 1 + 2j, 1 - 2j], [7.0, 8.0, 9.0, 100.0])
    expected = [[1e-3, 0.5, 3.0, nan], [2.0, nan, nan, nan], [nan] * 4, [7.0, 8.0, 9.0, 100.0]]
    np.testing.assert_allclose(positive_roots(p), expected, rtol=1e-9)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 100_000), degree=st.integers(1, 9), decades=st.floats(0.0, 5.0))
def test_random_roots_are_all_found(seed, degree, decades):
    """Real roots of both signs and pairs in all directions, spread over decades, some polynomials of lower degree."""
    rng = np.random.default_rng(seed)
    rows, wanted = [], []
    for _ in range(12):
        pairs = int(rng.integers(0, degree // 2 + 1))
        real = rng.choice([-1.0, 1.0], degree - 2 * pairs) * np.exp(rng.normal(0, decades, degree - 2 * pairs))
        half = np.exp(rng.normal(0, decades, pairs) + 1j * rng.uniform(0.02, np.pi, pairs))
        roots = np.concatenate([real, half, np.conj(half)])
        p = np.poly(roots).real
        # How much a rounding of the coefficients moves each root, in parts of it.
        moved = 1e-15 * np.polyval(np.abs(p), np.abs(roots))
        if np.all(moved < 1e-8 * np.abs(roots * np.polyval(np.polyder(p), roots))):
            rows.append(p * rng.choice([-3.0, 0.1]))
            wanted.append(np.sort(real[real > 0.0]))
    for x, expected in zip(positive_roots(np.array(rows).reshape(-1, degree + 1)), wanted, strict=True):
        np.testing.assert_allclose(listed(x), expected, rtol=1e-7)


def test_roots_at_the_cuts_and_far_outside():
    p = of_roots([CUTS[3], CUTS[5], -1.0], [1e-15, 1.0, 1e9], [CUTS[0] / 2, -3.0, CUTS[-1] * 2])
    expected = [[CUTS[3], CUTS[5], nan], [1e-15, 1.0, 1e9], [CUTS[0] / 2, CUTS[-1] * 2, nan]]
    np.testing.assert_allclose(positive_roots(p), expected, rtol=1e-9)


def test_of_two_that_touch_one_is_found():
    for gap in (0.0, 1e-9, 1e-8):
        found = listed(positive_roots(of_roots([2.0 + gap * 1j, 2.0 - gap * 1j, -1.0, -5.0]))[0])
        assert 1 <= found.size <= 2
        np.testing.assert_allclose(found, 2.0, rtol=1e-6)
    apart = positive_roots(of_roots([2.0, 2.0 + 1e-5, -1.0, -5.0]))[0]
    np.testing.assert_allclose(listed(apart), [2.0, 2.0 + 1e-5], rtol=1e-8)
    assert listed(positive_roots(of_roots([2.0 + 1e-3j, 2.0 - 1e-3j, -1.0, -5.0]))[0]).size == 0


def test_zero_coefficients():
    p = np.array(
        [
            [0.0, 0.0, 1.0, -2.0],
            [0.0, 1.0, -3.0, 2.0],
            [1.0, -3.0, 2.0, 0.0],
            [1.0, 0.0, 0.0, -8.0],
            [0.0, 0.0, 0.0, -1.0],
            [0.0, 0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0, 0.0],
        ]
    )
    expected = [[2, nan, nan], [1, 2, nan], [1, 2, nan], [2, nan, nan], [nan] * 3, [nan] * 3, [nan] * 3]
    np.testing.assert_allclose(positive_roots(p), expected, rtol=1e-12)
    assert positive_roots(np.zeros((3, 4))).shape == (3, 3)
    assert positive_roots(np.ones((3, 1))).shape == (3, 0)
    assert positive_roots(np.zeros((0, 4))).shape == (0, 3)


def test_grid_equals_points():
    p = np.random.default_rng(1).standard_normal((200, 7))
    found = positive_roots(p)
    for row, x in zip(p, found, strict=True):
        np.testing.assert_allclose(positive_roots(row[None])[0], x, rtol=1e-12)


def test_never_positive():
    square = np.poly([0.3, 0.3, -1.0, -2.0])
    touching = -square - 1e-9 * np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    p = np.array([touching, -np.poly([-1.0, -2.0, -3.0, -4.0]), -np.poly([0.3, 0.30001, -1.0, -2.0]), square])
    # Cut where it nearly touches, the proof succeeds; where it does not, nothing is claimed.
    assert never_positive(p, np.full(4, 0.3)).tolist() == [True, True, False, False]
    assert not never_positive(p, np.full(4, 0.02))[0]


@pytest.mark.parametrize("seed", range(4))
def test_never_positive_is_never_wrong(seed):
    rng = np.random.default_rng(seed)
    p = -np.abs(rng.standard_normal((3000, 6))) + rng.uniform(0.0, 2.0, (3000, 1)) * rng.standard_normal((3000, 6))
    claimed = never_positive(p, np.exp(rng.normal(0, 1, 3000)))
    x = np.geomspace(1e-6, 1e6, 2001)
    values = np.stack([np.polyval(row, x) for row in p[claimed]])
    assert 300 < claimed.sum() < 2700
    assert values.max() <= 0.0


def test_position_in_row():
    rows = np.array([0, 0, 2, 2, 2, 5])
    assert position_in_row(rows, 6).tolist() == [0, 1, 0, 1, 2, 0]
    assert position_in_row(np.zeros(0, dtype=int), 3).tolist() == []
