"""Gains of a controller flown on plants that are off: corners and random draws (seed Tables 8.4, 8.6)."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from schedules.designed import DesignedEnvelope
from service.documentation.openapi import job_answers, problems
from service.jobs.deferral import accepted
from service.jobs.kinds.perturbed import perturbed_job
from service.limits import fits_in_a_job, of_jobs
from service.routes.controllers import ControllerName
from service.routes.designs import DesignId
from service.schemas.robustness_answers import RobustPerformance
from service.settings import Settings
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere, principal_of, state_of
from service.studies.perturbed import Perturbed, WantedPerformance, perturbed
from service.wire.answering import answer, encode
from service.wire.reading import prefers_async
from service.wire.refusals import LimitExceeded

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/robust-performance", tags=["controllers"])


@router.get(
    "",
    response_model=RobustPerformance,
    responses=job_answers() | problems(404, 409, 422, 503),
    dependencies=[ALWAYS_HEAVY],
)
def robust_performance_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[WantedPerformance, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Gains as designed for the nominal plant, flown on plants whose derivatives and inertias are off.

    Each plant is linearised afresh about the nominal trim, and is the same at every point. Of each figure: its worst
    over the cases with the plant that gives it, percentiles, and the parameter that it depends on most.
    """
    asked, large = _asked(designs.envelope(ident), name, wanted, settings)
    jobs = state_of(request).jobs
    if jobs is not None and (large or prefers_async(request)):
        asking = principal_of(request)
        state_of(request).door.check_room(asking)
        new = perturbed_job(designs.find(ident), asked, asking.owner)
        return accepted(request, jobs.ask(new, asking.owner, again=False))
    return answer(request, encode(asked.document([asked.fly(*block) for block in asked.blocks])))


def _asked(
    envelope: DesignedEnvelope, name: str, wanted: WantedPerformance, settings: Settings
) -> tuple[Perturbed, bool]:
    """The cases, and whether they are too many in line.

    Raises
    ------
    LimitExceeded : they are too many for a job, too
    """
    try:
        return perturbed(envelope, name, wanted, settings), False
    except LimitExceeded as refused:
        if not fits_in_a_job(refused, settings):
            raise
        return perturbed(envelope, name, wanted, of_jobs(settings)), True
