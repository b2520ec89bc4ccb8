"""State feedbacks with two inputs to test with, and slow ways to look at them."""

import control as ct
import numpy as np
from scipy.linalg import solve_continuous_are


def random_loops(count, order, seed, gain=1.0):
    """Loops (count, ...) whose closed loop is stable by construction; about half of the plants are not."""
    rng = np.random.default_rng(seed)
    closed = rng.standard_normal((count, order, order))
    growth = np.linalg.eigvals(closed).real.max(axis=-1) + rng.uniform(0.05, 1.0, count)
    closed -= growth[:, None, None] * np.eye(order)
    return of_closed(closed, rng.standard_normal((count, order, 2)), gain * rng.standard_normal((count, 2, order)))


def of_closed(closed, B, K):
    return closed + B @ K, B, K


def regulators(count, order, seed, R=(1.0, 1.0)):
    """LQ regulators with ``Q = I`` and diagonal R."""
    rng = np.random.default_rng(seed)
    A, B = rng.standard_normal((count, order, order)), rng.standard_normal((count, order, 2))
    weights = np.eye(order), np.diag(R)
    X = np.array([solve_continuous_are(a, b, *weights) for a, b in zip(A, B, strict=True)])
    return A, B, np.linalg.inv(weights[1]) @ B.mT @ X


def resonant_loops(count, order, seed, spread, damping, scale):
    """Closed loops of lightly damped modes over some decades, each input and output taking part in all of them."""
    rng = np.random.default_rng(seed)
    closed = np.zeros((count, order, order))
    for matrix in closed:
        k = 0
        while k < order:
            w, zeta = 10.0 ** rng.uniform(-spread / 2, spread / 2), 10.0 ** rng.uniform(np.log10(damping), 0.0)
            if k + 1 < order and rng.random() < 0.8:
                matrix[k : k + 2, k : k + 2] = [[0.0, w], [-w, -2.0 * zeta * w]]
                k += 2
            else:
                matrix[k, k] = -w
                k += 1
    K = rng.standard_normal((count, 2, order)) * 10.0 ** rng.uniform(-scale, scale, (count, 2, order))
    return of_closed(closed, rng.standard_normal((count, order, 2)), K)


def complementary_of(A, B, K, omega, delays=(0.0, 0.0)):
    """T (W, 2, 2) of one loop from L itself."""
    plant = np.linalg.solve(1j * omega[:, None, None] * np.eye(len(A)) - A, B.astype(complex))
    L = np.exp(-1j * omega[:, None] * np.asarray(delays))[:, :, None] * (K @ plant)
    return np.linalg.solve(np.eye(2) + L, L)


def dense(poles, points=4000):
    """Frequencies (W,) about all poles (n,), and 0."""
    size = np.abs(poles)
    offsets = np.geomspace(1e-3, 300.0, 150)
    near = np.abs(poles.imag)[:, None] + np.abs(poles.real)[:, None] * np.concatenate([-offsets, [0.0], offsets])
    wide = np.geomspace(size.min() * 1e-3, size.max() * 1e3, points)
    return np.unique(np.abs(np.concatenate([[0.0], near.ravel(), wide])))


def sampled_mu(matrices):
    """mu (W,) of (W, 2, 2) as the least largest singular value over scalings, on samples of these: never below."""
    scaling = np.exp(np.linspace(-12.0, 12.0, 1201))
    best = np.full(len(matrices), np.inf)
    for d in scaling:
        scaled = matrices * np.array([[1.0, d], [1.0 / d, 1.0]])
        best = np.minimum(best, np.linalg.norm(scaled, ord=2, axis=(-2, -1)))
    return best


def abscissa(A, B, K, factors=(1.0, 1.0)):
    """Largest real part of the eigenvalues with these factors (..., 2) at the inputs."""
    return np.linalg.eigvals(A - B @ (np.asarray(factors)[..., None] * K)).real.max(axis=-1)


def factor(delta):
    return (1.0 + delta) / (1.0 - delta)


def control_return_difference(A, B, K, omega):
    """Smallest singular value of ``I + L`` (N, W) point by point, as users of python-control do."""
    found = []
    for a, b, k in zip(A, B, K, strict=True):
        response = ct.frequency_response(ct.ss(a, b, k, np.zeros((2, 2))), omega).frdata
        found.append([np.linalg.svd(np.eye(2) + L, compute_uv=False)[-1] for L in np.moveaxis(response, -1, 0)])
    return np.array(found)


def delayed_abscissa(A, B, K, delays, points=40):
    """Largest real part of the roots of ``x'(t) = A x(t) - sum B_i K_i x(t - tau_i)``.

    By collocation of the infinitesimal generator at Chebyshev points (Breda, Maset and Vermiglio 2005).
    """
    n, longest = len(A), max(delays)
    k = np.arange(points + 1)
    theta = np.cos(np.pi * k / points)
    weight = np.concatenate([[2.0], np.ones(points - 1), [2.0]]) * (-1.0) ** k
    D = np.outer(weight, 1.0 / weight) / (theta[:, None] - theta + np.eye(points + 1))
    D -= np.diag(D.sum(axis=1))
    generator = np.kron(2.0 / longest * D, np.eye(n))
    generator[:n] = 0.0
    generator[:n, :n] = A
    for i, tau in enumerate(delays):
        apart = 1.0 - 2.0 * tau / longest - theta
        at = np.abs(apart) < 1e-14
        with np.errstate(divide="ignore"):
            row = at.astype(float) if at.any() else 1.0 / (weight * apart)
        generator[:n] -= np.kron(row / row.sum(), np.outer(B[:, i], K[i]))
    return np.linalg.eigvals(generator).real.max()
