"""Schedule files over HTTP: every format, points without gains, and the rules that fill them."""

from __future__ import annotations

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from schedules.files import FILE_FORMATS, file_name, read_csv, read_json, read_npz, write_schedule
from schedules.rules import ScheduleRules
from service.documentation.design_examples import design_requests
from service.examples import example

TABLES = [f.suffix for f in FILE_FORMATS.values() if not f.says_missing]
OTHERS = [f.suffix for f in FILE_FORMATS.values() if f.says_missing]


@pytest.fixture(scope="module")
def holed(client: TestClient) -> str:
    """Path of the files of a regulator that has gains at one of two points."""
    wanted = example("wind_tunnel")
    wanted |= {"name": "holed", "grid": {"altitude_m": [0.0], "airspeed_m_s": [50.0, 400.0]}}
    wanted["controllers"] = wanted["controllers"][2:]
    document = client.post("/v1/designs", json=wanted).json()
    assert document["controllers"][0]["outcomes"] == [["ok", "outside_model"]]
    return f"/v1/designs/{document['id']}/schedules/lqr"


@pytest.mark.parametrize("suffix", FILE_FORMATS)
def test_every_format_is_the_domains_file(client: TestClient, design: dict[str, Any], suffix: str) -> None:
    for name in ("nf", "pf", "lqr"):
        response = client.get(design["links"]["schedules"][name][suffix])
        assert response.status_code == 200
        assert response.headers["content-type"] == FILE_FORMATS[suffix].media_type
        schedule = read_json(client.get(design["links"]["schedules"][name]["json"]).content)
        assert response.content == write_schedule(schedule, suffix)
        disposition = f'attachment; filename="{file_name(schedule, suffix)}"'
        assert response.headers["content-disposition"] == disposition
        # A rule changes nothing where nothing is missing.
        if suffix in TABLES:
            path = design["links"]["schedules"][name][suffix]
            assert client.get(f"{path}?fill=nearest_ok").headers["etag"] == response.headers["etag"]


@pytest.mark.parametrize("suffix", TABLES)
def test_missing_gains_are_filled_by_a_named_rule_only(
    client: TestClient, holed: str, refused: Any, suffix: str
) -> None:
    problem = refused(client.get(f"{holed}.{suffix}"), 409)
    assert problem["code"] == "no_design_at_point"
    assert "lqr has no gains at 1 of 2 points" in problem["detail"]
    assert "Mach" in problem["detail"]
    assert "nearest_ok, hold_neighbour" in problem["detail"]
    assert "json, csv, mat, npz, h5 files say where there is no gain" in problem["detail"]
    schedule = read_npz(client.get(f"{holed}.npz").content)
    tags = set()
    for rule in ("nearest_ok", "hold_neighbour"):
        response = client.get(f"{holed}.{suffix}?fill={rule}")
        assert response.status_code == 200
        assert response.content == write_schedule(schedule, suffix, rule)
        tags.add(response.headers["etag"])
    assert len(tags) == 2


@pytest.mark.parametrize("suffix", OTHERS)
def test_formats_that_say_missing_take_no_rule(client: TestClient, holed: str, refused: Any, suffix: str) -> None:
    assert client.get(f"{holed}.{suffix}").status_code == 200
    problem = refused(client.get(f"{holed}.{suffix}?fill=nearest_ok"), 422)
    (error,) = problem["errors"]
    assert error["pointer"] == "/fill"
    assert "nothing with json, csv, mat, npz, h5" in error["allowed"]


@pytest.mark.parametrize("query", ["fill=zero", "fill=", "fill=nearest_ok&fill=", "rule=nearest_ok"])
def test_rules_that_are_not_there(client: TestClient, holed: str, refused: Any, query: str) -> None:
    problem = refused(client.get(f"{holed}.c?{query}"), 422)
    assert problem["errors"][0]["pointer"] in ("/fill", "/rule")


def test_nothing_to_fill_with(client: TestClient, wanted: Any, refused: Any) -> None:
    wanted |= {"name": "none", "grid": {"altitude_m": [0.0], "airspeed_m_s": [50.0]}}
    wanted["controllers"] = [
        wanted["controllers"][1] | {"specs": {"damping_ratio_min": 0.99, "gain_margin_db_min": 40}}
    ]
    document = client.post("/v1/designs", json=wanted).json()
    assert "ok" not in document["controllers"][0]["outcomes"][0]
    problem = refused(client.get(f"/v1/designs/{document['id']}/schedules/pf.xml?fill=nearest_ok"), 409)
    assert "no point is ok" in problem["detail"]


def test_source_and_header_fit_under_the_names_they_are_saved_by(client: TestClient, tmp_path: Path) -> None:
    """Gains of an estimator and of a sampled design have long names; the design's name is none for a file."""
    compiler = shutil.which("gcc")
    for name in ("lqr_measured", "lqr_sampled"):
        request = design_requests()[name][1] | {"name": f'{name} Höhe "q" \n/*'}
        document = client.post("/v1/designs", json=request).json()
        for controller in document["controllers"]:
            links = document["links"]["schedules"][controller["name"]]
            saved = {}
            for suffix in TABLES:
                response = client.get(links[suffix] + "?fill=nearest_ok")
                assert response.status_code == 200, response.text
                (saved[suffix],) = re.findall(r'filename="([A-Za-z0-9_.-]+)"', response.headers["content-disposition"])
                (tmp_path / saved[suffix]).write_bytes(response.content)
                if suffix in ("xml", "dml"):
                    ET.fromstring(response.content)
            assert saved["m"].removesuffix(".m").isidentifier()
            if compiler is not None:
                command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-DGAINFIELD_SELF_TEST"]
                subprocess.run([*command, saved["c"], "-o", "self_test"], cwd=tmp_path, check=True, timeout=60)
                subprocess.run([tmp_path / "self_test"], check=True, timeout=60, stdout=subprocess.DEVNULL)


def test_rules_travel_with_the_file_or_are_refused(client: TestClient, refused: Any) -> None:
    """A table read back is interpolated by its own rule; formats without a place for a rule say so."""
    design = client.post("/v1/designs", json=example("wind_tunnel")).json()
    here = f"/v1/designs/{design['id']}/schedules/nf"
    query = "?rule=monotone_cubic&out_of_range=hold&integrator_placement=after_gain"
    for suffix, read in (("json", read_json), ("csv", read_csv), ("npz", read_npz)):
        found = read(client.get(f"{here}.{suffix}{query}").content)
        assert found.rules == ScheduleRules("monotone_cubic", "hold", "after_gain")
    for suffix in ("c", "xml", "dml", "m"):
        assert refused(client.get(f"{here}.{suffix}?rule=monotone_cubic"), 422)["errors"][0]["pointer"] == "/rule"
        assert client.get(f"{here}.{suffix}").status_code == 200
    assert refused(client.get(f"{here}.csv?rule=linear"), 422)["errors"][0]["pointer"] == "/rule"
