"""Peak powers of the actuators and the aileron's settling on a reference step, of the loop as it is flown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.characteristic import finite_points
from design.delay.step_response import delayed_step_response
from design.delay.with_pade import without_delay
from design.frequency.poles import poles
from design.loop import Loop
from design.lqr.power_weights import ReferenceStep
from design.response.course import Course
from design.response.extremes import largest_magnitudes
from design.response.final_value import decaying
from design.response.step_metrics import BAND
from design.response.step_response import Response
from model.arrays import FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class PowerFigures(GridArrays):
    """Figures of a step, each (*G,); nan where a loop is not stable or a value does not exist.

    Power is ``p_i = T_i d_i'`` with the total torque, trim included; peaks are those of the continuous response.

    Attributes
    ----------
    tab, aileron : peak of ``abs(p_i)`` [W]
    total : peak of ``abs(p_t) + abs(p_a)`` [W]: what a supply must give that takes nothing back
    net : peak of ``abs(p_t + p_a)`` [W]: where one actuator may feed the other
    settling_time : of the aileron within 2 % of its change [s]; nan where not inside the response
    overshoot : of the aileron, as a part of its change
    """

    tab: FloatArray
    aileron: FloatArray
    total: FloatArray
    net: FloatArray
    settling_time: FloatArray
    overshoot: FloatArray


def step_of(loop: Loop, step: ReferenceStep, samples: int = 2) -> Response:
    """Response of stable loops to the step, delays included, in as many references as each loop has."""
    sizes = {"r_a": step.aileron, "r_t": step.tab}
    return delayed_step_response(loop, np.array([sizes[name] for name in loop.references]), step.duration, samples)


def power_figures(loop: Loop, step: ReferenceStep) -> PowerFigures:
    """Figures of a step at every point whose loop is stable, delays as in `design.delay.with_pade`.

    Parameters
    ----------
    loop : over any grid, with a reference for the aileron
    """
    stable = finite_points(loop)
    stable[stable] = decaying(poles(without_delay(loop.take(stable)).closed)).all(axis=-1)
    values = np.full((6, *stable.shape), np.nan)
    if stable.any():
        some = loop.take(stable)
        values[:, stable] = _figures(some, step_of(some, step))
    return PowerFigures(*values)


def _figures(loop: Loop, response: Response) -> FloatArray:
    """The six figures (6, N) of N points."""
    names = ("T_t", "T_a", "dt_rate", "da_rate", "da")
    at = [response.index(name) for name in names]
    T_t, T_a, dt_rate, da_rate, da = np.moveaxis(response.graded.signals(response.rows[..., at, :]), -3, 0)
    p_t, p_a = T_t * dt_rate, T_a * da_rate
    peaks = largest_magnitudes(np.stack([p_t, p_a, p_t + p_a, p_t - p_a]))
    trim, final = loop.offset[..., at[-1], None, None], response.final_outputs[..., at[-1], None, None]
    course = Course((da - trim) / (final - trim), response.graded.times)
    # The sum of two magnitudes is the larger one of those of sum and difference.
    total = np.maximum(peaks[2], peaks[3])
    overshoot = np.maximum(course.peak().value - 1.0, 0.0)
    return np.stack([peaks[0], peaks[1], total, peaks[2], course.settling_time(BAND), overshoot])
