"""Keys: what opens, what does not, and what is never told or kept."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

import service.access.keys
from service.access.keys import KnownKeys, NewKey, add_key, list_keys, revoke_key
from service.access.rates import WRONG_KEYS_PER_MINUTE
from service.app import create_app
from service.settings import Settings
from service.store.store import Store


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[TestClient]:
    app = create_app(Settings(data_dir=tmp_path, require_keys=True))
    with TestClient(app, raise_server_exceptions=False) as client:
        yield client


def keys_of(client: TestClient) -> Any:
    return client.app.state.shared.store.keys  # type: ignore[attr-defined]


def bearer(new: NewKey) -> dict[str, str]:
    return {"Authorization": f"Bearer {new.token}"}


def test_a_key_opens_and_its_secret_is_kept_nowhere(guarded: TestClient, tmp_path: Path) -> None:
    new = add_key(keys_of(guarded), "flight-lab", "read")
    secret = new.token.rpartition("_")[2]
    assert len(bytes.fromhex(secret)) == 32
    assert new.key.digest == hashlib.sha256(secret.encode()).hexdigest()
    for headers in (bearer(new), {"X-API-Key": new.token}, {"authorization": f"bearer {new.token}"}):
        assert guarded.get("/v1/designs", headers=headers).status_code == 200
    kept = b"".join(path.read_bytes() for path in tmp_path.rglob("*") if path.is_file())
    assert new.key.digest.encode() in kept
    assert secret.encode() not in kept


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Authorization": "Basic Zm9vOmJhcg=="},
        {"Authorization": "Bearer"},
        {"Authorization": "Bearer gf_0123456789abcdef_" + "0" * 64},
        {"Authorization": "Bearer gf__"},
        {"X-API-Key": ""},
        {"X-API-Key": "gf_" + "\u0661" * 16 + "_" + "a" * 64},
        {"X-API-Key": "' OR 1=1 --"},
        {"X-API-Key": "a" * 10_000},
    ],
)
def test_what_opens_nothing(guarded: TestClient, refused: Any, headers: dict[str, str]) -> None:
    add_key(keys_of(guarded), "somebody")
    raw = {name: value.encode() for name, value in headers.items()}
    response = guarded.get("/v1/designs", headers=raw)
    assert refused(response, 401)["code"] == "unauthenticated"
    assert response.headers["www-authenticate"].startswith("Bearer ")
    assert response.headers["x-content-type-options"] == "nosniff"


def test_neither_part_opens_with_another(guarded: TestClient, refused: Any) -> None:
    one, other = add_key(keys_of(guarded), "one"), add_key(keys_of(guarded), "other")
    crossed = f"gf_{one.key.id}_{other.token.rpartition('_')[2]}"
    refused(guarded.get("/v1/designs", headers={"X-API-Key": crossed}), 401)
    refused(guarded.get("/v1/designs", headers={"X-API-Key": one.token, **bearer(other)}), 401)
    for changed in (one.token[:-1] + ("0" if one.token[-1] != "0" else "1"), one.token.upper(), one.token + "0"):
        refused(guarded.get("/v1/designs", headers={"X-API-Key": changed}), 401)


def test_an_unknown_id_is_compared_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compared = []

    def counted(one: str, other: str) -> bool:
        compared.append((len(one), len(other)))
        return one == other

    monkeypatch.setattr(service.access.keys.hmac, "compare_digest", counted)
    store = Store(tmp_path)
    new = add_key(store.keys, "somebody")
    known = KnownKeys(store.keys)
    for token in (new.token, f"gf_{'0' * 16}_{'0' * 64}", "nonsense"):
        known.looked_up(token)
    assert compared == [(64, 64)] * 3
    store.close()


def test_scopes(guarded: TestClient, refused: Any, quick: Any) -> None:
    store = keys_of(guarded)
    keys = {scope: add_key(store, scope, scope) for scope in ("read", "write", "admin")}  # type: ignore[arg-type]
    problem = refused(guarded.post("/v1/designs", json=quick, headers=bearer(keys["read"])), 403)
    assert (problem["code"], "write" in problem["detail"]) == ("not_allowed", True)
    assert guarded.post("/v1/designs", json=quick, headers=bearer(keys["write"])).status_code == 201
    refused(guarded.get("/metrics", headers=bearer(keys["write"])), 403)
    assert guarded.get("/metrics", headers=bearer(keys["admin"])).status_code == 200
    assert guarded.head("/v1/designs", headers=bearer(keys["read"])).status_code == 200
    refused(guarded.delete("/v1/designs", headers=bearer(keys["read"])), 403)


def test_a_revoked_key(guarded: TestClient, refused: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    store = keys_of(guarded)
    new = add_key(store, "leaver")
    assert guarded.get("/v1/designs", headers=bearer(new)).status_code == 200
    assert revoke_key(store, new.key.id)
    assert not revoke_key(store, new.key.id)
    assert not revoke_key(store, "unknown")
    now = service.access.keys.time.monotonic()
    monkeypatch.setattr(service.access.keys.time, "monotonic", lambda: now + service.access.keys.GOOD_FOR + 0.01)
    refused(guarded.get("/v1/designs", headers=bearer(new)), 401)
    (listed,) = list_keys(store)
    assert listed.revoked_at is not None


def test_what_is_open_to_everybody(guarded: TestClient, refused: Any) -> None:
    for path in ("/healthz", "/readyz", "/v1/version", "/docs", "/redoc", "/openapi.json"):
        assert guarded.get(path).status_code == 200, path
    for path in ("/v1/limits", "/metrics", "/v1/nowhere", "/anything", "//v1/designs", "/v1/designs/", "/docs/x"):
        refused(guarded.get(path), 401)
    refused(guarded.post("/healthz"), 401)


def test_openapi_has_a_security_scheme_only_with_keys(guarded: TestClient, client: TestClient) -> None:
    document = guarded.get("/openapi.json").json()
    assert document["components"]["securitySchemes"]["bearer"]["scheme"] == "bearer"
    assert document["paths"]["/v1/designs"]["post"]["security"] == [{"bearer": []}, {"key": []}]
    assert {"401", "403", "429"} <= set(document["paths"]["/v1/designs"]["post"]["responses"])
    assert "security" not in document["paths"]["/healthz"]["get"]
    without = client.get("/openapi.json").json()
    assert "securitySchemes" not in without["components"]
    assert "security" not in without["paths"]["/v1/designs"]["post"]


def test_guessing_is_slowed_and_known_keys_go_on(guarded: TestClient, refused: Any) -> None:
    store = keys_of(guarded)
    good, later = add_key(store, "good"), add_key(store, "later")
    assert guarded.get("/v1/designs", headers=bearer(good)).status_code == 200
    for number in range(WRONG_KEYS_PER_MINUTE):
        refused(guarded.get("/v1/designs", headers={"X-API-Key": f"gf_{number:016x}_{'0' * 64}"}), 401)
    response = guarded.get("/v1/designs", headers={"X-API-Key": f"gf_{'f' * 16}_{'0' * 64}"})
    assert refused(response, 429)["code"] == "too_many_requests"
    assert 1 <= int(response.headers["retry-after"]) <= 60
    refused(guarded.get("/v1/designs", headers=bearer(later)), 429)
    assert guarded.get("/v1/designs", headers=bearer(good)).status_code == 200


@pytest.mark.parametrize(
    "wrong",
    [
        {"name": ""},
        {"name": "a b"},
        {"name": "x" * 65},
        {"name": "x\n"},
        {"name": "x", "scope": "root"},
        {"name": "x", "requests_per_minute": 0},
        {"name": "x", "max_stored_bytes": -1},
    ],
)
def test_keys_that_cannot_be(tmp_path: Path, wrong: Any) -> None:
    store = Store(tmp_path)
    with pytest.raises(ValueError, match="key"):
        add_key(store.keys, **wrong)
    assert list_keys(store.keys) == []
    store.close()
