import numpy as np
import pytest
from scipy.linalg import expm

from design.robustness.diagonal import structured_singular_value
from design.robustness.sampled import simultaneous_margins_sampled
from design.robustness.simultaneous import simultaneous_margins
from tests.design.robustness.two_input_loops import factor, random_loops, regulators

TIME = 0.1


def held(A, B, time=TIME):
    """Zero-order hold of each of (N, n, n) and (N, n, 2)."""
    n = A.shape[-1]
    whole = expm(np.concatenate([np.concatenate([A, B], axis=-1), np.zeros((len(A), 2, n + 2))], axis=-2) * time)
    return whole[:, :n, :n], whole[:, :n, n:]


def loops(count, order, seed):
    A, B, K = regulators(count, order, seed)
    return *held(A, B), K


def radius(A, B, K, factors):
    return np.abs(np.linalg.eigvals(A - B @ (factors[..., None] * K))).max(axis=-1)


@pytest.mark.parametrize("order", [1, 2, 4, 6])
def test_peaks_are_those_of_the_unit_circle_and_nowhere_exceeded(order):
    A, B, K = loops(12, order, seed=order)
    found = simultaneous_margins_sampled(A, B, K, TIME)
    stable = np.flatnonzero(radius(A, B, K, np.ones(2)) < 1.0)
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(found.disk_margin)), stable)
    np.testing.assert_array_equal(np.flatnonzero(found.proved), stable)
    angle = np.unique(np.concatenate([np.linspace(0.0, np.pi, 4000), np.geomspace(1e-5, 1.0, 3000)]))
    z = np.exp(1j * angle)[:, None, None]
    for i in stable:
        closed = A[i] - B[i] @ K[i]
        T = K[i] @ np.linalg.solve(z * np.eye(order) - closed, B[i] + 0j)
        S = np.eye(2) - T
        truth = (
            structured_singular_value(S - T).max(),
            structured_singular_value(S).max(),
            structured_singular_value(T).max(),
            np.linalg.norm(S, ord=2, axis=(1, 2)).max(),
            np.linalg.norm(T, ord=2, axis=(1, 2)).max(),
        )
        mine = (
            2.0 / found.disk_margin[i], 1.0 / found.sensitivity_margin[i], 1.0 / found.complementary_margin[i],
            found.sensitivity_peak[i], found.complementary_peak[i],
        )  # fmt: skip
        assert np.all(np.array(truth) <= np.array(mine) * (1.0 + 1e-9))
        np.testing.assert_allclose(truth, mine, rtol=1e-4)


def test_worst_factors_put_a_pole_on_the_circle():
    A, B, K = loops(40, 4, seed=11)
    found = simultaneous_margins_sampled(A, B, K, TIME)
    reached = np.isfinite(found.worst_factors).all(axis=-1)
    assert reached.sum() > 20
    A, B, K, found = A[reached], B[reached], K[reached], found.take(reached)
    values = np.linalg.eigvals(A - B @ (found.worst_factors[:, :, None] * K))
    assert np.all(np.abs(values - np.exp(1j * found.disk_omega * TIME)[:, None]).min(axis=-1) < 1e-9)
    delta = (found.worst_factors - 1.0) / (found.worst_factors + 1.0)
    np.testing.assert_allclose(np.abs(delta).max(axis=-1), found.disk_margin / 2.0, rtol=1e-9)
    assert np.all(radius(A, B, K, factor(0.999 * delta)) < 1.0)
    rng = np.random.default_rng(1)
    for _ in range(200):
        other = found.disk_margin[:, None] / 2.0 * np.exp(2j * np.pi * rng.random(delta.shape))
        assert np.all(radius(A, B, K, factor(0.999 * other)) < 1.0)


