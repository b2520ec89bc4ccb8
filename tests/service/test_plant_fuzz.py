"""Random damage to the examples of every route about the plant: never a 500, always a known shape."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service.documentation.body_examples import BODIES
from service.examples import NAMES, example
from tests.service.openapi_examples import address, operations

JSON = {"Content-Type": "application/json"}
#: Searches take seconds; their own tests damage them.
SEARCHES = ("weight-search", "trade-off", "inverse-sizing", "refinement")
EXAMPLES = [
    (path, shown["value"])
    for path, examples in BODIES.items()
    if not path.endswith(SEARCHES)
    for shown in examples().values()
]

NUMBERS = st.sampled_from([0, -1, 1e-9, 0.5, 1, 30, 60, 90, 1e3, 1e9, 1e308, 5e-324, 10**400]) | st.floats()
WORDS = st.sampled_from(["zero_aileron_torque", "table", "taylor", "cubic", "unsteady", "\ud800", "", "/grid/mach"])
ANYTHING = st.recursive(
    st.none() | st.booleans() | NUMBERS | WORDS | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)


@pytest.fixture(scope="module")
def addresses(client: TestClient) -> dict[str, str]:
    """Where each body is posted to: below a design, that of the example."""
    client.post("/v1/designs", json=example(NAMES[0]))
    document = client.get("/openapi.json").json()
    return {path: address(path, operation)[0] for path, method, operation in operations(document) if method == "post"}


def places(document: Any, pointer: str = "") -> Iterator[str]:
    """Pointers to everything inside a document."""
    items = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    for key, value in items:
        yield f"{pointer}/{key}"
        yield from places(value, f"{pointer}/{key}")


def put(document: Any, pointer: str, value: Any) -> None:
    *parents, last = pointer.split("/")[1:]
    place = document
    for part in parents:
        place = place[int(part) if isinstance(place, list) else part]
    place[int(last) if isinstance(place, list) else last] = value


@st.composite
def damaged(draw: st.DrawFn) -> tuple[str, Any]:
    path, example = draw(st.sampled_from(EXAMPLES))
    document = copy.deepcopy(example)
    for _ in range(draw(st.integers(1, 3))):
        pointer = draw(st.sampled_from(sorted(places(example))))
        with suppress(KeyError, IndexError, TypeError, ValueError):  # already gone with what held it
            put(document, pointer, draw(NUMBERS | ANYTHING))
    return path, document


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(body=damaged())
def test_random_values_anywhere(
    client: TestClient, refused: Any, addresses: dict[str, str], body: tuple[str, Any]
) -> None:
    path, document = body
    response = client.post(addresses[path], content=json.dumps(document), headers=JSON)
    if response.status_code == 409:
        assert refused(response, 409)["code"] in ("study_not_possible", "no_design_at_point")
    elif response.status_code not in (200, 201):
        problem = refused(response, 422)
        assert problem["errors"] or problem["code"] == "invalid_request"
