"""A manoeuvre of one controller of a design, flown over a profile of altitude and speed."""

from __future__ import annotations

from typing import get_args

import numpy as np
from fastapi import APIRouter, Request, Response

from model.flight import SPEED_UNITS, SpeedAxis
from schedules.flight_profile import TABLE_STEP, fly_profile, profile_work
from schedules.profile import FlightProfile, ProfileRefused
from schedules.profile_response import ProfileRequest
from schedules.study import Study
from schedules.wire_names import wire_name
from service.designs import continuous_loop, controller_of
from service.documentation.openapi import BODY, problems
from service.limits import check_size
from service.presenters.flight_profile import flight_profile_document
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas.flight_profiles import FlightProfileRequest, FlownProfile, Profile
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import refused_by_the_domain
from service.to_domain.manoeuvre_of import manoeuvre_of
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute
from service.wire.refusals import FieldRefusal, InvalidRequest

_SPEEDS: dict[str, SpeedAxis] = {wire_name(name, SPEED_UNITS[name]): name for name in get_args(SpeedAxis)}

_STEPS = (
    f"steps of the flight ({TABLE_STEP} times as many with a table of hinge moments, 3 with an estimate of the error)"
)

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}", tags=["controllers"], route_class=JsonRoute)


@router.post(
    "/flight-profile",
    response_model=FlownProfile,
    responses=problems(*BODY, 404, 409, 503),
    dependencies=[ALWAYS_HEAVY],
)
def flight_profile(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    body: FlightProfileRequest,
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Any manoeuvre while altitude and speed change, with the gains of the schedule at every instant."""
    check_size("/samples", "samples", body.samples, "max_response_samples", settings)
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    manoeuvre = manoeuvre_of(body.manoeuvre, continuous_loop(controller).references)
    knots = len(manoeuvre.times) + len(body.profile.times_s)
    check_size("/profile", "knots of the profile and the manoeuvre", knots, "max_manoeuvre_stretches", settings)
    study, plant = envelope.study, envelope.plant
    asked = ProfileRequest(body.duration_s, body.samples, body.trim, body.tolerance, estimate_error=body.estimate_error)
    with refused_by_the_domain(name):
        try:
            profile = _profile(body.profile, study)
            work = profile_work(study, plant, controller, profile, manoeuvre, asked)
            check_size("/duration_s", _STEPS, work, "max_profile_steps", settings)
            found = fly_profile(study, plant, controller, profile, manoeuvre, asked)
        except ProfileRefused as refused:
            allowed = "altitudes and speeds at which the section has a model"
            raise InvalidRequest(
                f"/profile: {refused}", FieldRefusal("/profile", str(refused), None, allowed)
            ) from refused
    return answer(request, encode(flight_profile_document(envelope, controller, body, found)))


def _profile(wire: Profile, study: Study) -> FlightProfile:
    """The profile in the air of the study.

    Raises
    ------
    ProfileRefused
    """
    axis, speed = wire.speed
    return FlightProfile(
        np.array(wire.times_s), np.array(wire.altitude_m), _SPEEDS[axis], np.array(speed), study.grid.temperature_offset
    )
