"""Characteristic polynomial and numerator of single-input single-output systems by orthogonal transformations.

Arrays here carry the batch on their *last* axis, (n, n, N): numpy then works through the whole batch in each
of a few operations, many times faster than LAPACK goes through small matrices one by one.

In states where only the first is driven and each drives the next, ``b = s_0 e_1`` and A upper Hessenberg with the
subdiagonal ``s_1 .. s_(n-1)``, the polynomials ``p_i(s) = det(sI - A[i:, i:])`` follow from each other, and the
numerator of ``c (sI - A)^-1 b`` is ``sum_j c_j s_0 .. s_j p_(j+1)``: nothing is divided by, no difference of large
polynomials is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, IntArray

#: Passes of balancing; the first does nearly all, more do no harm and no good.
BALANCING_PASSES = 4


@dataclass(frozen=True, eq=False)
class Staircase:
    """States in which each drives the next.

    Attributes
    ----------
    A : (n, n, N) upper Hessenberg; what stands below the subdiagonal means nothing
    drive : (n, N) what drives the first state, then the subdiagonal of A
    c : (n, N)
    """

    A: FloatArray
    drive: FloatArray
    c: FloatArray


def staircase(A: FloatArray, b: FloatArray, c: FloatArray) -> Staircase:
    """(n, n, N), (n, N), (n, N) turned by one reflection a state (Householder); backward stable.

    The controller-Hessenberg form of Van Dooren and Verhaegen (1985).
    """
    n = len(b)
    A, c, column = A.copy(), c.copy(), b.copy()
    drive = np.empty_like(b)
    for k in range(n - 1):
        size = np.sqrt((column * column).sum(axis=0))
        drive[k] = np.where(column[0] > 0.0, -size, size)
        column[0] -= drive[k]
        # The reflection is I + column row'; it is the identity where there is nothing to turn.
        square = drive[k] * column[0]
        row = column / np.where(square == 0.0, 1.0, square)
        A[k:, k:] += column[:, None] * (row[:, None] * A[k:, k:]).sum(axis=0)
        A[:, k:] += (A[:, k:] * column).sum(axis=1)[:, None] * row
        c[k:] += (c[k:] * column).sum(axis=0) * row
        column = A[k + 1 :, k].copy()
    drive[n - 1] = column[0]
    return Staircase(A, drive, c)


def polynomials(form: Staircase) -> tuple[FloatArray, FloatArray]:
    """Numerator and characteristic polynomial, (n+1, N) each, highest power first."""
    n, N = form.drive.shape
    p = np.zeros((n + 1, n + 1, N))
    p[n, n] = 1.0
    for i in range(n - 1, -1, -1):
        weight = form.A[i, i:].copy()
        weight[1:] *= np.cumprod(form.drive[i + 1 :], axis=0)
        p[i, :-1] = p[i + 1, 1:]
        p[i] -= (weight[:, None] * p[i + 1 :]).sum(axis=0)
    weight = form.c * np.cumprod(form.drive, axis=0)
    return (weight[:, None] * p[1:]).sum(axis=0), p[0]


def balanced(A: FloatArray, b: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same system (n, n, N), (n, N), (n, N) in units of its states in which rows and columns of A are alike.

    Units change by powers of two, which rounds nothing. All states at once, with half of Osborne's step (1960),
    so that two that pull at each other do not swap places for ever.
    """
    n = len(b)
    size = np.abs(A)
    size[np.arange(n), np.arange(n)] = 0.0
    unit = np.ones(b.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(BALANCING_PASSES):
            step = np.sqrt(np.sqrt(size.sum(axis=0) / size.sum(axis=1)))
            # A state that is not driven by others, or drives none, has no measure.
            step = np.where((step > 0.0) & (step < np.inf), step, 1.0)
            size *= step[:, None]
            size /= step
            unit *= step
    unit = np.exp2(np.round(np.log2(unit)))
    return A * unit[:, None] / unit, b * unit, c / unit


def integrations(A: FloatArray, b: FloatArray, c: FloatArray) -> IntArray:
    """How many of ``c b, c A b, .. c A^(n-1) b`` are zero before the first that is not, (N,).

    One that is smaller than the rounding of its own terms is zero: a chain of k integrations between input and
    output shows as k - 1 zeros.
    """
    n = len(b)
    count = np.zeros(b.shape[1], dtype=np.int64)
    zero = np.ones(b.shape[1], dtype=bool)
    size, bound_A, bound_c = np.abs(b), np.abs(A), np.abs(c)
    for _ in range(n):
        value, bound = np.einsum("in,in->n", c, b), np.einsum("in,in->n", bound_c, size)
        zero &= np.abs(value) <= 8.0 * n * np.finfo(float).eps * bound
        if not zero.any():
            break
        count += zero
        b, size = np.einsum("ijn,jn->in", A, b), np.einsum("ijn,jn->in", bound_A, size)
    return count
