import numpy as np
import pytest

from design.frequency.margins import margins
from design.loop import SisoLoop
from design.robustness.diagonal import structured_singular_value
from design.robustness.simultaneous import simultaneous_margins
from tests.design.robustness.two_input_loops import (
    complementary_of,
    delayed_abscissa,
    factor,
    random_loops,
    regulators,
)

DELAYS = [(0.05, 0.05), (0.3, 0.0), (0.0, 1.0), (0.1, 0.6)]
NUMBERS = ("disk_margin", "sensitivity_margin", "complementary_margin", "sensitivity_peak", "complementary_peak")


@pytest.mark.parametrize("delays", DELAYS)
def test_stable_where_the_roots_of_the_delay_equation_are(delays):
    A, B, K = regulators(25, 4, seed=1)
    found = simultaneous_margins(A, B, K, delays)
    roots = np.array([delayed_abscissa(*loop, delays) for loop in zip(A, B, K, strict=True)])
    np.testing.assert_array_equal(np.isfinite(found.disk_margin), roots < 0.0)
    assert not found.proved.any()


def test_a_delay_can_stabilise():
    """``x'' - 0.05 x' + x = 0.2 x(t - 1.5)``: the delayed position is a negative rate."""
    A = np.array([[0.0, 1.0, 0.0], [-1.0, 0.05, 0.0], [0.0, 0.0, -1.0]])
    B = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    K = np.array([[-0.2, 0.0, 0.0], [0.0, 0.0, 0.5]])
    lags = np.array([0.0, 0.1, 0.5, 1.5, 2.5, 3.0, 3.1, 4.0])
    delays = np.stack([lags, np.zeros_like(lags)], axis=-1)
    found = simultaneous_margins(np.tile(A, (8, 1, 1)), B, K, delays)
    roots = np.array([np.linalg.eigvals(A - B @ K).real.max()] + [delayed_abscissa(A, B, K, d) for d in delays[1:]])
    np.testing.assert_array_equal(np.isfinite(found.disk_margin), roots < 0.0)
    assert 0 < np.isfinite(found.disk_margin).sum() < 8


@pytest.mark.parametrize("delays", DELAYS[:2])
def test_peaks_are_nowhere_exceeded(delays):
    A, B, K = regulators(8, 4, seed=2)
    found = simultaneous_margins(A, B, K, delays)
    omega = np.unique(np.concatenate([np.geomspace(1e-4, 1e4, 8000), np.linspace(0.01, 150.0, 20000)]))
    stable = np.flatnonzero(np.isfinite(found.disk_margin))
    assert stable.size > 2
    for i in stable:
        T = complementary_of(A[i], B[i], K[i], omega, delays)
        S = np.eye(2) - T
        peaks = (
            2.0 / structured_singular_value(S - T).max(),
            1.0 / structured_singular_value(S).max(),
            1.0 / structured_singular_value(T).max(),
            np.linalg.norm(S, ord=2, axis=(1, 2)).max(),
            np.linalg.norm(T, ord=2, axis=(1, 2)).max(),
        )
        mine = np.array([getattr(found, name)[i] for name in NUMBERS])
        better = np.array(peaks) / mine - 1.0
        # Margins are from above, peaks from below.
        assert np.all(better[:3] >= -1e-7)
        assert np.all(better[3:] <= 1e-7)
        assert np.all(np.abs(better) < 1e-3)


def test_worst_factors_make_the_loop_singular():
    delays = np.array([0.1, 0.2])
    A, B, K = regulators(12, 3, seed=3)
    found = simultaneous_margins(A, B, K, delays)
    reached = np.flatnonzero(np.isfinite(found.worst_factors).all(axis=-1))
    assert reached.size > 6
    stable = np.isfinite(found.disk_margin)
    assert not stable[1]
    np.testing.assert_array_equal(np.isnan(found.worst_factors).all(axis=-1), ~stable)
    for i in reached:
        s = 1j * found.disk_omega[i]
        F = found.worst_factors[i] * np.exp(-s * delays)
        matrix = np.linalg.solve(s * np.eye(3) - A[i], B[i] @ (F[:, None] * K[i]))
        values = np.linalg.eigvals(np.eye(3) + matrix)
        assert np.abs(values).min() < 1e-9 * (1.0 + np.abs(matrix).max())
        # And a little less of them does not destabilise: the roots with complex factors, by a doubled real system.
        delta = 0.98 * (found.worst_factors[i] - 1.0) / (found.worst_factors[i] + 1.0)
        assert np.abs(factor(delta) - 1.0).max() < np.abs(found.worst_factors[i] - 1.0).max()
        assert doubled_abscissa(A[i], B[i], factor(delta)[:, None] * K[i], delays) < 0.0


def doubled_abscissa(A, B, K, delays):
    """Roots of a complex delayed feedback: real and imaginary parts side by side, each input with its own delay."""
    n = len(A)
    inputs, outputs = np.zeros((2 * n, 4)), np.zeros((4, 2 * n))
    for i in range(2):
        inputs[:n, 2 * i], inputs[n:, 2 * i + 1] = B[:, i], B[:, i]
        outputs[2 * i] = np.concatenate([K[i].real, -K[i].imag])
        outputs[2 * i + 1] = np.concatenate([K[i].imag, K[i].real])
    return delayed_abscissa(np.kron(np.eye(2), A), inputs, outputs, tuple(np.repeat(delays, 2)))


