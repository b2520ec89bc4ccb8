"""A design's figures at a point beside the same by python-control: gains, poles, margins and step."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

import design.python_control as control
from design.assess import Assessment
from design.classical.controller import ClassicalController
from design.control_figures import Code
from design.loop import Loop
from design.lqr.coded_loop import CodedLoop
from design.lqr.controller import LqrController
from design.lqr.cost import cost_of
from design.lqr.retuning import scaled_cost
from design.lqr.sampled_design import SampledLqrDesign
from design.lqr.sampled_problem import sampled_problem
from design.lqr.tracking import augment_with_integral
from model.arrays import ComplexArray
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.judging import horizon

#: Largest difference of figures that agree. Of gains and poles as a part of them, of the others in their own unit; of
#: times in samples of python-control's response.
TOLERANCES = {
    "gains": 1e-6,
    "poles": 1e-6,
    "gain_margin": 1e-3,
    "phase_margin": np.deg2rad(1e-3),
    "sensitivity_peak": 1e-4,
    "samples": 2.0,
    "overshoot": 1e-4,
    "steady_state_value": np.deg2rad(1e-6),
}
#: Poles of a loop with a delay are those of an approximant, and follow it through a few digits less.
DELAYED_POLES = 1e-4


@dataclass(frozen=True)
class Checked:
    """A figure, and the same by python-control.

    Attributes
    ----------
    name, unit : of the figure; the unit inside
    value, by_control : nan or inf where there is none
    difference : relative for gains and poles, else in `unit`; nan where only one of them is a number
    tolerance : of that difference
    """

    name: str
    unit: str
    value: float | complex
    by_control: float | complex
    difference: float
    tolerance: float

    @property
    def agrees(self) -> bool:
        """Whether the difference is within the tolerance; two figures that both do not exist agree."""
        return bool(self.difference <= self.tolerance)


@dataclass(frozen=True)
class LeftOut:
    """A figure that python-control was not asked for, or did not answer, and why."""

    figure: str
    reason: str


@dataclass
class CrossCheck:
    """All figures of a controller at one point; margins by the actuator input that the loop is cut at."""

    gains: tuple[Checked, ...] = ()
    poles: tuple[Checked, ...] = ()
    margins: dict[str, tuple[Checked, ...]] = field(default_factory=dict)
    step: tuple[Checked, ...] = ()
    left_out: list[LeftOut] = field(default_factory=list)

    def groups(self) -> dict[str, tuple[Checked, ...]]:
        """Figures by kind: gains, poles, margins, step."""
        margins = tuple(checked for cut in self.margins.values() for checked in cut)
        return {"gains": self.gains, "poles": self.poles, "margins": margins, "step": self.step}

    @property
    def agrees(self) -> bool:
        """Whether every figure that was compared agrees."""
        return all(checked.agrees for group in self.groups().values() for checked in group)


def cross_check(envelope: DesignedEnvelope, controller: DesignedController, index: tuple[int, ...]) -> CrossCheck:
    """Figures of the controller at a grid point with gains, each beside the same by python-control.

    What python-control has no counterpart of, or refuses, is left out with the reason.

    Raises
    ------
    ValueError : the controller has no gains there
    """
    if controller.assessment is None or not controller.outcomes.ok[index]:
        raise ValueError(f"controller {controller.request.name} has no gains at {index}")
    here, found = controller.assessment.take(index), CrossCheck()
    loop, code = _flown(envelope, controller, index)
    with _left_out(found, "gains"):
        found.gains = _gains(envelope, controller, index, found)
    with _left_out(found, "poles"):
        found.poles = _poles(here, loop, code, found)
    with _left_out(found, "margins"):
        found.margins = _margins(here, loop, code)
    with _left_out(found, "step"):
        found.step = _step(envelope, controller, here, index, found)
    return found


@contextmanager
def _left_out(found: CrossCheck, figure: str) -> Iterator[None]:
    """What python-control or the numbers under it refuse is left out."""
    try:
        yield
    except (ValueError, ArithmeticError, TypeError, IndexError, RuntimeError) as error:
        found.left_out.append(LeftOut(figure, f"python-control does not answer: {error}"))


def _flown(
    envelope: DesignedEnvelope, controller: DesignedController, index: tuple[int, ...]
) -> tuple[Loop, Code | None]:
    """The continuous parts of the loop at a point, and how the controller runs where it runs as code."""
    loop, request = controller.loop, controller.request
    if isinstance(loop, CodedLoop):
        coded = loop.take(index)
        n, waiting = len(coded.states), coded.waiting if coded.remembered else (0,) * len(coded.inputs)
        return coded.continuous, Code(coded.sampling, coded.K[:, n : n + sum(waiting)], waiting)
    flown = loop.take(index)
    if isinstance(request, ClassicalController) and request.sampling is not None:
        # Kept is the continuous loop that lags as much; what is sampled has the actuator's own delay.
        m = len(flown.inputs)
        plain = replace(flown, delay=(envelope.study.tab_actuator.delay,))
        return plain, Code(request.sampling, np.zeros((m, 0)), (0,) * m)
    return flown, None


def _gains(
    envelope: DesignedEnvelope, controller: DesignedController, index: tuple[int, ...], found: CrossCheck
) -> tuple[Checked, ...]:
    request, optimum = controller.request, controller.optimum
    if not isinstance(request, LqrController) or optimum is None:
        given = isinstance(request, ClassicalController) and request.all_gains_given
        reason = "they are given" if given else "they are found by a search, of which python-control has no counterpart"
        found.left_out.append(LeftOut("gains", reason))
        return ()
    here = optimum.take(index)
    plant = augment_with_integral(envelope.plant.model.take(index), here.structure)
    cost = cost_of(request.weights, plant)
    if here.retuning is not None:
        factors = np.stack([here.retuning.tab, here.retuning.aileron, here.retuning.integrals], axis=-1)
        cost = scaled_cost(cost, plant, factors)
    found.left_out += _other_gains(controller)
    n, m = plant.B.shape
    if isinstance(here, SampledLqrDesign):
        sampled = sampled_problem(plant, cost, here.sampling)
        A, B, Q, R, N = sampled.A, sampled.B, sampled.Q, sampled.R, sampled.N
    else:
        A, B, Q, R, N = plant.A, plant.B, cost.Q, cost.R, np.zeros((n, m)) if cost.N is None else cost.N
    by_control = control.optimal_gain(A, B, Q, R, N, discrete=isinstance(here, SampledLqrDesign))
    named = [gain for gain in controller.gains if gain.name.startswith("K_")]
    return tuple(
        _relative(gain.name, gain.unit, float(gain.values[index]), float(other), TOLERANCES["gains"])
        for gain, other in zip(named, by_control.ravel(), strict=True)
    )


def _other_gains(controller: DesignedController) -> Iterator[LeftOut]:
    """Gains that are not those of the regulator."""
    names = [gain.name for gain in controller.gains if not gain.name.startswith("K_")]
    forward = [name for name in names if name.startswith("N_")]
    if forward:
        reason = "feed-forward to a rest that the tab is allocated by, of which python-control has no counterpart"
        yield LeftOut(" ".join(forward), reason)
    if controller.observer is not None:
        yield LeftOut("gains of the Kalman filter", "they are in the loop whose poles, margins and step are compared")


def _poles(here: Assessment, loop: Loop, code: Code | None, found: CrossCheck) -> tuple[Checked, ...]:
    """Each pole beside the one of python-control that is its own; those at z = 0 of a sampled loop have none."""
    ours = here.poles[np.isfinite(here.poles)]
    late = max(loop.delay) if code is None else 0.0
    if late > 0.0:
        known = np.abs(ours) * late <= control.KNOWN_TURN
        if not known.all():
            reason = f"{np.sum(~known)} poles turn too far within the delay for an approximant, which stands for it"
            found.left_out.append(LeftOut("poles", reason))
        ours = ours[known]
    others = control.control_poles(loop, code)
    if not ours.size or ours.size > others.size:
        found.left_out.append(LeftOut("poles", f"{ours.size} poles beside {others.size} by python-control"))
        return ()
    row, column = linear_sum_assignment(_apart(ours[:, None], others[None, :]))
    tolerance = DELAYED_POLES if late > 0.0 else TOLERANCES["poles"]
    return tuple(
        _relative(f"pole_{i + 1}", "rad/s", complex(ours[i]), complex(others[j]), tolerance)
        for i, j in zip(row, column, strict=True)
    )


def _apart(one: ComplexArray, other: ComplexArray) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.asarray(np.abs(one - other) / np.maximum(np.maximum(np.abs(one), np.abs(other)), np.finfo(float).tiny))


def _margins(here: Assessment, loop: Loop, code: Code | None) -> dict[str, tuple[Checked, ...]]:
    found = {}
    for name, ours, other in zip(here.actuators, here.margins, control.control_margins(loop, code), strict=True):
        wanted = (
            ("gain_margin_up", "dB", ours.gain_margin_up_db, other.gain_margin_up_db, "gain_margin"),
            ("gain_margin_down", "dB", ours.gain_margin_down_db, other.gain_margin_down_db, "gain_margin"),
            ("phase_margin", "rad", ours.phase_margin, other.phase_margin, "phase_margin"),
            ("sensitivity_peak", "1", ours.sensitivity_peak, other.sensitivity_peak, "sensitivity_peak"),
        )
        found[name] = tuple(_absolute(n, unit, float(a), b, TOLERANCES[key]) for n, unit, a, b, key in wanted)
    return found


def _step(
    envelope: DesignedEnvelope,
    controller: DesignedController,
    here: Assessment,
    index: tuple[int, ...],
    found: CrossCheck,
) -> tuple[Checked, ...]:
    if isinstance(controller.loop, CodedLoop):
        reason = "python-control has no response between the samples of a loop that is partly code"
        found.left_out.append(LeftOut("step", reason))
        return ()
    loop, study = controller.loop.take(index), envelope.study
    if not loop.references:
        found.left_out.append(LeftOut("step", "a regulator follows no reference"))
        return ()
    other = control.control_step(loop, study.reference.sizes(loop.references), horizon(study, controller.request))
    times = TOLERANCES["samples"] * other.resolution
    return (
        _absolute("rise_time", "s", float(here.step.rise_time), other.rise_time, times),
        _absolute("settling_time", "s", float(here.step.settling_time), other.settling_time, times),
        _absolute("overshoot", "1", float(here.step.overshoot), other.overshoot, TOLERANCES["overshoot"]),
        _absolute("undershoot", "1", float(here.step.undershoot), other.undershoot, TOLERANCES["overshoot"]),
        _absolute(
            "steady_state_value", "rad", float(here.step.steady_state_value), other.steady_state_value,
            TOLERANCES["steady_state_value"],
        ),
    )  # fmt: skip


def _relative(name: str, unit: str, value: float | complex, by_control: float | complex, tolerance: float) -> Checked:
    size = max(abs(value), abs(by_control))
    difference = abs(value - by_control) / size if size > 0.0 else 0.0
    return Checked(name, unit, value, by_control, difference, tolerance)


def _absolute(name: str, unit: str, value: float, by_control: float, tolerance: float) -> Checked:
    alike = value == by_control or (np.isnan(value) and np.isnan(by_control))
    both = np.isfinite(value) and np.isfinite(by_control)
    difference = 0.0 if alike else abs(value - by_control) if both else np.nan
    return Checked(name, unit, value, by_control, difference, tolerance)
