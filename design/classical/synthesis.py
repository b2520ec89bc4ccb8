"""Tab-only classical controllers designed over the grid (seed chapter 4): the fastest gains that meet the specs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.design_margin import design_margin
from design.classical.found import Found
from design.classical.gain_search import fastest
from design.classical.infeasibility import why_infeasible
from design.classical.normal_form import NormalForm
from design.classical.open_gains import OpenGains
from design.classical.steering import StepReference, refuse_unsteerable
from design.classical.tab_drive import TabDrive, tab_drive
from design.gains import Gain
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from model.actuators import Actuator
from model.arrays import BoolArray, FloatArray, GridArrays, ObjectArray
from model.servo_tab import ServoTab


@dataclass(frozen=True, eq=False)
class ClassicalDesign(GridArrays):
    """Gains over the grid, and what became of each point.

    Attributes
    ----------
    gains : (*G,) each, in the order in which their loops are closed; nan where the outcome is not ok
    outcomes : (*G,) a point whose specs cannot be met together is ``infeasible``
    infeasibility : (*G,) `design.classical.infeasibility.Infeasibility` where that is so, None elsewhere
    """

    gains: tuple[Gain, ...]
    outcomes: Outcomes
    infeasibility: ObjectArray


@dataclass(frozen=True, eq=False)
class DesignMargins(GridArrays):
    """How much stricter all specs could be at every point.

    Attributes
    ----------
    margin : (*G,) the part of its limit by which each spec can be stricter, all of them together; negative where they
        must be relaxed to be met; `design.classical.design_margin.LARGEST` where it is that or more; nan where the
        outcome is not ok
    binding : (*G,) quantity of the spec that is in the way first; None where none is
    gains : (*G,) each, that reach it
    outcomes : (*G,) not ok where there is nothing to design
    """

    margin: FloatArray
    binding: ObjectArray
    gains: tuple[Gain, ...]
    outcomes: Outcomes


def design_classical(
    servo: ServoTab,
    actuator: Actuator,
    controller: ClassicalController,
    reference: StepReference,
    outcomes: Outcomes,
) -> ClassicalDesign:
    """Fastest gains that meet the specs at every point: the largest bandwidth of r_a -> da.

    Gains that are given stay as they are, the others are chosen. When all are given nothing is searched, and no spec
    is looked at.

    Parameters
    ----------
    servo : servo-tab model over the grid
    actuator : the tab's
    controller : structure, specs and given gains; limits and gains are numbers or (*G,)
    reference : the step that settling, overshoot and the tab's motion are judged on
    outcomes : points that are not ok are left alone

    Raises
    ------
    ValueError : a spec that cannot steer; a given gain that is unknown or out of range; a drive without dynamics, which
        leaves nothing that bounds the bandwidth
    """
    _refuse_gains(controller)
    refuse_unsteerable(controller.specs)
    shape, names = outcomes.ok.shape, tuple(controller.gain_units)
    outcomes = _without_authority(servo, outcomes)
    ok = outcomes.ok
    values = np.full((len(names), *shape), np.nan)
    why = np.full(shape, None, dtype=object)
    if controller.all_gains_given:
        for row, name in zip(values, names, strict=True):
            row[ok] = np.broadcast_to(np.asarray(controller.gains[name], dtype=float), shape)[ok]
        return ClassicalDesign(_named(controller, values), outcomes, why)
    drive = _drive(actuator, controller)
    if np.any(ok):
        family, at, specs = _family(servo, drive, controller, reference, ok)
        found = fastest(family, at, specs)
        values[:, ok] = family.form.gains(family.kappas(found.z)).T
        why[ok] = _reasons(family, at, specs, found)
        outcomes = outcomes.failing(np.asarray(why != None), Outcome.INFEASIBLE, lambda i: why[i].describe())  # noqa: E711
        values[:, ~outcomes.ok] = np.nan
    return ClassicalDesign(_named(controller, values), outcomes, why)


def design_margin_sweep(
    servo: ServoTab,
    actuator: Actuator,
    controller: ClassicalController,
    reference: StepReference,
    outcomes: Outcomes,
) -> DesignMargins:
    """By how much all specs could be stricter at every point, each by the same part of its limit, and still be met.

    Parameters and errors as of `design_classical`; a controller whose gains are all given has nothing to search.

    Raises
    ------
    ValueError : also when there are no specs, or all gains are given
    """
    _refuse_gains(controller)
    refuse_unsteerable(controller.specs)
    if not controller.specs or controller.all_gains_given:
        raise ValueError("a design margin needs specs, and gains that are not given")
    drive = _drive(actuator, controller)
    outcomes = _without_authority(servo, outcomes)
    ok, names = outcomes.ok, tuple(controller.gain_units)
    values = np.full((1 + len(names), *ok.shape), np.nan)
    binding = np.full(ok.shape, None, dtype=object)
    if np.any(ok):
        family, at, specs = _family(servo, drive, controller, reference, ok)
        found = design_margin(family, at, specs)
        values[0, ok] = found.margin
        values[1:, ok] = family.form.gains(family.kappas(found.z)).T
        binding[ok] = [None if k < 0 else specs[k].quantity for k in found.binding]
    return DesignMargins(values[0], binding, _named(controller, values[1:]), outcomes)


def _refuse_gains(controller: ClassicalController) -> None:
    """Raise ValueError for given gains that the controller does not have, or that are out of range."""
    for name, value in controller.gains.items():
        if name not in controller.gain_units:
            raise ValueError(f"{controller.name} has no gain {name}; it has {', '.join(controller.gain_units)}")
        if not np.all(np.asarray(value) >= 0.0):
            raise ValueError(f"{name} must be at least 0, the law has its sign")
        if name in ("K_i", "K_theta") and not controller.all_gains_given and not np.all(np.asarray(value) > 0.0):
            raise ValueError(f"{name} must be more than 0 where other gains are to be chosen")


def _drive(actuator: Actuator, controller: ClassicalController) -> TabDrive:
    """The tab's drive, with what a sampled controller lags behind added to its delay.

    Raises ValueError when it has no dynamics, since no gain is then too large for the largest bandwidth.
    """
    drive = tab_drive(actuator, controller.tab_command)
    if controller.sampling is not None:
        drive = replace(drive, delay=drive.delay + controller.sampling.mean_delay)
    if drive.bandwidth is None and drive.delay == 0.0:
        if drive.command == "deflection":
            raise ValueError(
                "with an ideal deflection servo there is no largest bandwidth: give the servo a bandwidth, the "
                "actuator a delay, or all gains"
            )
        if "K_theta" not in controller.gains:
            raise ValueError(
                "with an ideal rate loop there is no largest bandwidth: give the rate loop a bandwidth, the actuator "
                "a delay, or the gain K_theta"
            )
    return drive


def _family(
    servo: ServoTab, drive: TabDrive, controller: ClassicalController, reference: StepReference, ok: BoolArray
) -> tuple[OpenGains, StepReference, tuple[Spec, ...]]:
    """Loops, reference and specs at the points of a mask (*G,), in one row."""
    form = NormalForm.of(servo.take(ok), drive, controller)
    given = {
        name: np.broadcast_to(np.asarray(value, dtype=float), ok.shape)[ok] for name, value in controller.gains.items()
    }
    family = OpenGains.of(form, tuple(controller.gain_units), given)
    specs = tuple(
        replace(s, limit=np.broadcast_to(np.asarray(s.limit, dtype=float), ok.shape)[ok]) for s in controller.specs
    )
    trim = np.broadcast_to(np.asarray(reference.tab_trim, dtype=float), ok.shape)[ok]
    return family, StepReference(reference.size, reference.horizon, trim), specs


def _reasons(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], found: Found) -> ObjectArray:
    """Why the points (P,) have no gains; None where they have."""
    why = np.full(found.met.shape, None, dtype=object)
    lost = np.flatnonzero(~found.met)
    if lost.size:
        of = family.take(lost), reference.take(lost), tuple(spec.take(lost) for spec in specs)
        why[lost] = why_infeasible(*of, found.take(lost))
    return why


def _named(controller: ClassicalController, values: FloatArray) -> tuple[Gain, ...]:
    units = controller.gain_units
    return tuple(Gain(name, unit, row) for (name, unit), row in zip(units.items(), values, strict=True))


def _without_authority(servo: ServoTab, outcomes: Outcomes) -> Outcomes:
    """Points where no deflection of the tab moves the aileron to a steady angle."""
    stiffness, gain = servo.static_stiffness, servo.static_tab_effect
    with np.errstate(invalid="ignore"):
        bad = ~((stiffness > 0) & (gain != 0))

    def reason(index: tuple[int, ...]) -> str:
        return (
            f"the servo-tab model has stiffness {stiffness[index]:.4g} 1/s^2 and tab effect {gain[index]:.4g} 1/s^2; "
            "tab-only control needs a statically stable aileron that the tab can move"
        )

    return outcomes.failing(bad, Outcome.INFEASIBLE, reason)


def gain_values(gains: tuple[Gain, ...]) -> dict[str, FloatArray]:
    """Gain arrays by name."""
    return {gain.name: gain.values for gain in gains}