def test_loops_that_do_not_meet_have_the_smaller_single_margin():
    A, B, K = random_loops(24, 2, seed=4)
    delay = 0.15
    whole = np.tile(A.reshape(12, 4, 2), (1, 1, 2)) * np.kron(np.eye(2), np.ones((2, 2)))
    inputs, outputs = np.zeros((12, 4, 2)), np.zeros((12, 2, 4))
    singles = []
    for i in range(2):
        rows = slice(2 * i, 2 * i + 2)
        inputs[:, rows, i], outputs[:, i, rows] = B[i::2, :, i], K[i::2, i]
        singles.append(margins(SisoLoop("u", A[i::2], B[i::2, :, i], K[i::2, i], np.ones(12), 1, delay)).disk_margin)
    found = simultaneous_margins(whole, inputs, outputs, (delay, delay)).disk_margin
    least = np.minimum(*singles)
    assert np.isfinite(least).sum() > 4
    np.testing.assert_allclose(found, least, rtol=1e-6)


def test_next_to_no_delay_is_no_delay():
    A, B, K = regulators(15, 5, seed=5)
    exact, tiny = simultaneous_margins(A, B, K), simultaneous_margins(A, B, K, (1e-10, 3e-10))
    for name in NUMBERS:
        np.testing.assert_allclose(getattr(tiny, name), getattr(exact, name), rtol=1e-7)


def test_points_without_delay_are_still_proved():
    A, B, K = regulators(6, 3, seed=6)
    delays = np.zeros((6, 2))
    delays[::2] = 0.05
    mixed, exact = simultaneous_margins(A, B, K, delays), simultaneous_margins(A, B, K)
    np.testing.assert_array_equal(mixed.proved, [False, True] * 3)
    np.testing.assert_allclose(mixed.disk_margin[1::2], exact.disk_margin[1::2], rtol=1e-13)
    late = simultaneous_margins(A[::2], B[::2], K[::2], (0.05, 0.05))
    np.testing.assert_allclose(mixed.disk_margin[::2], late.disk_margin, rtol=1e-12)


def test_batched_is_single():
    A, B, K = (v.reshape(5, 2, *v.shape[1:]) for v in regulators(10, 4, seed=7))
    delays = np.random.default_rng(7).uniform(0.0, 0.4, (5, 2, 2))
    whole = simultaneous_margins(A, B, K, delays)
    for index in np.ndindex(5, 2):
        one = simultaneous_margins(A[index], B[index], K[index], delays[index])
        for name in NUMBERS:
            np.testing.assert_allclose(getattr(one, name), getattr(whole, name)[index], rtol=1e-12)


def test_a_delay_that_is_too_long_is_not_judged():
    """Half a thousand turns within the band of the loop: nan, not a guess."""
    A, B, K = -np.eye(2), np.eye(2), np.array([[0.5, 0.1], [0.0, 0.5]])
    assert np.isfinite(simultaneous_margins(A, B, K, (50.0, 1.0)).disk_margin)
    assert np.isnan(simultaneous_margins(A, B, K, (5000.0, 1.0)).disk_margin)


def test_a_pole_next_to_the_axis_between_the_points_of_the_grid():
    """The delay is taken to within a billionth of the one that destabilises: a peak that no grid shows."""
    A, B = -np.eye(2), np.eye(2)
    K = np.array([[3.0, 0.4], [-0.3, 2.0]])

    def stable(tau):
        return bool(np.isfinite(simultaneous_margins(A, B, K, (tau, tau)).disk_margin))

    low, high = 0.1, 3.0
    assert stable(low)
    assert not stable(high)
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    found = simultaneous_margins(A, B, K, (low, low))
    assert found.disk_margin < 1e-8
    assert delayed_abscissa(A, B, K, (0.999 * low,) * 2) < 0.0 < delayed_abscissa(A, B, K, (1.001 * low,) * 2)


def test_a_weak_mode_that_the_delay_brings_next_to_the_axis():
    """Away from where it is without delay, and so narrow that the grid sees only what is beside it."""
    A, B = np.zeros((4, 4)), np.array([[0.0, 0.0], [-1e-4, 4e-5], [2.2, -0.05], [1.2, -0.12]])
    A[:2, :2], A[2:, 2:] = [[0.0, 1.34], [-1.34, -2e-7]], -np.eye(2)
    K = np.array([[-0.9, 0.8, 0.46, 0.42], [0.7, 0.86, 0.31, 0.76]])
    delays = (1.6875, 1.6875)
    found = simultaneous_margins(A, B, K, delays)
    T = complementary_of(A, B, K, np.linspace(1.3395, 1.3405, 100001), delays)
    np.testing.assert_allclose(found.disk_margin, 2.0 / structured_singular_value(np.eye(2) - 2.0 * T).max(), rtol=1e-3)
    assert found.disk_margin < 1e-3


@pytest.mark.parametrize("higher", [0, 1])
def test_the_higher_of_two_peaks_that_the_grid_shows_the_other_way_round(higher):
    """A narrow and a broad resonance in two channels, one a millionth higher, the narrow one between two points."""
    damping, frequency, size = np.array([0.01, 0.3]), np.array([1.0, 40.0]), np.ones(2)
    size[higher] += 1e-6
    closed, B, K = np.zeros((4, 4)), np.zeros((4, 2)), np.zeros((2, 4))
    for i, (zeta, w) in enumerate(zip(damping, frequency, strict=True)):
        closed[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[0.0, w], [-w, -2.0 * zeta * w]]
        B[2 * i + 1, i], K[i, 2 * i] = w, size[i] * 2.0 * zeta * np.sqrt(1.0 - zeta**2)
    found = simultaneous_margins(closed + B @ K, B, K, (1e-9, 1e-9))
    np.testing.assert_allclose(found.complementary_peak, 1.0 + 1e-6, rtol=1e-7)
    at = frequency * np.sqrt(1.0 - 2.0 * damping**2)
    np.testing.assert_allclose(found.complementary_omega, at[higher], rtol=1e-4)
