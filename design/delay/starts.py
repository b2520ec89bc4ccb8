"""Where the search for the roots of a characteristic function begins."""

from __future__ import annotations

import numpy as np

from design.delay.characteristic import Characteristic
from design.delay.pade import delay_chain
from design.frequency.polynomials import evaluate
from model.arrays import ComplexArray

#: Order of the approximant whose eigenvalues are the starts.
ORDER = 14
#: Its eigenvalues stand for roots up to this size times the delay; beyond, they are its own.
TRUSTED = 15.0
#: Passes of the fixed point that the retarded chains are found by.
PASSES = 6


def starts(f: Characteristic, branches: int) -> ComplexArray:
    """Starts (N, M) in the closed upper half plane, in units of the scale, nan padded.

    Parameters
    ----------
    f : with at least one delay
    branches : how many of the endless chain of roots that each delay makes are started from, the slowest first
    """
    chains = [_chain_roots(f, term, branches) for term in range(1, f.delays.shape[1])]
    return np.concatenate([_eigenvalues(f), *chains], axis=-1)


def _eigenvalues(f: Characteristic) -> ComplexArray:
    """Eigenvalues of the loop with every delay replaced by a chain of states, as far as they can be trusted."""
    chain, n = delay_chain(ORDER), f.order
    A = np.zeros((*f.A.shape[:-2], n + ORDER * f.B.shape[-1], n + ORDER * f.B.shape[-1]))
    A[:, :n, :n] = f.A
    for i in range(f.B.shape[-1]):
        at = slice(n + i * ORDER, n + (i + 1) * ORDER)
        rate = 1.0 / f.input_delays[:, i, None, None]
        A[:, :n, at] = f.B[:, :, i, None] * chain.c
        A[:, at, :n] = -chain.b[:, None] * f.K[:, i, None, :] * rate
        A[:, at, at] = chain.A * rate
    found: ComplexArray = np.linalg.eigvals(A).astype(complex)
    trusted = (found.imag >= 0.0) & (np.abs(found) * f.input_delays.max(axis=-1)[:, None] < TRUSTED)
    return np.where(trusted, found, np.nan)


def _chain_roots(f: Characteristic, term: int, branches: int) -> ComplexArray:
    """Approximate roots (N, branches) of ``p_0 + p_j exp(-s delay_j)`` far from the poles of the loop.

    From ``s delay = log(-p_j / p_0) + 2 pi i k`` as a fixed point; the logarithm is the one that is continuous to
    its asymptote ``log(-h) - d log s``, so that each k stays with its own root (Bellman and Cooke 1963, ch. 12).
    """
    p, delay = f.coefficients[:, term], f.delays[:, term]
    degree = np.argmax(p != 0.0, axis=-1)
    lead = np.take_along_axis(p, degree[:, None], axis=-1)
    present = (p != 0.0).any(axis=-1)
    degree = np.where(present, degree, 0)[:, None]
    turn = np.where(lead > 0.0, np.pi, 0.0)
    first = np.floor((degree * np.pi - turn) / (2.0 * np.pi))
    aim = 2.0 * np.pi * (first + np.arange(branches)) + turn
    span = np.where(present, delay, 1.0)[:, None]
    s = np.asarray((-1.0 + 1j * np.maximum(aim - 0.75 * np.pi * degree, 1.0)) / span, dtype=complex)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(PASSES):
            asymptote = aim - degree * np.angle(s)
            ratio = -evaluate(p, s) / evaluate(f.coefficients[:, 0], s)
            angle = np.angle(ratio)
            angle += 2.0 * np.pi * np.round((asymptote - angle) / (2.0 * np.pi))
            s = (np.log(np.abs(ratio)) + 1j * angle) / span
            s = np.asarray(s.real + 1j * np.abs(s.imag), dtype=complex)
    return np.where(present[:, None] & np.isfinite(s), s, np.nan)


def dense_starts(f: Characteristic, branches: int) -> ComplexArray:
    """Many more starts (N, M), for loops whose own poles are among the chains that a long delay makes.

    The poles of the open loop, and four starts to every turn of the shortest delay along the line where
    ``|p_j| exp(-Re s delay_j) = |p_0|``, near which the roots of two terms are.
    """
    found = [starts(f, branches), np.abs(f.open_poles.imag) * 1j + f.open_poles.real]
    for term in range(1, f.delays.shape[1]):
        delay = f.delays[:, term, None]
        omega = 0.5 * np.pi * np.arange(4.0 * branches) / delay
        s = np.asarray(1j * omega, dtype=complex)
        with np.errstate(divide="ignore", invalid="ignore"):
            for _ in range(PASSES):
                ratio = np.abs(evaluate(f.coefficients[:, term], s) / evaluate(f.coefficients[:, 0], s))
                s = np.asarray(np.log(ratio) / delay + 1j * omega, dtype=complex)
        found.append(np.where(np.isfinite(s), s, np.nan))
    return np.concatenate(found, axis=-1)
