"""The linear-quadratic regulator problem over the grid: cross term removed, scaled, checked point by point.

In continuous and in discrete time: ``x' = A x + B u`` or ``x+ = A x + B u``, an integral or a sum of
``x'Qx + u'Ru + 2x'Nu``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.lqr.balance import balance_exponents
from model.arrays import BoolArray, FloatArray, IntArray

#: Weights less symmetric than this, relative to their largest entry, are not a quadratic form.
ASYMMETRY = 1e-9
#: An eigenvalue of ``Q - N R^-1 N'`` this much below zero, relative and on a unit diagonal, is still rounding.
NEGATIVE_WEIGHT = 1e-10


@dataclass(frozen=True, eq=False)
class RiccatiEquation:
    """``A'X + XA - X F F' X + Q = 0`` in states and a time scaled by powers of two (no rounding).

    In discrete time ``A'XA - X - A'XF (I + F'XF)^-1 F'XA + Q = 0`` in scaled states.

    Attributes
    ----------
    A (N, n, n), F (N, n, m), Q (N, n, n) : the scaled equation; in continuous time the largest entry of its
        Hamiltonian is about 1
    state_exponent : (N, n) tau: ``x = 2^tau x'`` state by state
    time_exponent : (N,) k, even: ``A = 2^-k`` times the unscaled one; 0 in discrete time
    """

    A: FloatArray
    F: FloatArray
    Q: FloatArray
    state_exponent: IntArray
    time_exponent: IntArray

    @cached_property
    def G(self) -> FloatArray:
        """``F F'`` (N, n, n)."""
        return np.asarray(self.F @ self.F.mT)

    def take(self, index: IntArray | slice) -> RiccatiEquation:
        """The equation at some of the points."""
        return RiccatiEquation(
            self.A[index], self.F[index], self.Q[index], self.state_exponent[index], self.time_exponent[index]
        )

    def in_scale(self, matrix: FloatArray) -> FloatArray:
        """A closed-loop matrix (N, n, n) [1/s] in the scaled states and time; its eigenvalues only scale."""
        tau, k = self.state_exponent, self.time_exponent[:, None, None]
        return np.asarray(np.ldexp(matrix, tau[:, None, :] - tau[:, :, None] - k))

    def unscaled(self) -> RiccatiEquation:
        """The equation in the states' own units and in seconds; what overflows there becomes infinite."""
        tau, k = self.state_exponent, self.time_exponent[:, None, None]
        row, column = tau[:, :, None], tau[:, None, :]
        return RiccatiEquation(
            A=np.ldexp(self.A, row - column + k),
            F=np.ldexp(self.F, row + k // 2),
            Q=np.ldexp(self.Q, k - row - column),
            state_exponent=np.zeros_like(tau),
            time_exponent=np.zeros_like(self.time_exponent),
        )

    def solution_in_states(self, X: FloatArray) -> FloatArray:
        """X (N, n, n) of the scaled equation, in the states' own units."""
        tau = self.state_exponent
        return np.asarray(np.ldexp(X, -(tau[:, :, None] + tau[:, None, :])))

    def gain_in_states(self, gain: FloatArray) -> FloatArray:
        """A gain (N, m, n) on the scaled states, ``F'X`` in continuous time, on the states in their own units."""
        exponent = self.time_exponent[:, None, None] // 2 - self.state_exponent[:, None, :]
        return np.asarray(np.ldexp(gain, exponent))


@dataclass(frozen=True, eq=False)
class RegulatorProblem:
    """Minimise the integral or the sum of ``x'Qx + u'Ru + 2x'Nu``, over N points.

    Attributes
    ----------
    A (N, n, n), B (N, n, m) : the plant
    S : (N or 1, m, m) ``R^-1 = S S'``
    cross : (N or 1, m, n) ``R^-1 N'``, to be added to S times the gain of `equation`
    posed : (N,) data finite, Q and R symmetric, R positive definite; in discrete time, where weights differ from
        point to point, also ``Q - N R^-1 N'`` positive semidefinite. Elsewhere `equation` is a harmless one
    equation : of ``A - B R^-1 N'`` and ``Q - N R^-1 N'``
    discrete : in discrete time
    """

    A: FloatArray
    B: FloatArray
    S: FloatArray
    cross: FloatArray
    posed: BoolArray
    equation: RiccatiEquation
    discrete: bool

    def take(self, index: IntArray | slice) -> RegulatorProblem:
        """The problem at some of the points."""
        S = self.S if len(self.S) == 1 else self.S[index]
        cross = self.cross if len(self.cross) == 1 else self.cross[index]
        return RegulatorProblem(
            self.A[index], self.B[index], S, cross, self.posed[index], self.equation.take(index), self.discrete
        )


def regulator_problem(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray | None = None, discrete: bool = False
) -> RegulatorProblem:
    """The problem with its grid flattened to N points; numpy's floating-point warnings are the caller's.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, m) : the plant
    Q (n, n), R (m, m), N (n, m) or None : weights, with or without the grid's axes
    discrete : in discrete time

    Raises
    ------
    ValueError : shapes that do not belong together
    """
    check_shapes(A, B, Q, R, N)
    n, m = B.shape[-2:]
    A, B, Q = A.reshape(-1, n, n), B.reshape(-1, n, m), Q.reshape(-1, n, n)
    S, posed = inverse_root(R.reshape(-1, m, m))
    posed = posed & symmetric(Q)
    unit = np.diagonal(Q, axis1=-2, axis2=-1)
    reduced, cross = A, np.zeros((1, m, n))
    if N is not None:
        half = S.mT @ N.reshape(-1, n, m).mT
        cross = S @ half
        reduced, Q = A - B @ cross, Q - half.mT @ half
        posed = posed & finite(Q)
    F = B @ S
    posed = posed & finite(reduced) & finite(F)
    if discrete:
        posed = posed & semidefinite(Q, unit)
    if not posed.all():
        known = posed[:, None, None]
        reduced, F = np.where(known, reduced, -0.5 * np.eye(n)), np.where(known, F, 0.0)
        Q = np.where(known, Q, np.eye(n))
    return RegulatorProblem(
        A=A,
        B=B,
        S=S,
        cross=cross,
        posed=posed,
        equation=scaled_equation(reduced, F, 0.5 * (Q + Q.mT), discrete),
        discrete=discrete,
    )


def check_shapes(A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray | None) -> None:
    """Raise ValueError unless plant and weights belong together, each with no grid axes or those of A."""
    n, m = B.shape[-2:]
    grid = A.shape[:-2]
    wanted = {"A": (A, (n, n)), "Q": (Q, (n, n)), "R": (R, (m, m))}
    if N is not None:
        wanted["N"] = (N, (n, m))
    for name, (matrix, shape) in wanted.items():
        if matrix.shape[-2:] != shape or matrix.shape[:-2] not in ((), grid):
            raise ValueError(f"{name} has shape {matrix.shape}: expected {shape} at each point of {grid}")
    if B.shape[:-2] != grid:
        raise ValueError(f"A and B have different grids: {grid} and {B.shape[:-2]}")


def inverse_root(R: FloatArray) -> tuple[FloatArray, BoolArray]:
    """S (N, m, m) with ``R^-1 = S S'``, and the mask (N,) where R is finite, symmetric, positive definite.

    Inputs may be in mixed units, so positive definiteness is judged on R scaled to a unit diagonal.
    S is zero where R is not positive definite.
    """
    diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    definite = symmetric(R) & np.all(diagonal > 0, axis=-1)
    if not definite.all():
        R = np.where(definite[:, None, None], R, np.eye(R.shape[-1]))
        diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    unit = 1.0 / np.sqrt(diagonal)
    values, vectors = np.linalg.eigh(R * unit[:, :, None] * unit[:, None, :])
    definite = definite & (values[:, 0] > R.shape[-1] * np.finfo(float).eps)
    S = unit[:, :, None] * vectors / np.sqrt(np.maximum(values, np.finfo(float).tiny))[:, None, :]
    return S if definite.all() else np.where(definite[:, None, None], S, 0.0), definite


def finite(matrix: FloatArray) -> BoolArray:
    """Mask of the points where every entry is finite."""
    return np.asarray(np.isfinite(matrix).all(axis=(-2, -1)))


def symmetric(matrix: FloatArray) -> BoolArray:
    """Mask of the points where the matrix is finite and symmetric."""
    with np.errstate(invalid="ignore", over="ignore"):
        size, skew = np.abs(matrix).max(axis=(-2, -1)), np.abs(matrix - matrix.mT).max(axis=(-2, -1))
    return np.asarray((skew <= ASYMMETRY * size) & np.isfinite(size))


def semidefinite(matrix: FloatArray, diagonal: FloatArray) -> BoolArray:
    """Mask of the points where a symmetric matrix is positive semidefinite up to rounding.

    Parameters
    ----------
    matrix : (N, n, n)
    diagonal : (N or 1, n) of what the matrix was computed from: the size of its rounding errors
    """
    size = np.maximum(np.abs(diagonal), np.abs(np.diagonal(matrix, axis1=-2, axis2=-1)))
    unit = 1.0 / np.sqrt(np.where(size > 0, size, 1.0))
    scaled = matrix * unit[:, :, None] * unit[:, None, :]
    known = finite(scaled)
    lowest = np.linalg.eigvalsh(np.where(known[:, None, None], scaled, 0.0))[:, 0]
    return np.asarray(known & (lowest >= -NEGATIVE_WEIGHT))


def scaled_equation(A: FloatArray, F: FloatArray, Q: FloatArray, discrete: bool = False) -> RiccatiEquation:
    """The equation of A (N, n, n), F (N, n, m), Q (N or 1, n, n), balanced, its Hamiltonian of order one.

    In discrete time it is the states that are balanced only: the unit of time is the sample.
    """
    exponents = balance_exponents(A, F, Q)
    tau, size = exponents[:, :-1], exponents[:, -1]
    k = np.zeros_like(size) if discrete else 2 * ((size + 1) // 2)
    row, column, time = tau[:, :, None], tau[:, None, :], k[:, None, None]
    return RiccatiEquation(
        A=np.ldexp(A, column - row - time),
        F=np.ldexp(F, -row - time // 2),
        Q=np.ldexp(Q, row + column - time),
        state_exponent=tau,
        time_exponent=k,
    )
