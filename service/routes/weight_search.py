"""Weights of a state feedback that are searched: which ones meet specs, and what speed costs."""

from __future__ import annotations

import numpy as np
from fastapi import APIRouter, Request, Response

from design.lqr.weight_search import search_weights
from design.lqr.weight_tradeoff import trade_off
from service.documentation.openapi import BODY, problems
from service.limits import check_size
from service.presenters.weight_search import trade_off_document, weight_search_document
from service.routes.designs import DesignId
from service.schemas import weight_search_answers as answers
from service.schemas.weight_search_requests import TradeOffRequest, WeightSearchRequest
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import LqrName, refused_by_the_domain, state_feedback
from service.to_domain.weight_search_of import SoughtWeights, sought_weights
from service.wire.answering import answer, encode
from service.wire.reading import JsonRoute
from service.wire.refusals import FieldRefusal, InvalidRequest

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}", tags=["controllers"], route_class=JsonRoute)


@router.post(
    "/weight-search",
    response_model=answers.WeightSearch,
    responses=problems(*BODY, 404, 409, 503),
    dependencies=[ALWAYS_HEAVY],
)
def weight_search(
    request: Request,
    ident: DesignId,
    name: LqrName,
    body: WeightSearchRequest,
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Bryson weights that meet specs with the least power of the actuators: at each point, or the same everywhere.

    Of controllers whose weights follow Bryson's rule, or weigh power on top of such. A search takes about half a second
    a point, and three times as long where there are no such weights: `points` takes a large grid piece by piece.
    """
    feedback = state_feedback(designs.envelope(ident), name)
    sought = sought_weights(feedback, designs.find(ident).request, body, body.minimised)
    check_size("/points", "grid points to search at", sought.count, "max_weight_searches", settings)
    tab, aileron = sought.actuators
    with refused_by_the_domain(name):
        found = search_weights(
            feedback.envelope.plant.model,
            sought.search,
            sought.outcomes,
            tab,
            aileron,
            common=body.common,
            exchange=body.exchange,
        )
        own = sought.own_figures()
    return answer(request, encode(weight_search_document(sought, found, own, body.common, body.exchange)))


@router.post(
    "/trade-off",
    response_model=answers.TradeOff,
    responses=problems(*BODY, 404, 409, 503),
    dependencies=[ALWAYS_HEAVY],
)
def settling_trade_off(
    request: Request,
    ident: DesignId,
    name: LqrName,
    body: TradeOffRequest,
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """Settling time against the peak torque of the aileron's actuator: the best weights of each, point by point.

    Of the same controllers. A front takes some two seconds a point.
    """
    feedback = state_feedback(designs.envelope(ident), name)
    sought = sought_weights(feedback, designs.find(ident).request, body, "peak_aileron_torque")
    times = body.settling_times_s
    work = sought.count * (body.count if times is None else len(times))
    check_size("/points", "grid points times settling times", work, "max_weight_searches", settings)
    _check_times(sought, times)
    tab, aileron = sought.actuators
    with refused_by_the_domain(name):
        found = trade_off(
            feedback.envelope.plant.model,
            sought.search,
            None if times is None else tuple(times),
            body.count,
            sought.outcomes,
            tab,
            aileron,
        )
        own = sought.own_figures()
    return answer(request, encode(trade_off_document(sought, found, own)))


def _check_times(sought: SoughtWeights, times: list[float] | None) -> None:
    """Refuse a settling time above the slowest that is looked at, wherever on the grid.

    Raises
    ------
    InvalidRequest
    """
    (slowest,) = (float(np.min(spec.limit)) for spec in sought.search.specs if spec.quantity == "settling_time")
    for place, time in enumerate(times or ()):
        if time > slowest:
            pointer, detail = f"/settling_times_s/{place}", f"above the slowest that is looked at, {slowest:g} s"
            raise InvalidRequest(f"{pointer}: {detail}", FieldRefusal(pointer, detail, "s", f"<= {slowest:g}"))
