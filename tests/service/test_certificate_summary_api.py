"""What is proved of a schedule, in its files: asked for, read back, of this table only; and HDF5 with no library."""

from __future__ import annotations

import json
import re
import sys
from typing import Any

import pytest
from fastapi.testclient import TestClient

from schedules.files import FILE_FORMATS, read_csv, read_hdf5, read_json, read_matlab, read_npz
from schedules.proof.table_proof import ProvedSchedule
from service.app import create_app
from service.settings import Settings
from tests.service.flown_answers import posted

READERS = {"json": read_json, "csv": read_csv, "mat": read_matlab, "npz": read_npz, "h5": read_hdf5}
ASKED = "certificate=summary"


@pytest.fixture(scope="module")
def small(client: TestClient) -> dict[str, Any]:
    """One cell, of positive feedback and of the regulator; the former has a bound on the rates of flight."""
    from service.examples import example

    wanted = example("wind_tunnel")
    wanted |= {"name": "one cell", "grid": {"altitude_m": [0.0], "dynamic_pressure_pa": [551.25, 980.0]}}
    wanted["controllers"] = wanted["controllers"][1:]
    return posted(client, wanted)


@pytest.mark.parametrize("name", ["pf", "lqr"])
def test_the_summary_is_that_of_the_proof_and_its_certificate(
    client: TestClient, small: dict[str, Any], name: str
) -> None:
    file = client.get(f"{small['links']['schedules'][name]['json']}?{ASKED}").json()
    proof = file["proof"]
    assert file["proof_reason"] is None
    query = f"controller={name}&rates=true"
    summary = client.get(f"{small['links']['verification']}?{query}").json()["controllers"][name]["summary"]
    for member in ("proved", "refuted", "undecided", "sampled", "decay_rate_1_s", "words", "rate_bound"):
        assert proof[member] == summary[member], member
    assert proof["proved"] == 1
    assert proof["rate_bound"]["unlimited"] is (proof["rate_bound"]["speed_rate"] is None) is (name == "lqr")
    certificate = client.get(small["links"]["certificate"][name]).json()
    assert proof["certificate_sha256"] == certificate["sha256"]
    assert proof["table_sha256"] == certificate["table_sha256"]
    assert certificate["provenance"]["design_id"] == small["id"] == file["design_id"]
    assert certificate["provenance"]["request_digest"] == file["request_digest"]


@pytest.mark.parametrize("suffix", READERS)
def test_files_are_read_back_with_and_without(client: TestClient, small: dict[str, Any], suffix: str) -> None:
    path = small["links"]["schedules"]["lqr"][suffix]
    bare, proved = (READERS[suffix](client.get(f"{path}{query}").content) for query in ("", f"?{ASKED}"))
    assert not isinstance(bare, ProvedSchedule)
    assert isinstance(proved, ProvedSchedule)
    assert proved.proof.proved == 1
    assert proved.axes == bare.axes
    for one, other in zip(proved.gains, bare.gains, strict=True):
        assert one.values.tobytes() == other.values.tobytes()
    told = client.get(f"{small['links']['schedules']['lqr']['json']}?{ASKED}").json()["proof"]
    assert proved.proof.table_sha256 == told["table_sha256"]


@pytest.mark.parametrize("suffix", [f.suffix for f in FILE_FORMATS.values() if not f.says_missing])
def test_tables_of_programs_say_it_in_words(client: TestClient, small: dict[str, Any], suffix: str) -> None:
    path = small["links"]["schedules"]["lqr"][suffix]
    bare, proved = (client.get(f"{path}{query}").text for query in ("", f"?{ASKED}"))
    digest = client.get(f"{small['links']['schedules']['lqr']['json']}?{ASKED}").json()["proof"]["table_sha256"]
    assert "none was asked for" in bare
    assert digest not in bare
    assert digest in proved
    assert "proved 1, refuted 0" in proved


def test_sources_with_and_without_a_proof_fit_together(client: TestClient, small: dict[str, Any]) -> None:
    """They are of one table: its fingerprint does not tell whether it is proved."""
    links = small["links"]["schedules"]["lqr"]
    header = client.get(f"{links['h']}?{ASKED}").text
    bare = client.get(links["h"]).text
    marks = [re.findall(r"LQR_SCHEDULE_[0-9A-F]{16}\b", text) for text in (header, bare)]
    assert marks[0] == marks[1] != []


