"""The worst that references within an amplitude and a rate can do to one controller of a design."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, Field

from design.loop import Loop
from design.worst_case.channels import channels
from design.worst_case.peaks import GuaranteedPeaks, guaranteed_peaks
from design.worst_case.reference import worst_reference
from model.arrays import BoolArray
from schedules.designed import DesignedController
from schedules.study import Reference
from service.designs import controller_of, point_with_gains
from service.documentation.openapi import problems
from service.presenters.worst_case import worst_case_document, worst_reference_document
from service.routes.controllers import ControllerName, Point
from service.routes.designs import DesignId
from service.schemas.manoeuvres import RateLimit
from service.schemas.wire import PARAMETERS
from service.schemas.worst_case_answers import WorstCase, WorstReference
from service.state import ALWAYS_HEAVY, DesignsHere, SettingsHere
from service.studies.state_feedback import refused_by_the_domain
from service.to_domain.worst_case_of import Admissible, admissible, check_rows, chosen, followed_loop, signals
from service.wire.answering import answer, encode

router = APIRouter(prefix="/v1/designs/{id}/controllers/{name}/worst-case", tags=["controllers"])

#: Points whose step responses are kept at the same time: those of lightly damped loops are long.
AT_ONCE = 32

Amplitude = Annotated[float, Field(ge=0.0, le=60.0)]


class WantedLimits(BaseModel):
    """Within which limits references are admissible."""

    model_config = PARAMETERS

    aileron_deg: Amplitude | None = Field(
        default=None,
        description="Amplitude of the aileron's reference, about trim; without it, the size of the design's step",
        examples=[10.0],
    )
    rate_deg_s: RateLimit | None = Field(
        default=None, description="Rate of the aileron's reference; without it, the reference may jump", examples=[120]
    )
    tab_deg: Amplitude | None = Field(
        default=None,
        description="Amplitude of the tab's reference, where it has one; without it, the size of the design's step",
    )
    tab_rate_deg_s: RateLimit | None = Field(
        default=None, description="Rate of the tab's reference; without it, that of the aileron's"
    )


class WantedPeaks(WantedLimits):
    """Of which signals peaks are wanted."""

    signal: Annotated[list[str], Field(max_length=50)] = Field(
        default=[], description="Names of signals; without one, every signal and every error"
    )


class WantedReference(WantedLimits):
    """At which point, and for which signal."""

    point: Point
    signal: str = Field(description="Name of the signal that is to be largest", examples=["T_t_n_m"])


@router.get("", response_model=WorstCase, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY])
def worst_case_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[WantedPeaks, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """What every signal can reach at most over all references within an amplitude and a rate: proved, not sampled.

    The bounds hold for the linear loop with its actuators, filters and integrals. Whether a limit of an actuator is
    kept whatever the pilot does is answered beside them.
    """
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    loop = followed_loop(controller)
    limits = _admissible(loop, wanted, envelope.study.reference)
    outputs = chosen(loop, wanted.signal or list(signals(loop)))
    flown = loop.take(controller.outcomes.ok)
    check_rows(flown, limits, len(outputs), settings)
    with refused_by_the_domain(name):
        peaks, stable = _over_the_grid(controller, flown, limits, outputs)
    return answer(request, encode(worst_case_document(envelope, controller, limits, peaks, stable)))


@router.get(
    "/reference", response_model=WorstReference, responses=problems(404, 409, 422, 503), dependencies=[ALWAYS_HEAVY]
)
def worst_reference_of_controller(
    request: Request,
    ident: DesignId,
    name: ControllerName,
    wanted: Annotated[WantedReference, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """The reference that makes a signal largest at a point, as a recorded manoeuvre, and the peak that it reaches."""
    envelope = designs.envelope(ident)
    controller = controller_of(envelope, name)
    whole = followed_loop(controller)
    limits = _admissible(whole, wanted, envelope.study.reference)
    (output,) = chosen(whole, [wanted.signal])
    index = point_with_gains(envelope, controller, wanted.point)
    loop = whole.take(index)
    check_rows(loop, limits, 1, settings)
    with refused_by_the_domain(name):
        manoeuvre = worst_reference(loop, output, limits.amplitude, limits.rate)
        peaks = guaranteed_peaks(loop, limits.amplitude, limits.rate, (output,))
        document = worst_reference_document(loop, output, limits, manoeuvre, peaks)
    return answer(request, encode({"name": name, "point": wanted.point} | document))


def _admissible(loop: Loop, wanted: WantedLimits, reference: Reference) -> Admissible:
    return admissible(loop, reference, wanted.aileron_deg, wanted.rate_deg_s, wanted.tab_deg, wanted.tab_rate_deg_s)


def _over_the_grid(
    controller: DesignedController, flown: Loop, limits: Admissible, outputs: tuple[str, ...]
) -> tuple[GuaranteedPeaks, BoolArray]:
    """Peaks (*G, o), nan where there is no design, and the mask (*G,) of the points where they are known."""
    ok = controller.outcomes.ok
    upper, lower = np.full((2, *ok.shape, len(outputs)), np.nan)
    stable, where = np.zeros(ok.shape, dtype=bool), np.argwhere(ok)
    for first in range(0, len(where), AT_ONCE):
        part, index = flown.take(slice(first, first + AT_ONCE)), tuple(where[first : first + AT_ONCE].T)
        found = guaranteed_peaks(part, limits.amplitude, limits.rate, outputs)
        upper[index], lower[index] = found.upper, found.lower
        stable[index] = channels(part, outputs).stable
    return GuaranteedPeaks(upper, lower, outputs), stable
