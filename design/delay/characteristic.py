"""The characteristic function of a loop with delays: a sum of polynomials times exponentials, with all its roots.

Each delayed input closes its loop by a matrix of rank one, so that the determinant is linear in each of the
``x_i = exp(-s delay_i)``, and known from the loops in which the inputs of a subset T are closed and the others open,
whose characteristic polynomials are ``P_T``::

        det(sI - A + sum_i b_i k_i x_i) = sum_S prod_{i in S} x_i sum_{T in S} (-1)^(|S| - |T|) P_T(s) .

The polynomials are made of eigenvalues, which keep their digits when they are spread over decades.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np

from design.frequency.polynomials import nearby_power_of_two, with_roots
from design.loop import Loop
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: A delay up to this is none [s]: it turns no mode by more than rounding.
SHORTEST = 1e-15
#: How many points are worked on at once.
PART = 128
#: Exponents are held below this: beyond it nothing is looked for, and nothing may overflow.
LARGEST_EXPONENT = 300.0


@dataclass(frozen=True, eq=False)
class Characteristic(GridArrays):
    """``f(s) = sum_j p_j(s) exp(-s delay_j) = det(sI - A + sum_i b_i k_i exp(-s delay_i))`` of N points in one row.

    Every frequency is in units of the point's own `scale`.

    Attributes
    ----------
    A (N, n, n), B (N, n, m), K (N, m, n) : the loop with the inputs without delay closed, and the delayed ones
    input_delays : (N, m) their delays, times `scale`
    open_poles : (N, n) roots of p_0
    coefficients : (N, J, n+1) of p_j, highest power first; p_0 is monic and has no delay, the others rising ones
    delays : (N, J) sums of the delays of the inputs, times `scale`
    scale : (N,) [rad/s]
    """

    A: FloatArray
    B: FloatArray
    K: FloatArray
    input_delays: FloatArray
    open_poles: ComplexArray
    coefficients: FloatArray
    delays: FloatArray
    scale: FloatArray

    @property
    def parts(self) -> list[slice]:
        """The points in parts of at most `PART`, so that what is worked on at once stays small."""
        return [slice(first, first + PART) for first in range(0, self.scale.size, PART)]

    @property
    def order(self) -> int:
        """Number n of states, and degree of p_0."""
        return int(self.A.shape[-1])

    def terms(self, rows: IntArray, s: ComplexArray) -> ComplexArray:
        """Every coefficient times its power and exponential (M, J, n+1) at s (M,) of the points `rows` (M,)."""
        return np.asarray(self._weighted(rows, s) * _powers(s, self.order + 1)[:, None, :])

    def value(self, rows: IntArray, s: ComplexArray) -> ComplexArray:
        """Value (M,) of f at s (M,) of the points `rows` (M,)."""
        return np.asarray(self.terms(rows, s).sum(axis=(-2, -1)))

    def correction(self, rows: IntArray, s: ComplexArray) -> ComplexArray:
        """Newton's step ``f / f'`` (M,) at s (M,) of the points `rows` (M,); 0 where f is, inf or nan where f' is 0."""
        weighted, powers = self._weighted(rows, s), _powers(s, self.order + 1)[:, None, :]
        each = (weighted * powers).sum(axis=-1)
        slopes = (weighted[..., :-1] * np.arange(self.order, 0, -1) * powers[..., 1:]).sum(axis=-1)
        value, slope = each.sum(axis=-1), (slopes - each * self.delays[rows]).sum(axis=-1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return np.where(value == 0.0, 0.0, value / slope)

    def _weighted(self, rows: IntArray, s: ComplexArray) -> ComplexArray:
        """Coefficients times their exponentials (M, J, n+1)."""
        exponent = -s[:, None] * self.delays[rows]
        factor = np.exp(np.minimum(exponent.real, LARGEST_EXPONENT) + 1j * exponent.imag)
        return np.asarray(self.coefficients[rows] * factor[..., None])


def finite_points(loop: Loop) -> BoolArray:
    """Mask (*G,) of the points whose closed loop is finite.

    Raises
    ------
    ValueError : a delay is negative or not finite
    """
    for name, delay in zip(loop.inputs, loop.delay, strict=True):
        if not 0.0 <= delay < np.inf:
            raise ValueError(f"the delay of {name} must be finite and not negative, is {delay} s")
    return np.asarray(np.isfinite(loop.A).all(axis=(-2, -1)) & np.isfinite(loop.B @ loop.K).all(axis=(-2, -1)))


def characteristic(loop: Loop, points: BoolArray) -> Characteristic:
    """Characteristic function of the points (N of them) of a mask (*G,) whose matrices are finite."""
    delay = np.array(loop.delay)
    late, prompt = np.flatnonzero(delay > SHORTEST), np.flatnonzero(delay <= SHORTEST)
    A, B, K = loop.A[points], loop.B[points], loop.K[points]
    A = A - B[..., prompt] @ K[:, prompt]
    B, K = B[..., late], K[:, late]
    sets = list(chain.from_iterable(combinations(range(late.size), size) for size in range(late.size + 1)))
    closed = np.stack([A - B[..., list(S)] @ K[:, list(S)] for S in sets], axis=1)
    poles = np.linalg.eigvals(closed).astype(complex)
    scale = nearby_power_of_two(np.abs(poles).max(axis=(-2, -1)))
    unit = scale[:, None, None]
    poles = np.asarray(poles / unit, dtype=complex)
    sums = [float(delay[late[list(S)]].sum()) for S in sets]
    levels = sorted(set(sums))
    weights = np.zeros((len(levels), len(sets)))
    for i, S in enumerate(sets):
        for j, T in enumerate(sets):
            if set(T) <= set(S):
                weights[levels.index(sums[i]), j] += (-1.0) ** (len(S) - len(T))
    return Characteristic(
        A / unit, B / unit, K, delay[late] * scale[:, None], poles[:, 0],
        _combined(poles, weights), np.array(levels) * scale[:, None], scale,
    )  # fmt: skip


def _combined(poles: ComplexArray, weights: FloatArray) -> FloatArray:
    """(N, J, n+1) sums, with `weights` (J, 2^m), of the polynomials that have the roots `poles` (N, 2^m, n).

    What is left of coefficients that cancel is rounding, and is cleared away: far to the left of the axis the
    exponentials would make roots of it.
    """
    terms, size = with_roots(poles), with_roots(np.asarray(-np.abs(poles), dtype=complex)).max(axis=1)
    made = weights @ terms
    noise = 32.0 * terms.shape[-1] * np.finfo(float).eps * size
    made[:, 1:] = np.where(np.abs(made[:, 1:]) > noise[:, None, :], made[:, 1:], 0.0)
    return made


def _powers(s: ComplexArray, length: int) -> ComplexArray:
    """``s^(length-1) .. s, 1`` (M, length)."""
    factors = np.ones((s.size, length), dtype=complex)
    factors[:, 1:] = s[:, None]
    return np.asarray(np.multiply.accumulate(factors, axis=-1)[:, ::-1])
