"""Figures of merit of a step response: exact final values, times refined between the samples.

Rise, settling, overshoot and undershoot are measured in the output's own change from trim to its final value,
as in python-control's ``step_info``; how far that final value is from the wanted one is the steady-state error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.bandwidth import bandwidth
from design.loop import Loop
from design.response.course import Course
from design.response.final_value import final_values
from design.response.step_response import Response
from model.arrays import BoolArray, FloatArray, GridArrays

RISE = (0.1, 0.9)
BAND = 0.02
#: An overshoot below this is rounding, and has no peak time.
_PEAK_RESOLUTION = 1e-9


@dataclass(frozen=True, eq=False)
class StepMetrics(GridArrays):
    """Metrics of one output over the grid, each (*G,); nan where a value does not exist.

    Attributes
    ----------
    rise_time : from 10 % to 90 % of the change [s]; nan when 90 % is not reached inside the response
    settling_time : after it the output stays within 2 % of its change [s]; nan when not inside the response
    overshoot : largest excess over the final value, as a fraction of the change, >= 0
    undershoot : largest excursion the wrong way, as a fraction of the change, >= 0
    peak_time : time of the largest value [s]; nan without overshoot
    steady_state_value : the value the output settles to, trim included [unit of the output]
    steady_state_error : wanted change less the change it settles to [unit of the output]
    bandwidth : frequency where the transfer from the reference is 3 dB below its DC gain [rad/s]

    Where the output does not settle (an unstable loop) all of them are nan; where it settles to where it
    began, those that are fractions of the change are; of an output without a reference the error and the
    bandwidth are.
    """

    rise_time: FloatArray
    settling_time: FloatArray
    overshoot: FloatArray
    undershoot: FloatArray
    peak_time: FloatArray
    steady_state_value: FloatArray
    steady_state_error: FloatArray
    bandwidth: FloatArray


def step_metrics(
    loop: Loop, response: Response, output: str = "da", reference: FloatArray | None = None
) -> StepMetrics:
    """Metrics of an output that is to follow its reference (``da`` follows ``r_a``, ``dt`` follows ``r_t``).

    Parameters
    ----------
    loop : closed loops over the grid
    response : their response (``design.response.step_response.step_response``)
    output : name of the output
    reference : (p,) or (*G, p) wanted changes [rad]; the steps of the response when left out

    Raises
    ------
    ValueError : the loop has no such output
    """
    o = response.index(output)
    wanted = response.reference if reference is None else np.asarray(reference, dtype=float)
    final, trim = response.final_outputs[..., o], loop.offset[..., o]
    with np.errstate(over="ignore", invalid="ignore"):
        signal = response.graded.signals(response.rows[..., o : o + 1, :])[..., 0, :, :]
        moved = signal - trim[..., None, None]
        size = np.max(np.abs(moved), axis=(-2, -1))
    exists = np.isfinite(size) & (np.abs(final - trim) > 1e-12 * size)
    course = Course(moved[exists] / (final - trim)[exists, None, None], response.graded.times)
    peak = course.peak()
    return StepMetrics(
        rise_time=_spread(course.first_time(RISE[1]) - course.first_time(RISE[0]), exists),
        settling_time=_spread(course.settling_time(BAND), exists),
        overshoot=_spread(np.maximum(peak.value - 1.0, 0.0), exists),
        undershoot=_spread(course.undershoot(), exists),
        peak_time=_spread(np.where(peak.value > 1.0 + _PEAK_RESOLUTION, peak.time, np.nan), exists),
        steady_state_value=np.asarray(final),
        steady_state_error=_wanted(loop, output, wanted) - (final - trim),
        bandwidth=_bandwidth(loop, response, output),
    )


def _spread(values: FloatArray, exists: BoolArray) -> FloatArray:
    """(*G,) the values of the points that have them, nan elsewhere."""
    spread = np.full(exists.shape, np.nan)
    spread[exists] = values
    return spread


def _reference_of(loop: Loop, output: str) -> int | None:
    """Index of the reference that an output follows; None when the loop has none (a regulator)."""
    name = "r_" + output.removeprefix("d")
    return loop.references.index(name) if name in loop.references else None


def _wanted(loop: Loop, output: str, reference: FloatArray) -> FloatArray:
    """(*G,) wanted change of the output; nan when nothing is wanted of it."""
    column = _reference_of(loop, output)
    grid = loop.A.shape[:-2]
    return np.full(grid, np.nan) if column is None else np.broadcast_to(reference[..., column], grid)


def _bandwidth(loop: Loop, response: Response, output: str) -> FloatArray:
    """(*G,) bandwidth from its reference to the output [rad/s]."""
    column, o = _reference_of(loop, output), response.index(output)
    if column is None:
        return np.full(loop.A.shape[:-2], np.nan)
    A, b = loop.closed, loop.reference_input[..., column]
    c, d = loop.closed_outputs[..., o, :], loop.reference_feedthrough[..., o, column]
    generator = np.zeros_like(response.generator)
    generator[..., :-1, :-1], generator[..., :-1, -1] = A, b
    row = np.concatenate([c, d[..., None]], axis=-1)[..., None, :]
    return bandwidth(A, b, c, np.asarray(d), final_values(generator, row, response.poles)[..., 0])
