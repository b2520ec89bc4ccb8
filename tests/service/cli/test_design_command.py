"""`gainfield design` in this process: what it answers, what it writes, how it refuses."""

from __future__ import annotations

import json
import os
import pty
import subprocess
from pathlib import Path
from typing import Any

import pytest

from service.cli import documents
from service.cli.refusing import Refused
from tests.service.cli.command import ROOT, done, misused, refused, run, script, timeless


def test_a_design_is_taken_for_its_request(request_file: Path) -> None:
    design = done("design", request_file, "--json")
    again = done("design", "-", "--json", stdin=design)
    assert timeless(design) == timeless(again)


def test_a_wrong_field_has_its_pointer_unit_and_range(request_file: Path, quick: dict[str, Any]) -> None:
    quick["geometry"]["chord_m"] = -2.0
    quick["nonsense"] = 1
    request_file.write_text(json.dumps(quick))
    problem = refused("design", request_file)
    assert problem["code"] == "invalid_request"
    (chord,) = [field for field in problem["errors"] if field["pointer"] == "/geometry/chord_m"]
    assert (chord["unit"], chord["allowed"]) == ("m", ">= 0.001 and <= 100")
    (nonsense,) = [field for field in problem["errors"] if field["pointer"] == "/nonsense"]
    assert nonsense["detail"] == "unknown field"


def test_what_the_model_refuses(request_file: Path, quick: dict[str, Any]) -> None:
    quick["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [90_000.0]}
    request_file.write_text(json.dumps(quick))
    assert refused("design", request_file)["errors"][0]["pointer"] == "/grid"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "is not JSON"),
        ("[1]", "no JSON object"),
        ('{"a": 1, "a": 2}', "'a'"),
        ("[" * 9999, "nested"),
        ("\udcff", "UTF-8"),
    ],
)
def test_files_that_hold_no_request(tmp_path: Path, content: str, said: str) -> None:
    file = tmp_path / "request.json"
    file.write_bytes(content.encode("utf-8", "surrogateescape"))
    problem = refused("design", file)
    assert problem["code"] == "unreadable_file"
    assert said in problem["detail"]


def test_files_that_are_not_there(tmp_path: Path, request_file: Path) -> None:
    assert "No such file" in refused("design", tmp_path / "none.json")["detail"]
    assert "Is a directory" in refused("design", tmp_path)["detail"]
    assert "no such directory" in refused("design", request_file, "--out", tmp_path / "none" / "design.json")["detail"]
    assert "File exists" in refused("design", request_file, "--schedule", request_file)["detail"]
    assert "'txt' is no format" in misused("design", request_file, "--schedule", tmp_path, "--formats", "json,txt")
    assert "'zero'" in misused("design", request_file, "--schedule", tmp_path, "--fill", "zero")


def test_points_without_gains_are_filled_when_that_is_said(tmp_path: Path, quick: dict[str, Any]) -> None:
    quick["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [551.25, 980.0, 90_000.0]}
    request, tables = tmp_path / "request.json", tmp_path / "tables"
    request.write_text(json.dumps(quick))
    command = ("design", request, "--schedule", tables, "--formats", "json,c", "--out", tmp_path / "design.json")
    assert "lqr.c: " in refused(*command)["detail"]
    assert list(tables.iterdir()) == []
    assert not (tmp_path / "design.json").exists()
    assert "1 outside_model" in done(*command, "--fill", "nearest_ok")
    assert {path.suffix for path in tables.iterdir()} == {".json", ".c"}


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "design.json"
    file.write_bytes(b"before")

    def full(source: object, target: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space"):
        documents.write_file(file, b"after")
    assert file.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [file]


def test_a_bar_on_a_terminal_and_nowhere_else(request_file: Path) -> None:
    file = request_file
    plain = run("design", file, "--json")
    assert plain.exit_code == 0
    assert plain.stderr == ""
    ours, theirs = pty.openpty()
    try:
        shown = subprocess.run(
            [*script(), "design", str(file), "--json"],
            cwd=ROOT, stdout=subprocess.PIPE, stderr=theirs, timeout=60, env=os.environ | {"TERM": "xterm"},
        )  # fmt: skip
        os.set_blocking(ours, False)
        assert b"designing" in os.read(ours, 1 << 16)
    finally:
        os.close(ours)
        os.close(theirs)
    assert timeless(shown.stdout) == timeless(plain.stdout)


def test_documents_are_checked_before_work_begins(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="no such directory"):
        documents.check_directory(tmp_path / "none" / "file")
