"""The second look: every loop is judged as it is flown, and gains that this does not bear out are withdrawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.assess import Assessment, achieved, assess, verdicts
from design.classical.controller import ClassicalController
from design.delay.with_pade import without_delay
from design.frequency.fastest_mode import fastest_surface_mode
from design.gains import Gain
from design.loop import Loop
from design.lqr.coded_loop import CodedLoop
from design.lqr.sampled_assessment import assess_sampled
from design.outcome import Outcome, Outcomes
from design.response.manoeuvre_demand import manoeuvre_demands
from design.response.manoeuvre_response import manoeuvre_response
from design.sampling import Sampling, as_if_continuous
from design.specs import Spec
from model.actuators import ActuatorLimits
from model.arrays import BoolArray, ComplexArray, FloatArray
from model.reduced_frequency import reduced_frequency
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.study import Controller, Study


def horizon(study: Study, request: Controller) -> float:
    """How long a controller's step is followed [s]: the reference's duration, or longer where a spec needs it."""
    limits = [float(np.max(spec.limit)) for spec in asked(request) if spec.quantity == "settling_time"]
    return max([study.reference.duration, *(1.25 * limit for limit in limits)])


def asked(request: Controller) -> tuple[Spec, ...]:
    """The specs of the request, which are judged first of all."""
    return request.specs if isinstance(request, ClassicalController) else ()


def _steering(request: Controller) -> tuple[Spec, ...]:
    """The specs that gains had to meet to be chosen: none where all gains are given."""
    return () if isinstance(request, ClassicalController) and request.all_gains_given else asked(request)


def _sampling(request: Controller) -> Sampling | None:
    return request.sampling if isinstance(request, ClassicalController) else None


def judged(
    study: Study,
    plant: PlantEnvelope,
    request: Controller,
    outcomes: Outcomes,
    gains: tuple[Gain, ...],
    loop: Loop | CodedLoop,
) -> DesignedController:
    """Judge the loop as it is flown, and withdraw every gain that this second look does not bear out."""
    ok = outcomes.ok
    if not np.any(ok):
        none = np.full(ok.shape, np.nan)
        return DesignedController(request, outcomes, gains, loop, None, none.astype(complex), none, ())
    step, duration = study.reference.sizes(loop.references), horizon(study, request)
    try:
        found = _assessed(study, request, loop.take(ok), step, duration).spread(ok)
        fastest = _fastest_mode(request, loop, ok)
        checked = _certify(outcomes, found, _steering(request), gains, plant)
    except np.linalg.LinAlgError as error:
        checked = _without_unjudgeable(study, outcomes, request, loop, step, duration, str(error))
    if not np.array_equal(checked.ok, ok):
        kept = loop.take(checked.ok).spread(checked.ok)
        return judged(study, plant, request, checked, _kept(gains, checked), kept)
    frequency = reduced_frequency(fastest[..., None], plant.grid.condition, study.geometry.chord)[..., 0]
    actuators = {"tab": study.tab_actuator, "aileron": study.aileron_actuator}
    said = verdicts(found, ok, asked(request), study.spec_pack, actuators)
    flown = loop if isinstance(loop, CodedLoop) else as_if_continuous(loop, _sampling(request))
    return DesignedController(request, outcomes, gains, flown, found, fastest, frequency, said)


def figures_at(study: Study, request: Controller, loop: Loop, where: BoolArray) -> Assessment | None:
    """The loop's figures at the points of a mask, in one row; None where their numbers cannot be judged together."""
    step, duration = study.reference.sizes(loop.references), horizon(study, request)
    try:
        return _assessed(study, request, loop.take(where), step, duration)
    except np.linalg.LinAlgError:
        return None


def _assessed(
    study: Study, request: Controller, loop: Loop | CodedLoop, step: FloatArray, duration: float
) -> Assessment:
    """Figures of a loop that is finite everywhere; what actuators are asked for is that of the study's manoeuvre."""
    if isinstance(loop, CodedLoop):
        return _on_manoeuvre(study, loop, assess_sampled(loop, step, duration))
    return _on_manoeuvre(study, loop, assess(loop, step, duration, sampling=_sampling(request)))


