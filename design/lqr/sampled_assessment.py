"""Everything that is said of a coded loop: poles and margins at its samples, step and demand between them."""

from __future__ import annotations

from dataclasses import fields
from typing import TypeVar

import numpy as np

from design.assess import Assessment
from design.frequency.bandwidth import bandwidth
from design.frequency.sampled import sampled_margins, sampled_poles
from design.lqr.coded_loop import CodedLoop
from design.lqr.sampled_response import SampledResponse, breaks_of, intervals, sampled_step_response
from design.response.course import Course
from design.response.demand import ActuatorDemand, actuator_demands
from design.response.step_metrics import BAND, RISE, StepMetrics
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: An overshoot below this is rounding, and has no peak time.
PEAK_RESOLUTION = 1e-9
#: Numbers of the states of a response that are held at once.
PART = 2_000_000

_Result = TypeVar("_Result", bound=GridArrays)


def assess_sampled(loop: CodedLoop, reference: FloatArray, duration: float) -> Assessment:
    """Judge a coded loop whose matrices are finite at every point; the step is followed between its samples too.

    Poles are ``ln z / T``, nan for modes that are over after the delay. The loop is cut between the code and the plant.
    The reference step is met at a sample, and its bandwidth is that of ``r_a -> da`` at the samples.

    Parameters
    ----------
    loop : over any grid (`take` the points that carry gains)
    reference : (p,) sizes of the step in each reference [rad]
    duration : how long the step is followed, at least [s]

    Raises
    ------
    ValueError : duration out of range, or more states than `design.frequency.margins.LARGEST`, twice the commands under
        way included where the code remembers them
    """
    grid = loop.A.shape[:-2]
    found = sampled_poles(loop.closed, loop.sampling.time, max(loop.waiting, default=0))
    step, demand = _followed(loop, np.asarray(reference, dtype=float), duration)
    margins = sampled_margins(loop.opened().cuts())
    return Assessment(
        poles=np.where(np.isfinite(found.equivalent), found.equivalent, complex(np.nan, np.nan)),
        damping_ratio=np.min(found.damping_ratio, axis=-1),
        largest_real_part=np.max(found.equivalent.real, axis=-1),
        margins=tuple(margins.take(i) for i in range(loop.B.shape[-1])),
        step=_reshaped(step, grid),
        demand=tuple(_reshaped(each, grid) for each in demand),
        actuators=loop.continuous.inputs,
        loop=loop.continuous,
    )


def _followed(loop: CodedLoop, reference: FloatArray, duration: float) -> tuple[StepMetrics, list[ActuatorDemand]]:
    """Metrics and demands (N,) of all points in one row, as many at a time as memory likes.

    Points whose responses need the same mesh are worked on together, so that none depends on its neighbours.
    """
    flat = _flattened(loop)
    count, place, parts = intervals(flat), [], []
    for needed in np.unique(count):
        points = np.flatnonzero(count == needed)
        numbers = duration / loop.sampling.time * len(breaks_of(loop)) * needed * (loop.A.shape[-1] + 3)
        size = max(1, int(PART / numbers))
        for some in (points[first : first + size] for first in range(0, points.size, size)):
            chosen = flat.take(some)
            response = sampled_step_response(chosen, reference, duration)
            place.append(some)
            parts.append((sampled_step_metrics(chosen, response), sampled_demands(chosen, response)))
    order = np.argsort(np.concatenate(place))
    step = _joined([metrics for metrics, _ in parts], order)
    return step, [_joined([each[i] for _, each in parts], order) for i in range(loop.B.shape[-1])]


def sampled_demands(loop: CodedLoop, response: SampledResponse) -> tuple[ActuatorDemand, ...]:
    """Demand of a response on each actuator, ripple between the samples included."""
    return actuator_demands(loop.continuous, response, loop.continuous.inputs)


def sampled_step_metrics(loop: CodedLoop, response: SampledResponse, output: str = "da") -> StepMetrics:
    """Metrics of an output that is to follow its reference, as of `design.response.step_metrics`.

    Times are found between the samples, and so are overshoot and undershoot; the bandwidth is that at the samples.

    Raises
    ------
    ValueError : the loop has no such output
    """
    o = response.index(output)
    final, trim = response.final_outputs[..., o], loop.continuous.offset[..., o]
    with np.errstate(over="ignore", invalid="ignore"):
        moved = response.graded.signals(response.rows[..., o : o + 1, :])[..., 0, :, :] - trim[..., None, None]
        size = np.max(np.abs(moved), axis=(-2, -1))
    exists = np.isfinite(size) & (np.abs(final - trim) > 1e-12 * size)
    course = Course(moved[exists] / (final - trim)[exists, None, None], response.graded.times)
    peak, name = course.peak(), "r_" + output.removeprefix("d")
    column = loop.continuous.references.index(name) if name in loop.continuous.references else None
    unknown = np.full(final.shape, np.nan)
    return StepMetrics(
        rise_time=_spread(course.first_time(RISE[1]) - course.first_time(RISE[0]), exists),
        settling_time=_spread(course.settling_time(BAND), exists),
        overshoot=_spread(np.maximum(peak.value - 1.0, 0.0), exists),
        undershoot=_spread(course.undershoot(), exists),
        peak_time=_spread(np.where(peak.value > 1.0 + PEAK_RESOLUTION, peak.time, np.nan), exists),
        steady_state_value=np.asarray(final),
        steady_state_error=unknown if column is None else response.reference[..., column] - (final - trim),
        bandwidth=unknown if column is None else _bandwidth(loop, response.closed_poles, column, output),
    )


def _bandwidth(loop: CodedLoop, poles: ComplexArray, column: int, output: str) -> FloatArray:
    """(*G,) -3 dB from a reference to a state of the plant [rad/s], by the bilinear map of the unit circle."""
    result = np.full(poles.shape[:-1], np.nan)
    stable = np.abs(poles).max(axis=-1) < 1.0
    F, b = loop.closed[stable], loop.reference_input[stable][..., column]
    identity, at = np.eye(F.shape[-1]), loop.states.index(output)
    inverse = np.linalg.inv(F + identity)
    matrix, driven, row = inverse @ (F - identity), np.einsum("nij,nj->ni", inverse, b), inverse[:, at]
    at_rest = np.linalg.solve(identity - F, b[..., None])[:, at, 0]
    omega = bandwidth(matrix, driven, 2.0 * row, -driven[:, at], at_rest)
    result[stable] = 2.0 * np.arctan(omega) / loop.sampling.time
    return result


def _flattened(loop: CodedLoop) -> CodedLoop:
    """All points in one row."""
    grid = loop.A.shape[:-2]
    count = int(np.prod(grid, dtype=int))
    place = np.unravel_index(np.arange(count), grid) if grid else (None,)
    return loop.take(place)


def _joined(parts: list[_Result], order: IntArray) -> _Result:
    """Parts (N_i,) of all points, one after the other, in this order."""
    kind = type(parts[0])
    names = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    return kind(**{name: np.concatenate([getattr(part, name) for part in parts])[order] for name in names})


def _reshaped(result: _Result, grid: tuple[int, ...]) -> _Result:
    kind = type(result)
    names = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    return kind(**{name: getattr(result, name).reshape(grid) for name in names})


def _spread(values: FloatArray, exists: BoolArray) -> FloatArray:
    """(*G,) the values of the points that have them, nan elsewhere."""
    spread = np.full(exists.shape, np.nan)
    spread[exists] = values
    return spread
