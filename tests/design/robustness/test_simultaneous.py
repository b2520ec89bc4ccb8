from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.frequency.margins import margins
from design.loop import SisoLoop
from design.robustness.simultaneous import SimultaneousMargins, simultaneous_margins
from tests.design.robustness.two_input_loops import (
    abscissa,
    complementary_of,
    dense,
    factor,
    of_closed,
    random_loops,
    regulators,
    resonant_loops,
    sampled_mu,
)

LOOPS = {
    "order 1": random_loops(20, 1, seed=1),
    "order 2": random_loops(20, 2, seed=2),
    "order 4": random_loops(25, 4, seed=3),
    "order 7": random_loops(15, 7, seed=4, gain=0.3),
    "regulators": regulators(20, 4, seed=5),
    "resonant": resonant_loops(20, 6, seed=6, spread=2, damping=1e-3, scale=0),
    "stiff": resonant_loops(15, 8, seed=7, spread=6, damping=1e-2, scale=1),
}


def single(A, B, K, i):
    """The loop opened at input i only."""
    other = 1 - i
    A = A - B[..., :, other, None] * K[..., other, None, :]
    return SisoLoop("u", A, B[..., :, i], K[..., i, :], np.ones(A.shape[:-2]), 1)


def smallest_single(A, B, K):
    return np.minimum(*(margins(single(A, B, K, i)).disk_margin for i in (0, 1)))


def same(a, b, tolerance):
    for field in fields(a):
        x, y = getattr(a, field.name), getattr(b, field.name)
        assert x.shape == y.shape
        assert x.dtype == y.dtype
        if field.name.endswith("_omega"):
            # Where the gain is flat its place is known to half the digits only.
            np.testing.assert_allclose(x, y, rtol=1e-6, atol=1e-9)
        elif x.dtype == bool:
            np.testing.assert_array_equal(x, y)
        else:
            np.testing.assert_allclose(x, y, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("name", LOOPS)
def test_peaks_are_those_of_a_dense_grid_and_nowhere_exceeded(name):
    A, B, K = LOOPS[name]
    found = simultaneous_margins(A, B, K)
    assert found.proved.all()
    for i in range(len(A)):
        omega = dense(np.linalg.eigvals(A[i] - B[i] @ K[i]))
        # Without the plant's own poles, where L is not finite.
        T = K[i] @ np.linalg.solve(1j * omega[:, None, None] * np.eye(len(A[i])) - A[i] + B[i] @ K[i], B[i] + 0j)
        largest = [np.linalg.norm(M, ord=2, axis=(1, 2)).max() for M in (np.eye(2) - T, T)]
        mine = found.sensitivity_peak[i], found.complementary_peak[i]
        assert np.all(np.array(largest) <= np.array(mine) * (1.0 + 1e-9))
        np.testing.assert_allclose(largest, mine, rtol=2e-4)
        # mu is the largest singular value at the best scaling, found by brute force at some peaks.
        for M, mu in (
            (np.eye(2) - 2.0 * T, 2.0 / found.disk_margin[i]),
            (np.eye(2) - T, 1.0 / found.sensitivity_margin[i]),
            (T, 1.0 / found.complementary_margin[i]),
        ):
            balance = np.sqrt(np.abs(M[:, 1, 0]) / np.abs(M[:, 0, 1]))[:, None, None]
            scaled = M * np.where(np.eye(2) == 1.0, 1.0, np.concatenate([balance, 1.0 / balance], axis=1))
            above = np.linalg.norm(scaled, ord=2, axis=(1, 2))
            assert above.max() <= mu * (1.0 + 1e-9)
            if i < 3:
                np.testing.assert_allclose(sampled_mu(M[[above.argmax()]]), mu, rtol=1.2e-2)


@pytest.mark.parametrize("name", LOOPS)
def test_worst_factors_put_a_pole_on_the_axis(name):
    A, B, K = LOOPS[name]
    found = simultaneous_margins(A, B, K)
    reached = np.isfinite(found.worst_factors).all(axis=-1)
    np.testing.assert_array_equal(reached | (found.disk_margin > 2.0 - 1e-6), True)
    factors = found.worst_factors[reached]
    size = np.abs((factors - 1.0) / (factors + 1.0)).max(axis=-1)
    np.testing.assert_allclose(size, found.disk_margin[reached] / 2.0, rtol=1e-9)
    values = np.linalg.eigvals(A - B @ (np.where(reached[:, None], found.worst_factors, 1.0)[:, :, None] * K))
    off = np.abs(values - 1j * np.where(reached, found.disk_omega, 0.0)[:, None]).min(axis=-1)
    largest = np.abs(values).max(axis=-1) + np.abs(A - B @ K).max(axis=(1, 2))
    assert np.all(off[reached] < 1e-9 * largest[reached])


def test_no_factors_of_the_disk_destabilise_and_the_worst_are_found():
    """All phases of both channels on the edge of the disk, and random ones within it."""
    A, B, K = (v[:8] for v in LOOPS["order 4"])
    found = simultaneous_margins(A, B, K)
    turn = np.exp(2j * np.pi * (np.arange(60) + 0.5) / 60)
    phases = np.stack(np.meshgrid(turn, turn), axis=-1).reshape(-1, 2)
    rng = np.random.default_rng(1)
    inside = phases * rng.uniform(0.0, 1.0, phases.shape) ** 0.2
    for a, b, k, m in zip(A, B, K, found.disk_margin, strict=True):
        assert np.all(abscissa(a, b, k, factor(0.9999 * 0.5 * m * phases)) < 0.0)
        assert np.all(abscissa(a, b, k, factor(0.9999 * 0.5 * m * inside)) < 0.0)
        assert np.any(abscissa(a, b, k, factor(1.03 * 0.5 * m * phases)) > 0.0)


def test_gains_and_phases_that_are_guaranteed():
    A, B, K = (v[:10] for v in LOOPS["order 4"])
    found = simultaneous_margins(A, B, K)
    assert np.all(found.gain_margin_down_db == -found.gain_margin_up_db)
    part = np.linspace(-0.999, 0.999, 15)
    pairs = np.stack(np.meshgrid(part, part), axis=-1).reshape(-1, 2)
    for i, (a, b, k) in enumerate(zip(A, B, K, strict=True)):
        gains = 10.0 ** (np.minimum(found.gain_margin_up_db[i], 60.0) * pairs / 20.0)
        assert np.all(abscissa(a, b, k, gains) < 0.0)
        assert np.all(abscissa(a, b, k, np.exp(1j * found.phase_margin[i] * pairs)) < 0.0)
        sizes = 0.999 * pairs * np.exp(1j * np.linspace(0.0, 20.0, len(pairs)))[:, None]
        assert np.all(abscissa(a, b, k, 1.0 / (1.0 - found.sensitivity_margin[i] * sizes)) < 0.0)
        assert np.all(abscissa(a, b, k, 1.0 + found.complementary_margin[i] * sizes) < 0.0)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(-1.0, 1.0))
