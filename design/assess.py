"""Everything that is said of a closed loop, from the one loop that is flown; and the verdicts on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.delay.damping import least_damping_ratio_delayed
from design.delay.delayed_poles import delayed_poles
from design.delay.step_response import delayed_step_response
from design.delay.with_pade import without_delay
from design.disturbance.noise_gain import noise_gain
from design.estimation.cut_margins import margins_of_cuts
from design.frequency.margins import Margins
from design.frequency.poles import largest_real_part, least_damping_ratio, poles
from design.frequency.sampled import sampled_margins, sampled_poles
from design.frequency.sampled_loop import SampledLoop
from design.loop import Loop
from design.response.demand import ActuatorDemand, actuator_demands
from design.response.step_metrics import StepMetrics, step_metrics
from design.sampling import Sampling, as_if_continuous, digital_loop
from design.specs import Spec, Verdict
from model.actuators import Actuator
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class Assessment(GridArrays):
    """Figures of a loop over the grid.

    Of a digital controller poles and margins are those of the loop from sample to sample, exact; step and demand are
    those of the continuous loop that lags as much (`design.sampling.as_if_continuous`). A sampled state feedback is
    followed between its samples too (`design.lqr.sampled_assessment`).

    Attributes
    ----------
    poles : (*G, n) closed-loop poles [rad/s]; with a delay the rightmost ones, nan padded; sampled ``ln z / T``
    damping_ratio : (*G,) smallest of their damping ratios; with a delay as `design.delay.damping` has it
    largest_real_part : (*G,) of all closed-loop poles [1/s]; nan where a delay leaves it unproved
    margins : one for each actuator input at which the loop is cut, the other inputs closed
    step : the aileron's response to the reference step
    demand : one for each actuator of the loop
    actuators : names of cuts and actuators, in that order
    loop : what was judged; of a sampled state feedback the continuous loop that is run as code, without the gains on
        commands under way
    """

    poles: ComplexArray
    damping_ratio: FloatArray
    largest_real_part: FloatArray
    margins: tuple[Margins, ...]
    step: StepMetrics
    demand: tuple[ActuatorDemand, ...]
    actuators: tuple[str, ...]
    loop: Loop

    @property
    def stable(self) -> BoolArray:
        """(*G,) all closed-loop poles are stable; with a delay, proved to be."""
        return np.asarray(self.largest_real_part < 0.0)

    @property
    def return_difference(self) -> FloatArray:
        """(*G, m) smallest ``|1 + L|`` at each cut, at most 1."""
        return np.asarray(1.0 / np.stack([each.sensitivity_peak for each in self.margins], axis=-1))

    @cached_property
    def noise_gain(self) -> FloatArray | None:
        """Largest gain from noise on the aileron's angle to the commanded tab deflection (`design.disturbance`)."""
        return noise_gain(self.loop)


def assess(
    loop: Loop, reference: FloatArray, duration: float, samples: int = 501, sampling: Sampling | None = None
) -> Assessment:
    """Judge a loop whose matrices are finite at every point.

    Parameters
    ----------
    loop : over any grid (`Loop.take` the points that carry gains)
    reference : (p,) sizes of the step in each reference [rad]
    duration : how long the step is followed [s], longer than any delay
    samples : samples of the step; peaks and times are refined between them
    sampling : how its controller runs on a computer; None is a continuous one
    """
    flown = as_if_continuous(loop, sampling)
    response, chained = delayed_step_response(flown, reference, duration, samples), without_delay(flown)
    digital = None if sampling is None else digital_loop(loop, sampling)
    found, damping, growth = _poles(loop) if digital is None else _sampled_poles(digital, _waiting(loop, sampling))
    return Assessment(
        poles=found,
        damping_ratio=damping,
        largest_real_part=growth,
        margins=margins_of_cuts(loop) if digital is None else _margins_of_sampled_cuts(digital),
        step=step_metrics(chained, response, "da", reference),
        demand=actuator_demands(chained, response, loop.inputs),
        actuators=loop.inputs,
        loop=flown,
    )


