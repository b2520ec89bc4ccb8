"""`gainfield keys`: what it makes opens a server, and what it revokes does not."""

from __future__ import annotations

import json
import time
import urllib.error
from pathlib import Path

from tests.service.cli.command import done, misused, refused
from tests.service.http.running import Running, server


def _status(running: Running, token: str) -> int:
    try:
        return running.get("/v1/designs", Authorization=f"Bearer {token}")[0]
    except urllib.error.HTTPError as error:
        with error:
            return error.code


def test_keys_open_a_server_until_they_are_revoked(tmp_path: Path, request_file: Path) -> None:
    token = done("keys", "add", "alice", "--data-dir", tmp_path).strip()
    made = json.loads(done("keys", "add", "bob", "--scope", "read", "--data-dir", tmp_path, "--json"))
    with server(tmp_path, require_keys="true") as running:
        assert (_status(running, token), _status(running, made["key"]), _status(running, "")) == (200, 200, 401)
        address = f"http://127.0.0.1:{running.port}"
        assert refused("design", request_file, "--server", address, "--key", made["key"])["code"] == "not_allowed"
        assert refused("design", request_file, "--server", address)["code"] == "unauthenticated"
        done("keys", "revoke", made["id"], "--data-dir", tmp_path)
        deadline = time.monotonic() + 20.0
        while _status(running, made["key"]) != 401:
            assert time.monotonic() < deadline
            time.sleep(0.2)
    listed = json.loads(done("keys", "list", "--data-dir", tmp_path, "--json"))
    assert [(key["name"], key["scope"], key["revoked_at"] is None) for key in listed] == [
        ("alice", "write", True), ("bob", "read", False),
    ]  # fmt: skip
    words = done("keys", "list", "--data-dir", tmp_path)
    assert token.rpartition("_")[2] not in words + json.dumps(listed)
    assert "revoked" in words.splitlines()[1]
    assert refused("keys", "revoke", made["id"], "--data-dir", tmp_path)["code"] == "no_key"


def test_limits_are_kept(tmp_path: Path) -> None:
    done("keys", "add", "c", "--requests-per-minute", "5", "--max-stored-bytes", "7", "--data-dir", tmp_path)
    (key,) = json.loads(done("keys", "list", "--data-dir", tmp_path, "--json"))
    assert (key["requests_per_minute"], key["max_stored_bytes"]) == (5, 7)


def test_keys_that_none_can_be(tmp_path: Path) -> None:
    assert "letters" in misused("keys", "add", "??", "--data-dir", tmp_path)
    assert "one of read, write, admin" in misused("keys", "add", "d", "--scope", "all", "--data-dir", tmp_path)
    for wrong in ("0", "-1", "x", str(2**31)):
        misused("keys", "add", "d", "--requests-per-minute", wrong, "--data-dir", tmp_path)
    misused("keys", "add", "d", "--max-stored-bytes", str(2**63), "--data-dir", tmp_path)
