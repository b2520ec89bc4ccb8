"""One running application for the tests of the service, and the design of the first shipped example in it."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Iterator
from typing import Any

import httpx2
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.examples import example
from service.schemas.problem import Problem
from service.settings import Settings

# Work above a limit is refused, not made a job, but in the tests of jobs, which say how much a job may do.
os.environ.setdefault("GAINFIELD_JOB_WORK_FACTOR", "1")


@pytest.fixture(scope="session")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """A client of an application with its own store; a fault of the server is an answer, not an exception."""
    app = create_app(Settings(data_dir=tmp_path_factory.mktemp("designs")))
    with TestClient(app, raise_server_exceptions=False) as running:
        yield running


@pytest.fixture(scope="session")
def design(client: TestClient) -> dict[str, Any]:
    """The design of the example `wind_tunnel`, as answered."""
    response = client.post("/v1/designs", json=example("wind_tunnel"))
    assert response.status_code in (200, 201), response.text
    document: dict[str, Any] = response.json()
    return document


@pytest.fixture
def wanted() -> dict[str, Any]:
    """The request of the example `wind_tunnel`, free to be changed."""
    return copy.deepcopy(example("wind_tunnel"))


@pytest.fixture
def quick(wanted: dict[str, Any]) -> dict[str, Any]:
    """The example with one point and the regulator alone: a design of a few milliseconds."""
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    wanted["controllers"] = wanted["controllers"][2:]
    return wanted


Refused = Callable[[httpx2.Response, int], dict[str, Any]]


@pytest.fixture(scope="session")
def refused() -> Refused:
    """Check the one shape of every error, and what none may carry; answers the problem document."""

    def check(response: httpx2.Response, status: int) -> dict[str, Any]:
        assert response.status_code == status, (response.status_code, response.text)
        assert response.headers["content-type"] == "application/problem+json"
        document: dict[str, Any] = response.json()
        Problem.model_validate(document, strict=True)
        assert document["status"] == status
        assert document["type"] == f"urn:gainfield:problem:{document['code']}"
        for leak in ("Traceback", "site-packages", ".py", "/home/", "/usr/", "pydantic"):
            assert leak not in response.text
        return document

    return check
