"""A closed loop as seen from its references: which outputs are asked for, and how references reach them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.delay.with_pade import without_delay
from design.disturbance.closed_system import ClosedSystem, closed_system
from design.loop import Loop
from model.arrays import BoolArray, FloatArray, GridArrays

#: Behind the name of an angle it stands for its tracking error.
ERROR = "_error"
#: Least damping ratio of a mode, and least decay of the slowest mode as a part of the fastest, that a mesh can follow.
LEAST_DAMPING, SLOWEST = 0.004, 1e-8


@dataclass(frozen=True, eq=False)
class Channels(GridArrays):
    """``x' = A x + B r``, ``y = y0 + C x + D r + R r'`` over the grid, all loops closed.

    Attributes
    ----------
    A (*G, n, n), B (*G, n, p), C (*G, o, n), D (*G, o, p), R (*G, o, p)
    trim : (*G, o) y0
    stable : (*G,) mask of the points whose modes all die out, and soon enough that a mesh can follow them
    finite : (*G,) mask of the points that carry no nan or inf
    names : of the outputs
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    R: FloatArray
    trim: FloatArray
    stable: BoolArray
    finite: BoolArray
    names: tuple[str, ...]


def channels(loop: Loop, outputs: tuple[str, ...]) -> Channels:
    """The loop from all its references to some outputs.

    Parameters
    ----------
    loop : over any grid; points that carry nan are marked as not finite
    outputs : names of its outputs, or ``da_error``, ``dt_error``: the reference less the change of its angle,
        ``r_a - da``, whose trim is zero

    A loop with delays is led through `design.delay.with_pade.without_delay`, with all that it says of its errors.

    Raises
    ------
    ValueError : no such output or no reference for an error, or a delay is negative
    """
    known = (*loop.outputs, *(angle + ERROR for angle in loop.outputs))
    unknown = [name for name in outputs if name not in known]
    if unknown:
        raise ValueError(f"the loop has no output {unknown[0]!r}; it has {', '.join(loop.outputs)}")
    angles = tuple(name.removesuffix(ERROR) if _is_error(loop, name) else name for name in outputs)
    if min(loop.delay) < 0.0:
        raise ValueError(f"delays must not be negative, are {loop.delay} s")
    undelayed = replace(without_delay(loop), delay=(0.0,) * len(loop.delay))
    system = closed_system(undelayed, loop.references, angles)
    C, D, R, trim = (
        system.C.copy(),
        system.D.copy(),
        system.R.copy(),
        loop.offset[..., [loop.outputs.index(name) for name in angles]],
    )
    for row, (name, angle) in enumerate(zip(outputs, angles, strict=True)):
        if name != angle:
            for M in (C, D, R, trim[..., None]):
                M[..., row, :] *= -1.0
            D[..., row, loop.references.index(_reference(angle))] += 1.0
            trim[..., row] = 0.0
    finite = _finite(system, trim)
    return Channels(system.A, system.B, C, D, R, trim, system.stable & _followed(system), finite, tuple(outputs))


def _is_error(loop: Loop, name: str) -> bool:
    if name in loop.outputs or not name.endswith(ERROR):
        return False
    if _reference(name.removesuffix(ERROR)) not in loop.references:
        raise ValueError(f"the loop has no reference for {name!r}; it has {', '.join(loop.references)}")
    return True


def _reference(angle: str) -> str:
    """Name of the reference that an angle follows: ``r_a`` of ``da``."""
    return "r_" + angle.removeprefix("d")


def _followed(system: ClosedSystem) -> BoolArray:
    """(*G,) mask of the points whose modes all are within what `design.response.graded` resolves."""
    size, decay = np.abs(system.poles), -system.poles.real
    oscillates = np.any(decay < LEAST_DAMPING * size, axis=-1)
    lasts = np.min(decay, axis=-1) < SLOWEST * np.max(size, axis=-1)
    return np.asarray(~oscillates & ~lasts)


def _finite(system: ClosedSystem, trim: FloatArray) -> BoolArray:
    arrays = (system.A, system.B, system.C, system.D, system.R, trim[..., None])
    return np.asarray(np.all([np.isfinite(M).all(axis=(-2, -1)) for M in arrays], axis=0))
