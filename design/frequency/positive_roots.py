"""Positive roots of real polynomials, with proof that none is missed.

The half-line is cut at fixed points. On each piece the polynomial is written in Bernstein's basis, where one sign
change means exactly one root and none means no root (Descartes' rule; Rouillier and Zimmermann 2004); that is one
matrix product for the whole batch, and the roots are then found by Newton's method between their brackets. Only
where a piece remains undecided, because roots are near to each other or to the real axis, the eigenvalues of the
companion matrix are asked.
"""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np

from design.frequency.polynomials import leading_zeros, powers, roots
from model.arrays import BoolArray, FloatArray, IntArray

#: Ratio of the ends of each piece, and number of nodes on it, ends included, in geometric progression.
RATIO, NODES = 16.0, 33
#: One of the cuts; the others are this times powers of `RATIO`. No plain number, so that hardly a root falls on it.
CUT = 1.0594630943592953
CUTS = CUT * RATIO ** np.arange(-8.0, 4.0)
#: A root counts as real when its imaginary part is below this part of its size (the curve touches).
NEARLY_REAL = 1e-6
#: The last of the Newton steps is no longer than this part of the root: the next would be about its square.
CONVERGED = 1e-5


def positive_roots(p: FloatArray) -> FloatArray:
    """Positive real roots of (N, m+1), (N, m), rising, nan padded; of two that touch, one.

    Best where the roots are of the order of 1, between 1e-9 and 4e3; correct everywhere.
    """
    N, m = p.shape[0], p.shape[1] - 1
    result = np.full((N, m), np.nan)
    # What is zero at every point of the grid does not count as a coefficient.
    p = p[:, int(leading_zeros(p).min(initial=m)) :]
    if p.shape[1] < 2:
        return result
    coefficients = _bernstein(p)
    positive = coefficients > 0.0
    changes = (positive[:, 1:] != positive[:, :-1]).sum(axis=1, dtype=np.int8)
    # The outermost pieces reach to zero and to infinity: nothing to put nodes on.
    undecided = (changes > 1).any(axis=0) | (changes[0] > 0) | (changes[-1] > 0)
    undecided |= (coefficients == 0.0).any(axis=(0, 1))
    rows, piece = np.nonzero(((changes == 1) & ~undecided).T)
    x, settled = _between_cuts(p[rows], coefficients[piece, :, rows], piece)
    undecided[rows[~settled]] = True
    kept = ~undecided[rows]
    rows, x = rows[kept], x[kept]
    result[rows, position_in_row(rows, N)] = x
    if undecided.any():
        result[undecided, : p.shape[1] - 1] = _by_eigenvalues(p[undecided])
    return result


def never_positive(p: FloatArray, cut: FloatArray) -> BoolArray:
    """Mask of (N, m+1) that are proven not to be positive at any x >= 0; False where it remains open.

    Parameters
    ----------
    cut : (N,) a positive point to cut at: where p nearly touches zero the proof succeeds from both sides
    """
    scaled = p * (cut / CUT)[:, None] ** np.arange(p.shape[1] - 1, -1, -1.0)
    return np.asarray((_bernstein(scaled) <= 0.0).all(axis=(0, 1)))


def position_in_row(rows: IntArray, count: int) -> IntArray:
    """(K,) how many entries of the same row come before each, of the row numbers `rows` (K,), rising, below `count`."""
    first = np.searchsorted(rows, np.arange(count))
    return np.asarray(np.arange(rows.size) - first[rows])


def _bernstein(p: FloatArray) -> FloatArray:
    """Coefficients (I, m+1, N) of (N, m+1) on each of the pieces."""
    m = p.shape[1] - 1
    return np.asarray(_pieces(m) @ p.T).reshape(CUTS.size + 1, m + 1, -1)


def _between_cuts(p: FloatArray, coefficients: FloatArray, piece: IntArray) -> tuple[FloatArray, BoolArray]:
    """The one root (K,) of (K, m+1) on its piece (K,), with its coefficients there, and whether it is settled."""
    m = p.shape[1] - 1
    ratio, basis = _nodes(m)
    positive = coefficients @ basis > 0.0
    place = np.argmax(positive != positive[:, :1], axis=1)
    low, high = (CUTS[piece - 1] * ratio[place - i] for i in (1, 0))
    value_low, value_high = (np.einsum("ki,ik->k", coefficients, basis[:, place - i]) for i in (1, 0))
    x = low + (high - low) * (value_low / (value_low - value_high))
    p, power = p.T, np.arange(m, -1.0, -1.0)[:, None]
    step = x
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(3):
            terms = p * powers(x, m + 1)
            step = x * terms.sum(axis=0) / (power * terms).sum(axis=0)
            x = np.clip(x - step, low, high)
    return x, np.abs(step) <= CONVERGED * x


def _by_eigenvalues(p: FloatArray) -> FloatArray:
    x = roots(p)
    with np.errstate(invalid="ignore"):
        real = (x.real > 0.0) & (x.imag >= 0.0) & (x.imag <= NEARLY_REAL * np.abs(x))
    return np.sort(np.where(real, x.real, np.nan), axis=-1)


@cache
def _pieces(m: int) -> FloatArray:
    """((I m+1), m+1): polynomial of degree m to its Bernstein coefficients on each piece."""
    ends = [0.0, *CUTS]
    tables = [_piece(m, low, high, 1.0) for low, high in zip(ends, CUTS, strict=False)]
    return np.concatenate([*tables, _piece(m, float(CUTS[-1]), 1.0, 0.0)])


def _piece(m: int, low: float, high: float, weight: float) -> FloatArray:
    """(m+1, m+1): to the coefficients in ``C(m, i) t^i (1 - t)^(m-i)``.

    ``x = (low (1 - t) + high t) / ((1 - t) + weight t)``, the polynomial times the denominator's m-th power:
    from `low` to `high` with the weight 1, from `low` to infinity with 0.
    """
    table = np.zeros((m + 1, m + 1))
    for i in range(m + 1):
        for k in range(m + 1):
            ways = range(max(0, i - m + k), min(k, i) + 1)
            each = (comb(k, j) * comb(m - k, i - j) * low ** (k - j) * high**j * weight ** (i - j) for j in ways)
            table[i, m - k] = sum(each) / comb(m, i)
    return table


@cache
def _nodes(m: int) -> tuple[FloatArray, FloatArray]:
    """Nodes (`NODES`,) of a piece over its lower end, and Bernstein's basis there (m+1, `NODES`)."""
    ratio = RATIO ** np.linspace(0.0, 1.0, NODES)
    t = (ratio - 1.0) / (RATIO - 1.0)
    return ratio, np.array([comb(m, i) * t**i * (1.0 - t) ** (m - i) for i in range(m + 1)])
