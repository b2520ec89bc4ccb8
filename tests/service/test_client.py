"""The client against a running application, and against servers that are busy, slow or strange."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.client import Client, Job, JobEnded, Problem
from service.settings import Settings


@pytest.fixture
def gainfield(tmp_path: Path) -> Iterator[Client]:
    with TestClient(create_app(Settings(data_dir=tmp_path))) as http, Client(http=http) as client:
        yield client


Answer = tuple[int, dict[str, Any]] | tuple[int, dict[str, Any], dict[str, str]]


def scripted(*answers: Answer) -> tuple[Client, list[httpx2.Request]]:
    """A client of a server that answers in this order, and what it was asked."""
    asked: list[httpx2.Request] = []
    waiting = list(answers)

    def serve(request: httpx2.Request) -> httpx2.Response:
        asked.append(request)
        status, document, *headers = waiting.pop(0)
        return httpx2.Response(status, json=document, headers=headers[0] if headers else None)

    return Client(http=httpx2.Client(base_url="http://test", transport=httpx2.MockTransport(serve))), asked


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """What was slept, without the sleep."""
    slept: list[float] = []
    monkeypatch.setattr(time, "sleep", slept.append)
    return slept


def job(state: str, done: int = 0, **more: Any) -> dict[str, Any]:
    progress = {"done": done, "total": 4}
    return {"id": "j1", "kind": "design", "state": state, "progress": progress, "result": None, "error": None} | more


def test_from_a_request_to_a_file(gainfield: Client, tmp_path: Path, wanted: Any) -> None:
    assert gainfield.example("wind_tunnel") == wanted
    design = gainfield.design(wanted)
    assert gainfield.read_design(design["id"]) == design
    assert gainfield.design(wanted) == design
    assert [one["id"] for one in gainfield.designs()] == [design["id"]]
    point = gainfield.point(design, 3)
    locus = gainfield.study(design, "nf", "root-locus", point=3, loop="K_p")
    gains = {gain["name"]: gain["value"] for gain in point["controllers"][0]["gains"]}
    assert locus["chosen_gain"] == pytest.approx(gains["K_p"])
    swept = gainfield.study(design["id"], "lqr", "frequency-response", point=3, from_=1.0, to=100.0)
    assert (swept["omega_rad_s"][0], swept["omega_rad_s"][-1]) == (1.0, 100.0)
    flown = {"manoeuvre": {"kind": "step", "aileron_deg": 5.0}, "duration_s": 1.0, "point": 3}
    assert gainfield.study(design, "lqr", "response", flown)["kind"] == "linear"
    saved = gainfield.save_schedule(design, "nf", tmp_path / "nf.npz")
    with np.load(saved) as table:
        assert table["K_p"].shape == tuple(design["grid"]["shape"])
    table = gainfield.schedule(design, "lqr", "json")
    assert table.startswith(b"{")


def test_pages_are_followed(gainfield: Client, quick: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"design {number}" for number in range(3)]
    for name in names:
        gainfield.design(quick | {"name": name})
    whole = gainfield.get
    monkeypatch.setattr(gainfield, "get", lambda path, **query: whole(path, **query, limit=2))
    assert [one["name"] for one in gainfield.designs()] == names[::-1]


def test_refusals_are_exceptions_in_words(gainfield: Client, quick: Any) -> None:
    quick["geometry"]["chord_m"] = -1.0
    with pytest.raises(Problem, match="/geometry/chord_m") as refused:
        gainfield.design(quick)
    assert (refused.value.status, refused.value.code) == (422, "invalid_request")
    assert refused.value.errors[0]["unit"] == "m"
    with pytest.raises(Problem, match="there is no design"):
        gainfield.read_design("0" * 32)


def test_a_job_is_waited_for(pauses: list[float]) -> None:
    client, asked = scripted(
        (202, job("queued")),
        (200, job("running", 1)),
        (200, job("running", 3)),
        (200, job("succeeded", 4, result="/v1/designs/d1")),
        (200, {"id": "d1"}),
    )
    seen: list[Job] = []
    assert client.design({"name": "large"}, progress=seen.append) == {"id": "d1"}
    assert [(one.state, one.done, one.total) for one in seen] == [
        ("running", 1, 4),
        ("running", 3, 4),
        ("succeeded", 4, 4),
    ]
    assert [request.url.path for request in asked[1:]] == ["/v1/jobs/j1"] * 3 + ["/v1/designs/d1"]
    assert asked[0].headers["idempotency-key"]
    assert pauses == sorted(pauses)


def test_a_file_that_a_job_writes_is_the_file(pauses: list[float]) -> None:
    client, asked = scripted(
        (202, job("queued")), (200, job("succeeded", 4, result="/v1/jobs/j1/result")), (200, {"proof": "proved"})
    )
    assert client.schedule("d1", "nf", "json", certificate="summary") == b'{"proof":"proved"}'
    assert asked[0].url.params["certificate"] == "summary"


@pytest.mark.parametrize(
    ("ended", "error"),
    [
        (job("failed", error={"status": 422, "code": "limit_exceeded", "detail": "too much", "errors": []}), Problem),
        (job("failed"), JobEnded),
        (job("cancelled"), JobEnded),
    ],
)
def test_a_job_that_ends_badly(ended: Any, error: type[Exception]) -> None:
    client, _ = scripted((202, job("queued")), (200, ended))
    with pytest.raises(error):
        client.design({})


def test_design_in_the_background() -> None:
    client, asked = scripted((202, job("queued")), (200, {"id": "d1"}))
    started = client.start_design({})
    assert isinstance(started, Job)
    assert not started.ended
    assert asked[0].headers["prefer"] == "respond-async"
    assert client.start_design({}) == {"id": "d1"}


def test_a_busy_server_is_asked_again(pauses: list[float]) -> None:
    busy: Answer = (429, {}, {"retry-after": "3"})
    client, asked = scripted(busy, (503, {}, {"retry-after": "1"}), (200, {"id": "d1"}))
    assert client.design({}) == {"id": "d1"}
    assert pauses == [3.0, 1.0]
    assert len({request.headers["idempotency-key"] for request in asked}) == 1


@pytest.mark.parametrize(
    ("answer", "tries"),
    [
        ((429, {}, {"retry-after": "1"}), 5),
        ((503, {}), 1),
        ((422, {}), 1),
        ((502, {}, {"content-type": "text/html"}), 1),
    ],
)
def test_and_not_for_ever(answer: Answer, tries: int, pauses: list[float]) -> None:
    client, asked = scripted(*[answer] * tries)
    with pytest.raises(Problem) as refused:
        client.get("/v1/version")
    assert (refused.value.status, refused.value.code) == (answer[0], "not_gainfield")
    assert len(asked) == tries == len(pauses) + 1


def test_ids_of_jobs(pauses: list[float]) -> None:
    client, asked = scripted(
        (200, {"items": [job("running")], "next_cursor": None}), (202, {}), (200, job("cancelled"))
    )
    (running,) = client.jobs()
    client.cancel(running)
    with pytest.raises(JobEnded, match="j1 cancelled"):
        client.wait("j1")
    assert [(request.method, request.url.path) for request in asked] == [
        ("GET", "/v1/jobs"),
        ("DELETE", "/v1/jobs/j1"),
        ("GET", "/v1/jobs/j1"),
    ]


def test_the_key_goes_with_every_request() -> None:
    client = Client("http://test", key="gf_1_secret")
    seen: Callable[[str], str | None] = client._http.headers.get
    assert seen("authorization") == "Bearer gf_1_secret"
    client.close()
