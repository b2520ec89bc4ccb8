"""Whose designs are seen, how much each may keep, and how often each may ask."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.access.exposure import Exposed, check_exposure, is_loopback, keys_required
from service.access.keys import add_key
from service.access.principals import ANYBODY, OPERATOR
from service.access.rates import Rates, block_of
from service.app import create_app
from service.settings import Settings


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[TestClient]:
    with TestClient(create_app(Settings(data_dir=tmp_path, require_keys=True))) as client:
        yield client


def key(client: TestClient, name: str, scope: Any = "write", **limits: int) -> dict[str, str]:
    store = client.app.state.shared.store.keys  # type: ignore[attr-defined]
    return {"X-API-Key": add_key(store, name, scope, **limits).token}


def ids(client: TestClient, headers: dict[str, str]) -> list[str]:
    return [one["id"] for one in client.get("/v1/designs", headers=headers).json()["items"]]


def test_each_sees_their_own(guarded: TestClient, refused: Any, quick: Any) -> None:
    ann, bob, admin = key(guarded, "ann"), key(guarded, "bob"), key(guarded, "boss", "admin")
    ident = guarded.post("/v1/designs", json=quick, headers=ann).json()["id"]
    assert (ids(guarded, ann), ids(guarded, bob), ids(guarded, admin)) == ([ident], [], [ident])
    for path in ("", "/points", "/points/0", "/schedules/lqr.csv", "/verification", "/actuation-comparison"):
        where = f"/v1/designs/{ident}{path}"
        theirs = refused(guarded.get(where, headers=bob), 404)
        nobodys = refused(guarded.get(where.replace(ident, "0" * 32), headers=bob), 404)
        assert theirs["detail"].replace(ident, "0" * 32) == nobodys["detail"]
        assert guarded.get(where, headers=ann).status_code == 200, path
    assert guarded.get(f"/v1/designs/{ident}", headers=admin).status_code == 200
    refused(guarded.post("/v1/schedules/verify", json=verify_body(ident), headers=bob), 404)


def verify_body(ident: str) -> dict[str, Any]:
    from service.documentation.body_examples import BODIES

    bodies = [example["value"] for example in BODIES["/v1/schedules/verify"]().values()]
    body = next(one for one in bodies if "design_id" in one or "design" in one)
    return {**{name: value for name, value in body.items() if name != "design"}, "design_id": ident}


def test_the_same_request_of_two_is_one_design_of_both(guarded: TestClient, quick: Any) -> None:
    ann, bob = key(guarded, "ann"), key(guarded, "bob")
    first = guarded.post("/v1/designs", json=quick, headers=ann)
    again = guarded.post("/v1/designs", json=quick, headers=bob)
    assert again.content == first.content
    assert ids(guarded, bob) == ids(guarded, ann) == [first.json()["id"]]


def test_keys_of_one_name_share(guarded: TestClient, quick: Any) -> None:
    old, new = key(guarded, "team"), key(guarded, "team", "read")
    ident = guarded.post("/v1/designs", json=quick, headers=old).json()["id"]
    assert ids(guarded, new) == [ident]


def test_the_quota_is_of_the_owner_and_names_itself(guarded: TestClient, refused: Any, quick: Any) -> None:
    ann, bob = key(guarded, "ann", max_stored_bytes=1), key(guarded, "bob")
    first = guarded.post("/v1/designs", json=quick, headers=ann)
    assert first.status_code == 201
    other = quick | {"name": "another"}
    problem = refused(guarded.post("/v1/designs", json=other, headers=ann), 413)
    assert (problem["code"], "max_stored_bytes" in problem["detail"]) == ("quota_exceeded", True)
    assert guarded.post("/v1/designs", json=quick, headers=ann).content == first.content
    assert guarded.post("/v1/designs", json=other, headers=bob).status_code == 201
    refused(guarded.post("/v1/designs", json=other, headers=ann), 413)
    assert len(ids(guarded, ann)) == 1


def test_the_rate_of_a_key(guarded: TestClient, refused: Any) -> None:
    ann, bob = key(guarded, "ann", requests_per_minute=3), key(guarded, "bob", requests_per_minute=3)
    for left in (2, 1, 0):
        response = guarded.get("/v1/limits", headers=ann)
        assert response.status_code == 200
        assert response.headers["ratelimit"].startswith(f'"minute";r={left};t=')
        assert response.headers["ratelimit-policy"] == '"minute";q=3;w=60'
    response = guarded.get("/v1/limits", headers=ann)
    refused(response, 429)
    assert 1 <= int(response.headers["retry-after"]) <= 60
    assert response.headers["ratelimit"].startswith('"minute";r=0;')
    assert guarded.get("/v1/limits", headers=bob).status_code == 200
    assert guarded.get("/healthz", headers=ann).status_code == 200


def test_the_rate_is_not_passed_by_many_at_once(guarded: TestClient) -> None:
    ann, found = key(guarded, "ann", requests_per_minute=10), []
    threads = [
        threading.Thread(target=lambda: found.append(guarded.get("/v1/limits", headers=ann).status_code))
        for _ in range(25)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(found) == [200] * 10 + [429] * 15


def test_the_rate_of_an_address(tmp_path: Path, refused: Any) -> None:
    settings = Settings(data_dir=tmp_path, anonymous_requests_per_minute=2)
    with TestClient(create_app(settings)) as client:
        assert [client.get("/v1/limits").status_code for _ in range(3)] == [200, 200, 429]
        assert client.get("/v1/version").status_code == 200


def test_addresses_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    now = time.time()
    monkeypatch.setattr("limits.storage.memory.time.time", lambda: now)  # the storage forgets by itself, too
    rates = Rates()
    for number in range(2000):
        rates.wrong_key(f"10.0.{number // 256}.{number % 256}")
        rates.of_address(f"2001:db8:{number:x}::1", 5)
    storage: Any = rates._fixed.storage
    assert len(storage.storage) == 4000
    monkeypatch.setattr("limits.storage.memory.time.time", lambda: now + 61.0)
    # The storage sweeps in a thread of its own, which a count sets going.
    deadline = time.monotonic() + 30.0
    while len(storage.storage) > 1:
        assert time.monotonic() < deadline, len(storage.storage)
        rates.wrong_key("10.9.9.9")
        time.sleep(0.02)
    assert len(storage.expirations) <= 1
    assert len(storage.events) == 0


@pytest.mark.parametrize(
    ("address", "block"),
    [
        ("10.1.2.3", "10.1.2.3"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
        ("::ffff:10.1.2.3", "10.1.2.3"),
        ("fe80::1%eth0", "fe80::"),
        ("testclient", "unknown"),
    ],
)
def test_blocks_of_addresses(address: str, block: str) -> None:
    assert block_of(address) == block


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "::1", "[::1]", "localhost", "LOCALHOST"])
def test_loopback(host: str) -> None:
    settings = Settings(host=host)
    assert is_loopback(host)
    assert not keys_required(settings)
    check_exposure(settings, any_keys=False)


@pytest.mark.parametrize(
    "host", ["0.0.0.0", "::", "", "10.0.0.1", "example.org", "localhost.example.org", "127.0.0.1.x"]
)
def test_elsewhere_only_with_keys_or_openly(host: str) -> None:
    assert keys_required(Settings(host=host))
    with pytest.raises(Exposed, match="keys are required"):
        check_exposure(Settings(host=host), any_keys=False)
    check_exposure(Settings(host=host), any_keys=True)
    check_exposure(Settings(host=host, allow_anonymous=True), any_keys=False)
    with pytest.raises(Exposed, match="GAINFIELD_ALLOW_ANONYMOUS"):
        check_exposure(Settings(host=host, require_keys=False), any_keys=True)
    with pytest.raises(Exposed, match="keys are required"):
        check_exposure(Settings(host=host, require_keys=True, allow_anonymous=True), any_keys=False)


def test_who_asks_without_a_key_is_no_admin_where_anybody_may(tmp_path: Path, quick: Any) -> None:
    assert (OPERATOR.sees, ANYBODY.sees) == (None, "local")
    settings = Settings(data_dir=tmp_path, host="0.0.0.0", allow_anonymous=True)
    with TestClient(create_app(settings)) as client:
        ann = key(client, "ann")
        ident = client.post("/v1/designs", json=quick, headers=ann).json()["id"]
        assert client.get("/v1/designs").json()["items"] == []
        assert client.get(f"/v1/designs/{ident}").status_code == 404
        assert client.get(f"/v1/designs/{ident}", headers=ann).status_code == 200
