"""`gainfield verify`: exit code 0 only for tables that are proved everywhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.service.cli.command import done, misused, refused, run


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a request, its design, its schedule and the certificate of that."""
    from service.examples import example

    here = tmp_path_factory.mktemp("made")
    request = example("wind_tunnel")
    request["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [551.25, 980.0]}
    request["controllers"] = request["controllers"][2:]
    (here / "request.json").write_text(json.dumps(request))
    done("design", here / "request.json", "--out", here / "design.json", "--schedule", here)
    done(
        "verify", here / "wind_tunnel_lqr.json", "--design", here / "design.json",
        "--certificate", here / "certificate.json",
    )  # fmt: skip
    return here


def test_a_schedule_and_its_certificate(made: Path) -> None:
    schedule, certificate = made / "wind_tunnel_lqr.json", made / "certificate.json"
    assert "every cell is proved" in done("verify", schedule, "--design", made / "request.json")
    found = json.loads(done("verify", schedule, "--design", made / "design.json", "--json"))
    assert found["controllers"]["lqr"]["summary"]["proved"] == 1
    held = json.loads(done("verify", certificate, "--json"))
    assert (held["holds"], held["proved"], held["of"]) == (True, 1, 1)
    table = json.loads(certificate.read_text())["table_sha256"]
    assert done("verify", certificate, "--table", table).startswith("proved: 1 of 1 cells")
    assert run("verify", certificate, "--table", "0" * 64).exit_code == 1


def _changed(made: Path, tmp_path: Path, name: str, change: Any) -> Path:
    document = json.loads((made / name).read_text())
    change(document)
    file = tmp_path / name
    file.write_text(json.dumps(document))
    return file


def test_a_certificate_that_was_changed_is_refuted(made: Path, tmp_path: Path) -> None:
    def faster(document: dict[str, Any]) -> None:
        document["alpha"] *= 2.0

    result = run("verify", _changed(made, tmp_path, "certificate.json", faster), "--json")
    assert result.exit_code == 1
    said = json.loads(result.stdout)
    assert said["holds"] is False
    assert said["words"].startswith("refuted: the certificate was changed")


@pytest.mark.parametrize("member", ["axes", "gains", "cells", "plants", "terms", "proved", "sha256"])
def test_a_certificate_that_cannot_be_read(made: Path, tmp_path: Path, member: str) -> None:
    def without(document: dict[str, Any]) -> None:
        del document[member]

    def other(document: dict[str, Any]) -> None:
        document[member] = 7

    for change in (without, other):
        result = run("verify", _changed(made, tmp_path, "certificate.json", change))
        assert result.exit_code == 1
        assert "every cell" not in result.output


def test_gains_that_do_not_hold_are_refuted_at_a_point(made: Path, tmp_path: Path) -> None:
    def zero(document: dict[str, Any]) -> None:
        for gain in document["gains"]:
            gain["values"] = [[0.0 for _ in row] for row in gain["values"]]

    file = _changed(made, tmp_path, "wind_tunnel_lqr.json", zero)
    unwritten = tmp_path / "certificate.json"
    result = run("verify", file, "--design", made / "design.json", "--certificate", unwritten)
    assert result.exit_code == 1
    assert f"not written: {unwritten}" in result.stderr
    assert not unwritten.exists()
    assert "cell [0, 0]: refuted, unstable at 0 m and " in result.stdout
    as_json = run("verify", file, "--design", made / "design.json", "--json")
    assert as_json.exit_code == 1
    (cell,) = json.loads(as_json.stdout)["controllers"]["lqr"]["cells"]
    assert cell["counterexample"]["largest_real_part"] > 0.0


def test_a_table_with_a_hole_is_not_proved(made: Path, tmp_path: Path) -> None:
    def hole(document: dict[str, Any]) -> None:
        for gain in document["gains"]:
            gain["values"][0][1] = None
        document["outcomes"][0][1], document["reasons"][0][1] = "infeasible", "for this test"

    result = run("verify", _changed(made, tmp_path, "wind_tunnel_lqr.json", hole), "--design", made / "design.json")
    assert result.exit_code == 1


def test_a_schedule_that_is_refused_names_its_field(made: Path, tmp_path: Path) -> None:
    def unit(document: dict[str, Any]) -> None:
        document["gains"][0]["unit"] = "furlong"

    problem = refused(
        "verify", _changed(made, tmp_path, "wind_tunnel_lqr.json", unit), "--design", made / "design.json"
    )
    assert problem["errors"][0]["pointer"] == "/schedule/gains/0/unit"

    def stranger(document: dict[str, Any]) -> None:
        document["controller"] = "stranger"

    file = _changed(made, tmp_path, "wind_tunnel_lqr.json", stranger)
    assert "'stranger'; there are lqr" in refused("verify", file, "--design", made / "design.json")["detail"]
    file.write_text(json.dumps({"axes": [], "gains": []}))
    assert "names no design_id" in refused("verify", file, "--server", "http://127.0.0.1:1")["detail"]


def test_what_is_neither(made: Path) -> None:
    assert "neither" in refused("verify", made / "design.json")["detail"]
    assert "give --design" in misused("verify", made / "wind_tunnel_lqr.json")
    assert "--table" in misused(
        "verify", made / "wind_tunnel_lqr.json", "--table", "0", "--design", made / "design.json"
    )
    assert "takes neither" in misused("verify", made / "certificate.json", "--design", made / "design.json")
