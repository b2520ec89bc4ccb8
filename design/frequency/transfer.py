"""Transfer functions of single-input single-output loops, as polynomials and as exact responses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.polynomials import leading_zeros, roots, with_roots
from design.frequency.staircase import balanced, integrations, polynomials, staircase
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray


@dataclass(frozen=True, eq=False)
class Transfer(GridArrays):
    """``numerator(s) / denominator(s)``, highest power first, both (*G, n+1), denominator monic.

    Nothing is cancelled: a mode that the input does not reach or the output does not see is a root of both
    (an integral that the opened loop does not feed back, say).

    Attributes
    ----------
    numerator : (*G, n+1), the first coefficient 0 because there is no feed-through
    denominator : (*G, n+1), the characteristic polynomial ``det(sI - A)``
    """

    numerator: FloatArray
    denominator: FloatArray

    @property
    def zeros(self) -> ComplexArray:
        """Roots of the numerator (*G, n) [rad/s], nan padded."""
        return roots(self.numerator)

    @property
    def relative_degree(self) -> IntArray:
        """Number of poles less that of zeros (*G,); n+1 when the response is zero throughout."""
        return leading_zeros(self.numerator)

    def scaled(self, frequency: FloatArray) -> Transfer:
        """The same transfer as a function of ``s / frequency``, frequency (*G,) [rad/s]."""
        powers = frequency[..., None] ** np.arange(self.denominator.shape[-1])
        return Transfer(self.numerator / powers, self.denominator / powers)


def transfer(A: FloatArray, b: FloatArray, c: FloatArray) -> Transfer:
    """``c (sI - A)^-1 b`` by `design.frequency.staircase`.

    Parameters
    ----------
    A : (*G, n, n), b : (*G, n), c : (*G, n), finite
    """
    n = A.shape[-1]
    system = balanced(
        np.ascontiguousarray(A.reshape(-1, n * n).T).reshape(n, n, -1),
        np.ascontiguousarray(b.reshape(-1, n).T),
        np.ascontiguousarray(c.reshape(-1, n).T),
    )
    numerator, denominator = polynomials(staircase(*system))
    numerator[1:][np.arange(n)[:, None] < integrations(*system)] = 0.0
    shape = (*b.shape[:-1], n + 1)
    return Transfer(numerator.T.reshape(shape), denominator.T.reshape(shape))


def natural_gain(A: FloatArray, b: FloatArray, c: FloatArray, poles: ComplexArray) -> FloatArray:
    """Gain (*G,) at which ``|k L| = 1`` amid the poles (*G, n) of A: one that moves them fairly; 1 if none does."""
    size, norm = np.abs(poles), np.linalg.norm(A, axis=(-2, -1))
    largest = np.max(size, axis=-1)
    # Poles that are all at the origin are so within rounding only; then any unit of time will do.
    largest = np.where(largest > 1e-6 * norm, largest, np.where(norm > 0.0, norm, 1.0))[..., None]
    # The geometric mean of the distances, in a direction in which there hardly is a pole.
    s = np.exp(np.mean(np.log(np.maximum(size, 1e-3 * largest)), axis=-1, keepdims=True) + 0.9j)
    strength = np.abs(response(A, b, c, s).value[..., 0])
    reached = strength > 0.0
    return np.where(reached, 1.0 / np.where(reached, strength, 1.0), 1.0)


def transfer_of_poles(
    open_poles: ComplexArray, closed_poles: ComplexArray, gain: FloatArray, markov: FloatArray
) -> Transfer:
    """Transfer whose poles are at the one place without feedback and at the other with `gain`.

    The numerator is ``(p_closed - p_open) / gain``, p being the characteristic polynomials. Poles keep their
    digits when they are spread over many decades, where the classical recursions on powers of A lose them;
    what the difference loses belongs to frequencies where the loop is far weaker than rounding.

    Parameters
    ----------
    open_poles, closed_poles : (*G, n)
    gain : (*G,), not 0
    markov : (*G, n+1) of `markov_parameters`: the leading coefficients that are zero, and the first that is not
    """
    n = open_poles.shape[-1]
    denominator = with_roots(open_poles)
    numerator = (with_roots(closed_poles) - denominator) / gain[..., None]
    markov = markov[..., :n]
    first = leading_zeros(markov)[..., None]
    place = np.arange(n)
    numerator[..., 0] = 0.0
    numerator[..., 1:] = np.where(place > first, numerator[..., 1:], np.where(place == first, markov, 0.0))
    return Transfer(numerator, denominator)


def markov_parameters(A: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """``c b, c A b, .. c A^n b`` (*G, n+1): ``c (sI - A)^-1 b = sum h_i / s^i``.

    One that is smaller than the rounding of its own terms is exactly zero, so that a chain of k integrations
    between input and output shows as k - 1 zeros.
    """
    n = A.shape[-1]
    matrices, vector, rows = (np.stack([m, np.abs(m)]) for m in (A, b[..., None], c[..., None, :]))
    result = np.empty((2, *b.shape[:-1], n + 1))
    for k in range(n + 1):
        result[..., k] = (rows @ vector)[..., 0, 0]
        vector = matrices @ vector
    value, bound = result
    return np.where(np.abs(value) > 8.0 * n * np.finfo(float).eps * bound, value, 0.0)


@dataclass(frozen=True, eq=False)
class Response(GridArrays):
    """``L(s) = c (sI - A)^-1 b`` and its derivatives with respect to s, each (*G, m).

    On the axis, ``dL/dw = j slope``.
    """

    value: ComplexArray
    slope: ComplexArray
    curvature: ComplexArray


def response(A: FloatArray, b: FloatArray, c: FloatArray, s: ComplexArray) -> Response:
    """Exact transfer and derivatives at the points `s` (*G, m), from the state matrices themselves.

    With ``R = (sI - A)^-1``: ``L = c R b``, ``L' = -c R^2 b``, ``L'' = 2 c R^3 b``.

    Raises
    ------
    numpy.linalg.LinAlgError : a point of `s` is exactly an eigenvalue of `A`
    """
    n = A.shape[-1]
    shifted = np.empty((*s.shape, n, n), dtype=complex)
    shifted[...] = -A[..., None, :, :]
    shifted[..., np.arange(n), np.arange(n)] += s[..., None]
    resolvent = np.linalg.inv(shifted)
    right = (resolvent * b[..., None, None, :]).sum(axis=-1)
    left = (resolvent * c[..., None, :, None]).sum(axis=-2)
    value = (c[..., None, :] * right).sum(axis=-1)
    slope = -(left * right).sum(axis=-1)
    curvature = 2.0 * (left * (resolvent * right[..., None, :]).sum(axis=-1)).sum(axis=-1)
    return Response(value, slope, curvature)
