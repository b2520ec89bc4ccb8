"""Roots of a characteristic function from starts, by Newton's method: each to rounding, and each once."""

from __future__ import annotations

import numpy as np

from design.delay.characteristic import Characteristic
from model.arrays import ComplexArray, IntArray

#: Passes on the polynomials; most starts need four.
PASSES = 16
#: A step this short, as a part of the root, is the last one on the polynomials.
APPROACHED = 1e-11
#: A root has been found when the last step, in state space, is no longer than this part of it.
FOUND = 1e-7
#: Two roots this near, as a part of their size, are one that was found twice.
SAME = 1e-9
#: Sizes are not taken for smaller than this, in units of the scale: a root at the origin has none.
SMALLEST = 1e-6
#: A root is not looked for where a delay makes more than the exponential of this of it, nor farther out than this many
#: times the scale and a turn of the shortest delay.
RUNAWAY, FAR = 100.0, 1e4


def rightmost_first(f: Characteristic, starts: ComplexArray) -> ComplexArray:
    """Distinct roots (N, 2M) that the starts (N, M) lead to, by falling real part, both of each pair; nan padded."""
    rows, columns = np.nonzero(np.isfinite(starts))
    s = _polished(f, rows, _approached(f, rows, starts[rows, columns]))
    real = np.abs(s.imag) <= SAME * np.maximum(np.abs(s), SMALLEST)
    upper = np.full(starts.shape, complex(np.nan, np.nan))
    upper[rows, columns] = np.where(real, s.real, s.real + 1j * np.abs(s.imag))
    upper = _once(upper)
    lower = np.where(upper.imag > 0.0, upper.conj(), np.nan)
    roots = np.concatenate([upper, lower], axis=-1)
    return np.take_along_axis(roots, np.lexsort((roots.imag, -roots.real), axis=-1), axis=-1)


def _approached(f: Characteristic, rows: IntArray, s: ComplexArray) -> ComplexArray:
    """Newton's method on the polynomials from s (M,), (M,), nan where it runs away; each stops on its own."""
    s, moving = s.copy(), np.arange(s.size)
    longest, farthest = f.delays.max(axis=-1)[rows], FAR * (1.0 + 1.0 / f.delays[:, 1])[rows]
    for _ in range(PASSES):
        step = f.correction(rows[moving], s[moving])
        s[moving] = here = s[moving] - step
        found = np.abs(step) <= APPROACHED * np.maximum(np.abs(here), SMALLEST)
        lost = ~np.isfinite(step) | (-here.real * longest[moving] > RUNAWAY) | (np.abs(here) > farthest[moving])
        s[moving[lost]] = np.nan
        moving = moving[~lost & ~found]
        if not moving.size:
            break
    return s


def _polished(f: Characteristic, rows: IntArray, s: ComplexArray) -> ComplexArray:
    """Two more steps from s (M,), on the determinant itself; nan where the second one is not short."""
    s = s.copy()
    left = np.flatnonzero(np.isfinite(s))
    for _ in range(2):
        step = _determinant_step(f, rows[left], s[left])
        s[left] = s[left] - step
    s[left[np.abs(step) > FOUND * np.maximum(np.abs(s[left]), SMALLEST)]] = np.nan
    return s


def _determinant_step(f: Characteristic, rows: IntArray, s: ComplexArray) -> ComplexArray:
    """Newton's step (M,) ``1 / trace(D^-1 D')`` at s (M,), ``D = sI - A + sum_i b_i k_i exp(-s delay_i)``."""
    delays, unit = f.input_delays[rows], np.eye(f.order)
    x = np.exp(-s[:, None] * delays)
    D = s[:, None, None] * unit - f.A[rows] + (f.B[rows] * x[:, None, :]) @ f.K[rows]
    slope = unit - (f.B[rows] * (x * delays)[:, None, :]) @ f.K[rows]
    regular = np.linalg.slogdet(D).sign != 0.0
    step = np.zeros_like(s)
    step[regular] = 1.0 / np.trace(np.linalg.solve(D[regular], slope[regular]), axis1=-2, axis2=-1)
    return step


def _once(s: ComplexArray) -> ComplexArray:
    """Each of s (N, M) once, the others nan."""
    near = np.abs(s[:, :, None] - s[:, None, :]) <= SAME * np.maximum(np.abs(s), SMALLEST)[:, :, None]
    earlier = np.tri(s.shape[-1], k=-1, dtype=bool)
    return np.where((near & earlier).any(axis=-1), np.nan, s)
