"""What a controller asks of both actuators, for a comparison: the reference step, and the same step at limited rates.

The torque that the tab takes off the aileron (`design.actuator_sizing.tab_held`) is set against what the tab's actuator
does for it, and against the time that is lost where the reference is slowed down (seed 5.7, Fig 5.20).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields

import numpy as np

from design.actuator_sizing.tab_held import TAB_HELD, with_tab_held
from design.delay.with_pade import without_delay
from design.frequency.poles import poles
from design.loop import Loop
from design.manoeuvre import Manoeuvre, rate_limited_step, step
from design.response.course import Course
from design.response.demand import ActuatorDemand
from design.response.manoeuvre_demand import manoeuvre_demands
from design.response.manoeuvre_response import ManoeuvreResponse, manoeuvre_response
from design.response.step_metrics import BAND
from design.response.stretches import Stretches
from model.actuators import ActuatorLimits
from model.arrays import FloatArray, GridArrays
from model.linear_model import LinearModel
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.study import Reference
from schedules.tab_saving import TabSaving

#: Points that are flown at once, so that memory stays bounded.
AT_ONCE = 256
#: Unless they are asked for, rates at which the step takes these parts of the time that it is followed.
PARTS = (0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625)


@dataclass(frozen=True, eq=False)
class Actuation(GridArrays):
    """Figures of a manoeuvre, trim included: each (*G,), or (*G, R) over R rates; nan where there is no design.

    Attributes
    ----------
    aileron_peak_torque : what the aileron's actuator gives; of a tab-only controller what the trim leaves [N m]
    tab_held_peak_torque : what it would have to give for the same motion, the tab held at its trim angle [N m]
    tab_peak_torque : [N m]; inf where it is not finite
    tab_peak_rate : [rad/s]; inf where the tab jumps
    tab_peak_deflection : of the total deflection [rad]
    settling_time : from the beginning, after it the aileron stays within 2 % of its change [s]; nan where it does not
    overshoot : largest excess over the final value, as a part of the change, at least 0 [-]
    """

    aileron_peak_torque: FloatArray
    tab_held_peak_torque: FloatArray
    tab_peak_torque: FloatArray
    tab_peak_rate: FloatArray
    tab_peak_deflection: FloatArray
    settling_time: FloatArray
    overshoot: FloatArray

    @property
    def saving(self) -> TabSaving:
        """How much of the aileron's torque the tab saves."""
        return TabSaving(self.aileron_peak_torque, self.tab_held_peak_torque)


def why_not_compared(designed: DesignedController) -> str | None:
    """Why a controller has no place in the comparison; None where it has one."""
    if not isinstance(designed.loop, Loop):
        return "it is a sampled state feedback, which runs as code: torques with the tab held are not known of it"
    if "r_a" not in designed.loop.references:
        return "it follows no reference: there is no step to compare"
    if not np.any(designed.outcomes.ok):
        return "no point carries a design"
    return None


def step_actuation(plant: PlantEnvelope, designed: DesignedController, reference: Reference) -> Actuation:
    """Figures (*G,) of the reference step: those of the assessment, and the torque with the tab held.

    Raises
    ------
    ValueError : the controller is one that `why_not_compared` has a reason for
    """
    loop, model = _flown(plant, designed)
    assessment = designed.assessment
    if assessment is None:
        raise ValueError(f"controller {designed.request.name} has not been assessed")
    manoeuvre, ok = reference.manoeuvre(loop.references), designed.outcomes.ok
    held = []
    for part in _parts(len(loop.A)):
        response = manoeuvre_response(
            with_tab_held(loop.take(part), model.take(part)), manoeuvre, reference.duration, 2
        )
        held.append(response.peaks[:, response.index(TAB_HELD)])
    judged = assessment.take(ok)
    figures = _figures(
        dict(zip(judged.actuators, judged.demand, strict=True)), model, np.concatenate(held),
        judged.step.settling_time, judged.step.overshoot,
    )  # fmt: skip
    return figures.spread(ok)


def rate_limited_actuation(
    plant: PlantEnvelope, designed: DesignedController, reference: Reference, rates: FloatArray
) -> Actuation:
    """Figures (*G, R) of the reference step where its references move at limited rates (R,) [rad/s].

    Each is followed until the reference has arrived, and from then on for as long as the step is. Delays are chains of
    states (`design.response.manoeuvre_response`). Points share meshes, so that a figure is the same among others as
    alone to 1e-7 of its value.

    Raises
    ------
    ValueError : the controller is one that `why_not_compared` has a reason for, or a rate is not positive and finite
    """
    loop, model = _flown(plant, designed)
    size, names = reference.sizes(loop.references), [each.name for each in fields(Actuation)]
    found = np.empty((len(names), len(loop.A), len(rates)))
    for column, rate in enumerate(rates.tolist()):
        manoeuvre = rate_limited_step(size, rate)
        duration = float(manoeuvre.times[-1]) + reference.duration
        for part in _parts(len(loop.A)):
            measured = _measured(loop.take(part), model.take(part), manoeuvre, duration)
            found[:, part, column] = [getattr(measured, name) for name in names]
    return Actuation(*found).spread(designed.outcomes.ok)


