"""Jobs over HTTP: asked for by preference or by size, watched, cancelled, and their results."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from pydantic import TypeAdapter

from schedules.flown_figures import MOST_DELAYED_LOOPS, MOST_LOOPS
from service.app import create_app
from service.limits import of_jobs
from service.schemas.jobs import Job, JobList
from service.settings import Settings

ASYNC = {"Prefer": "respond-async"}


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("jobs"), max_tab_only_designs=4, job_work_factor=10)
    with TestClient(create_app(settings), raise_server_exceptions=False) as running:
        yield running


def events(client: TestClient, job: str, last: str | None = None) -> list[dict[str, str]]:
    headers = {} if last is None else {"Last-Event-ID": last}
    with client.stream("GET", f"/v1/jobs/{job}/events", headers=headers) as stream:
        assert stream.status_code == 200
        assert stream.headers["content-type"].startswith("text/event-stream")
        text = "".join(stream.iter_text())
    blocks = [block for block in text.split("\n\n") if block and not block.startswith(":")]
    return [dict(line.split(": ", 1) for line in block.splitlines()) for block in blocks]


def finished(client: TestClient, job: str) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(events(client, job)[-1]["data"])
    return document


@pytest.fixture(scope="module")
def made(here: TestClient, large: Any) -> str:
    return str(here.post("/v1/designs", json=large(3, "nf", "lqr")).json()["id"])


def test_a_design_as_a_job(here: TestClient, large: Any) -> None:
    wanted = large(2, "nf", "lqr")
    answer = here.post("/v1/designs", json=wanted, headers={"Prefer": "handling=lenient, Respond-Async; x=1"})
    assert answer.status_code == 202, answer.text
    job = TypeAdapter(Job).validate_python(answer.json(), strict=True)
    assert answer.headers["location"] == job.links.self == f"/v1/jobs/{job.id}"
    assert (answer.headers["retry-after"], answer.headers["preference-applied"]) == ("1", "respond-async")
    seen = events(here, job.id)
    documents = [json.loads(event["data"]) for event in seen]
    assert [document["state"] for document in documents] == [event["event"] for event in seen]
    assert seen[-1]["event"] == "succeeded"
    ids = [int(event["id"]) for event in seen]
    assert ids == sorted(set(ids))
    last = TypeAdapter(Job).validate_python(documents[-1], strict=True)
    assert (last.progress.done, last.progress.total, last.progress.time_left_s, last.error) == (2, 2, 0.0, None)
    assert here.get(f"/v1/jobs/{job.id}").json() == documents[-1]
    assert events(here, job.id, str(ids[-1])) == []
    assert [event["id"] for event in events(here, job.id, "nonsense")] == [seen[-1]["id"]]
    design = here.get(str(last.result))
    assert design.json()["provenance"]["created_at"] == last.created_at
    assert here.get(last.links.result).content == design.content
    # It is there now: asked for again, in whichever way, it is the same bytes at once.
    again = here.post("/v1/designs", json=wanted, headers=ASYNC)
    assert (again.status_code, again.content) == (200, design.content)
    point = here.get(f"{last.result}/points/1")
    assert point.status_code == 200


def test_any_heavy_answer_as_a_job(here: TestClient, made: str) -> None:
    for path in (f"/v1/designs/{made}/controllers/nf/design-margin", f"/v1/designs/{made}/schedules/nf.csv"):
        first, second = (here.get(path, headers=ASYNC) for _ in range(2))
        assert (first.status_code, second.status_code) == (202, 202)
        assert first.json()["id"] == second.json()["id"]
        job = finished(here, first.json()["id"])
        assert job["state"] == "succeeded", job
        result, direct = here.get(job["result"]), here.get(path, headers={"Prefer": "wait=60"})
        assert direct.status_code == 200
        assert result.content == direct.content
        for name in ("content-type", "etag", "content-disposition"):
            assert result.headers.get(name) == direct.headers.get(name)
        assert here.get(job["result"], headers={"If-None-Match": result.headers["etag"]}).status_code == 304


def test_every_spelling_of_a_body_is_one_job(here: TestClient, large: Any) -> None:
    wanted = large(2, "nf")
    body = {name: wanted[name] for name in ("geometry", "inertia", "aerodynamics", "atmosphere", "trim", "grid")}
    headers = ASYNC | {"Content-Type": "application/json"}
    spelt = [json.dumps(body), json.dumps(dict(reversed(body.items())), indent=2)]
    jobs = [here.post("/v1/linear-models", content=text, headers=headers).json()["id"] for text in spelt]
    assert jobs[0] == jobs[1]
    assert finished(here, jobs[0])["state"] == "succeeded"
    assert here.get(f"/v1/jobs/{jobs[0]}/result").json() == here.post("/v1/linear-models", json=body).json()


def test_wrong_requests_are_refused_at_once(here: TestClient, made: str, large: Any, refused: Any) -> None:
    before = here.get("/v1/jobs").json()["items"]
    wrong = large(2, "nf") | {"name": 7}
    assert refused(here.post("/v1/designs", json=wrong, headers=ASYNC), 422)["errors"][0]["pointer"] == "/name"
    refused(here.post("/v1/designs", content=b"{", headers=ASYNC | {"Content-Type": "application/json"}), 400)
    nowhere = f"/v1/designs/{'0' * 32}/controllers/nf/verdicts"
    refused(here.get(nowhere, headers=ASYNC), 404)
    compare = f"/v1/designs/{made}/compare?with={'0' * 32}"
    refused(here.get(compare, headers=ASYNC), 404)
    bad = f"/v1/designs/{made}/controllers/nf/frequency-response?nonsense=1"
    refused(here.get(bad, headers=ASYNC), 422)
    assert here.get("/v1/jobs").json()["items"] == before


def test_a_refusal_of_the_domain_is_the_error_of_the_job(here: TestClient, made: str, refused: Any) -> None:
    path = f"/v1/designs/{made}/controllers/none/verdicts"
    job = finished(here, here.get(path, headers=ASYNC).json()["id"])
    assert job["state"] == "failed"
    assert job["error"] == refused(here.get(path), 404)
    assert refused(here.get(job["links"]["result"]), 409)["code"] == "no_result"
    again = here.get(path, headers=ASYNC).json()
    assert again["id"] == job["id"]
    assert again["state"] in ("queued", "running", "failed")


def test_more_than_is_done_in_line_becomes_a_job_within_its_limit(here: TestClient, large: Any, refused: Any) -> None:
    answer = here.post("/v1/designs", json=large(5, "nf"), headers={"Prefer": "wait=60"})
    assert (answer.status_code, "preference-applied" in answer.headers) == (202, False)
    assert finished(here, answer.json()["id"])["state"] == "succeeded"
    problem = refused(here.post("/v1/designs", json=large(41, "nf")), 422)
    assert problem["code"] == "limit_exceeded"
    for words in ("max_tab_only_designs", "GAINFIELD_JOB_WORK_FACTOR", "40 at most"):
        assert words in problem["detail"]
    limits = {limit["name"]: limit["value"] for limit in here.get("/v1/limits").json()["limits"]}
    assert (limits["job_work_factor"], limits["max_queued_jobs"]) == (10, 100)


def test_what_is_asked_of_a_design_too_large_to_be_made_in_line_is_a_job(tmp_path: Path, large: Any) -> None:
    """Made by a job, it is not made again in the server for what is asked of it; smaller ones are."""
    wanted = large(6, "lqr")
    settings = Settings(data_dir=tmp_path / "small", max_point_designs=5, job_work_factor=2)
    with TestClient(create_app(settings)) as client:
        answer = client.post("/v1/designs", json=wanted)
        assert answer.status_code == 202
        design = str(finished(client, answer.json()["id"])["result"])
        assert client.get(design).status_code == 200
        answers = {}
        for path in ("controllers/lqr/figures", "points", "points/2", "schedules/lqr.json", "report"):
            answer = client.get(f"{design}/{path}")
            assert answer.status_code == 202, path
            job = finished(client, answer.json()["id"])
            assert job["state"] == "succeeded", job
            answers[path] = client.get(job["links"]["result"])
        ident = client.post("/v1/designs", json=large(5, "lqr")).json()["id"]
        assert client.get(f"/v1/designs/{ident}/controllers/lqr/figures").status_code == 200
    with TestClient(create_app(Settings(data_dir=tmp_path / "wide"))) as client:
        ident = client.post("/v1/designs", json=wanted).json()["id"]
        figures = client.get(f"/v1/designs/{ident}/controllers/lqr/figures")
    assert design.endswith(ident)
    assert answers["controllers/lqr/figures"].content == figures.content
    assert answers["report"].headers["content-type"].startswith("text/html")
    assert len(answers["points"].content.splitlines()) == 6


def test_the_domain_flies_what_a_job_may_fly() -> None:
    widest = of_jobs(Settings())
    assert widest.max_flown_loops <= MOST_LOOPS
    assert widest.max_delayed_loops <= MOST_DELAYED_LOOPS


def test_heavy_answers_above_their_limit_become_jobs(tmp_path: Path, large: Any, refused: Any) -> None:
    settings = Settings(data_dir=tmp_path, max_flown_loops=4, job_work_factor=3)
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        ident = client.post("/v1/designs", json=large(2, "lqr")).json()["id"]
        path = f"/v1/designs/{ident}/controllers/lqr/robust-performance?method=monte_carlo&draws="
        in_line, as_job, too_much = (client.get(f"{path}{draws}") for draws in (2, 6, 7))
        assert in_line.status_code == 200
        assert as_job.status_code == 202, as_job.text
        job = finished(client, as_job.json()["id"])
        assert job["state"] == "succeeded", job
        assert client.get(job["result"]).json().keys() == in_line.json().keys()
        assert "max_flown_loops" in refused(too_much, 422)["detail"]


def test_cancelling_and_forgetting(here: TestClient, large: Any, refused: Any) -> None:
    job = here.post("/v1/designs", json=large(40, "nf") | {"name": "cancelled"}, headers=ASYNC).json()
    asked = here.delete(f"/v1/jobs/{job['id']}")
    assert asked.status_code in (200, 202)
    assert asked.json()["state"] == ("cancelling" if asked.status_code == 202 else "cancelled")
    ended = finished(here, job["id"])
    assert (ended["state"], ended["result"], ended["error"]) == ("cancelled", None, None)
    refused(here.get(ended["links"]["result"]), 409)
    assert here.delete(f"/v1/jobs/{job['id']}").status_code == 204
    for path in ("", "/events", "/result"):
        refused(here.get(f"/v1/jobs/{job['id']}{path}"), 404)
    refused(here.delete(f"/v1/jobs/{job['id']}"), 404)


def test_the_list_in_pages(here: TestClient, refused: Any) -> None:
    whole = here.get("/v1/jobs").json()
    TypeAdapter(JobList).validate_python(whole, strict=True)
    seen, cursor = [], ""
    while cursor is not None:
        page = here.get(f"/v1/jobs?limit=2{cursor and '&cursor=' + cursor}").json()
        seen += page["items"]
        cursor = page["next_cursor"]
    assert [job["id"] for job in seen] == [job["id"] for job in whole["items"]]
    assert len(seen) >= 4
    for bad in ("limit=0", "limit=100000", "cursor=d1", "cursor=j", "cursor=j1x", "cursor=j" + "9" * 30, "x=1"):
        refused(here.get(f"/v1/jobs?{bad}"), 422)


def test_a_full_queue_says_when_to_come_again(tmp_path: Path, large: Any, refused: Any) -> None:
    settings = Settings(data_dir=tmp_path, max_queued_jobs=1, max_running_jobs=1)
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        answers = [
            client.post("/v1/designs", json=large(400, "nf") | {"name": f"{number}"}, headers=ASYNC)
            for number in range(4)
        ]
        full = next(answer for answer in answers if answer.status_code != 202)
        problem = refused(full, 429)
        assert (problem["code"], full.headers["retry-after"]) == ("queue_full", "1")
        assert "GAINFIELD_MAX_QUEUED_JOBS" in problem["detail"]


def test_an_unsafe_cluster_is_refused_at_start(tmp_path: Path) -> None:
    app = create_app(Settings(data_dir=tmp_path, dask="tcp://192.0.2.1:8786"))
    with pytest.raises(ValueError, match="GAINFIELD_DASK_ALLOW_INSECURE"), TestClient(app):
        pass
