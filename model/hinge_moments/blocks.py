"""Evaluation of a fit at many angles, some thousands at a time: memory stays bounded on any grid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from model.arrays import FloatArray, Floats
from model.hinge_moments.expansion import HingeMoments

_BLOCK = 4096


def in_blocks(evaluate: Callable[[FloatArray], HingeMoments], alpha: Floats, dt: Floats, da: Floats) -> HingeMoments:
    """Hinge moments (*G) by a function that takes angles (m, 3), order [alpha, dt, da] [rad]."""
    angles = np.stack(np.broadcast_arrays(*(np.asarray(x, float) for x in (alpha, dt, da))), axis=-1)
    flat = angles.reshape(-1, 3)
    value, gradient = np.empty((len(flat), 2)), np.empty((len(flat), 2, 3))
    for start in range(0, len(flat), _BLOCK):
        block = slice(start, start + _BLOCK)
        moments = evaluate(flat[block])
        value[block], gradient[block] = moments.value, moments.gradient
    grid = angles.shape[:-1]
    return HingeMoments(value.reshape(*grid, 2), gradient.reshape(*grid, 2, 3))