def _on_manoeuvre(study: Study, loop: Loop | CodedLoop, found: Assessment) -> Assessment:
    """The assessment with the actuators' demands of the study's manoeuvre, where that is not the step itself.

    Raises
    ------
    ValueError : a sampled state feedback, which is followed through steps at once only
    """
    if study.reference.rate_limit is None:
        return found
    if isinstance(loop, CodedLoop):
        raise ValueError("a sampled state feedback is followed through a step at once, not at a limited rate")
    flown = found.loop
    response = manoeuvre_response(flown, study.reference.manoeuvre(flown.references), study.reference.duration, 2)
    return replace(
        found, demand=manoeuvre_demands(flown, response, flown.inputs, (ActuatorLimits(),) * len(flown.inputs))
    )


def _fastest_mode(request: Controller, loop: Loop | CodedLoop, ok: BoolArray) -> ComplexArray:
    """Fastest closed-loop mode of the surfaces that the air moves (*G,) [rad/s], nan where there is no design."""
    fastest = np.full(ok.shape, complex(np.nan, np.nan))
    surfaces = ("da",) if isinstance(request, ClassicalController) else ("dt", "da")
    if isinstance(loop, CodedLoop):
        fastest[ok] = fastest_surface_mode(loop.closed[ok], loop.states, surfaces, loop.sampling.time)
        return fastest
    chained = without_delay(loop.take(ok))
    fastest[ok] = fastest_surface_mode(chained.closed, chained.states, surfaces)
    return fastest


def _without_unjudgeable(
    study: Study,
    outcomes: Outcomes,
    request: Controller,
    loop: Loop | CodedLoop,
    step: FloatArray,
    duration: float,
    together: str,
) -> Outcomes:
    """One point whose numbers LAPACK gives up on must not lose the others: find such points one by one.

    Where each can be judged alone and only all of them `together` cannot, none is known to be right: all are withdrawn.
    """
    reasons = np.full(outcomes.ok.shape, None, dtype=object)
    for index in map(tuple, np.argwhere(outcomes.ok)):
        try:
            _assessed(study, request, loop.take(index), step, duration)
            _fastest_mode(request, loop.take(index), np.array(True))
        except np.linalg.LinAlgError as error:
            reasons[index] = str(error)
    failed = np.asarray(reasons != None)  # noqa: E711, elementwise
    if not np.any(failed):
        failed, reasons = outcomes.ok, np.full(outcomes.ok.shape, together, dtype=object)
    return outcomes.failing(failed, Outcome.NOT_CERTIFIED, lambda index: f"the loop cannot be judged: {reasons[index]}")


def _certify(
    outcomes: Outcomes, found: Assessment, specs: tuple[Spec, ...], gains: tuple[Gain, ...], plant: PlantEnvelope
) -> Outcomes:
    """Eigenvalues of the loop in state space must be stable, and the specs that chose the gains must be met."""
    ok, growth = outcomes.ok, found.largest_real_part
    cancelled = _stiffness_cancelled(gains, plant)

    def unstable(index: tuple[int, ...]) -> str:
        if np.isnan(growth[index]):
            return "the loop with its delay could not be proved stable"
        said = f"the closed loop has an eigenvalue with real part {growth[index]:.4g} 1/s"
        if cancelled is not None and cancelled[index] >= 1.0:
            return f"{said}: K_f cancels {cancelled[index]:.4g} of the aileron's stiffness, all of it or more"
        return said

    outcomes = outcomes.failing(ok & ~(growth < 0), Outcome.NOT_CERTIFIED, unstable)
    for spec in specs:
        values = achieved(found, spec.quantity)
        if values is None:
            continue
        outcomes = outcomes.failing(
            ok & ~spec.met(values),
            Outcome.NOT_CERTIFIED,
            lambda index, spec=spec, values=values: (  # type: ignore[misc]
                f"judged on the loop that is flown, {spec.quantity} is {values[index]:.6g} "
                f"against {spec.take(index).limit:.6g} asked"
            ),
        )
    return outcomes


def _stiffness_cancelled(gains: tuple[Gain, ...], plant: PlantEnvelope) -> FloatArray | None:
    """Part f of the aileron's static stiffness that positive feedback takes away (*G,); None without it."""
    for gain in gains:
        if gain.name == "K_f":
            return np.asarray(gain.values * np.abs(plant.servo_tab.dc_gain))
    return None


def _kept(gains: tuple[Gain, ...], outcomes: Outcomes) -> tuple[Gain, ...]:
    return tuple(Gain(g.name, g.unit, np.where(outcomes.ok, g.values, np.nan)) for g in gains)
