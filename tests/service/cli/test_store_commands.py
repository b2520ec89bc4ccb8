"""`gainfield check`, `backup`, `export` and `migrate`, on real data directories, on PostgreSQL, and beside a server."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.service.cli.command import done, misused, refused, run
from tests.service.http.running import server
from tests.service.store.postgresql import Server, binaries, running


def _blobs(data: Path) -> list[Path]:
    return sorted(path for path in (data / "files").rglob("*") if path.is_file() and len(path.name) == 64)


def test_check_tells_what_is_damaged(stored: Path) -> None:
    assert done("check", "--data-dir", stored) == "the store is whole\n"
    assert json.loads(done("check", "--data-dir", stored, "--json")) == {"findings": []}
    blob = _blobs(stored)[0]
    content = blob.read_bytes()
    os.chmod(blob, 0o600)
    blob.write_bytes(b"x" + content[1:])
    assert run("check", "--data-dir", stored, "--quick").exit_code == 0
    result = run("check", "--data-dir", stored)
    assert result.exit_code == 1
    assert blob.name in result.stderr
    blob.unlink()
    result = run("check", "--data-dir", stored, "--quick", "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["findings"] == [{"subject": "file", "name": blob.name, "detail": "it is missing"}]


def test_a_backup_of_a_server_at_work_is_a_store(tmp_path: Path, quick: dict[str, Any]) -> None:
    with server(tmp_path) as serving:
        serving.post("/v1/designs", quick)
        target = tmp_path / "copies" / "monday"
        said = json.loads(done("backup", target, "--data-dir", tmp_path, "--json"))
        assert said["database"]
        assert said["files"] > 0
        assert said["findings"] == []
        assert "exists" in refused("backup", target, "--data-dir", tmp_path)["detail"]
    assert done("check", "--data-dir", target) == "the store is whole\n"
    archive = tmp_path / "designs.zip"
    assert done("export", archive, "--data-dir", target) == f"{archive}: 1 designs\n"
    with zipfile.ZipFile(archive) as content:
        assert len(json.loads(content.read("index.json"))["designs"]) == 1


def test_a_backup_of_damaged_files_says_so(tmp_path: Path, stored: Path) -> None:
    _blobs(stored)[0].unlink()
    result = run("backup", tmp_path / "copy", "--data-dir", stored)
    assert result.exit_code == 1
    assert "it is missing" in result.stderr or "damaged: file" in result.stderr
    assert (tmp_path / "copy").is_dir()


def test_an_export_is_of_one_owner_when_that_is_said(tmp_path: Path, stored: Path) -> None:
    assert json.loads(done("export", tmp_path / "all", "--data-dir", stored, "--json")) == {"designs": 1}
    assert json.loads(done("export", tmp_path / "one", "--owner", "nobody", "--data-dir", stored, "--json")) == {
        "designs": 0
    }
    file = tmp_path / "file"
    file.write_text("x")
    assert refused("export", file / "below", "--data-dir", stored)["code"] in ("store_unavailable", "file_error")


@pytest.mark.parametrize("command", [["check"], ["backup", "target"], ["export", "target"], ["keys", "list"]])
def test_no_store_is_made_by_looking_for_one(tmp_path: Path, command: list[str]) -> None:
    assert refused(*command, "--data-dir", tmp_path / "none")["code"] == "no_store"
    assert list(tmp_path.iterdir()) == []


def test_a_database_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "gainfield.db").write_bytes(b"no database" * 100)
    for command in ("check", "migrate"):
        assert refused(command, "--data-dir", tmp_path)["code"] == "store_unavailable"


def test_migrate_twice(tmp_path: Path) -> None:
    first = json.loads(done("migrate", "--data-dir", tmp_path, "--json"))
    assert first == json.loads(done("migrate", "--data-dir", tmp_path, "--json"))
    assert misused("migrate", "somewhere")


@pytest.fixture
def postgresql() -> Iterator[Server]:
    programs = binaries()
    if programs is None:
        assert os.environ.get("CI") != "true", "PostgreSQL is not installed (Debian: postgresql)"
        pytest.skip("PostgreSQL is not installed (Debian: postgresql)")
    with running(programs) as found:
        found.execute("CREATE DATABASE team")
        yield found


def test_postgresql_by_a_file_of_secrets(tmp_path: Path, postgresql: Server) -> None:
    secrets, data = tmp_path / "secrets", tmp_path / "data"
    secrets.mkdir()
    (secrets / "gainfield_database_url").write_text(postgresql.url("team") + "\n")
    chosen = {"GAINFIELD_SECRETS_DIR": str(secrets), "GAINFIELD_DATA_DIR": str(data)}
    assert "gainfield migrate" in refused("keys", "add", "alice", **chosen)["detail"]
    done("migrate", **chosen)
    done("keys", "add", "alice", **chosen)
    assert "alice" in done("keys", "list", **chosen)
    assert not (data / "gainfield.db").exists()
    assert done("check", **chosen) == "the store is whole\n"
    assert "pg_dump" in done("backup", tmp_path / "copy", **chosen)
    # What is said by environment is stronger than the file.
    wrong = chosen | {"GAINFIELD_DATABASE_URL": "mysql://somewhere"}
    assert refused("migrate", **wrong)["code"] == "store_unavailable"
