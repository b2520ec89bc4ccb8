"""A plant from one sample to the next: zero-order hold at its inputs, any delay before them, no approximation."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np

from design.response.transition import transition
from model.arrays import FloatArray, GridArrays

#: A delay this near to whole samples, in samples, is whole.
WHOLE = 1e-12


@dataclass(frozen=True, eq=False)
class SampledPlant(GridArrays):
    """``x_(k+1) = A x_k + B v_k``, the plant's states first, then the commands that are still on their way.

    Attributes
    ----------
    A : (*G, n + d, n + d), B : (*G, n + d, m)
    plant_states : n
    sample_time : [s]
    """

    A: FloatArray
    B: FloatArray
    plant_states: int
    sample_time: float


def sampled_plant(A: FloatArray, B: FloatArray, sample_time: float, delay: tuple[float, ...]) -> SampledPlant:
    """``x' = A x + B u`` with ``u(t) = v_k`` from ``t_k + delay`` to ``t_(k+1) + delay``, at the samples ``t_k``.

    The modified z-transform in state space (Astrom and Wittenmark, Computer-Controlled Systems, 3rd ed., 1997,
    section 2.3): a delay of ``(m + p) T`` with ``0 <= p < 1`` lets ``v_(k-m-1)`` act for the first ``p T`` of a
    sample and ``v_(k-m)`` for the rest.

    Parameters
    ----------
    A : (*G, n, n) [rad/s], B : (*G, n, m)
    sample_time : [s]
    delay : of each input [s], at least 0, computation included

    Raises
    ------
    ValueError : the sample time is not positive, a delay is negative, or there is not one for each input
    """
    if not sample_time > 0.0:
        raise ValueError(f"sample time must be positive, is {sample_time} s")
    n, m = B.shape[-2:]
    if len(delay) != m:
        raise ValueError(f"{m} inputs need {m} delays, there are {len(delay)}")
    if min(delay) < 0.0:
        raise ValueError(f"delay must not be negative, is {min(delay)} s")
    samples = [_whole_and_part(each / sample_time) for each in delay]
    waiting = [whole + (part > 0.0) for whole, part in samples]
    size = n + sum(waiting)
    F, G = np.zeros((*A.shape[:-2], size, size)), np.zeros((*A.shape[:-2], size, m))
    F[..., :n, :n] = transition(A, sample_time)
    place = n
    for i, (whole, part) in enumerate(samples):
        # Where v_(k-j) is: j = 0 is the input itself, the others stand one after the other from `place` on.
        columns = [G[..., i], *(F[..., place + j] for j in range(waiting[i]))]
        now, before = _hold(A, B[..., i], sample_time, part)
        columns[whole][..., :n] = now
        if part > 0.0:
            columns[whole + 1][..., :n] = before
        for j in range(waiting[i]):
            columns[j][..., place + j] = 1.0
        place += waiting[i]
    return SampledPlant(F, G, n, sample_time)


def _whole_and_part(samples: float) -> tuple[int, float]:
    nearest = round(samples)
    if abs(samples - nearest) <= WHOLE * max(1.0, samples):
        return nearest, 0.0
    return floor(samples), samples - floor(samples)


def _hold(A: FloatArray, b: FloatArray, sample_time: float, part: float) -> tuple[FloatArray, FloatArray]:
    """What a command does that acts for the last ``1 - part`` of a sample, and for the first `part`, (*G, n) each."""
    n = b.shape[-1]
    generator = np.zeros((*b.shape[:-1], n + 1, n + 1))
    generator[..., :n, :n], generator[..., :n, n] = A, b
    last = transition(generator, (1.0 - part) * sample_time)
    first = transition(generator, part * sample_time)
    carried = last[..., :n, :n] @ first[..., :n, n:]
    return last[..., :n, n], carried[..., 0]