def samples_needed(designed: DesignedController, reference: Reference, rates: FloatArray) -> int:
    """Samples at which the step and its rate-limited forms (R,) are looked at, all points together: what they cost.

    Some 0.2 to 0.9 microseconds each. None of a controller that `why_not_compared` has a reason for.
    """
    if not isinstance(designed.loop, Loop) or why_not_compared(designed) is not None:
        return 0
    loop = designed.loop.take(designed.outcomes.ok)
    size, count = reference.sizes(loop.references), 0
    manoeuvres = [step(size), *(rate_limited_step(size, rate) for rate in rates.tolist())]
    for part in _parts(len(loop.A)):
        flown = without_delay(loop.take(part))
        found = poles(flown.closed)
        for manoeuvre in manoeuvres:
            duration = float(manoeuvre.times[-1]) + reference.duration
            groups = Stretches.between(manoeuvre.times, duration, found).groups(found, duration)
            count += len(flown.A) * sum((group.last - group.first) * group.mesh.points for group in groups)
    return count


def usual_rates(reference: Reference) -> FloatArray:
    """Rates (R,) at which the aileron's reference takes `PARTS` of the time that it is followed [rad/s], rising."""
    return abs(reference.aileron) / (np.array(PARTS) * reference.duration)


def _flown(plant: PlantEnvelope, designed: DesignedController) -> tuple[Loop, LinearModel]:
    """Loops (N,) of the points that carry a design, and their models."""
    reason = why_not_compared(designed)
    if reason is not None or not isinstance(designed.loop, Loop):
        raise ValueError(f"controller {designed.request.name} is not compared: {reason}")
    ok = designed.outcomes.ok
    return designed.loop.take(ok), plant.model.take(ok)


def _parts(count: int) -> Iterator[slice]:
    for first in range(0, count, AT_ONCE):
        yield slice(first, first + AT_ONCE)


def _measured(loop: Loop, model: LinearModel, manoeuvre: Manoeuvre, duration: float) -> Actuation:
    """Figures (N,) of loops (N,)."""
    seen = with_tab_held(loop, model)
    response = manoeuvre_response(seen, manoeuvre, duration, 2)
    limits = (ActuatorLimits(),) * len(loop.inputs)
    demands = dict(zip(loop.inputs, manoeuvre_demands(seen, response, loop.inputs, limits), strict=True))
    held = response.peaks[:, response.index(TAB_HELD)]
    return _figures(demands, model, held, *_settled(response, loop.offset[:, loop.outputs.index("da")]))


def _figures(
    demands: Mapping[str, ActuatorDemand],
    model: LinearModel,
    held: FloatArray,
    settling_time: FloatArray,
    overshoot: FloatArray,
) -> Actuation:
    tab, aileron = demands["tab"], demands.get("aileron")
    return Actuation(
        aileron_peak_torque=np.abs(model.input_offset[:, 1]) if aileron is None else aileron.peak_torque,
        tab_held_peak_torque=held,
        tab_peak_torque=tab.peak_torque,
        tab_peak_rate=tab.peak_rate,
        tab_peak_deflection=tab.peak_deflection,
        settling_time=settling_time,
        overshoot=overshoot,
    )


def _settled(response: ManoeuvreResponse, trim: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Settling time [s] and overshoot [-] (N,) of the aileron over all stretches; nan where it has none."""
    o = response.index("da")
    change = response.final_outputs[:, o] - trim
    with np.errstate(invalid="ignore"):
        exists = np.isfinite(change) & (np.abs(change) > 1e-12 * response.peaks[:, o])
    settling, overshoot = np.full((2, len(change)), np.nan)
    if not np.any(exists):
        return settling, overshoot
    last, most = np.zeros(int(exists.sum())), np.zeros(int(exists.sum()))
    for part in response.driven.signals(response.rows[:, o : o + 1]):
        samples = part.values.shape[-1]
        moved = part.values[exists].reshape(len(last), -1, samples) - trim[exists, None, None]
        times = part.starts.reshape(-1, 1) + part.steps.reshape(-1, 1) * np.arange(samples)
        course = Course(moved / change[exists, None, None], times)
        here = course.settling_time(BAND)
        # 0 where it never leaves the band: then it has settled before, or just as this part begins.
        before = np.where(np.isnan(last), times[0, 0], last)
        last = np.where(here == 0.0, before, here)
        most = np.maximum(most, course.peak().value - 1.0)
    settling[exists], overshoot[exists] = last, most
    return settling, overshoot
