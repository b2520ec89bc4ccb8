"""From a study to a designed envelope: the one function that notebooks and the service both call."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.assess import Assessment, achieved, assess, verdicts
from design.classical.synthesis import ClassicalController, design_classical, gain_values
from design.classical.tab_loop import tab_loop
from design.frequency.fastest_mode import fastest_surface_mode
from design.frequency.poles import largest_real_part
from design.gains import Gain
from design.loop import Loop
from design.lqr.synthesis import LqrController, LqrDesign, design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.weights import WeightsRefused
from design.outcome import Outcome, Outcomes
from design.specs import Spec, Verdict
from model.arrays import BoolArray, ComplexArray, FloatArray
from model.reduced_frequency import QUASI_STEADY_LIMIT, reduced_frequency
from schedules.analysis import EnvelopeWarning, PlantEnvelope, analyse
from schedules.study import Controller, Study


@dataclass(frozen=True, eq=False)
class DesignedController:
    """One controller over the grid: gains with their outcomes, the loop that is flown, and what is said of it.

    Attributes
    ----------
    request : what was asked for
    outcomes : (*G,)
    gains : each (*G,), nan where the outcome is not ok
    loop : over the whole grid, nan where the outcome is not ok
    assessment : over the whole grid, nan where the outcome is not ok; None when no point is
    fastest_mode : (*G,) fastest closed-loop mode of the surfaces that the air moves (`design.frequency.fastest_mode`)
        [rad/s]: both of them with state feedback, the aileron where the tab's position is imposed; nan where the
        outcome is not ok
    reduced_frequency : (*G,) k of that mode [-]
    verdicts : one per spec
    riccati : solution and certificate of the LQR; None for classical controllers
    """

    request: Controller
    outcomes: Outcomes
    gains: tuple[Gain, ...]
    loop: Loop
    assessment: Assessment | None
    fastest_mode: ComplexArray
    reduced_frequency: FloatArray
    verdicts: tuple[Verdict, ...]
    riccati: LqrDesign | None


@dataclass(frozen=True, eq=False)
class DesignedEnvelope:
    """A study, its plant and its controllers, over the grid."""

    study: Study
    plant: PlantEnvelope
    controllers: tuple[DesignedController, ...]
    warnings: tuple[EnvelopeWarning, ...]

    def controller(self, name: str) -> DesignedController:
        """The controller of this name; KeyError when there is none."""
        for controller in self.controllers:
            if controller.request.name == name:
                return controller
        raise KeyError(name)


class ControllerRefused(ValueError):
    """A controller that cannot work at any point of the grid.

    Attributes
    ----------
    controller : its name
    refused : what its weights lack
    """

    def __init__(self, controller: str, refused: WeightsRefused) -> None:
        super().__init__(f"controller {controller}: {refused}")
        self.controller = controller
        self.refused = refused


def run(study: Study) -> DesignedEnvelope:
    """Design and judge every controller of a study over its grid.

    Raises
    ------
    ValueError : the grid cannot be built
    ControllerRefused : weights that cannot work at any point
    """
    plant = analyse(study)
    controllers = tuple(_design(study, plant, request) for request in study.controllers)
    warnings = plant.warnings + _trim_warnings(study, plant) + _frequency_warnings(study, controllers)
    return DesignedEnvelope(study, plant, controllers, warnings)


def horizon(study: Study, request: Controller) -> float:
    """How long a controller's step is followed [s]: the reference's duration, or longer where a spec needs it."""
    limits = [spec.limit for spec in _asked(request) if spec.quantity == "settling_time"]
    return max([study.reference.duration, *(1.25 * limit for limit in limits)])


def _asked(request: Controller) -> tuple[Spec, ...]:
    return request.specs if isinstance(request, ClassicalController) else ()


def _design(study: Study, plant: PlantEnvelope, request: Controller) -> DesignedController:
    if isinstance(request, ClassicalController):
        return _classical(study, plant, request)
    return _lqr(study, plant, request)


def _classical(study: Study, plant: PlantEnvelope, request: ClassicalController) -> DesignedController:
    gains, outcomes = design_classical(
        plant.servo_tab, study.tab_actuator, request, horizon(study, request), plant.outcomes
    )
    loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, gain_values(gains))
    return _judged(study, plant, request, outcomes, gains, loop, None)


def _lqr(study: Study, plant: PlantEnvelope, request: LqrController) -> DesignedController:
    try:
        design = design_lqr(plant.model, request, plant.outcomes)
    except WeightsRefused as refused:
        raise ControllerRefused(request.name, refused) from refused
    loop = lqr_loop(plant.model, design)
    return _judged(study, plant, request, design.outcomes, _matrix_gains(loop, plant.model.inputs), loop, design)


def _judged(
    study: Study,
    plant: PlantEnvelope,
    request: Controller,
    outcomes: Outcomes,
    gains: tuple[Gain, ...],
    loop: Loop,
    riccati: LqrDesign | None,
) -> DesignedController:
    """Judge the loop as it is flown, and withdraw every gain that this second look does not bear out."""
    ok = outcomes.ok
    if not np.any(ok):
        none = np.full(ok.shape, np.nan)
        return DesignedController(request, outcomes, gains, loop, None, none.astype(complex), none, (), riccati)
    step, duration = np.array([study.reference.aileron]), horizon(study, request)
    try:
        found = assess(loop.take(ok), step, duration).spread(ok)
        fastest = _fastest_mode(request, loop, ok)
        checked = _certify(outcomes, found, _asked(request))
    except np.linalg.LinAlgError as error:
        checked = _without_unjudgeable(outcomes, request, loop, step, duration, str(error))
    if not np.array_equal(checked.ok, ok):
        kept = loop.take(checked.ok).spread(checked.ok)
        return _judged(study, plant, request, checked, _kept(gains, checked), kept, riccati)
    frequency = reduced_frequency(fastest[..., None], plant.grid.condition, study.geometry.chord)[..., 0]
    actuators = {"tab": study.tab_actuator, "aileron": study.aileron_actuator}
    said = verdicts(found, ok, _asked(request), study.spec_pack, actuators)
    return DesignedController(request, outcomes, gains, loop, found, fastest, frequency, said, riccati)


def _fastest_mode(request: Controller, loop: Loop, ok: BoolArray) -> ComplexArray:
    """Fastest closed-loop mode of the surfaces that the air moves (*G,) [rad/s], nan where there is no design."""
    fastest = np.full(ok.shape, complex(np.nan, np.nan))
    surfaces = ("da",) if isinstance(request, ClassicalController) else ("dt", "da")
    fastest[ok] = fastest_surface_mode(loop.closed[ok], loop.states, surfaces)
    return fastest


def _without_unjudgeable(
    outcomes: Outcomes, request: Controller, loop: Loop, step: FloatArray, duration: float, together: str
) -> Outcomes:
    """One point whose numbers LAPACK gives up on must not lose the others: find such points one by one.

    Where each can be judged alone and only all of them `together` cannot, none is known to be right: all are withdrawn.
    """
    reasons = np.full(outcomes.ok.shape, None, dtype=object)
    for index in map(tuple, np.argwhere(outcomes.ok)):
        try:
            assess(loop.take(index), step, duration)
            _fastest_mode(request, loop.take(index), np.array(True))
        except np.linalg.LinAlgError as error:
            reasons[index] = str(error)
    failed = np.asarray(reasons != None)  # noqa: E711, elementwise
    if not np.any(failed):
        failed, reasons = outcomes.ok, np.full(outcomes.ok.shape, together, dtype=object)
    return outcomes.failing(failed, Outcome.NOT_CERTIFIED, lambda index: f"the loop cannot be judged: {reasons[index]}")


def _certify(outcomes: Outcomes, found: Assessment, asked: tuple[Spec, ...]) -> Outcomes:
    """Eigenvalues of the loop in state space must be stable, and the specs that chose the gains must be met."""
    ok = outcomes.ok
    growth = np.full(ok.shape, np.nan)
    growth[ok] = largest_real_part(found.poles[ok])
    outcomes = outcomes.failing(
        ok & ~(growth < 0),
        Outcome.NOT_CERTIFIED,
        lambda index: f"the closed loop has an eigenvalue with real part {growth[index]:.4g} 1/s",
    )
    for spec in asked:
        values = achieved(found, spec.quantity)
        if values is None:
            continue
        outcomes = outcomes.failing(
            ok & ~spec.met(values),
            Outcome.NOT_CERTIFIED,
            lambda index, spec=spec, values=values: (  # type: ignore[misc]
                f"judged on the loop that is flown, {spec.quantity} is {values[index]:.6g} "
                f"against {spec.limit:.6g} asked"
            ),
        )
    return outcomes


def _kept(gains: tuple[Gain, ...], outcomes: Outcomes) -> tuple[Gain, ...]:
    return tuple(Gain(g.name, g.unit, np.where(outcomes.ok, g.values, np.nan)) for g in gains)


#: Unit of a torque gain on each state.
_TORQUE_GAIN_UNITS = {
    "dt": "N m/rad",
    "da": "N m/rad",
    "dt_rate": "N m s/rad",
    "da_rate": "N m s/rad",
    "int_a": "N m/(rad s)",
    "lag_1": "N m/rad",
    "lag_2": "N m/rad",
}


def _matrix_gains(loop: Loop, inputs: tuple[str, ...]) -> tuple[Gain, ...]:
    """``K_<input>_<state>`` and ``N_<input>_<reference>`` of a state-feedback loop."""
    feedback = [
        Gain(f"K_{u}_{x}", _TORQUE_GAIN_UNITS[x], loop.K[..., i, j])
        for i, u in enumerate(inputs)
        for j, x in enumerate(loop.states)
    ]
    forward = [
        Gain(f"N_{u}_{r}", "N m/rad", loop.N[..., i, j])
        for i, u in enumerate(inputs)
        for j, r in enumerate(loop.references)
    ]
    return (*feedback, *forward)


def _trim_warnings(study: Study, plant: PlantEnvelope) -> tuple[EnvelopeWarning, ...]:
    """Tab-only controllers have no actuator for the torque that holds the aileron at its trim."""
    names = [c.name for c in study.controllers if isinstance(c, ClassicalController)]
    torque = np.abs(plant.trim.torque[..., 1])
    held = plant.outcomes.ok & (torque > 1e-9)
    if not names or not np.any(held):
        return ()
    detail = (
        f"the trim needs an aileron torque of up to {np.max(torque[held]):.4g} N m, which the tab-only controllers "
        f"({', '.join(names)}) have no actuator for; trim the tab with 'zero_aileron_torque' for a floating aileron"
    )
    return (EnvelopeWarning("aileron_torque_at_trim", detail, tuple(int(i) for i in np.flatnonzero(held))),)


def _frequency_warnings(study: Study, controllers: tuple[DesignedController, ...]) -> tuple[EnvelopeWarning, ...]:
    """Points at which a closed loop is too fast for a circulation that is taken as settled."""
    damping = study.aerodynamics.damping
    if damping == "unsteady" or not controllers:
        return ()
    largest = np.max(np.stack([np.nan_to_num(c.reduced_frequency, nan=0.0) for c in controllers]), axis=(1, 2))
    fast = np.any([c.reduced_frequency > QUASI_STEADY_LIMIT for c in controllers], axis=0)
    if not np.any(fast):
        return ()
    each = ", ".join(f"{c.request.name} {k:.3g}" for c, k in zip(controllers, largest, strict=True))
    detail = (
        f"reduced frequency k of the fastest closed-loop mode of the surfaces up to: {each}; damping '{damping}' takes "
        f"the circulation as settled, which holds below k = {QUASI_STEADY_LIMIT}; damping 'unsteady' has its lag"
    )
    return (EnvelopeWarning("reduced_frequency", detail, tuple(int(i) for i in np.flatnonzero(fast))),)