def test_never_larger_than_the_smallest_single_margin(seed, order, decade):
    A, B, K = random_loops(3, order, seed, gain=10.0**decade)
    found = simultaneous_margins(A, B, K)
    assert np.all(found.disk_margin <= smallest_single(A, B, K) * (1.0 + 1e-7))
    # mu(S) is at most sigma(S), and the three are one family.
    assert np.all(found.sensitivity_margin >= found.return_difference * (1.0 - 1e-9))
    assert np.all(1.0 / found.complementary_margin <= found.complementary_peak * (1.0 + 1e-9))
    assert np.all(found.sensitivity_margin <= 1.0 + 1e-12)
    assert np.all(2.0 / found.disk_margin <= 2.0 / found.sensitivity_margin + 1.0 + 1e-9)


def test_loops_that_do_not_meet_have_the_smaller_single_margin():
    A, B, K = random_loops(60, 3, seed=11)
    block = np.kron(np.eye(2), np.ones((3, 3)))
    whole = np.tile(A.reshape(30, 6, 3), (1, 1, 2)) * block
    inputs, outputs = np.zeros((30, 6, 2)), np.zeros((30, 2, 6))
    singles = []
    for i in range(2):
        rows = slice(3 * i, 3 * i + 3)
        inputs[:, rows, i], outputs[:, i, rows] = B[i::2, :, i], K[i::2, i]
        singles.append(margins(SisoLoop("u", A[i::2], B[i::2, :, i], K[i::2, i], np.ones(30), 1)))
    found = simultaneous_margins(whole, inputs, outputs)
    each = np.stack([s.disk_margin for s in singles])
    stable = ~np.isnan(each).any(axis=0)
    assert stable.sum() > 5
    np.testing.assert_array_equal(np.isnan(found.disk_margin), ~stable)
    np.testing.assert_allclose(found.disk_margin[stable], each.min(axis=0)[stable], rtol=1e-9)
    peak = np.stack([s.sensitivity_peak for s in singles]).max(axis=0)
    np.testing.assert_allclose(found.sensitivity_peak[stable], peak[stable], rtol=1e-8)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-2.0, 2.0))
