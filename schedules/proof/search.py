"""Search for one Lyapunov matrix for many loops.

The programme is solved in coordinates in which the best matrix so far is the identity, at the rate it proves already:
each round proves more (a generalised eigenvalue by Dinkelbach's iteration). It begins with the modes of the mean loop.
Of many loops only those that bind go into the programme; the others are looked at and join when they are violated.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray
from schedules.proof.barrier import Answer, central
from schedules.proof.decay import decay_rates, slowest
from schedules.proof.semidefinite import best_lyapunov

#: Programmes solved for one answer at most.
MOST_ROUNDS = 8
#: A round that proves less than this part more, of the slowest mode's rate, is the last.
WORTHWHILE = 0.02
#: Rounds as good as the last that a proof must not be farther away than.
HOPE = 4.0
#: Loops of which `central` is asked first.
FEW_LOOPS = 48
#: Loops of the first programme, and those that join it at a time.
FIRST_LOOPS, MORE_LOOPS = 40, 16


def lyapunov(A: FloatArray, largest: bool = False, start: FloatArray | None = None) -> FloatArray | None:
    """P (n, n) with ``A_k' P + P A_k < 0`` for all loops A (K, n, n), or None where none is found.

    Loops that must decay at a rate alpha are given as ``A + alpha I``.

    Parameters
    ----------
    largest : go on until hardly more can be proved, of the loops as they are given
    start : a matrix to begin with
    """
    bound = float(np.min(slowest(A)))
    if bound <= 0.0:
        return None  # a loop of the set is not stable itself
    P = modal(np.mean(A, axis=0)) if start is None else start
    best, rate = P, _least_rate(A, P)
    if not np.isfinite(rate):
        return None
    if rate > 0.0 and not largest:
        return best
    if not largest and len(A) <= FEW_LOOPS:
        L = np.asarray(np.linalg.cholesky(P))
        path = central(L.T @ A @ np.linalg.inv(L).T)
        if path.answer is Answer.NONE:
            return None
        candidate = _back(path.X, L)
        if _least_rate(A, candidate) > 0.0:
            return candidate
    aim = 0.0
    for _ in range(MOST_ROUNDS):
        found = _solved(A, best, aim)
        reached = -np.inf if found is None else _least_rate(A, found)
        gained = reached - rate
        if found is not None and gained > 0.0:
            best, rate = found, reached
        if rate > 0.0 and not largest:
            return best
        if gained < WORTHWHILE * bound and aim <= rate:
            break
        if rate + HOPE * max(gained, 0.0) < 0.0 and aim < 0.0:
            break
        # A rate that is proved already can be asked for; one that is not may have no answer.
        aim = rate
    return best if rate > 0.0 else None


def _least_rate(A: FloatArray, P: FloatArray) -> float:
    """What P proves of the worst loop; minus infinity where it is not positive definite but for rounding."""
    try:
        return float(np.min(decay_rates(A, P)))
    except np.linalg.LinAlgError:
        return float("-inf")


def _solved(A: FloatArray, P: FloatArray, rate: float) -> FloatArray | None:
    """The programme's answer for all loops, in the coordinates they came in; None where it is not positive."""
    L = np.asarray(np.linalg.cholesky(P))
    turned = L.T @ A @ np.linalg.inv(L).T
    used = np.argsort(decay_rates(A, P))[:FIRST_LOOPS]
    while True:
        X = best_lyapunov(turned[used], rate)
        if X is None:
            return None
        values = np.linalg.eigvalsh(X)
        if not values[0] > 1e-12 * values[-1]:
            return None
        if len(used) == len(A):
            break
        forms = np.swapaxes(turned, -1, -2) @ X + X @ turned + 2.0 * rate * X
        worst = np.linalg.eigvalsh(forms)[:, -1]
        broken = worst > np.max(worst[used]) + 1e-6 * float(np.max(np.abs(forms)))
        broken[used] = False
        if not np.any(broken):
            break
        worst[~broken] = -np.inf
        used = np.concatenate([used, np.argsort(-worst)[: min(MORE_LOOPS, int(np.sum(broken)))]])
    return _back(X, L)


def _back(X: FloatArray, L: FloatArray) -> FloatArray:
    """A matrix in the coordinates that the loops came in, its largest entry 1."""
    found = L @ X @ L.T
    return np.asarray(found + found.T) / (2.0 * float(np.max(np.abs(found))))


def modal(A: FloatArray) -> FloatArray:
    """``Re (V V*)^-1`` of the modes V, each of length one when entries are measured in their own typical size."""
    size = _balance(A)
    values, V = np.linalg.eig(A / size[:, None] * size[None, :])
    gram = (V @ V.conj().T).real
    # Modes that nearly coincide leave it singular: a little of the identity keeps it apart.
    gram += 1e-9 * float(np.max(np.abs(gram))) * np.eye(len(values))
    P = np.linalg.inv(gram) / (size[:, None] * size[None, :])
    return np.asarray(0.5 * (P + P.T))


def _balance(A: FloatArray) -> FloatArray:
    """Typical sizes (n,) of the states: rows and columns of A scaled by them have like norms."""
    size = np.ones(len(A))
    off = np.abs(A) * (1.0 - np.eye(len(A)))
    for _ in range(20):
        scaled = off / size[:, None] * size[None, :]
        rows, columns = np.sum(scaled, axis=1), np.sum(scaled, axis=0)
        usable = (rows > 0.0) & (columns > 0.0)
        size = size * np.where(
            usable, np.sqrt(np.where(usable, rows, 1.0) / np.where(usable, columns, 1.0)) ** 0.5, 1.0
        )
    return np.asarray(size)
