"""H2 norms against closed forms, exact fractions, scipy, quadrature, and a simulation with noise."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.linalg import expm, solve_continuous_lyapunov

from design.disturbance.closed_system import ClosedSystem, closed_system
from design.disturbance.h2 import h2_norm
from tests.design.disturbance.outside_loops import (
    full_loop,
    of_transfer,
    oscillators,
    plain_loop,
    random_systems,
    same_at_every_point,
)


def test_second_order_closed_form():
    """``w^2 / (s^2 + 2 z w s + w^2)`` has ``sqrt(w / (4 z))``."""
    omega = np.array([1e-2, 1.0, 377.0, 1e4])[:, None]
    zeta = np.array([1e-8, 1e-3, 0.1, 0.7, 1.0, 30.0])
    norm = h2_norm(oscillators(omega, zeta))
    np.testing.assert_allclose(norm.pairs[..., 0, 0], np.sqrt(omega / (4.0 * zeta)), rtol=1e-12)
    np.testing.assert_allclose(norm.total, np.sqrt(omega / (4.0 * zeta)), rtol=1e-12)


@pytest.mark.parametrize(
    "lags",
    [(1, 2), (Fraction(1, 100), 10000), (Fraction(1, 100), 1, 10000), (3, 3000, 4000, 5000), (1, 2, 3, 4, 5, 6, 7, 8)],
)
def test_chains_of_lags_in_exact_fractions(lags):
    """``prod a / (s + a)`` as a chain: poles up to six decades apart."""
    rates = [Fraction(a) for a in lags]
    square = Fraction(0)
    residues = []
    for i, a in enumerate(rates):
        residue = Fraction(1)
        for j, b in enumerate(rates):
            residue *= b if j == i else b / (b - a)
        residues.append(residue)
    for a, r in zip(rates, residues, strict=True):
        square += sum(r * q / (a + b) for b, q in zip(rates, residues, strict=True))
    n = len(rates)
    a = np.array([float(rate) for rate in rates])
    A = -np.diag(a) + np.diag(a[1:], -1)
    B, C = np.zeros((n, 1)), np.zeros((1, n))
    B[0], C[0, -1] = a[0], 1.0
    norm = h2_norm(ClosedSystem.of(A, B, C, np.zeros((1, 1))))
    np.testing.assert_allclose(norm.pairs.item(), np.sqrt(float(square)), rtol=1e-12)


def test_random_systems_against_scipy():
    systems = random_systems(20, seed=3, n=8)
    norm = h2_norm(systems)
    for i in range(20):
        A, B, C = systems.A[i], systems.B[i], systems.C[i]
        each = [np.diag(C @ solve_continuous_lyapunov(A, -np.outer(b, b)) @ C.T) for b in B.T]
        np.testing.assert_allclose(norm.pairs[i], np.sqrt(each).T, rtol=1e-9)
        P = solve_continuous_lyapunov(A, -B @ B.T)
        np.testing.assert_allclose(norm.total[i], np.sqrt(np.trace(C @ P @ C.T)), rtol=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([2, 4, 6]), st.floats(0.0, 6.0))
def test_a_norm_is_right_or_not_given(seed, n, decades):
    """Modes spread over decades in states that mix them all: what rounding hides is nan, not wrong."""
    rng = np.random.default_rng(seed)
    poles = -(10.0 ** rng.uniform(-decades / 2, decades / 2, n))
    T = rng.standard_normal((n, n))
    A, B, C = T @ (poles[:, None] * np.linalg.inv(T)), rng.standard_normal((n, 1)), rng.standard_normal((1, n))
    value = h2_norm(ClosedSystem.of(A, B, C, np.zeros((1, 1)))).pairs.item()
    values, vectors = np.linalg.eig(A)
    residues = (C @ vectors)[0] * np.linalg.solve(vectors, B)[:, 0]
    expected = -np.sum(residues[:, None] * residues / (values[:, None] + values)).real
    sure = np.sum(np.abs(residues[:, None] * residues / (values[:, None] + values))) * np.linalg.cond(vectors) * 1e-14
    if sure < 1e-4 * expected:
        assert np.isnan(value) or abs(value**2 - expected) < 2e-4 * expected + sure


def test_hopeless_conditioning_is_nan():
    """The reached states are seen by an output that nearly cancels them."""
    A = np.array([[-1.0, 0.0], [0.0, -1.0 - 1e-13]])
    cancelling = ClosedSystem.of(A, np.ones((2, 1)), np.array([[1.0, -1.0]]), np.zeros((1, 1)))
    assert np.isnan(h2_norm(cancelling).pairs).all()


def test_what_is_infinite_zero_or_missing():
    A = np.array([[-1.0, 0.0], [0.0, -2.0]])
    system = ClosedSystem.of(A, np.eye(2), np.eye(2), np.array([[0.0, 0.0], [0.0, 3.0]]))
    norm = h2_norm(system)
    np.testing.assert_allclose(norm.pairs, [[np.sqrt(0.5), 0.0], [0.0, np.inf]], rtol=1e-14)
    assert norm.total == np.inf
    for growing in (np.diag([-1.0, 0.0]), np.diag([-1.0, 1e-3]), np.diag([-1.0, np.nan])):
        assert np.isnan(h2_norm(ClosedSystem.of(growing, np.eye(2), np.eye(2), np.zeros((2, 2)))).pairs).all()


def test_root_mean_squares_add_up():
    norm = h2_norm(random_systems(4, seed=5))
    intensity = np.array([0.3, 2.0])
    expected = np.sqrt(norm.pairs[..., 0] ** 2 * 0.3 + norm.pairs[..., 1] ** 2 * 2.0)
    np.testing.assert_allclose(norm.rms(intensity), expected, rtol=1e-14)
    np.testing.assert_allclose(norm.rms(np.tile(intensity, (4, 1))), expected, rtol=1e-14)
    silent = h2_norm(ClosedSystem.of(-np.eye(1), np.ones((1, 2)), np.ones((1, 1)), np.array([[0.0, 1.0]])))
    np.testing.assert_allclose(silent.rms(np.array([4.0, 0.0])), [np.sqrt(2.0)], rtol=1e-14)
    assert silent.rms(np.array([4.0, 1e-9])) == np.inf


def test_root_mean_square_of_a_simulation():
    """The loop driven by white noise, discretised exactly (Van Loan 1978), within four standard errors."""
    system = oscillators(6.0, 0.3)
    intensity, step, samples, runs = 0.04, 0.05, 4000, 64
    A, Q = system.A, intensity * system.B @ system.B.T
    block = expm(np.block([[-A, Q], [np.zeros((2, 2)), A.T]]) * step)
    Ad = block[2:, 2:].T
    root = np.linalg.cholesky(Ad @ block[:2, 2:])
    rng = np.random.default_rng(12)
    x, squares = np.zeros((runs, 2)), np.zeros(runs)
    for k in range(samples + 200):
        x = x @ Ad.T + rng.standard_normal((runs, 2)) @ root.T
        squares += x[:, 0] ** 2 * (k >= 200)
    mean = squares / samples
    expected = h2_norm(system).rms(np.array([intensity])).item() ** 2
    error = mean.std(ddof=1) / np.sqrt(runs)
    assert abs(mean.mean() - expected) < 4.0 * error < 0.1 * expected


def test_grid_equals_points():
    same_at_every_point(h2_norm, random_systems(6, seed=1), ("pairs", "total"), 1e-11)
    same_at_every_point(h2_norm, closed_system(full_loop(), ("r_a",), ("tab",)), ("pairs", "total"), 1e-11)


@pytest.mark.parametrize("product", [1e-3, 0.1, 1.0, 1.5, 1.57])
def test_delayed_integrator_closed_form(product):
    """``dx = -k x(t - h) dt + dW`` has the variance ``(1 + sin kh) / (2 k cos kh)`` (Kuechler and Mensch 1992)."""
    delay = 0.02
    k = product / delay
    loop = plain_loop([[0.0]], [[1.0]], [[k]], [[1.0, 0.0]], [[0.0, -k]], [[1.0]], delay=delay)
    norm = h2_norm(closed_system(loop, ("w0", "w1"), ("y0", "u0")))
    variance = (1.0 + np.sin(product)) / (2.0 * k * np.cos(product))
    # Noise on what is measured enters through the delay with the gain; the command sees it at once.
    np.testing.assert_allclose(norm.pairs[0], np.sqrt(variance) * np.array([1.0, k]), rtol=1e-8)
    np.testing.assert_allclose(norm.pairs[1], [np.sqrt(variance) * k, np.inf], rtol=1e-8)


def test_delayed_oscillators_against_quadrature():
    """Three states, a delay, a lightly damped mode that only the delay destabilises nearly."""
    A = [[0.0, 1.0, 0.0], [-100.0, -0.4, 100.0], [0.0, 0.0, -30.0]]
    K = [[0.5, 0.02, 0.0]]
    loop = plain_loop(A, [[0.0], [0.0], [30.0]], K, [[0.0], [1.0], [0.0]], [[0.0]], [[1.0, 0, 0], [0, 1.0, 0]], 0.01)
    system = closed_system(loop, ("w0",), ("y0", "y1"))
    norm = h2_norm(system)

    def density(w, i):
        return float(np.abs(system.response(np.array([w]))[0, i, 0]) ** 2) / np.pi

    for i in range(2):
        peak = np.abs(system.poles[np.argmax(system.poles.real)].imag)
        edges = [0.0, 0.5 * peak, 0.9 * peak, peak, 1.1 * peak, 3.0 * peak, 300.0, 3000.0]
        square = sum(
            quad(density, low, high, args=(i,), epsabs=0.0, epsrel=1e-11, limit=400)[0] for low, high in pairwise(edges)
        )
        square += quad(lambda x, i=i: density(1.0 / x, i) / x**2, 0.0, 1.0 / 3000.0, epsabs=0.0, epsrel=1e-9)[0]
        np.testing.assert_allclose(norm.pairs[i, 0], np.sqrt(square), rtol=2e-8)


def test_a_short_delay_is_hardly_any():
    for delay, difference in ((1e-4, 2e-3), (1e-5, 2e-4)):
        loops = [full_loop(grid=(), seed=9, delay=(d, d)) for d in (delay, 0.0)]
        with_delay, without = (h2_norm(closed_system(loop, ("r_a",), ("tab", "aileron"))).pairs for loop in loops)
        assert np.isinf(without).all()
        assert np.isinf(with_delay).all()
        loop = plain_loop(
            np.diag([-1.0, -2.0]),
            np.eye(2),
            [[1.0, 0.3], [-0.2, 2.0]],
            [[1.0], [1.0]],
            [[0.0], [0.0]],
            np.eye(2),
            delay,
        )
        pair = h2_norm(closed_system(loop, ("w0",), ("y0", "u1"))).pairs
        none = plain_loop(loop.A, loop.B, loop.K, loop.G, loop.M, loop.C)
        np.testing.assert_allclose(pair, h2_norm(closed_system(none, ("w0",), ("y0", "u1"))).pairs, rtol=difference)


def test_delayed_grid_equals_points():
    loop = full_loop(delay=(0.02, 0.05), seed=4)
    system = closed_system(loop, ("d_disturbance",), ("x", "tab"))
    same_at_every_point(h2_norm, system, ("pairs", "total"), 1e-12)


def test_transfers_without_dynamics_between():
    """A zero at the origin, and one that nearly cancels a pole."""
    system = of_transfer([[0.0, 1.0, 0.0], [0.0, 1.0, 2.0 + 1e-9]], [[1.0, 3.0, 2.0], [1.0, 3.0, 2.0]])
    np.testing.assert_allclose(h2_norm(system).pairs[:, 0, 0], [np.sqrt(1.0 / 6.0), np.sqrt(0.5)], rtol=1e-8)
