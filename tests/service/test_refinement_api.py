"""Refined tables over HTTP."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from schedules.refine.refine import refine
from schedules.refine.request import RefineRequest
from schedules.run import run
from service.app import create_app
from service.examples import example
from service.schemas.requests import DesignRequest
from service.settings import Settings
from service.to_domain.study_of import study


@pytest.fixture(scope="module")
def here(client: TestClient) -> str:
    """Address of the example's controllers."""
    return f"/v1/designs/{client.post('/v1/designs', json=example('wind_tunnel')).json()['id']}/controllers"


@pytest.mark.parametrize("name", ["pf", "lqr"])
def test_it_is_the_table_of_the_domain_and_a_design_of_its_own(client: TestClient, here: str, name: str) -> None:
    response = client.post(f"{here}/{name}/refinement", json={"fraction": 0.9})
    assert response.status_code == 200, response.text
    found = response.json()
    wanted = refine(
        study(DesignRequest.model_validate(example("wind_tunnel"))),
        name,
        RefineRequest(fraction=0.9, most_lines=(5, 10)),
    )
    assert found["holds"]
    assert found["remaining"] == []
    assert found["words"] == wanted.words
    assert found["points"] == wanted.points
    assert found["proved_decay_rate_1_s"] == wanted.proof.summary.alpha
    assert all(spec["loss_percent"] <= 5.0 for spec in found["specs"])
    assert found["uniform"]["points"] >= found["points"]
    # Posted as a grid, it is this table: its gains are those of a new design.
    document = example("wind_tunnel") | {"grid": found["request_grid"]}
    design = client.post("/v1/designs", json=document).json()
    (controller,) = (c for c in design["controllers"] if c["name"] == name)
    for gain, again in zip(found["gains"], controller["gains"], strict=True):
        np.testing.assert_allclose(gain["values"], again["values"], rtol=1e-9)


def test_too_few_lines_say_what_remains(client: TestClient, here: str) -> None:
    body = {"spec_tolerance_percent": 0.1, "altitude_lines": 2, "speed_lines": 3, "uniform": False}
    found = client.post(f"{here}/nf/refinement", json=body).json()
    assert not found["holds"]
    assert found["why"]
    assert found["remaining"]
    assert found["uniform"] is None


def test_bad_requests(client: TestClient, here: str, tmp_path: Any, refused: Callable[..., dict[str, Any]]) -> None:
    bad: list[tuple[dict[str, Any], str]] = [
        ({"fraction": 1.0}, "/fraction"),
        ({"spec_tolerance_percent": 0.0}, "/spec_tolerance_percent"),
        ({"gain_error_percent": -1.0}, "/gain_error_percent"),
        ({"altitude_lines": 1}, "/altitude_lines"),
        ({"speed_lines": 65}, "/speed_lines"),
        ({"start": "middle"}, "/start"),
        ({"lines": 3}, "/lines"),
    ]
    for body, pointer in bad:
        assert refused(client.post(f"{here}/lqr/refinement", json=body), 422)["errors"][0]["pointer"] == pointer
    document = example("wind_tunnel")
    document["controllers"] = [document["controllers"][2] | {"sample_time_s": 0.002}]
    ident = client.post("/v1/designs", json=document).json()["id"]
    problem = refused(client.post(f"/v1/designs/{ident}/controllers/lqr/refinement", json={}), 409)
    assert problem["code"] == "study_not_possible"
    with TestClient(create_app(Settings(data_dir=tmp_path, max_refined_points=10))) as small:
        ident = small.post("/v1/designs", json=example("wind_tunnel")).json()["id"]
        problem = refused(small.post(f"/v1/designs/{ident}/controllers/lqr/refinement", json={}), 422)
        assert (problem["code"], "max_refined_points" in problem["detail"]) == ("limit_exceeded", True)


def test_the_designs_study_is_left_alone(client: TestClient, here: str) -> None:
    before = client.get(f"{here}/lqr/verdicts").json()
    client.post(f"{here}/lqr/refinement", json={"uniform": False})
    assert client.get(f"{here}/lqr/verdicts").json() == before
    assert run(study(DesignRequest.model_validate(example("wind_tunnel")))).plant.grid.shape == (2, 4)
