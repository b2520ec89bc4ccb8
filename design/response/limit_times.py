"""How long signals are at or beyond limits, with the crossings and what stands out between two samples refined."""

from __future__ import annotations

import numpy as np

from design.response.excursions import hidden_excursions
from design.response.extremes import SAMPLED_PART
from design.response.interpolant import crossings
from model.arrays import FloatArray


def times_beyond(signals: FloatArray, limits: FloatArray, steps: FloatArray) -> FloatArray:
    """Time that each signal spends where its magnitude is its limit or more.

    Parameters
    ----------
    signals : (..., S, m+1) on blocks of even samples that resolve them
    limits : (...) positive, or nan where there is none
    steps : (S,) sample step of each block [s]

    Returns
    -------
    (...) [s]; 0 where there is no limit
    """
    blocks, samples = signals.shape[-2:]
    rows = signals.reshape(-1, samples)
    level = np.repeat(np.broadcast_to(limits, signals.shape[:-2]).reshape(-1), blocks)
    with np.errstate(invalid="ignore"):
        near = np.flatnonzero(np.max(np.abs(rows), axis=-1) >= SAMPLED_PART * level)
    spent = np.zeros(len(rows))
    for sign in (1.0, -1.0):
        spent[near] += _above(sign * rows[near] - level[near, None], level[near])
    return np.asarray(spent.reshape(signals.shape[:-1]) @ steps)


def _above(excess: FloatArray, level: FloatArray) -> FloatArray:
    """(R,) how long [samples] each row (R, m+1) is not below zero, what it is a part of having this level (R,)."""
    above = excess >= 0.0
    spent: FloatArray = np.sum(above[:, :-1] & above[:, 1:], axis=-1, dtype=np.float64)
    row, before = np.nonzero(above[:, :-1] != above[:, 1:])
    place = crossings(excess, row, before, np.zeros(len(row)))
    falling = above[row, before]
    np.add.at(spent, row, np.where(falling, place - before, before + 1.0 - place))
    hidden = hidden_excursions(excess, level)
    np.add.at(spent, hidden.row, hidden.side * (hidden.end - hidden.begin))
    return spent
