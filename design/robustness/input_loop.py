"""The complementary sensitivity of a state feedback at its two inputs, from the matrices themselves.

With the loop transfer ``L = K (sI - A)^-1 B`` at the plant's input, ``T = (I + L)^-1 L = K (sI - A + B K)^-1 B`` is
finite on the whole axis as soon as the closed loop has no pole there, whatever the plant has. A delay of each input
multiplies L from the left by ``diag(exp(-s tau_i))``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray


@dataclass(frozen=True, eq=False)
class InputLoop(GridArrays):
    """Loops of N points in one row; without their delays ``T = D + K (sI - A)^-1 B``.

    Attributes
    ----------
    A : (N, n, n) of the *closed* loop
    B, K : (N, n, 2), (N, 2, n)
    D : (N, 2, 2) T at infinity: 0, but for sampled loops that were mapped to the s-plane
    poles : (N, n) eigenvalues of A
    delay : (N, 2) of each input
    """

    A: FloatArray
    B: FloatArray
    K: FloatArray
    D: FloatArray
    poles: ComplexArray
    delay: FloatArray

    @property
    def is_delayed(self) -> bool:
        """Whether there is a delay at any input of any point."""
        return bool(np.any(self.delay > 0.0))


def complementary(loop: InputLoop, omega: FloatArray) -> ComplexArray:
    """T without delay at the frequencies (N, W), (N, W, 2, 2)."""
    inputs = np.broadcast_to(loop.B[:, None], (*omega.shape, *loop.B.shape[1:]))
    return np.asarray(loop.D[:, None] + loop.K[:, None] @ np.linalg.solve(_pencil(loop.A[:, None], omega), inputs))


def undelayed(loop: InputLoop, rows: IntArray, omega: FloatArray) -> ComplexArray:
    """T (R, 2, 2) without delay at the finite frequencies (R,) of the points `rows` (R,)."""
    return np.asarray(loop.D[rows] + loop.K[rows] @ np.linalg.solve(_pencil(loop.A[rows], omega), loop.B[rows]))


def value(loop: InputLoop, rows: IntArray, omega: FloatArray) -> ComplexArray:
    """T (R, 2, 2) with the delays at the finite frequencies (R,) of the points `rows` (R,)."""
    T = undelayed(loop, rows, omega)
    return delayed(T, turn(loop, rows, omega)) if loop.is_delayed else T


def with_derivatives(loop: InputLoop, rows: IntArray, omega: FloatArray) -> tuple[ComplexArray, ...]:
    """T with the delays, dT/dw and d2T/dw2, each (R, 2, 2), as `value`.

    With ``X = (jw I - A)^-1``: ``K X B``, ``-j K X^2 B`` and ``-2 K X^3 B``.
    """
    resolvent = np.linalg.inv(_pencil(loop.A[rows], omega))
    states = resolvent @ loop.B[rows]
    K = loop.K[rows]
    outputs = K @ resolvent
    T = loop.D[rows] + K @ states
    slope = -1j * (outputs @ states)
    curvature = -2.0 * (outputs @ (resolvent @ states))
    if not loop.is_delayed:
        return T, slope, curvature
    # Of T G = H by the product rule, H = diag(turn) T and G = I - T + H with the T on the right without delay.
    rate = -1j * loop.delay[rows][:, :, None]
    factor = turn(loop, rows, omega)[:, :, None]
    H = factor * T, factor * (slope + rate * T), factor * (curvature + rate * (2.0 * slope + rate * T))
    G = np.eye(2) - T + H[0], H[1] - slope, H[2] - curvature
    inverse = inverse_2x2(G[0])
    T = H[0] @ inverse
    slope = (H[1] - T @ G[1]) @ inverse
    return T, slope, (H[2] - 2.0 * slope @ G[1] - T @ G[2]) @ inverse


def turn(loop: InputLoop, rows: IntArray, omega: FloatArray) -> ComplexArray:
    """``exp(-j w tau_i)`` (R, ..., 2) at the frequencies (R, ...) of the points `rows` (R,)."""
    between = (1,) * (omega.ndim - 1)
    return np.asarray(np.exp(-1j * omega[..., None] * loop.delay[rows].reshape(-1, *between, 2)))


def delay_factor(T: ComplexArray, turn: ComplexArray) -> ComplexArray:
    """``det(I + (diag(turn) - I) T)`` (*G,): what the delays multiply ``det(I + L)`` by.

    Parameters
    ----------
    T : (*G, 2, 2) without delay
    turn : (*G, 2) ``exp(-j w tau_i)``
    """
    G = np.eye(2) + (turn[..., None] - 1.0) * T
    return np.asarray(G[..., 0, 0] * G[..., 1, 1] - G[..., 0, 1] * G[..., 1, 0])


def delayed(T: ComplexArray, turn: ComplexArray) -> ComplexArray:
    """T with the delays, ``diag(turn) T (I + (diag(turn) - I) T)^-1`` (*G, 2, 2), parameters as of `delay_factor`."""
    return np.asarray((turn[..., None] * T) @ inverse_2x2(np.eye(2) + (turn[..., None] - 1.0) * T))


def inverse_2x2(matrix: ComplexArray) -> ComplexArray:
    """Inverse of (*G, 2, 2); not finite where there is none."""
    a, b, c, e = (matrix[..., i, j] for i in (0, 1) for j in (0, 1))
    adjugate = np.stack([np.stack([e, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(adjugate / (a * e - b * c)[..., None, None])


def _pencil(A: FloatArray, omega: FloatArray) -> ComplexArray:
    """``jwI - A`` (*G, n, n)."""
    n = A.shape[-1]
    pencil = np.empty((*omega.shape, n, n), dtype=complex)
    pencil[...] = -A
    pencil[..., np.arange(n), np.arange(n)] += 1j * omega[..., None]
    return pencil