def test_first_order_loops_in_closed_form():
    """``x+ = a x + b u`` in both channels: ``S - T = (z - a - k b) / (z - a + k b)`` is largest at z = 1 or -1."""
    a, b, k = np.array([0.9, 1.2, 0.5]), np.array([0.1, 0.5, 1.0]), np.array([2.0, 1.0, 1.2])
    second = 0.99, 0.01, 1.0
    A, B, K = np.zeros((3, 2, 2)), np.zeros((3, 2, 2)), np.zeros((3, 2, 2))
    for matrix, first, other in zip((A, B, K), (a, b, k), second, strict=True):
        matrix[:, 0, 0], matrix[:, 1, 1] = first, other
    found = simultaneous_margins_sampled(A, B, K, TIME)

    def largest(a, b, k):
        return np.maximum(*(np.abs((z - a - k * b) / (z - a + k * b)) for z in (1.0, -1.0)))

    np.testing.assert_allclose(found.disk_margin, 2.0 / np.maximum(largest(a, b, k), largest(*second)), rtol=1e-12)
    # The last one, a - k b = -0.7, is worst at half the sample rate.
    np.testing.assert_allclose(found.disk_omega[2], np.pi / TIME)
    np.testing.assert_allclose(found.worst_factors[2].imag, 0.0, atol=1e-12)


def test_fast_sampling_is_nearly_continuous():
    A, B, K = regulators(8, 3, seed=12)
    exact = simultaneous_margins(A, B, K)
    for time, tolerance in ((1e-2, 0.2), (1e-4, 2e-3)):
        found = simultaneous_margins_sampled(*held(A, B, time), K, time)
        np.testing.assert_allclose(found.disk_margin, exact.disk_margin, rtol=tolerance)


def test_deadbeat_and_delays_of_whole_samples():
    """All closed-loop poles at 0: ``T = z^-1``, or with a sample's delay as a state ``u`` late by one."""
    found = simultaneous_margins_sampled(np.eye(2), np.eye(2), np.eye(2), 1.0)
    np.testing.assert_allclose(found.disk_margin, 2.0 / 3.0)
    np.testing.assert_allclose(found.disk_omega, np.pi)
    np.testing.assert_allclose(found.worst_factors, [2.0, 1.0], atol=2.0)
    A = np.block([[np.eye(2), np.eye(2)], [np.zeros((2, 4))]])
    B, K = np.concatenate([np.zeros((2, 2)), np.eye(2)]), 0.5 * np.concatenate([np.eye(2), np.eye(2)], axis=1)
    late = simultaneous_margins_sampled(A, B, K, 1.0)
    assert late.proved
    z = np.exp(1j * np.linspace(0.0, np.pi, 20001))
    L = K[0, 0] * (1.0 / (z * (z - 1.0 + 1e-300))) + K[0, 2] / z
    np.testing.assert_allclose(late.disk_margin, 2.0 / np.max(np.abs((1.0 - L[1:]) / (1.0 + L[1:]))), rtol=1e-6)


def test_unstable_and_broken_points_leave_their_neighbours_alone():
    A, B, K = (v.copy() for v in loops(5, 3, seed=13))
    whole = simultaneous_margins_sampled(A, B, K, TIME)
    A[1] += 2.0 * np.eye(3)
    A[3, 0, 0] = np.nan
    found = simultaneous_margins_sampled(A, B, K, TIME)
    assert np.isnan(found.disk_margin[[1, 3]]).all()
    assert not found.proved[[1, 3]].any()
    np.testing.assert_allclose(found.disk_margin[[0, 2, 4]], whole.disk_margin[[0, 2, 4]], rtol=1e-13)


def test_batched_is_single():
    A, B, K = (v.reshape(2, 2, *v.shape[1:]) for v in loops(4, 3, seed=14))
    whole = simultaneous_margins_sampled(A, B, K, TIME)
    for index in np.ndindex(2, 2):
        one = simultaneous_margins_sampled(A[index], B[index], K[index], TIME)
        np.testing.assert_allclose(one.disk_margin, whole.disk_margin[index], rtol=1e-12)
        np.testing.assert_allclose(one.complementary_peak, whole.complementary_peak[index], rtol=1e-12)


@pytest.mark.parametrize("time", [0.0, -1.0, np.nan, np.inf])
def test_no_such_sample_time(time):
    with pytest.raises(ValueError, match="sample time"):
        simultaneous_margins_sampled(*random_loops(1, 2, seed=1), time)
