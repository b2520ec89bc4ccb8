"""How a step disturbance is rejected: the largest deviation, when it is reached, when it has gone, and what stays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.with_pade import without_delay
from design.disturbance.closed_system import ClosedSystem, StablePoints
from design.disturbance.open_parts import Matrices
from design.response.course import Course, Peak
from design.response.extremes import NOISE, SAMPLED_PART
from design.response.graded import graded_states
from design.response.interpolant import local_maxima
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: A deviation has gone when it stays within this part of its peak.
BAND = 0.05
#: The response is followed until its slowest mode has decayed by exp(-16) at least.
_DECAY = 16.0
#: A mode of a damping below ``2^-8`` is not followed to its end.
_LEAST_DAMPED = 8
#: Steps of the exponents that a mesh is chosen by.
_STEPS = np.array([4, 2])
#: A steady value below this part of the peak is rounding: with integral action nothing stays.
_NOTHING = 1e-11
#: A deviation that never exceeds what stays by more than this part of it has no peak of its own.
_APPROACHED = 1e-9


@dataclass(frozen=True, eq=False)
class Rejection(GridArrays):
    """Deviations after a unit step of one input, all others at rest, each (*G, o, p).

    All are nan where the loop is not stable, or holds a mode of damping below 1/256, which would have to be followed
    over hundreds of turns.

    Attributes
    ----------
    peak : largest deviation, with its sign [unit of the output per unit of the input]; inf where the output takes the
        rate of the input
    peak_time : when it is reached [s]; nan where nothing deviates, or where it is only approached, as what stays
    rejection_time : after it the deviation stays within `band` times the peak [s]; nan where it never does, or where
        nothing deviates
    residual : what stays, the DC gain [unit of the output per unit of the input]; 0 with integral action
    band : part of the peak
    """

    peak: FloatArray
    peak_time: FloatArray
    rejection_time: FloatArray
    residual: FloatArray
    band: float


def rejection(system: ClosedSystem, band: float = BAND, inputs: tuple[str, ...] | None = None) -> Rejection:
    """Figures of the step response from each input to each output, found between the samples of a graded mesh.

    Without delay they are accurate to 1e-8. A transport delay is an approximant of order 12 here
    (`design.delay.with_pade`), good to 1e-7 of the peak for torques, which no command answers at once; the residual is
    exact.

    Parameters
    ----------
    system : over any grid
    band : part of the peak, between 0 and 1
    inputs : those that are stepped; the others have nan. All of them when left out

    Raises
    ------
    ValueError : the band is not between 0 and 1, or the system has no such input
    """
    columns = [_column(system, name) for name in (system.inputs if inputs is None else inputs)]
    if not 0.0 < band < 1.0:
        raise ValueError(f"the band must be between 0 and 1, is {band}")
    points = system.stable_points
    matrices = _without_delay(points, columns)
    poles = np.linalg.eigvals(matrices.A).astype(np.complex128)
    stepped = np.full((4, *matrices.D.shape), np.nan)
    needs = _mesh_needs(poles)
    for need in np.unique(needs[needs[:, 1] <= _LEAST_DAMPED], axis=0):
        alike = np.all(needs == need, axis=-1)
        linked = points.linked[alike][..., columns]
        stepped[:, alike] = _figures(matrices.take(alike), linked, poles[alike], need, band)
    endless = points.R[..., columns] != 0.0
    stepped[0], stepped[1:3] = np.where(endless, np.inf, stepped[0]), np.where(endless, np.nan, stepped[1:3])
    figures = np.full((4, *points.R.shape), np.nan)
    figures[..., columns] = stepped
    peak, peak_time, rejection_time, residual = (system.over_grid(values) for values in figures)
    return Rejection(peak, peak_time, rejection_time, residual, float(band))


def _column(system: ClosedSystem, name: str) -> int:
    if name not in system.inputs:
        raise ValueError(f"there is no such input as {name!r}; there are {', '.join(system.inputs)}")
    return system.inputs.index(name)


def _without_delay(points: StablePoints, columns: list[int]) -> Matrices:
    """The closed loops from some of their inputs, with approximants in the place of their delays."""
    if points.parts is None:
        A, B, C, D = points.matrices.A, points.matrices.B, points.matrices.C, points.matrices.D
    else:
        loop = without_delay(points.parts.as_loop)
        A, B, C = loop.closed, loop.reference_input, loop.closed_outputs
        D = loop.reference_feedthrough + points.parts.J
    return Matrices(A, B[..., columns], C, D[..., columns])


def _unit(poles: ComplexArray) -> FloatArray:
    """Unit of time (N,) of each point [s], a power of two, in which its slowest mode decays by 1 to 2."""
    return np.asarray(np.exp2(np.ceil(-np.log2(np.min(-poles.real, axis=-1)))))


def _mesh_needs(poles: ComplexArray) -> IntArray:
    """What the mesh of a point hangs on (N, 2): binary exponents of its fastest mode's size and its least damping.

    Points of the same needs share a mesh, which then does not depend on any other point. The exponents are rounded up
    to multiples of 4 and 2, so that there are few meshes.
    """
    size = np.abs(poles)
    fastest = np.max(size, axis=-1) * _unit(poles)
    undamped = np.max(size / -poles.real, axis=-1)
    exponents = np.log2(np.stack([fastest, undamped], axis=-1)) - 1e-9
    return np.asarray(_STEPS * np.maximum(np.ceil(exponents / _STEPS), 1.0), dtype=np.int64)


def _figures(matrices: Matrices, linked: BoolArray, poles: ComplexArray, need: IntArray, band: float) -> FloatArray:
    """(4, N, o, p) fields of `Rejection` of points that share a mesh."""
    N, n, p = matrices.B.shape
    o = matrices.C.shape[-2]
    unit = _unit(poles)
    generator = np.zeros((N, p, n + 1, n + 1))
    generator[..., :n, :n] = (matrices.A * unit[:, None, None])[:, None]
    generator[..., :n, n] = matrices.B.mT * unit[:, None, None]
    rows = np.concatenate([matrices.C[:, None] * linked.mT[..., None], matrices.D.mT[..., None]], axis=-1)
    damping = 0.5 ** float(need[1])
    pole = 2.0 ** float(need[0]) * np.array([-damping + 1j * np.sqrt(1.0 - damping**2)])
    mesh = graded_states(generator, pole, _DECAY)
    signal = mesh.signals(rows).swapaxes(1, 2).reshape(N * o * p, mesh.blocks, mesh.intervals + 1)
    residual = np.where(linked, matrices.response(np.zeros(N)).real, matrices.D)
    peak = _largest(signal, mesh.times)
    size, time = np.abs(peak.value), peak.time
    gone = Course(1.0 + signal / np.where(size > 0.0, size, 1.0)[:, None, None], mesh.times).settling_time(band)
    value, size, time, gone = (v.reshape(N, o, p) for v in (peak.value, size, time, gone))
    residual = np.where(np.abs(residual) <= _NOTHING * size, 0.0, residual)
    approached = np.abs(residual) >= size * (1.0 - _APPROACHED)
    value = np.where(approached, residual, value)
    time = np.where(approached, np.nan, time * unit[:, None, None])
    gone = np.where(np.abs(residual) >= band * np.abs(value), np.nan, gone * unit[:, None, None])
    return np.stack([value, time, gone, residual])


def _largest(signal: FloatArray, times: FloatArray) -> Peak:
    """Largest deviations (K,) of signals (K, S, m+1) to either side, with their signs, and their times."""
    size = np.abs(signal).reshape(len(signal), -1)
    index = np.argmax(size, axis=-1)[:, None]
    value = np.take_along_axis(signal.reshape(size.shape), index, axis=-1)[:, 0]
    time = times.reshape(-1)[index[:, 0]]
    top = np.abs(value)
    found = local_maxima(size.reshape(signal.shape), SAMPLED_PART * top, NOISE * top, signed=signal)
    row, block = np.divmod(found.row, len(times))
    # Of several maxima of one signal the last written stays: the highest, so they are written in order.
    order = np.argsort(found.value, kind="stable")
    order = order[found.value[order] > top[row[order]]]
    at, start, step = row[order], times[block[order], 0], times[block[order], 1] - times[block[order], 0]
    value[at] = np.copysign(found.value[order], signal[at, block[order], np.rint(found.place[order]).astype(np.int64)])
    time[at] = start + step * found.place[order]
    return Peak(value, time)