def test_units_do_not_matter(seed, decade):
    """Of the inputs (mu, not sigma), of the states, and of time."""
    A, B, K = random_loops(2, 4, seed)
    rng = np.random.default_rng(seed)
    found = simultaneous_margins(A, B, K)
    units = np.array([1.0, 10.0**decade])
    T = np.linalg.qr(rng.standard_normal((4, 4)))[0]
    for other in (
        simultaneous_margins(A, B * units, K / units[:, None]),
        simultaneous_margins(T.T @ A @ T, T.T @ B, K @ T),
        simultaneous_margins(A * 10.0**decade, B * 10.0**decade, K),
        simultaneous_margins(A.mT, K.mT, B.mT),
    ):
        for name in ("disk_margin", "sensitivity_margin", "complementary_margin", "phase_margin"):
            np.testing.assert_allclose(getattr(other, name), getattr(found, name), rtol=1e-8)


def test_a_narrow_peak_between_all_frequencies_that_one_would_look_at():
    """A mode of damping ratio 1e-7 beside a broad loop: high, and narrower than any grid."""
    zeta, w = 1e-7, 1.2345678
    closed = np.zeros((4, 4))
    closed[:2, :2] = [[0.0, w], [-w, -2.0 * zeta * w]]
    closed[2:, 2:] = [[-1.0, 0.3], [0.0, -2.0]]
    B = np.array([[0.0, 0.0], [1e-4, 2e-4], [1.0, 0.0], [0.3, 1.0]])
    K = np.array([[1e-3, 0.0, 0.7, 0.2], [0.0, 2e-3, -0.4, 0.5]])
    A, B, K = of_closed(closed, B, K)
    found = simultaneous_margins(A, B, K)
    peak = w * np.sqrt(1.0 - zeta**2)
    omega = peak * (1.0 + np.linspace(-20.0, 20.0, 20001) * zeta)
    T = K @ np.linalg.solve(1j * omega[:, None, None] * np.eye(4) - closed, B + 0j)
    np.testing.assert_allclose(found.complementary_peak, np.linalg.norm(T, ord=2, axis=(1, 2)).max(), rtol=1e-5)
    np.testing.assert_allclose(found.disk_omega, w, rtol=1e-6)
    assert found.complementary_peak > 1.1 * np.linalg.norm(K[:, 2:] @ np.linalg.solve(-closed[2:, 2:], B[2:]), ord=2)


def test_the_higher_of_two_peaks_that_are_nearly_the_same():
    """Two resonances decades apart, one a millionth higher: whichever it is, it is found."""
    for higher in (0, 1):
        closed = np.zeros((4, 4))
        for k, w in enumerate((1.0, 300.0)):
            closed[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0.0, w], [-w, -0.02 * w]]
        size = np.array([1.0, 1.0])
        size[higher] += 1e-6
        B, K = np.zeros((4, 2)), np.zeros((2, 4))
        for k, w in enumerate((1.0, 300.0)):
            B[2 * k + 1, k], K[k, 2 * k] = w, size[k]
        found = simultaneous_margins(*of_closed(closed, B, K))
        np.testing.assert_allclose(found.complementary_omega, (1.0, 300.0)[higher], rtol=1e-2)


def test_regulators_keep_the_guarantees_of_lq():
    """With diagonal R: mu(S) at most 1, so gains from a half and phases to 60 deg in both channels at once."""
    A, B, K = regulators(40, 5, seed=8, R=(100.0, 0.01))
    found = simultaneous_margins(A, B, K)
    np.testing.assert_allclose(found.sensitivity_margin, 1.0, rtol=1e-8)
    assert np.all(found.disk_margin >= 2.0 / 3.0 * (1.0 - 1e-8))
    np.testing.assert_allclose(simultaneous_margins(*regulators(20, 4, seed=9)).return_difference, 1.0, rtol=1e-8)