def test_a_filled_table_tells_of_the_proof_of_the_designed_one(client: TestClient, wanted: dict[str, Any]) -> None:
    """The cell at the filled point is undecided; the gains that fill it are not those of the proof."""
    wanted |= {"name": "holed", "grid": {"altitude_m": [0.0], "airspeed_m_s": [30.0, 50.0, 400.0]}}
    wanted["controllers"] = wanted["controllers"][2:]
    links = posted(client, wanted)["links"]["schedules"]["lqr"]
    proof = client.get(f"{links['json']}?{ASKED}").json()["proof"]
    assert (proof["proved"], proof["undecided"], proof["decay_rate_1_s"], proof["rate_bound"]) == (1, 1, None, None)
    assert "no gains" in proof["rate_bound_reason"]
    for suffix in ("c", "m", "xml", "dml"):
        text = client.get(f"{links[suffix]}?{ASKED}&fill=nearest_ok").text
        assert proof["table_sha256"] in text, suffix
        assert "undecided 1" in text


@pytest.mark.parametrize("query", ["", f"?{ASKED}"])
def test_a_file_can_be_posted_back(client: TestClient, small: dict[str, Any], query: str) -> None:
    file = client.get(f"{small['links']['schedules']['lqr']['json']}{query}").json()
    body = {"schedule": file, "design_id": small["id"], "controller": "lqr"}
    response = client.post("/v1/schedules/verify", json=body)
    assert response.status_code == 200, response.text
    assert response.json()["controllers"]["lqr"]["summary"]["proved"] == 1


def test_an_edited_table_does_not_keep_its_proof(client: TestClient, small: dict[str, Any]) -> None:
    content = client.get(f"{small['links']['schedules']['lqr']['json']}?{ASKED}").content
    for change in (
        lambda d: d["gains"][0]["values"][0].__setitem__(0, d["gains"][0]["values"][0][0] * (1.0 + 1e-15)),
        lambda d: d["axes"][1]["values"].__setitem__(0, 551.0),
        lambda d: d["gains"].pop(0),
        lambda d: d["proof"].__setitem__("table_sha256", "0" * 64),
    ):
        document = json.loads(content)
        change(document)
        with pytest.raises(ValueError, match=r"the proof is of|which the proof is of"):
            read_json(json.dumps(document).encode())
        read_json(json.dumps(document | {"proof": None}).encode())
    for member, value in (("proved", -1), ("proved", True), ("words", 3), ("gains", "K"), ("decay_rate_1_s", "fast"),
                          ("rate_bound", 3), ("rate_bound", {}), ("certificate_sha256", 1)):  # fmt: skip
        document = json.loads(content)
        document["proof"][member] = value
        with pytest.raises(ValueError, match="proof"):
            read_json(json.dumps(document).encode())


def test_what_cannot_be_proved_is_not_asked_for(
    client: TestClient, small: dict[str, Any], refused: Any, tmp_path: Any
) -> None:
    path = small["links"]["schedules"]["lqr"]["json"]
    for query in (f"{ASKED}&rule=monotone_cubic", f"{ASKED}&integrator_placement=after_gain", "certificate=all"):
        assert refused(client.get(f"{path}?{query}"), 422)["errors"][0]["pointer"] == "/certificate"
    assert client.get(f"{path}?{ASKED}&out_of_range=hold").status_code == 200
    with TestClient(create_app(Settings(data_dir=tmp_path, max_proof_pieces=165))) as few:
        posted(few, small["request"])
        problem = refused(few.get(f"{path}?{ASKED}"), 422)
        assert (problem["code"], problem["errors"][0]["pointer"]) == ("limit_exceeded", "/certificate")
        assert few.get(path).status_code == 200


def test_a_sampled_schedule_says_why_it_has_no_proof(client: TestClient, wanted: dict[str, Any]) -> None:
    wanted |= {"name": "late", "grid": {"altitude_m": [0.0], "dynamic_pressure_pa": [551.25, 980.0]}}
    wanted["controllers"] = [wanted["controllers"][2] | {"sample_time_s": 0.005}]
    path = posted(client, wanted)["links"]["schedules"]["lqr"]["json"]
    content = client.get(f"{path}?{ASKED}").content
    proof = json.loads(content)["proof"]
    assert (proof["proved"], proof["sampled"], proof["certificate_sha256"], proof["decay_rate_1_s"]) == (
        0,
        1,
        None,
        None,
    )
    assert "computer" in proof["rate_bound_reason"]
    assert isinstance(read_json(content), ProvedSchedule)


def test_hdf5_without_its_library_names_the_extra(
    client: TestClient, small: dict[str, Any], refused: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = small["links"]["schedules"]["lqr"]["h5"]
    assert client.get(path).headers["content-type"] == "application/x-hdf5"
    monkeypatch.setitem(sys.modules, "h5py", None)
    problem = refused(client.get(path), 404)
    assert "pip install .[hdf5]" in problem["detail"]
