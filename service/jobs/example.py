"""The job that the routes of jobs are shown with in the documentation: it runs as it stands."""

from __future__ import annotations

from functools import cache
from typing import Any

from service.documentation.body_examples import BODIES
from service.jobs.deferral import answer_id
from service.store.designs import LOCAL

#: What it answers.
EXAMPLE_PATH = "/v1/linear-models"


def example_body() -> Any:
    """The body of the request that it answers."""
    return next(iter(BODIES[EXAMPLE_PATH]().values()))["value"]


@cache
def example_job() -> str:
    """Its id where no keys are asked for."""
    return answer_id(LOCAL, "POST", EXAMPLE_PATH, "", example_body())
