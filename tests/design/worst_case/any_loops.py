"""Loops without gains, for worst references: any system behind one reference or two, and its exact simulation."""

import numpy as np
from scipy.linalg import expm

from design.loop import Loop


def system(A, b, C, D=None, R=None, trim=None, references=("r_a",), outputs=None):
    """``x' = A x + b r, y = C x + D r + R r' + trim`` over any grid, as a loop whose command is the reference."""
    A, b, C = (np.asarray(M, dtype=float) for M in (A, b, C))
    *grid, n, p = b.shape
    o = C.shape[-2]
    D = np.zeros((*grid, o, p)) if D is None else np.asarray(D, dtype=float)
    R = np.zeros((*grid, o, p)) if R is None else np.asarray(R, dtype=float)
    trim = np.zeros((*grid, o)) if trim is None else np.asarray(trim, dtype=float)
    eye = np.broadcast_to(np.eye(p), (*grid, p, p))

    def none(rows, columns):
        return np.zeros((*grid, rows, columns))

    return Loop(
        A=A, B=b, E=none(n, p), G=none(n, 0), K=none(p, n), N=eye, M=none(p, 0), C=C, F=none(o, n), D=D, H=R,
        offset=trim, states=tuple(f"x{i}" for i in range(n)), inputs=("tab", "aileron")[-p:], references=references,
        outputs=outputs or ("da", "dt", "T_a", "T_t")[:o], disturbances=(), stages=(), delay=(0.0,) * p,
    )  # fmt: skip


def random_system(seed, count, n=5, o=3, direct=True):
    """`count` stable systems of widely spread modes, oscillating ones among them."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((count, n, n)) * np.geomspace(2.0, 60.0, n)[:, None]
    shift = np.linalg.eigvals(A).real.max(axis=-1) + rng.uniform(0.5, 5.0, count)
    A = A - shift[:, None, None] * np.eye(n)
    D = rng.standard_normal((count, o, 1)) if direct else None
    return system(A, rng.standard_normal((count, n, 1)), rng.standard_normal((count, o, n)), D)


def resonance(omega, zeta):
    """``omega^2 / (s^2 + 2 zeta omega s + omega^2)``."""
    A = [[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]]
    return system(A, [[0.0], [omega**2]], [[1.0, 0.0]])


def at_knots(loop, manoeuvre):
    """(k, o) exact outputs just after each knot and just before it, by the matrix exponential of each stretch."""
    A, b, C, D = loop.closed, loop.reference_input, loop.closed_outputs, loop.reference_feedthrough
    R = loop.H @ loop.N
    n, p = b.shape
    x, after, before = np.zeros(n), [], []
    for k, time in enumerate(manoeuvre.times):
        value, slope = manoeuvre.values[k], manoeuvre.slopes[k]
        if k:
            length = time - manoeuvre.times[k - 1]
            M = np.zeros((n + 2 * p, n + 2 * p))
            M[:n, :n], M[:n, n : n + p] = A, b
            M[n : n + p, n + p :] = np.eye(p)
            x = (expm(M * length) @ np.concatenate([x, manoeuvre.values[k - 1], manoeuvre.slopes[k - 1]]))[:n]
            before.append(C @ x + D @ manoeuvre.ends[k - 1] + R @ manoeuvre.slopes[k - 1] + loop.offset)
        after.append(C @ x + D @ value + R @ slope + loop.offset)
    return np.array(after), np.array([loop.offset, *before])
