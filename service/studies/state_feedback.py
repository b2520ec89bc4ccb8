"""What studies of state feedback have in common: which controllers they are of, and what the domain refuses of one."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated

from fastapi import Path

from design.loop import Loop
from design.lqr.controller import LqrController
from schedules.designed import DesignedController, DesignedEnvelope
from service.designs import controller_of
from service.wire.refusals import StudyNotPossible

_NAME = "Name of the controller, a state feedback"
#: A state feedback, and one whose weights weigh power, of the examples that documentation shows.
LqrName = Annotated[str, Path(alias="name", description=_NAME, examples=["lqr"])]
PowerName = Annotated[str, Path(alias="name", description=_NAME, examples=["after"])]

log = logging.getLogger("gainfield")


@dataclass(frozen=True, eq=False)
class StateFeedback:
    """A controller of a design that is a continuous state feedback with all states measured.

    Attributes
    ----------
    envelope : the design
    controller : of that design
    request : what it was asked for
    loop : that it flies, over the grid
    """

    envelope: DesignedEnvelope
    controller: DesignedController
    request: LqrController
    loop: Loop


def state_feedback(envelope: DesignedEnvelope, name: str) -> StateFeedback:
    """The controller of this name, for a study of its continuous design with all states measured.

    Raises
    ------
    NotFound : there is no such controller
    StudyNotPossible : it is of another kind, runs on a computer, or does not measure its states
    """
    controller = controller_of(envelope, name)
    request = controller.request
    if not isinstance(request, LqrController):
        detail = f"the controller {name} is of the kind {request.kind}; this study is of state feedback, the kind lqr"
        raise StudyNotPossible(detail)
    if request.measurement is not None:
        raise _not_of_the_continuous_design(name, "works its states out from the angles (measurement)")
    if request.sampling is not None or not isinstance(controller.loop, Loop):
        raise _not_of_the_continuous_design(name, "runs on a computer (sample_time_s)")
    return StateFeedback(envelope, controller, request, controller.loop)


def _not_of_the_continuous_design(name: str, what: str) -> StudyNotPossible:
    return StudyNotPossible(
        f"the controller {name} {what}; this study is of the continuous design with all states measured"
    )


@contextmanager
def refused_by_the_domain(name: str) -> Iterator[None]:
    """What the domain refuses about the controller of this name is a study that is not possible, not a fault."""
    try:
        yield
    except (ValueError, ArithmeticError) as error:
        log.warning("a study was refused by the domain", exc_info=error)
        raise StudyNotPossible(f"the study is not possible for the controller {name}: {error}") from error
