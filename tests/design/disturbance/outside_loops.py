"""Loops and closed systems to test with: random ones with every matrix full, and some of a given transfer function."""

from __future__ import annotations

import numpy as np

from design.disturbance.closed_system import ClosedSystem
from design.loop import Loop


def full_loop(grid=(2, 3), seed=1, delay=(0.0, 0.0), stable=True) -> Loop:
    """A random loop of 5 states in which nothing is zero; noise ``n_noise`` and a disturbance ``d_disturbance``."""
    rng = np.random.default_rng(seed)
    n, m, p, q, o = 5, len(delay), 1, 2, 3
    shapes = {
        "A": (n, n), "B": (n, m), "E": (n, p), "G": (n, q), "K": (m, n), "N": (m, p), "M": (m, q),
        "C": (o, n), "F": (o, n), "D": (o, m), "H": (o, m),
    }  # fmt: skip
    arrays = {name: rng.standard_normal((*grid, *shape)) for name, shape in shapes.items()}
    if stable:
        arrays["K"] *= 0.3
        closed = arrays["A"] - arrays["B"] @ arrays["K"]
        growth = np.linalg.eigvals(closed).real.max(axis=-1) + 2.0
        arrays["A"] -= growth[..., None, None] * np.eye(n)
    return Loop(
        **arrays, offset=rng.standard_normal((*grid, o)), states=tuple("abcde"), inputs=("tab", "aileron")[:m],
        references=("r_a",), outputs=("x", "y", "z"), disturbances=("d_disturbance", "n_noise"), stages=(), delay=delay,
    )  # fmt: skip


def plain_loop(A, B, K, G, M, C, delay=0.0) -> Loop:
    """``x' = A x + B v + G w``, ``u = -K x + M w``, ``y = C x`` of one point; from w0 w1 .. to y0 y1 .."""
    A, B, K, G, M, C = (np.atleast_2d(np.asarray(X, dtype=float)) for X in (A, B, K, G, M, C))
    n, m, o = len(A), B.shape[1], len(C)
    return Loop(
        A=A, B=B, E=np.zeros((n, 0)), G=G, K=K, N=np.zeros((m, 0)), M=M, C=C, F=np.zeros((o, n)), D=np.zeros((o, m)),
        H=np.zeros((o, m)), offset=np.zeros(o), states=tuple(f"x{i}" for i in range(n)), inputs=("u0", "u1")[:m],
        references=(), outputs=tuple(f"y{i}" for i in range(o)), disturbances=tuple(f"w{i}" for i in range(G.shape[1])),
        stages=(), delay=(delay,) * m,
    )  # fmt: skip


def of_transfer(numerator, denominator) -> ClosedSystem:
    """One input, one output, in controllable form: rows of as many coefficients, one row for each point of the grid."""
    numerator, denominator = (np.atleast_2d(np.asarray(p, dtype=float)) for p in (numerator, denominator))
    count, n = len(denominator), denominator.shape[-1] - 1
    A, B = np.zeros((count, n, n)), np.zeros((count, n, 1))
    A[:, np.arange(1, n), np.arange(n - 1)] = B[:, 0, 0] = 1.0
    A[:, 0] = -denominator[:, 1:] / denominator[:, :1]
    direct = numerator[:, :1] / denominator[:, :1]
    C = numerator[:, 1:] / denominator[:, :1] + direct * A[:, 0]
    return ClosedSystem.of(A, B, C[:, None], direct[..., None])


def oscillators(omega, zeta) -> ClosedSystem:
    """``w^2 / (s^2 + 2 z w s + w^2)`` over the shape of omega and zeta."""
    omega, zeta = np.broadcast_arrays(np.asarray(omega, dtype=float), np.asarray(zeta, dtype=float))
    A, B = np.zeros((*omega.shape, 2, 2)), np.zeros((*omega.shape, 2, 1))
    A[..., 0, 1], A[..., 1, 0], A[..., 1, 1], B[..., 1, 0] = 1.0, -(omega**2), -2.0 * zeta * omega, omega**2
    C = np.broadcast_to([[1.0, 0.0]], (*omega.shape, 1, 2))
    return ClosedSystem.of(A, B, C, np.zeros((*omega.shape, 1, 1)))


def random_systems(count, seed, n=5, o=3, p=2, damping=None) -> ClosedSystem:
    """Random stable systems; with `damping`, the least damped pole has about that."""
    rng = np.random.default_rng(seed)
    A = 20.0 * rng.standard_normal((count, n, n))
    values = np.linalg.eigvals(A)
    shift = values.real.max(axis=-1) + rng.uniform(0.5, 5.0, count)
    if damping is not None:
        shift = values.real.max(axis=-1) + damping * np.abs(values).max(axis=-1)
    A -= shift[:, None, None] * np.eye(n)
    B, C = rng.standard_normal((count, n, p)), rng.standard_normal((count, o, n))
    return ClosedSystem.of(A, B, C, np.zeros((count, o, p)))


def same_at_every_point(function, system, fields, tolerance=1e-12):
    """``function(system)`` at a point of the grid is ``function(point)``, nan and infinite where it is."""
    whole = function(system)
    for index in np.ndindex(system.grid):
        alone = function(system.take(index))
        for field in fields:
            np.testing.assert_allclose(
                getattr(whole, field)[index],
                getattr(alone, field),
                rtol=tolerance,
                atol=0.0,
                err_msg=f"{field} {index}",
            )
