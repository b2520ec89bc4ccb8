"""Trajectories of a state feedback in the phase planes of the two surfaces."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from design.loop import Loop
from design.lqr.phase_plane import free_trajectory, step_trajectory
from model.arrays import FloatArray
from service.designs import point_with_gains
from service.documentation.openapi import problems
from service.limits import check_size
from service.presenters.phase_plane import free_documents, trajectory_document
from service.presenters.requirements import reference_document
from service.routes.controllers import Point
from service.routes.designs import DesignId
from service.schemas import lqr_studies
from service.schemas.wire import PARAMETERS
from service.state import HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import LqrName, refused_by_the_domain, state_feedback
from service.wire.answering import answer, encode
from service.wire.refusals import FieldRefusal, InvalidRequest

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/phase-plane", tags=["controllers"])

StartAngle = Annotated[float, Field(ge=0.0, le=180.0)]


class WantedTrajectories(BaseModel):
    """At which point, from where, and how finely."""

    model_config = PARAMETERS

    point: Point
    starts: Annotated[int, Field(ge=0)] = Field(
        default=12, description="How many free trajectories, evenly about an ellipse in the plane of both angles"
    )
    aileron_deg: StartAngle | None = Field(
        default=None, description="Its half axis along the aileron's angle; without it, the size of the design's step"
    )
    tab_deg: StartAngle | None = Field(
        default=None, description="Its half axis along the tab's angle; without it, that along the aileron's"
    )
    duration_s: Annotated[float, Field(ge=1e-3, le=1e3)] | None = Field(
        default=None, description="How long all are followed; without it, as long as the design's reference"
    )
    samples: Annotated[int, Field(ge=2)] = Field(default=201, description="Samples of each, both ends included")


@router.get("", response_model=lqr_studies.PhasePlane, responses=problems(404, 409, 422, 503), dependencies=[HEAVY])
def phase_plane_of_controller(
    request: Request,
    ident: DesignId,
    name: LqrName,
    wanted: Annotated[WantedTrajectories, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Trajectories of angles, rates and torques: after the design's step, and let go at rest from angles about trim."""
    size = (1 + wanted.starts) * wanted.samples
    check_size("/starts", "samples of the step and all starts", size, "max_response_samples", settings)
    feedback = state_feedback(designs.envelope(ident), name)
    index = point_with_gains(feedback.envelope, feedback.controller, wanted.point)
    reference, loop = feedback.envelope.study.reference, feedback.loop.take(index)
    duration = wanted.duration_s or reference.duration
    _check_duration(duration, loop)
    largest = abs(float(np.rad2deg(reference.aileron))) if wanted.aileron_deg is None else wanted.aileron_deg
    angles = _about(wanted.starts, largest, largest if wanted.tab_deg is None else wanted.tab_deg)
    with refused_by_the_domain(name):
        sizes = reference.sizes(loop.references)
        step = step_trajectory(loop, sizes, duration, wanted.samples) if sizes.size else None
        free = free_trajectory(_repeated(loop, len(angles)), _states(loop, angles), duration, wanted.samples)
    document = {
        "name": name,
        "point": wanted.point,
        "delays": "exact_after_the_step" if any(loop.delay) else "none",
        "trim": _trim(loop),
        **reference_document(reference, duration),
        "step": None if step is None else trajectory_document(step),
        "free": free_documents(angles, free),
    }
    return answer(request, encode(document))


def _check_duration(duration: float, loop: Loop) -> None:
    """Refuse a step that is over before its command arrives.

    Raises
    ------
    InvalidRequest
    """
    longest = max(loop.delay)
    if duration <= longest:
        detail = f"{duration:g} s is not longer than the transport delay of {longest:g} s"
        raise InvalidRequest(f"/duration_s: {detail}", FieldRefusal("/duration_s", detail, "s", f"> {longest:g}"))


def _about(count: int, aileron: float, tab: float) -> FloatArray:
    """Angles (S, 2) of aileron and tab on an ellipse, evenly in its parameter, the first along the aileron's axis."""
    turn = 2.0 * np.pi * np.arange(count) / max(count, 1)
    return np.stack([aileron * np.cos(turn), tab * np.sin(turn)], axis=-1)


def _repeated(loop: Loop, count: int) -> Loop:
    """The loop of one point `count` times."""
    return loop.take(np.newaxis).take(np.zeros(count, dtype=int))


def _states(loop: Loop, angles: FloatArray) -> FloatArray:
    """States (S, n) at these angles (S, 2) [deg], all others as at trim."""
    states = np.zeros((len(angles), len(loop.states)))
    states[:, [loop.states.index("da"), loop.states.index("dt")]] = np.deg2rad(angles)
    return states


def _trim(loop: Loop) -> dict[str, Any]:
    offset = np.rad2deg(loop.offset)
    return {
        "aileron_deg": float(offset[loop.outputs.index("da")]),
        "tab_deg": float(offset[loop.outputs.index("dt")]),
    }