def test_no_loop_stands_everything():
    A = -np.diag([1.0, 2.0, 3.0])
    found = simultaneous_margins(A, np.ones((3, 2)), np.zeros((2, 3)))
    assert found.disk_margin == 2.0
    assert found.gain_margin_up_db == np.inf
    assert found.complementary_margin == np.inf
    assert found.disk_omega == np.inf
    assert np.isnan(found.worst_factors).all()
    assert found.return_difference == 1.0
    assert found.proved


def test_integrators_of_the_plant_are_no_trouble():
    """L is infinite at 0; the loops are ``k / s``, with S - T all-pass."""
    found = simultaneous_margins(np.zeros((2, 2)), np.eye(2), np.diag([2.0, 5.0]))
    np.testing.assert_allclose(found.disk_margin, 2.0, rtol=1e-12)
    np.testing.assert_allclose(found.complementary_peak, 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.return_difference, 1.0, rtol=1e-9)


def test_unstable_and_broken_points_leave_their_neighbours_alone():
    A, B, K = (v.copy() for v in random_loops(7, 4, seed=12))
    whole = simultaneous_margins(A, B, K)
    A[1] += 10.0 * np.eye(4)
    A[3, 0, 0], B[4, 1, 1], K[5, 0, 0] = np.nan, np.inf, -np.inf
    A[6], B[6], K[6] = np.zeros((4, 4)), np.zeros((4, 2)), np.zeros((2, 4))
    assert abscissa(A[1], B[1], K[1]) > 0.0
    found = simultaneous_margins(A, B, K)
    good = [0, 2]
    same(found.take(good), whole.take(good), 1e-12)
    for field in fields(SimultaneousMargins):
        values = getattr(found, field.name)[[1, 3, 4, 5, 6]]
        assert np.all(np.isnan(values)) if field.name != "proved" else not values.any()


def test_batched_is_single():
    A, B, K = (v.reshape(2, 3, *v.shape[1:]) for v in random_loops(6, 5, seed=13))
    whole = simultaneous_margins(A, B, K)
    for index in np.ndindex(2, 3):
        same(whole.take(index), simultaneous_margins(A[index], B[index], K[index]), 1e-12)
    shared = simultaneous_margins(A, B[0, 0], K)
    same(shared.take((0, 0)), whole.take((0, 0)), 1e-12)


def test_blocks_of_points_join():
    A, B, K = (np.concatenate([v] * 6) for v in random_loops(25, 3, seed=14))
    found = simultaneous_margins(A, B, K)
    same(found.take(slice(0, 25)), found.take(slice(125, 150)), 1e-12)
    same(found.take(slice(50, 75)), simultaneous_margins(A[:25], B[:25], K[:25]), 1e-12)


def test_results_are_read_only_and_can_be_spread():
    found = simultaneous_margins(*random_loops(3, 2, seed=15))
    with pytest.raises(ValueError, match="read-only"):
        found.disk_margin[0] = 1.0
    wide = found.spread(np.array([True, False, True, True]))
    assert np.isnan(wide.disk_margin[1])
    assert wide.worst_factors.shape == (4, 2)
    assert replace(found, proved=~found.proved).proved.any() != found.proved.any()


@pytest.mark.parametrize(
    ("shapes", "delays", "message"),
    [
        (((3, 3), (3, 1), (1, 3)), None, "must be"),
        (((3, 3), (4, 2), (2, 3)), None, "must be"),
        (((3, 2), (3, 2), (2, 3)), None, "must be"),
        (((3, 3), (3, 2), (2, 3)), [0.1, -0.1], "delays"),
        (((3, 3), (3, 2), (2, 3)), [np.nan, 0.1], "delays"),
    ],
)
def test_requests_that_cannot_work(shapes, delays, message):
    with pytest.raises(ValueError, match=message):
        simultaneous_margins(*(np.zeros(shape) for shape in shapes), delays)


def test_the_loop_transfer_is_that_of_the_plants_input():
    """Against T from L itself, so that nothing hangs on the closed form of T."""
    A, B, K = (v[0] for v in random_loops(1, 3, seed=16))
    found = simultaneous_margins(A, B, K)
    T = complementary_of(A, B, K, np.array([float(found.sensitivity_omega), float(found.complementary_omega)]) + 1e-9)
    np.testing.assert_allclose(np.linalg.norm(np.eye(2) - T[0], ord=2), found.sensitivity_peak, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(T[1], ord=2), found.complementary_peak, rtol=1e-6)
