"""How slowly the code of a state feedback may run."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from design.frequency.margins import LARGEST
from design.loop import Loop
from design.lqr.coded_loop import command_delays
from design.lqr.sample_time_sweep import sweep_sample_time
from design.lqr.sampled_response import FEWEST_INTERVALS, MOST_INTERVALS
from design.response.graded import RESOLUTION
from design.sampling import Sampling
from design.specs import QUANTITIES, Spec
from model.arrays import FloatArray
from schedules.designed import DesignedController, DesignedEnvelope
from service.designs import point_with_gains
from service.documentation.openapi import problems
from service.limits import check_size
from service.presenters.grid import grid_document
from service.presenters.requirements import reference_document
from service.presenters.sample_time_sweep import sweep_document
from service.routes.designs import DesignId
from service.schemas import specs
from service.schemas.sample_time_answers import SampleTimeSweep
from service.schemas.wire import PARAMETERS
from service.settings import Settings
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import LqrName, refused_by_the_domain, state_feedback
from service.wire.answering import answer, encode
from service.wire.refusals import FieldRefusal, InvalidRequest, NoDesignAtPoint, StudyNotPossible
from service.wire.spec_names import SPEC_FIELDS, spec_field

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/sample-time-sweep", tags=["controllers"])

SampleTime = Annotated[float, Field(ge=1e-6, le=10.0)]
_JUDGED = "Judged beside the spec pack, or in the place of what that asks of it"


class JudgedSpecs(BaseModel):
    """Specs that a sample time must meet, beside those of the design's spec pack or in their place."""

    model_config = PARAMETERS

    damping_ratio_min: specs.DampingRatio | None = Field(default=None, description=_JUDGED)
    gain_margin_db_min: specs.GainMargin | None = Field(default=None, description=_JUDGED)
    phase_margin_deg_min: specs.PhaseMargin | None = Field(default=None, description=_JUDGED)
    disk_margin_min: specs.DiskMargin | None = Field(default=None, description=_JUDGED)
    sensitivity_peak_max: specs.SensitivityPeak | None = Field(default=None, description=_JUDGED)
    settling_time_s_max: specs.SettlingTime | None = Field(default=None, description=_JUDGED)
    overshoot_percent_max: specs.Overshoot | None = Field(default=None, description=_JUDGED)


class WantedSweep(JudgedSpecs):
    """Which sample times are tried, at which points, and what they must meet."""

    from_s: SampleTime = Field(default=5e-4, description="Fastest sample time")
    to_s: SampleTime = Field(default=2e-2, description="Slowest sample time, not below the fastest")
    count: Annotated[int, Field(ge=1)] = Field(
        default=8, description="How many sample times are scanned, evenly in proportion; a single one is the fastest"
    )
    halvings: Annotated[int, Field(ge=0, le=6)] = Field(
        default=4, description="How often each step from passing to failing is halved, in proportion"
    )
    computation_samples: Annotated[float, Field(ge=0.0, le=4.0)] = Field(
        default=1.0,
        description="Time from a measurement to its command, in samples; the actuators' own delays add to it",
    )
    duration_s: Annotated[float, Field(ge=1e-3, le=1e3)] | None = Field(
        default=None, description="How long each step is followed; without it, as long as the design's reference"
    )
    point: int | None = Field(
        default=None,
        description="Flat row-major index of a grid point, from 0; without it, every point that has gains",
        examples=[3],
    )


