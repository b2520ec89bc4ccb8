"""Transfer functions of single-input single-output loops, as polynomials and as exact responses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.polynomials import leading_zeros, power_of_two_scale, roots
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray


@dataclass(frozen=True, eq=False)
class Transfer(GridArrays):
    """``numerator(s) / denominator(s)``, highest power first, both (*G, n+1), denominator monic.

    Nothing is cancelled: a mode that the input does not reach or the output does not see is a root of both
    (an integral that the opened loop does not feed back, say). `without_common_origin` cancels the ones at
    the origin, and only when asked.

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

    @property
    def frequency_scale(self) -> FloatArray:
        """Power of two near the largest pole (*G,) [rad/s], for `scaled`."""
        return power_of_two_scale(self.denominator)

    def scaled(self, frequency: FloatArray) -> Transfer:
        """The same transfer as a function of ``s / frequency``, frequency (*G,) [rad/s]."""
        powers = frequency[..., None] ** np.arange(self.denominator.shape[-1])
        return Transfer(self.numerator / powers, self.denominator / powers)

    def without_common_origin(self) -> Transfer:
        """The same transfer with the common factors s cancelled; the degrees are lowered, not the lengths."""
        tails = [leading_zeros(p[..., ::-1]) for p in (self.numerator, self.denominator)]
        shift = np.minimum(tails[0], tails[1])
        index = np.arange(self.denominator.shape[-1]) - shift[..., None]
        kept = index >= 0
        return Transfer(
            *(
                np.where(kept, np.take_along_axis(p, np.maximum(index, 0), axis=-1), 0.0)
                for p in (self.numerator, self.denominator)
            )
        )


def transfer(A: FloatArray, b: FloatArray, c: FloatArray) -> Transfer:
    """``c (sI - A)^-1 b`` by Leverrier's method in Faddeev's form (Gantmacher 1959, IV.5).

    ``M_1 = I``, ``d_k = -tr(A M_k) / k``, ``M_k+1 = A M_k + d_k I``; the numerator's coefficients are
    ``c M_k b``. No scaling of the states by powers of two changes a single rounding of it. Beside the
    products run those of the magnitudes; a coefficient that is smaller than the rounding of its own terms
    is exactly zero, so that missing leading terms (relative degree) and integrators come out as such.

    Parameters
    ----------
    A : (*G, n, n), b : (*G, n), c : (*G, n)
    """
    n = A.shape[-1]
    identity = np.eye(n)
    matrices, columns, rows = (np.stack([m, np.abs(m)]) for m in (A, b[..., None], c[..., None, :]))
    adjugate: FloatArray = np.broadcast_to(identity, matrices.shape)
    signs = np.reshape([-1.0, 1.0], (2, *(1,) * (A.ndim - 2)))
    denominator, numerator = np.zeros((2, *A.shape[:-2], n + 1)), np.zeros((2, *A.shape[:-2], n + 1))
    denominator[0, ..., 0] = 1.0
    for k in range(1, n + 1):
        numerator[..., k] = (rows @ adjugate @ columns)[..., 0, 0]
        product = matrices @ adjugate
        denominator[..., k] = signs * np.trace(product, axis1=-2, axis2=-1) / k
        adjugate = product + denominator[..., k, None, None] * identity
    rounding = 8.0 * n * np.finfo(float).eps
    return Transfer(
        *(np.where(np.abs(value) > rounding * bound, value, 0.0) for value, bound in (numerator, denominator))
    )


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
