"""The OpenAPI document: every request example runs, every answer is as declared, every error is declared."""

from __future__ import annotations

import json
from typing import Any

import pytest
from fastapi.routing import APIRoute
from fastapi.testclient import TestClient
from pydantic import TypeAdapter

from service.documentation.design_examples import design_requests
from service.jobs.example import EXAMPLE_PATH, example_body, example_job
from service.routes import ROUTERS
from service.schemas.problem import Problem
from service.wire.errors import STATUS
from tests.service.openapi_examples import address, operations

METHODS = ("get", "post")


@pytest.fixture(scope="module")
def document(client: TestClient) -> dict[str, Any]:
    openapi: dict[str, Any] = client.get("/openapi.json").json()
    return openapi


@pytest.fixture(scope="module")
def shown(client: TestClient, design: dict[str, Any]) -> list[str]:
    """Ids of the designs that routes are shown with: the first example, and one that weighs power.

    And the job that the routes of jobs are shown with has ended.
    """
    response = client.post("/v1/designs", json=design_requests()["lqr_power"][1])
    assert response.status_code in (200, 201), response.text
    job = client.post(EXAMPLE_PATH, json=example_body(), headers={"Prefer": "respond-async"})
    assert (job.status_code, job.headers["location"]) == (202, f"/v1/jobs/{example_job()}")
    with client.stream("GET", f"/v1/jobs/{example_job()}/events") as events:
        assert "event: succeeded" in list(events.iter_lines())
    return [design["id"], response.json()["id"]]


def test_the_routes_of_the_contract(document: dict[str, Any]) -> None:
    assert {(method, path) for path, method, _ in operations(document)} == {
        ("post", "/v1/designs"),
        ("post", "/v1/previews"),
        ("get", "/v1/designs/{id}/report"),
        ("get", "/v1/designs/{id}/controllers/{name}/figures"),
        ("get", "/v1/designs"),
        ("get", "/v1/designs/{id}"),
        ("delete", "/v1/designs/{id}"),
        ("get", "/v1/designs/{id}/points"),
        ("get", "/v1/designs/{id}/points/{index}"),
        ("get", "/v1/designs/{id}/controllers/{name}/root-locus"),
        ("get", "/v1/designs/{id}/controllers/{name}/response"),
        ("get", "/v1/designs/{id}/controllers/{name}/actuator-requirements"),
        ("post", "/v1/designs/{id}/controllers/{name}/response"),
        ("post", "/v1/designs/{id}/controllers/{name}/actuator-requirements"),
        ("post", "/v1/designs/{id}/controllers/{name}/refinement"),
        ("post", "/v1/designs/{id}/controllers/{name}/weight-search"),
        ("post", "/v1/designs/{id}/controllers/{name}/trade-off"),
        ("post", "/v1/designs/{id}/controllers/{name}/actuator-selection"),
        ("post", "/v1/designs/{id}/controllers/{name}/inverse-sizing"),
        ("post", "/v1/designs/{id}/controllers/{name}/flight-profile"),
        ("get", "/v1/designs/{id}/controllers/{name}/frequency-response"),
        ("get", "/v1/designs/{id}/controllers/{name}/cross-flight"),
        ("get", "/v1/designs/{id}/controllers/{name}/robust-performance"),
        ("get", "/v1/designs/{id}/controllers/{name}/worst-case"),
        ("get", "/v1/designs/{id}/controllers/{name}/worst-case/reference"),
        ("get", "/v1/designs/{id}/controllers/{name}/hidden-coupling"),
        ("get", "/v1/designs/{id}/actuation-comparison"),
        ("get", "/v1/designs/{id}/cross-check"),
        ("get", "/v1/designs/{id}/compare"),
        ("get", "/v1/designs/{id}/controllers/{name}/simultaneous-margins"),
        ("get", "/v1/designs/{id}/controllers/{name}/norms"),
        ("get", "/v1/designs/{id}/controllers/{name}/phase-plane"),
        ("get", "/v1/designs/{id}/controllers/{name}/power-comparison"),
        ("get", "/v1/designs/{id}/controllers/{name}/sample-time-sweep"),
        ("get", "/v1/designs/{id}/controllers/{name}/limited-tab"),
        ("get", "/v1/designs/{id}/controllers/{name}/verdicts"),
        ("get", "/v1/designs/{id}/controllers/{name}/design-margin"),
        ("get", "/v1/designs/{id}/controllers/{name}/scaling"),
        ("get", "/v1/designs/{id}/controllers/{name}/gains"),
        ("get", "/v1/designs/{id}/schedules/{controller}.{suffix}"),
        ("get", "/v1/designs/{id}/verification"),
        ("get", "/v1/designs/{id}/controllers/{name}/certificate"),
        ("post", "/v1/schedules/verify"),
        ("get", "/v1/atmosphere"),
        ("post", "/v1/hinge-moments"),
        ("post", "/v1/linear-models"),
        ("post", "/v1/eigenvalue-sweeps"),
        ("post", "/v1/steady-state-maps"),
        ("post", "/v1/similarity"),
        ("get", "/v1/spec-packs"),
        ("get", "/v1/examples"),
        ("get", "/v1/examples/{name}"),
        ("get", "/v1/jobs"),
        ("get", "/v1/jobs/{id}"),
        ("get", "/v1/jobs/{id}/events"),
        ("get", "/v1/jobs/{id}/result"),
        ("delete", "/v1/jobs/{id}"),
        ("get", "/v1/limits"),
        ("get", "/v1/version"),
        ("get", "/healthz"),
        ("get", "/readyz"),
        ("get", "/metrics"),
    }