@router.get("", response_model=SampleTimeSweep, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY])
def sample_time_sweep_of_controller(
    request: Request,
    ident: DesignId,
    name: LqrName,
    wanted: Annotated[WantedSweep, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Figures of the loop run as code, by sample time, and the slowest that passes: redesigned for it, and emulated.

    A sample time passes where the loop is stable and meets the design's spec pack and the specs asked for here. Figures
    are exact: those of the step also between the samples.
    """
    feedback = state_feedback(designs.envelope(ident), name)
    if feedback.request.delay_states:
        detail = "runs a model of its delays (delay_states), which from sample to sample are exact"
        raise StudyNotPossible(f"the controller {name} {detail}; this study takes none")
    points = _points(feedback.envelope, feedback.controller, wanted.point)
    study, plant = feedback.envelope.study, feedback.envelope.plant
    duration = wanted.duration_s or study.reference.duration
    times = _times(wanted)
    index = np.unravel_index(points, plant.grid.shape)
    loop = feedback.loop.take(index)
    _check_work(loop, times, duration, wanted.computation_samples, settings)
    judged, left_out = _specs(study.spec_pack, wanted)
    here = tuple(spec.take(index) for spec in judged)
    with refused_by_the_domain(name):
        found = sweep_sample_time(
            plant.model.take(index),
            feedback.request,
            times.tolist(),
            here,
            study.reference.sizes(loop.references),
            duration,
            wanted.computation_samples,
            tab=study.tab_actuator,
            aileron=study.aileron_actuator,
            halvings=wanted.halvings,
        )
    document: dict[str, Any] = {
        "name": name,
        "kind": feedback.request.kind,
        "grid": grid_document(plant.grid),
        "points": points,
        **reference_document(study.reference, duration),
        "computation_samples": wanted.computation_samples,
        "halvings": wanted.halvings,
        "not_judged": left_out,
        **sweep_document(found, here),
    }
    return answer(request, encode(document))


def _points(envelope: DesignedEnvelope, controller: DesignedController, point: int | None) -> list[int]:
    """Flat indices of the points that are swept.

    Raises
    ------
    InvalidRequest, NoDesignAtPoint : there is no such point, or none has gains
    """
    if point is not None:
        point_with_gains(envelope, controller, point)
        return [point]
    points: list[int] = np.flatnonzero(controller.outcomes.ok).tolist()
    if not points:
        raise NoDesignAtPoint(f"the controller {controller.request.name} has no gains at any point")
    return points


def _times(wanted: WantedSweep) -> FloatArray:
    """The sample times that are scanned [s].

    Raises
    ------
    InvalidRequest : the fastest is above the slowest
    """
    if wanted.from_s > wanted.to_s:
        detail = f"the fastest sample time, {wanted.from_s:g} s, is above the slowest, {wanted.to_s:g} s"
        raise InvalidRequest(f"/from_s: {detail}", FieldRefusal("/from_s", detail, "s", f"<= {wanted.to_s:g}"))
    return np.geomspace(wanted.from_s, wanted.to_s, wanted.count)


def _check_work(loop: Loop, times: FloatArray, duration: float, computation: float, settings: Settings) -> None:
    """Refuse more samples than this server follows, and more commands under way than can be judged.

    Raises
    ------
    LimitExceeded, InvalidRequest
    """
    samples = np.ceil(duration / times) * _finer(loop, times)
    check_size("/from_s", "samples of one step", _whole(samples.max()), "max_step_samples", settings)
    check_size("/from_s", "samples of all steps that are scanned", _whole(samples.sum()), "max_swept_samples", settings)
    fastest = float(times[0])
    delays = command_delays(loop.delay, Sampling(fastest, computation * fastest))
    under_way = sum(int(np.ceil(delay / fastest)) for delay in delays)
    # Each is a state of the loop, and one of the code's memory of its own commands.
    if loop.A.shape[-1] + 2 * under_way > LARGEST:
        detail = f"{under_way} commands are under way at once with a sample time of {fastest:g} s"
        allowed = f"a sample time with at most {(LARGEST - loop.A.shape[-1]) // 2} commands under way"
        raise InvalidRequest(f"/from_s: {detail}", FieldRefusal("/from_s", detail, "s", allowed))


def _finer(loop: Loop, times: FloatArray) -> FloatArray:
    """How many times finer than at least the mesh between the samples is, at points and sample times (N, S)."""
    fastest = np.abs(np.linalg.eigvals(loop.A)).max(axis=-1, keepdims=True)
    finer = fastest * times / (RESOLUTION * FEWEST_INTERVALS)
    return np.asarray(np.clip(finer, 1.0, MOST_INTERVALS / FEWEST_INTERVALS), dtype=np.float64)


def _whole(samples: float) -> int:
    return int(np.ceil(samples))


def _specs(pack: tuple[Spec, ...], wanted: JudgedSpecs) -> tuple[tuple[Spec, ...], list[str]]:
    """The pack with what is asked for in its place or beside it, and the specs that a coded torque loop cannot have."""
    asked = {name: getattr(wanted, name) for name in JudgedSpecs.model_fields}
    given = [SPEC_FIELDS[name].spec(limit) for name, limit in asked.items() if limit is not None]
    replaced = {(spec.quantity, spec.sense) for spec in given}
    every = [*(spec for spec in pack if (spec.quantity, spec.sense) not in replaced), *given]
    left_out = [spec_field(spec.quantity, spec.sense).name for spec in every if spec.quantity == "noise_gain"]
    return tuple(spec for spec in every if spec.quantity in QUANTITIES and spec.quantity != "noise_gain"), left_out
