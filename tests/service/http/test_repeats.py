"""`Idempotency-Key`: the same again is answered the same, and nothing is locked for ever."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

import service.designs
import service.http.repeats
from schedules.run import run
from service.access.keys import add_key
from service.app import create_app
from service.settings import Settings
from service.store.repeated import KEPT_FOR, LOST_AFTER, KeptAnswer
from service.store.store import Store

KEY = {"Idempotency-Key": "order-1"}


@pytest.fixture
def own(tmp_path: Path) -> Iterator[TestClient]:
    with TestClient(create_app(Settings(data_dir=tmp_path)), raise_server_exceptions=False) as client:
        yield client


def test_the_same_status_headers_and_bytes(own: TestClient, quick: Any) -> None:
    first = own.post("/v1/designs", json=quick, headers=KEY)
    again = own.post("/v1/designs", json=quick, headers=KEY)
    plain = own.post("/v1/designs", json=quick)
    assert (first.status_code, again.status_code, plain.status_code) == (201, 201, 200)
    assert again.content == first.content
    assert again.headers["idempotency-replayed"] == "true"
    assert "idempotency-replayed" not in first.headers
    changing = {"date", "x-request-id", "server-timing", "idempotency-replayed"}
    assert {name: v for name, v in again.headers.items() if name not in changing} == {
        name: v for name, v in first.headers.items() if name not in changing
    }
    assert again.headers["x-request-id"] != first.headers["x-request-id"]
    assert again.headers["location"] == f"/v1/designs/{first.json()['id']}"


def test_another_request_under_the_key(own: TestClient, refused: Any, quick: Any) -> None:
    own.post("/v1/designs", json=quick, headers=KEY)
    for path, body in (("/v1/designs", quick | {"name": "other"}), ("/v1/linear-models", plant(quick))):
        problem = refused(own.post(path, json=body, headers=KEY), 422)
        assert (problem["code"], problem["errors"][0]["pointer"]) == ("repeated_differently", "/Idempotency-Key")
    refused(own.post("/v1/designs?x=1", json=quick, headers=KEY), 422)


def plant(quick: Any) -> Any:
    return {part: quick[part] for part in ("geometry", "inertia", "aerodynamics", "atmosphere", "trim", "grid")}


@pytest.mark.parametrize("key", [b"", b"x" * 201, b"a\tb", b"a\x7fb", "\u00e9".encode(), b"\xff"])
def test_keys_that_are_none(own: TestClient, refused: Any, quick: Any, key: bytes) -> None:
    problem = refused(own.post("/v1/designs", json=quick, headers={"Idempotency-Key": key}), 422)
    assert problem["errors"][0]["pointer"] == "/Idempotency-Key"
    assert own.get("/v1/designs").json()["items"] == []
    assert own.get("/v1/designs", headers={"Idempotency-Key": key}).status_code == 200


def test_two_keys_at_once(own: TestClient, refused: Any, quick: Any) -> None:
    headers = [("Idempotency-Key", "a"), ("Idempotency-Key", "b")]
    refused(own.post("/v1/designs", json=quick, headers=headers), 422)


def test_a_refusal_leaves_the_key_free(own: TestClient, refused: Any, quick: Any) -> None:
    refused(own.post("/v1/designs", json=quick | {"name": 3}, headers=KEY), 422)
    refused(own.post("/v1/designs", content=b"{", headers=KEY | {"Content-Type": "application/json"}), 400)
    assert own.post("/v1/designs", json=quick, headers=KEY).status_code == 201


def test_a_fault_leaves_the_key_free(
    own: TestClient, refused: Any, quick: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fault(study: Any) -> None:
        raise RuntimeError("a fault")

    with monkeypatch.context() as patched:
        patched.setattr(service.designs, "run", fault)
        refused(own.post("/v1/designs", json=quick, headers=KEY), 500)
    assert own.post("/v1/designs", json=quick, headers=KEY).status_code == 201


def test_many_at_once_are_one(own: TestClient, quick: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    begun, release = threading.Event(), threading.Event()

    def slow(study: Any) -> Any:
        begun.set()
        release.wait(20)
        return run(study)

    monkeypatch.setattr(service.designs, "run", slow)
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(own.post, "/v1/designs", json=quick, headers=KEY)
        assert begun.wait(20)
        for _ in range(3):
            meanwhile = own.post("/v1/designs", json=quick, headers=KEY)
            assert (meanwhile.status_code, meanwhile.json()["code"]) == (409, "repeated_too_soon")
            assert int(meanwhile.headers["retry-after"]) >= 1
        release.set()
        assert first.result().status_code == 201
    assert own.post("/v1/designs", json=quick, headers=KEY).content == first.result().content


def test_keys_are_of_their_owner(tmp_path: Path, quick: Any) -> None:
    with TestClient(create_app(Settings(data_dir=tmp_path, require_keys=True))) as client:
        store = client.app.state.shared.store.keys  # type: ignore[attr-defined]
        ann, bob = ({"X-API-Key": add_key(store, name).token} for name in ("ann", "bob"))
        assert client.post("/v1/designs", json=quick, headers=ann | KEY).status_code == 201
        other = client.post("/v1/designs", json=quick | {"name": "other"}, headers=bob | KEY)
        assert other.status_code == 201
        assert "idempotency-replayed" not in other.headers


def test_only_so_many_are_kept(tmp_path: Path, refused: Any, quick: Any) -> None:
    with TestClient(create_app(Settings(data_dir=tmp_path, max_repeatable_answers=2))) as client:
        for number in range(2):
            assert client.post("/v1/designs", json=quick, headers={"Idempotency-Key": str(number)}).status_code < 300
        response = client.post("/v1/designs", json=quick, headers={"Idempotency-Key": "one more"})
        assert "GAINFIELD_MAX_REPEATABLE_ANSWERS" in refused(response, 429)["detail"]
        assert client.post("/v1/designs", json=quick, headers={"Idempotency-Key": "0"}).status_code == 201


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    opened = Store(tmp_path)
    yield opened
    opened.close()


ANSWER = KeptAnswer(201, (("content-type", "application/json"),), b"{}")


def test_a_lost_first_is_replaced_and_cannot_speak_for_the_second(store: Store) -> None:
    kept = store.repeated
    assert kept.begin("ann", "k", "1" * 64, 1000.0, 9) == "first"
    assert kept.begin("ann", "k", "1" * 64, 1000.0 + LOST_AFTER - 1, 9) == "in_flight"
    kept.still_answering("ann", "k", "1" * 64, 1020.0)
    assert kept.begin("ann", "k", "1" * 64, 1020.0 + LOST_AFTER - 1, 9) == "in_flight"
    later = 1020.0 + LOST_AFTER + 1
    assert kept.begin("ann", "k", "2" * 64, later, 9) == "first"
    kept.keep("ann", "k", "1" * 64, ANSWER, later)
    kept.forget("ann", "k", "1" * 64)
    assert kept.begin("ann", "k", "2" * 64, later, 9) == "in_flight"


def test_kept_for_a_day(store: Store) -> None:
    kept = store.repeated
    assert kept.begin("ann", "k", "1" * 64, 0.0, 9) == "first"
    kept.keep("ann", "k", "1" * 64, ANSWER, 1.0)
    assert kept.begin("ann", "k", "1" * 64, KEPT_FOR, 9) == ANSWER
    kept.forget("ann", "k", "1" * 64)
    assert kept.begin("ann", "k", "2" * 64, KEPT_FOR, 9) == "different"
    assert kept.begin("ann", "k", "2" * 64, KEPT_FOR + 2.0, 9) == "first"


def test_one_of_many_processes_is_the_first(tmp_path: Path) -> None:
    stores = [Store(tmp_path) for _ in range(4)]
    with ThreadPoolExecutor(8) as pool:
        for number in range(10):
            turns = list(pool.map(lambda s, n=number: s.repeated.begin("ann", f"k{n}", "1" * 64, 0.0, 99), stores * 2))
            assert sorted(map(str, turns)) == ["first"] + ["in_flight"] * 7
    for one in stores:
        one.close()


def test_a_long_answer_says_that_it_is_not_lost(own: TestClient, quick: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service.http.repeats, "LOST_AFTER", 0.06)
    said, begin = threading.Event(), run
    kept = own.app.state.shared.store.repeated  # type: ignore[attr-defined]
    monkeypatch.setattr(kept, "still_answering", lambda *args: said.set())

    def slow(study: Any) -> Any:
        assert said.wait(20)
        return begin(study)

    monkeypatch.setattr(service.designs, "run", slow)
    assert own.post("/v1/designs", json=quick, headers=KEY).status_code == 201