@pytest.mark.usefixtures("shown")
def test_every_body_example_runs(client: TestClient, document: dict[str, Any]) -> None:
    ran = []
    for path, method, operation in operations(document):
        examples = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("examples", {})
        assert bool(examples) == (method == "post"), path
        for name, example in examples.items():
            where, _ = address(path, operation)
            response = client.post(where, json=example["value"])
            assert response.status_code in (200, 201), (path, name, response.text)
            assert str(response.status_code) in operation["responses"]
            ran.append((path, name))
    assert len(ran) == 42


@pytest.mark.usefixtures("shown")
def test_every_parameter_example_runs(client: TestClient, document: dict[str, Any]) -> None:
    """With the example designs posted, every GET of the document works as its examples say, names and all."""
    for path, method, operation in operations(document):
        if method == "get":
            where, query = address(path, operation)
            response = client.get(where, params=query)
            assert response.status_code == 200, (where, query, response.text)
            media = response.headers["content-type"].partition(";")[0]
            assert media in operation["responses"]["200"]["content"], (path, media)


@pytest.mark.usefixtures("shown")
def test_answers_are_what_their_models_say(client: TestClient, document: dict[str, Any]) -> None:
    """Every JSON answer has exactly the fields of its declared model."""
    routes = [route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute)]
    models = {(route.path, *map(str.lower, route.methods)): route.response_model for route in routes}
    checked = 0
    for path, method, operation in operations(document):
        if method not in METHODS:
            continue
        where, query = address(path, operation)
        if method == "post":
            (example, *_) = operation["requestBody"]["content"]["application/json"]["examples"].values()
            response = client.post(where, json=example["value"])
        else:
            response = client.get(where, params=query)
        model = models[path, method]
        if model is not None:
            TypeAdapter(model).validate_python(response.json(), strict=True)
            checked += 1
    assert checked == 53


def test_routes_below_a_design_are_shown_with_one_that_has_what_they_need(
    document: dict[str, Any], shown: list[str]
) -> None:
    ids = {
        path: [p["example"] for p in operation["parameters"] if p["name"] == "id"]
        for path, method, operation in operations(document)
        if "{id}" in path
    }
    jobs = [ids.pop(path) for path in list(ids) if path.startswith("/v1/jobs")]
    assert jobs == [[example_job()]] * 3
    power = "/v1/designs/{id}/controllers/{name}/power-comparison"
    assert ids.pop(power) == [shown[1]]
    assert set(map(tuple, ids.values())) == {(shown[0],)}
    assert "x-example" not in json.dumps(document)


def test_every_error_is_declared_with_its_shape(document: dict[str, Any]) -> None:
    known = {str(status) for status, _, _ in STATUS.values()}
    for path, method, operation in operations(document):
        responses = operation["responses"]
        errors = {status: r for status, r in responses.items() if status[0] in "45"}
        assert set(errors) <= known, path
        for response in errors.values():
            (media, content), *others = response["content"].items()
            assert (media, others) == ("application/problem+json", [])
            assert content["schema"] == {"$ref": "#/components/schemas/Problem"}
            Problem.model_validate(content["example"], strict=True)
        if method == "post":
            assert {"400", "413", "415", "422"} <= set(errors), path
        if "{id}" in path:
            assert {"404", "503"} <= set(errors), path
        if any(p["in"] == "query" for p in operation.get("parameters", [])):
            assert "422" in errors, path
    assert "HTTPValidationError" not in document["components"]["schemas"]
    assert {"Problem", "FieldProblem"} <= set(document["components"]["schemas"])


def test_references_lead_somewhere(document: dict[str, Any]) -> None:
    text = json.dumps(document)
    names = {part.split('"')[0] for part in text.split('"#/components/schemas/')[1:]}
    assert names <= set(document["components"]["schemas"])


def test_every_operation_is_described(document: dict[str, Any]) -> None:
    for path, method, operation in operations(document):
        assert operation.get("description"), path
        assert operation.get("tags"), path
        assert operation["responses"].get("304") or operation.get("requestBody") or method == "delete", path


def test_numbers_state_their_unit(document: dict[str, Any]) -> None:
    """Every numeric field of the document says its unit; that of a dimensional name is the one it ends in."""
    schemas = document["components"]["schemas"]
    chord = schemas["Geometry"]["properties"]["chord_m"]
    assert (chord["unit"], chord["minimum"], chord["maximum"]) == ("m", 0.001, 100.0)
    assert schemas["Demand"]["properties"]["peak_rate_deg_s"]["unit"] == "deg/s"
    assert schemas["BrysonWeights"]["properties"]["aileron_integral_deg_s"]["unit"] == "deg s"
    for name, schema in schemas.items():
        for field, node in schema.get("properties", {}).items():
            # The keys of an object of numbers carry the units of its values.
            if '"type": "number"' in json.dumps(node) and "additionalProperties" not in json.dumps(node):
                assert node.get("unit"), (name, field)


def test_the_document_names_no_outside_server(document: dict[str, Any]) -> None:
    assert "servers" not in document
    assert "http://" not in json.dumps(document)
    assert "https://" not in json.dumps(document)
