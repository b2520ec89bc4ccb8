"""Settling time and overshoot of very many loops, in groups that share a mesh, so that memory stays bounded.

`design.response.step_metrics` takes all its loops on one mesh, as fine as the worst of them needs. Loops at the edge
of stability need a hundred times the samples of the others, and among thousands there are always some. Here each loop
is answered on the mesh that it would have alone. What is measured is the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from design.delay.characteristic import SHORTEST
from design.delay.step_response import delayed_step_response
from design.frequency.poles import poles
from design.loop import Loop
from design.response.course import Course
from design.response.graded import (
    BLOCKS,
    FADING,
    INTERVALS,
    LARGEST_BLOCKS,
    LARGEST_INTERVALS,
    RESOLUTION,
)
from design.response.step_metrics import BAND
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray

#: Bytes of states on the mesh of one group, or of one loop that needs more; what is taken of them is about as large.
GROUP_BYTES = 16_000_000
#: With delays the mesh is finer, and known only afterwards; loops at once then.
DELAYED_AT_ONCE = 16


@dataclass(frozen=True, eq=False)
class StepQuality(GridArrays):
    """How the aileron's step ends and by how much it overshoots, as in `design.response.step_metrics`.

    Attributes
    ----------
    settling_time : (N,) after it the aileron stays within 2 % of its change [s]; nan when not inside the response
    overshoot : (N,) largest excess over the final value, as a part of the change [-], at least 0
    """

    settling_time: FloatArray
    overshoot: FloatArray


def step_quality(loop: Loop, reference: float, duration: float) -> StepQuality:
    """Settling time and overshoot of the aileron after a step of its reference; nan where it has none.

    Parameters
    ----------
    loop : (N,) stable loops whose matrices are finite
    reference : size of the step [rad]
    duration : how long it is followed [s], longer than any delay
    """
    seen = _aileron_only(loop)
    settling, overshoot = np.full((2, len(loop.A)), np.nan)
    for group in _groups(loop, duration):
        settling[group], overshoot[group] = _measured(seen.take(group), reference, duration)
    return StepQuality(settling, overshoot)


def _aileron_only(loop: Loop) -> Loop:
    """The loop with its output ``da`` alone and without stages: the rest need not be carried along."""
    row = loop.outputs.index("da")
    one = slice(row, row + 1)
    return replace(
        loop, C=loop.C[..., one, :], F=loop.F[..., one, :], D=loop.D[..., one, :], H=loop.H[..., one, :],
        offset=loop.offset[..., one], outputs=("da",), stages=(),
    )  # fmt: skip


def _measured(loop: Loop, reference: float, duration: float) -> tuple[FloatArray, FloatArray]:
    """Settling times and overshoots (N,) of loops on one mesh."""
    step = np.array([reference if name == "r_a" else 0.0 for name in loop.references])
    response = delayed_step_response(loop, step, duration, 2)
    trim = loop.offset[:, 0]
    change = response.final_outputs[:, 0] - trim
    moved = response.graded.signals(response.rows)[:, 0] - trim[:, None, None]
    exists = np.isfinite(change) & (np.abs(change) > 1e-12 * np.max(np.abs(moved), axis=(-2, -1)))
    settling, overshoot = np.full((2, len(change)), np.nan)
    course = Course(moved[exists] / change[exists, None, None], response.graded.times)
    settling[exists] = course.settling_time(BAND)
    overshoot[exists] = np.maximum(course.peak().value - 1.0, 0.0)
    return settling, overshoot


def _groups(loop: Loop, duration: float) -> Iterator[IntArray]:
    """Indices (M,) of loops that share a mesh, no more at once than `GROUP_BYTES` hold."""
    count, n = loop.A.shape[:2]
    if max(loop.delay) > SHORTEST:
        yield from _in_parts(np.arange(count), DELAYED_AT_ONCE)
        return
    intervals, blocks = _mesh(poles(loop.closed), duration)
    mesh = intervals * (LARGEST_BLOCKS + 1) + blocks
    for kind in np.unique(mesh):
        alike = np.flatnonzero(mesh == kind)
        size = int((intervals[alike[0]] + 1) * blocks[alike[0]] * (n + 1) * 8)
        yield from _in_parts(alike, max(1, GROUP_BYTES // size))


def _in_parts(index: IntArray, most: int) -> Iterator[IntArray]:
    for first in range(0, index.size, most):
        yield index[first : first + most]


def _mesh(found: ComplexArray, duration: float) -> tuple[IntArray, IntArray]:
    """Intervals of a block and blocks (N,) of the mesh that `design.response.graded` makes for each loop alone."""
    size = np.abs(found)
    fading = np.maximum(-found.real, FADING * 1e-6 * size)
    turns = np.minimum(0.5 * size * duration / RESOLUTION, FADING * size / np.where(size > 0.0, fading, 1.0))
    needed = 2.0 ** np.ceil(np.log2(np.maximum(turns.max(axis=-1), 1.0)))
    intervals = np.clip(needed, INTERVALS, LARGEST_INTERVALS).astype(np.int64)
    fastest = np.max(size, axis=-1) * duration / (RESOLUTION * intervals)
    blocks = 1 + np.ceil(np.log2(np.maximum(fastest, 1.0))).astype(np.int64)
    return intervals, np.clip(blocks + blocks % 2, BLOCKS, LARGEST_BLOCKS)
