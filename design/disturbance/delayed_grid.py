"""Frequencies between any two of which the response of a loop with delays is smooth."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from design.disturbance.closed_system import StablePoints
from design.disturbance.frequency_grid import distinct
from design.disturbance.open_parts import Matrices, OpenParts
from model.arrays import FloatArray

#: Places about each resonance, in units of its half width.
_OFFSETS = np.array([-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0, 8.0])
#: Frequencies of the ladder, which reaches this far beyond the slowest mode and the fastest.
_LADDER, _REACH = 96, 8.0
#: Turn of the longest delay [rad] from one frequency to the next, and how many such steps there are at most.
_TURN, _STEPS = 0.5, 4096
#: Delays that differ turn against each other this often below the top: what the directions of their turns can do
#: together is seen there, up to a hundredth of what they can do at the top.
_ROUNDS = 16.0
#: Above the last octave in which the loop's gain reaches this, it does not hear its own echo.
_QUIET = 0.02
_OCTAVES = 2.0 ** np.arange(16)


def delayed_grid(points: StablePoints, parts: OpenParts) -> FloatArray:
    """Frequencies (N, W), rising from 0 [rad/s], for stable systems (N, ...) with a delay.

    A ladder that is even over the decades, steps in which the delay turns by half a radian, and places about the
    rightmost poles. The endless others decay faster than those, and are further apart than the steps.
    """
    poles = np.where(np.isnan(points.poles), 0.0, points.poles)
    size = np.abs(poles)
    top = _REACH * np.abs(np.linalg.eigvals(points.matrices.A)).max(axis=-1)
    octaves = top[:, None] * _OCTAVES
    loop = Matrices(parts.A, parts.B, parts.K, np.zeros(parts.K.shape[:-1] + parts.B.shape[-1:]))
    heard = np.linalg.norm(loop.take((slice(None), None)).response(octaves), axis=(-2, -1)) > _QUIET
    top = octaves[np.arange(len(top)), np.minimum(np.max(heard * np.arange(1, 17), axis=-1), 15)]
    delay = max(parts.delay)
    apart = [abs(one - other) for one, other in combinations((0.0, *parts.delay), 2) if one != other]
    if len(set(parts.delay) - {0.0}) > 1:
        top = np.maximum(top, _ROUNDS * 2.0 * np.pi / min(apart))
    count = min(int(np.ceil(np.max(top, initial=0.0) * delay / _TURN)), _STEPS)
    bottom = np.where(size > 0.0, size, np.inf).min(axis=-1) / _REACH
    ladder = bottom[:, None] * (top / bottom)[:, None] ** np.linspace(0.0, 1.0, _LADDER)
    steps = np.arange(count) * np.full((len(top), 1), _TURN / delay)
    marks = [np.abs(poles.imag) + np.abs(poles.real) * offset for offset in _OFFSETS]
    grid = np.concatenate([steps, ladder, *marks], axis=-1)
    return distinct(np.clip(grid, 0.0, top[:, None]))
