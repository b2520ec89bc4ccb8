"""A continuous regulator problem seen at its samples: exact plant, exact cost, delayed inputs, over the grid.

Between two samples the input is held: with ``W = [A B; 0 0]`` state and input move by ``exp(W t)``, and the integral of
the quadratic cost over one sample is a quadratic form in them (Van Loan 1978) ::

    M(T) = int_0^T exp(W't) [Q N; N' R] exp(W t) dt

Van Loan reads M off the exponential of ``[-W' M; 0 W]``, which overflows where a fast mode decays many times within a
sample. Here the series of M is summed over a time short enough, and doubled, ``M(2t) = M(t) + exp(W't) M(t) exp(W t)``.
How short is decided by the spectral radius of ``|W|``, which does not depend on the units of states and inputs; nor do
the relative errors of the entries.

A transport delay of an input, whole samples and a fraction of one, makes the commands that are under way states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from design.lqr.regulator import check_shapes, finite
from model.arrays import FloatArray, GridArrays

#: Terms of the series, over a time in which no mode moves by more than e^0.5: what is left out is below 1e-17.
TERMS = 18
#: Largest spectral radius of ``|W| T``: with more a growing mode overflows, and a decaying one is over at once.
FASTEST = 1e9
#: A delay this near to a whole number of samples, in samples, is whole.
WHOLE = 1e-9
#: A singular value of Q below this, on a unit diagonal, is zero.
RANK = 1e-12


@dataclass(frozen=True, eq=False)
class SampledRegulator(GridArrays):
    """Minimise ``sum( x'Qx + u'Ru + 2x'Nu )`` for ``x+ = A x + B u``.

    Attributes
    ----------
    A (*G, n, n), B (*G, n, m) : from sample to sample, the input held in between
    Q (*G, n, n), R (*G, m, m), N (*G, n, m) : integral of the cost over one sample
    command_weight : (*G, m, m) diagonal, the part of R that prices each input by itself; without it
        ``[Q N; N' R]`` is still positive semidefinite. It may be charged when an input is commanded instead of when it
        arrives: over all samples the sum is the same
    held : the states behind those of the plant, each the command of an input some samples ago: ``(input, samples)``
    """

    A: FloatArray
    B: FloatArray
    Q: FloatArray
    R: FloatArray
    N: FloatArray
    command_weight: FloatArray
    held: tuple[tuple[int, int], ...] = ()


def sampled_regulator(
    A: FloatArray,
    B: FloatArray,
    Q: FloatArray,
    R: FloatArray,
    N: FloatArray | None,
    sample_time: float,
    delay: Sequence[float] | None = None,
) -> SampledRegulator:
    """``x' = A x + B u`` and ``int( x'Qx + u'Ru + 2x'Nu ) dt`` for an input that is held for `sample_time`.

    With a delay u in the cost is what arrives at the plant, but for the `command_weight`. nan at points whose numbers
    are not finite, or leave double precision within a sample.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, m) : the plant
    Q (n, n), R (m, m), N (n, m) or None : weights, with or without the grid's axes; R > 0, Q - N R^-1 N' >= 0
    sample_time : positive [s]
    delay : (m,) of each input, not negative [s]; none when None

    Raises
    ------
    ValueError : shapes that do not belong together, a sample time that is not positive, a negative delay
    """
    check_shapes(A, B, Q, R, N)
    if not (np.isfinite(sample_time) and sample_time > 0):
        raise ValueError(f"the sample time must be positive, not {sample_time} s")
    grid, (n, m) = A.shape[:-2], B.shape[-2:]
    whole, late = _split_delay(np.zeros(m) if delay is None else np.asarray(delay, dtype=float), m, sample_time)
    alone = _command_weight(Q, R, N)
    W, cost = np.zeros((*grid, n + m, n + m)), np.zeros((*grid, n + m, n + m))
    W[..., :n, :n], W[..., :n, n:] = A, B
    cost[..., :n, :n], cost[..., n:, n:] = Q, R - alone
    if N is not None:
        cost[..., :n, n:], cost[..., n:, :n] = N, N.mT
    last = np.flatnonzero(late)
    moved, integral = _one_sample(W, cost, n, late, sample_time)
    states = n + len(last)
    A_sampled, B_sampled = np.zeros((*grid, states, states)), np.zeros((*grid, states, m))
    A_sampled[..., :n, :], B_sampled[..., :n, :] = moved[..., :states], moved[..., states:]
    B_sampled[..., n + np.arange(len(last)), last] = 1.0
    alone = np.broadcast_to(alone * sample_time, (*grid, m, m))
    sampled = SampledRegulator(
        A=A_sampled,
        B=B_sampled,
        Q=integral[..., :states, :states],
        R=integral[..., states:, states:] + alone,
        N=integral[..., :states, states:],
        command_weight=alone,
        held=tuple((int(i), 1) for i in last),
    )
    return with_input_delay(sampled, whole)


def with_input_delay(sampled: SampledRegulator, samples: Sequence[int]) -> SampledRegulator:
    """The problem whose input is a command that arrives some samples later: the commands under way become states.

    Behind the states there are follow, input by input, the commands of 1, 2, .. samples ago. What arrives is priced
    when it arrives, but for the `command_weight`, which is charged with the command.

    Parameters
    ----------
    samples : (m,) of each input

    Raises
    ------
    ValueError : not m whole numbers, or a negative one
    """
    m = sampled.B.shape[-1]
    if len(samples) != m or any(d != int(d) or d < 0 for d in samples):
        raise ValueError(f"a delay of {tuple(samples)} samples: expected {m} whole numbers, not negative")
    under_way = [(i, age) for i, d in enumerate(samples) for age in range(1, int(d) + 1)]
    if not under_way:
        return sampled
    grid, n, more = sampled.A.shape[:-2], sampled.A.shape[-1], len(under_way)
    # [x; what arrives] = arriving @ [x; under way; command]
    arriving = np.zeros((n + m, n + more + m))
    arriving[:n, :n] = np.eye(n)
    shift = np.zeros((more, n + more + m))
    for k, (i, age) in enumerate(under_way):
        shift[k, n + more + i if age == 1 else n + k - 1] = 1.0
        if age == samples[i]:
            arriving[n + i, n + k] = 1.0
    for i, d in enumerate(samples):
        if d == 0:
            arriving[n + i, n + more + i] = 1.0
    move = np.concatenate([sampled.A, sampled.B], axis=-1) @ arriving
    move = np.concatenate([move, np.broadcast_to(shift, (*grid, *shift.shape))], axis=-2)
    rest = sampled.R - sampled.command_weight
    cost = np.concatenate(
        [np.concatenate([sampled.Q, sampled.N], axis=-1), np.concatenate([sampled.N.mT, rest], axis=-1)], axis=-2
    )
    cost = arriving.T @ cost @ arriving
    states = n + more
    return SampledRegulator(
        A=move[..., :states],
        B=move[..., states:],
        Q=cost[..., :states, :states],
        R=cost[..., states:, states:] + sampled.command_weight,
        N=cost[..., :states, states:],
        command_weight=sampled.command_weight,
        held=(*((i, age + int(samples[i])) for i, age in sampled.held), *under_way),
    )


def _split_delay(delay: FloatArray, inputs: int, sample_time: float) -> tuple[list[int], FloatArray]:
    """Whole samples (m,) and the fraction of one that is left (m,)."""
    if delay.shape != (inputs,) or not np.all(np.isfinite(delay)) or np.any(delay < 0):
        raise ValueError(f"delays of {delay.tolist()} s: expected {inputs} numbers, not negative")
    samples = delay / sample_time
    near = np.rint(samples)
    samples = np.where(np.abs(samples - near) <= WHOLE, near, samples)
    whole = np.floor(samples)
    return [int(d) for d in whole], samples - whole


def _command_weight(Q: FloatArray, R: FloatArray, N: FloatArray | None) -> FloatArray:
    """The largest multiple of the diagonal of R that leaves ``[Q N; N' R]`` positive semidefinite without it.

    It is the diagonal of R itself, where R is diagonal and there is no N.
    """
    diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    weight = diagonal[..., None] * np.eye(R.shape[-1])
    if N is None and np.array_equal(R, weight):
        return weight
    with np.errstate(all="ignore"):
        unit = 1.0 / np.sqrt(diagonal)
        rest = R * unit[..., :, None] * unit[..., None, :]
        if N is not None:
            size = np.diagonal(Q, axis1=-2, axis2=-1)
            scale = np.where(size > 0, 1.0 / np.sqrt(size), 1.0)
            weight_of_states = _or_zero(Q * scale[..., :, None] * scale[..., None, :])
            cross = scale[..., :, None] * N * unit[..., None, :]
            rest = rest - cross.mT @ np.linalg.pinv(weight_of_states, rcond=RANK, hermitian=True) @ cross
    # A hair less, so that rounding leaves the rest positive.
    share = np.clip(np.linalg.eigvalsh(_or_zero(rest))[..., 0] - RANK, 0.0, 1.0)
    return np.asarray(share[..., None, None] * weight)


def _or_zero(matrix: FloatArray) -> FloatArray:
    """The matrix where it is finite, elsewhere zero."""
    return np.where(finite(matrix)[..., None, None], matrix, 0.0)


def _one_sample(
    W: FloatArray, cost: FloatArray, n: int, late: FloatArray, sample_time: float
) -> tuple[FloatArray, FloatArray]:
    """State after a sample (*G, n, k) and its cost (*G, k, k) from ``[x; commands before; commands]``.

    The inputs that arrive a fraction of a sample late, ``late`` (m,), begin it with the command before.
    """
    m = len(late)
    last = np.flatnonzero(late)
    k = n + len(last) + m
    whole = np.eye(n, k)
    moved, integral = np.broadcast_to(whole, (*W.shape[:-2], n, k)), np.zeros((*W.shape[:-2], k, k))
    times = np.unique([0.0, *late, 1.0])
    for start, end in pairwise(times):
        held = np.zeros((m, k))
        for i in range(m):
            held[i, n + len(last) + i if late[i] <= start else n + int(np.searchsorted(last, i))] = 1.0
        begin = np.concatenate([moved, np.broadcast_to(held, (*W.shape[:-2], m, k))], axis=-2)
        step, part = _interval(W, cost, (end - start) * sample_time)
        integral = integral + begin.mT @ part @ begin
        moved = (step @ begin)[..., :n, :]
    return moved, 0.5 * (integral + integral.mT)


def _interval(W: FloatArray, cost: FloatArray, duration: float) -> tuple[FloatArray, FloatArray]:
    """``exp(W t)`` and ``int_0^t exp(W's) cost exp(W s) ds`` (*G, k, k) for t = duration; nan where not finite."""
    shape = W.shape
    W, cost = W.reshape(-1, *shape[-2:]) * duration, cost.reshape(-1, *shape[-2:]) * duration
    with np.errstate(all="ignore"):
        known = finite(W) & finite(cost)
        W, cost = np.where(known[:, None, None], W, 0.0), np.where(known[:, None, None], cost, 0.0)
        speed = np.abs(np.linalg.eigvals(np.abs(W))).max(axis=-1)
        known &= speed <= FASTEST
        doublings = np.where(known, np.maximum(np.ceil(np.log2(2.0 * np.maximum(speed, 0.5))), 0.0), 0.0)
        shrink = np.exp2(-doublings)[:, None, None]
        W, term = W * shrink, cost * shrink
        move, integral, power = np.eye(shape[-1]) + W, term, W
        for k in range(2, TERMS + 1):
            term = (term @ W) / k
            term = term + term.mT
            integral = integral + term
            power = (power @ W) / k
            move = move + power
        for done in range(int(doublings.max(initial=0.0))):
            going = np.flatnonzero(doublings > done)
            step = move[going]
            integral[going] += step.mT @ integral[going] @ step
            move[going] = step @ step
        known &= finite(move) & finite(integral)
    move[~known], integral[~known] = np.nan, np.nan
    return move.reshape(shape), integral.reshape(shape)