def _poles(loop: Loop) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Poles, least damping ratio and largest real part."""
    if not any(loop.delay):
        found = poles(loop.closed)
        return found, least_damping_ratio(found), largest_real_part(found)
    delayed = delayed_poles(loop)
    growth = np.max(np.where(np.isnan(delayed.poles), -np.inf, delayed.poles.real), axis=-1)
    growth = np.where(delayed.complete_beyond < 0.0, growth, np.nan)
    return delayed.poles, least_damping_ratio_delayed(loop), growth


def _waiting(loop: Loop, sampling: Sampling | None) -> int:
    """Samples from a measurement to the arrival of the last of its commands."""
    return 0 if sampling is None else int(np.ceil((max(loop.delay, default=0.0) + sampling.delay) / sampling.time))


def _sampled_poles(loop: SampledLoop, waiting: int) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Poles, least damping ratio and largest real part; of modes that are over after some samples, none."""
    found = sampled_poles(loop.closed, loop.sample_time, waiting)
    lasting = np.where(np.isfinite(found.equivalent), found.equivalent, complex(np.nan, np.nan))
    return lasting, np.min(found.damping_ratio, axis=-1), np.max(found.equivalent.real, axis=-1)


def _margins_of_sampled_cuts(loop: SampledLoop) -> tuple[Margins, ...]:
    stacked = sampled_margins(loop.cuts())
    return tuple(stacked.take(i) for i in range(len(loop.inputs)))


def achieved(assessment: Assessment, quantity: str) -> FloatArray | None:
    """(*G,) value of a quantity of `design.specs.QUANTITIES`; None when this loop does not have it.

    Of several cuts the worst one counts.
    """
    cuts = assessment.margins
    worst: dict[str, Callable[[], FloatArray]] = {
        "gain_margin": lambda: np.min([np.minimum(m.gain_margin_up_db, -m.gain_margin_down_db) for m in cuts], axis=0),
        "phase_margin": lambda: np.min([m.phase_margin for m in cuts], axis=0),
        "disk_margin": lambda: np.min([m.disk_margin for m in cuts], axis=0),
        "sensitivity_peak": lambda: np.max([m.sensitivity_peak for m in cuts], axis=0),
        "delay_margin": lambda: np.min([m.delay_margin for m in cuts], axis=0),
        "bandwidth": lambda: assessment.step.bandwidth,
        "damping_ratio": lambda: assessment.damping_ratio,
        "settling_time": lambda: assessment.step.settling_time,
        "overshoot": lambda: assessment.step.overshoot,
    }
    if quantity in worst:
        return np.asarray(worst[quantity]())
    if quantity == "noise_gain":
        return assessment.noise_gain
    actuator, what = quantity.split("_", 1)
    if actuator not in assessment.actuators:
        return None
    return np.asarray(getattr(assessment.demand[assessment.actuators.index(actuator)], f"peak_{what}"))


def limit_specs(actuators: dict[str, Actuator]) -> tuple[Spec, ...]:
    """The actuators' limits as specs; a limit that is absent is no spec."""
    specs = []
    for name, actuator in actuators.items():
        limits = actuator.limits
        for what in ("deflection", "rate", "torque", "power"):
            limit = getattr(limits, what)
            if limit is not None:
                specs.append(Spec(f"{name}_{what}", "max", limit, "limits"))
    return tuple(specs)


def verdicts(
    assessment: Assessment,
    judged: BoolArray,
    asked: tuple[Spec, ...],
    pack: tuple[Spec, ...],
    actuators: dict[str, Actuator],
) -> tuple[Verdict, ...]:
    """Verdict on each spec asked for, of the pack and of the actuators' limits, over the grid.

    Parameters
    ----------
    assessment : over the whole grid, nan where a point carries no design
    judged : (*G,) mask of the points that carry one
    asked, pack : specs of the request and of the pack
    actuators : by name; their limits are specs too
    """
    found = []
    for spec in (*asked, *pack, *limit_specs(actuators)):
        values = achieved(assessment, spec.quantity)
        if values is not None:
            found.append(Verdict(spec, np.where(judged, values, np.nan), judged, judged & spec.met(values)))
    return tuple(found)
