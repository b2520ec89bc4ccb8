"""The documentation's answers, groups, titles, symbols and shell lines: all there, and all as the service is."""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.routing import APIRoute
from fastapi.testclient import TestClient
from pydantic import TypeAdapter

from service.app import create_app
from service.documentation.answer_examples import ANSWERS, example_answer, file_name, marked, trimmed
from service.documentation.curl_lines import curl_line
from service.documentation.operation_titles import GROUPS, TITLES
from service.documentation.symbols import is_symbol
from service.examples import example
from service.routes import ROUTERS
from service.settings import Settings
from service.wire.units import unit_of
from tests.make_answer_examples import ids, live_answers, prepare
from tests.served import served
from tests.service.openapi_examples import operations


@pytest.fixture(scope="module")
def document(client: TestClient) -> dict[str, Any]:
    openapi: dict[str, Any] = client.get("/openapi.json").json()
    return openapi


def shape(value: Any) -> Any:
    """The fields of an answer and of what it holds; entries of lists as one, since numbers come and go."""
    if isinstance(value, dict):
        return {name: shape(held) for name, held in value.items()}
    if isinstance(value, list):
        return [shape(held) for held in value if isinstance(held, dict | list)]
    return None


def shown(document: dict[str, Any], path: str, method: str) -> Any:
    responses = document["paths"][path][method]["responses"]
    found = [responses[s]["content"]["application/json"] for s in ("200", "201") if s in responses]
    return found[0]["example"]


def test_every_answer_is_shown_as_it_is_given(client: TestClient, document: dict[str, Any]) -> None:
    """Each is valid for its model, and has the fields of what the service answers now."""
    prepare(client)
    routes = [route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute)]
    models = {(next(iter(route.methods)).lower(), route.path): route.response_model for route in routes}
    known = set()
    for method, path, answer in live_answers(client):
        kept = shown(document, path, method)
        known.add(file_name(method, path))
        if models[method, path] is not None:
            TypeAdapter(models[method, path]).validate_python(kept, strict=True)
        if path not in ("/v1/designs", "/v1/jobs", "/healthz", "/readyz"):  # lists of what others have posted
            assert shape(kept) == shape(trimmed(answer)), path
    assert {file.name for file in ANSWERS.glob("*.json")} == known
    assert len(known) > 50


def test_answers_name_the_designs_of_this_code(document: dict[str, Any]) -> None:
    text = json.dumps(document)
    assert "<design" not in text
    assert "<job>" not in text
    current = ids()["design wind_tunnel"]
    assert shown(document, "/v1/designs/{id}", "get")["id"] == current
    assert current not in "".join(file.read_text() for file in ANSWERS.glob("*.json"))


def test_marks_go_back_and_forth() -> None:
    text = marked({"id": "abc", "links": ["/v1/designs/abc"]}, {"design one": "abc"})
    assert "abc" not in text
    assert text.count("<design one>") == 2
    assert example_answer("get", "/nowhere", {}) is None
    assert trimmed({"a": [[1.0] * 9] * 9, "b": list(range(9))}) == {"a": [[1.0] * 4] * 2, "b": [0, 1, 2, 3]}


def test_every_operation_has_its_group_and_title(document: dict[str, Any]) -> None:
    found = {(method, path): operation for path, method, operation in operations(document)}
    assert set(found) == set(TITLES)
    titles = [operation["summary"] for operation in found.values()]
    assert len(set(titles)) == len(titles)
    for operation in found.values():
        summary = operation["summary"]
        assert 8 <= len(summary) <= 60
        assert summary[0].isupper()
        assert not summary.endswith(".")
        assert set(operation["tags"]) <= set(GROUPS)
    assert [tag["name"] for tag in document["tags"]] == list(GROUPS)
    assert {group for operation in found.values() for group in operation["tags"]} == set(GROUPS)


def test_every_number_states_its_unit_and_every_symbol_its_meaning(document: dict[str, Any]) -> None:
    """A name made of words says what it is; one that holds a symbol is described."""
    for name, schema in document["components"]["schemas"].items():
        for field, node in schema.get("properties", {}).items():
            branches = [node, *node.get("anyOf", [])]
            if any(one.get("type") == "number" for one in branches):
                assert node.get("unit"), (name, field)
                # Models may say more: deg/sqrt(Hz) of a noise, deg s of an integral.
                assert unit_of(field) == "1" or node["unit"].startswith(unit_of(field).split("/")[0]), (name, field)
            if is_symbol(field):
                assert node.get("description"), (name, field)
    for path, _, operation in operations(document):
        for parameter in operation.get("parameters", []):
            if parameter["schema"].get("type") == "number":
                assert parameter["schema"].get("unit"), (path, parameter["name"])
            assert parameter.get("description") or not is_symbol(parameter["name"]), (path, parameter["name"])


def test_what_is_a_symbol() -> None:
    assert all(map(is_symbol, ("A", "C_Ha_da", "T_a_n_m", "h2", "re", "omega_n_rad_s", "p05")))
    assert not any(map(is_symbol, ("chord_m", "peak_rate_deg_s", "settling_time_s_max", "id", "worst_point")))


def test_the_document_is_small_and_its_own_part_quick() -> None:
    app = create_app()
    begun = time.process_time()
    document = app.openapi()
    assert len(json.dumps(document, separators=(",", ":"))) < 1_500_000
    assert time.process_time() - begun < 6.0
    begun = time.process_time()
    assert app.openapi() is document
    assert time.process_time() - begun < 0.01


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A real server on a free port of this machine."""
    with served(Settings(data_dir=tmp_path_factory.mktemp("shell"))) as at:
        yield at


@pytest.mark.skipif(shutil.which("curl") is None, reason="there is no curl on this machine")
def test_shell_lines_run_as_they_stand(document: dict[str, Any], address: str) -> None:
    """In the order of a reader: post the example, then read of it, post to it, and forget it."""
    design = "/v1/designs/{id}"
    for method, path, field in (
        ("post", "/v1/designs", "controllers"),
        ("get", design, "controllers"),
        ("get", f"{design}/controllers/{{name}}/gains", "gains"),
        ("post", f"{design}/controllers/{{name}}/response", "signals"),
        ("post", "/v1/hinge-moments", "derivatives"),
        ("get", "/v1/atmosphere", "temperature_k"),
    ):
        (sample,) = document["paths"][path][method]["x-codeSamples"]
        ran = subprocess.run(
            ["bash", "-c", sample["source"]],
            env={"GAINFIELD": address, "PATH": "/usr/bin:/bin"},
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
        assert ran.returncode == 0, (path, ran.stderr)
        assert field in json.loads(ran.stdout), path


def test_shell_lines_show_the_key_where_one_is_asked_for() -> None:
    body = {"requestBody": {"content": {"application/json": {"examples": {"one": {"value": example("wind_tunnel")}}}}}}
    line = curl_line("post", "/v1/designs", body, keys=True)
    assert line.count('"Authorization: Bearer $GAINFIELD_KEY"') == 2
    assert "Authorization" not in curl_line("get", "/v1/limits", {}, keys=False)
