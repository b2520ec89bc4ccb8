"""Proofs between the grid points over HTTP: of designs, and their certificates."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from schedules.designed import DesignedEnvelope
from schedules.perturbations import Uncertainty
from schedules.proof.certificate import Origin, to_document
from schedules.proof.prove import ProofRequest, prove
from schedules.proof.reading_error import reading_margins
from schedules.proof.scheduling_rates import scheduling_rates
from schedules.run import run
from service.schemas.requests import DesignRequest
from service.to_domain.study_of import study
from tests.service.flown_answers import posted, wind_tunnel

ROOT = Path(__file__).parents[2]
NAMES = ("nf", "pf", "lqr")
Refused = Callable[[Any, int], dict[str, Any]]


@pytest.fixture(scope="module")
def envelope() -> DesignedEnvelope:
    return wind_tunnel()


@pytest.fixture(scope="module")
def proofs(client: TestClient, design: dict[str, Any]) -> dict[str, Any]:
    """What GET says of every controller of the example."""
    response = client.get(design["links"]["verification"])
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def same(got: Any, wanted: float) -> bool:
    return (got is None) == (not np.isfinite(wanted)) and (got is None or got == wanted)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_answered_is_the_domains_proof(
    proofs: dict[str, Any], envelope: DesignedEnvelope, design: dict[str, Any], name: str
) -> None:
    proof = prove(envelope.study, envelope.plant, envelope.controller(name), ProofRequest(most_pieces=16))
    found, said = proofs["controllers"][name], proof.summary
    assert list(proofs["controllers"]) == list(NAMES)
    assert proofs["grid"] == design["grid"]
    assert found["covers"] == "the model"
    for cell, wire in zip(proof.cells, found["cells"], strict=True):
        assert (wire["index"], wire["status"], wire["reason"]) == (list(cell.index), cell.status, cell.reason)
        assert same(wire["decay_rate_1_s"], cell.alpha)
        assert same(wire["wanted_1_s"], cell.wanted)
        assert wire["pieces"] == len(cell.pieces)
        assert wire["counterexample"] is None
        assert cell.slowest is not None
        assert wire["slowest"]["largest_real_part"] == -cell.slowest.rate
        assert wire["slowest"]["largest_real_part"] <= -wire["decay_rate_1_s"]
    summary = found["summary"]
    counts = (summary["proved"], summary["refuted"], summary["undecided"], summary["sampled"])
    assert counts == (said.proved, said.refuted, said.undecided, said.sampled) == (3, 0, 0, 0)
    assert (summary["decay_rate_1_s"], summary["common"], summary["words"]) == (said.alpha, said.common, said.words)
    assert summary["rate_bound"] is summary["signal_error"] is None
    assert summary["rate_bound_reason"] == summary["signal_error_reason"] == "not asked for"


def test_controllers_by_name(client: TestClient, design: dict[str, Any], proofs: dict[str, Any]) -> None:
    response = client.get(design["links"]["verification"], params={"controller": ["lqr", "nf", "lqr"]})
    assert list(response.json()["controllers"]) == ["lqr", "nf"]
    assert response.json()["controllers"]["nf"] == proofs["controllers"]["nf"]


def test_margins_and_rates(client: TestClient, design: dict[str, Any], wanted: dict[str, Any]) -> None:
    wanted |= {"name": "one cell", "grid": {"altitude_m": [0.0], "dynamic_pressure_pa": [551.25, 980.0]}}
    query = "controller=pf&margins=true&rates=true&altitude_rate_m_s=25"
    link = posted(client, wanted)["links"]["verification"]
    summary = client.get(f"{link}?{query}").json()["controllers"]["pf"]["summary"]
    envelope = run(study(DesignRequest.model_validate(wanted)))
    proof = prove(envelope.study, envelope.plant, envelope.controller("pf"), ProofRequest(most_pieces=16))
    margins, rates = reading_margins(proof), scheduling_rates(proof, 25.0)
    error = summary["signal_error"]
    for wire, margin in zip([error, *error["cells"]], [margins.envelope, *margins.cells], strict=True):
        assert wire["index"] == (None if margin.index is None else list(margin.index))
        of = (wire["proved_percent"], wire["stable_down_percent"], wire["stable_up_percent"])
        assert of == (100.0 * margin.proved, 100.0 * margin.low, 100.0 * margin.high)
    assert 0.0 < error["proved_percent"] <= min(error["stable_down_percent"], error["stable_up_percent"])
    bound = summary["rate_bound"]
    assert bound == {
        "altitude_rate_m_s": 25.0, "axis": "dynamic_pressure_pa", "speed_rate": rates.speed_rate, "unit": "Pa/s",
        "unlimited": False, "decay_rate_1_s": 0.0,
    }  # fmt: skip
    assert rates.speed_rate > 0.0
    query = "controller=lqr&rates=true"
    bound = client.get(f"{design['links']['verification']}?{query}").json()["controllers"]["lqr"]["summary"]
    assert (bound["common"], bound["rate_bound"]["unlimited"], bound["rate_bound"]["speed_rate"]) == (True, True, None)


@pytest.mark.parametrize("together", [False, True])
def test_plants_that_are_off(
    client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope, together: bool
) -> None:
    query = f"hinge_moment_percent=20&C_Ht_da_percent=0&tab_inertia_percent=10&together={together}".lower()
    query = query.replace("c_ht_da", "C_Ht_da")
    found = client.get(f"{design['links']['verification']}?controller=lqr&controller=pf&{query}").json()["controllers"]
    sizes = {"C_Ha_da": 0.2, "C_Ha_dt": 0.2, "C_Ht_dt": 0.2, "tab_inertia": 0.1}
    changes = [Uncertainty(name, size) for name, size in sizes.items()]  # type: ignore[arg-type]
    asked = ProofRequest(changes=changes, together=together, most_pieces=16)
    for name in ("lqr", "pf"):
        proof = prove(envelope.study, envelope.plant, envelope.controller(name), asked)
        assert found[name]["covers"] == proof.covers
        assert [c["status"] for c in found[name]["cells"]] == [c.status for c in proof.cells]
    (worst, *_) = found["pf"]["cells"]
    assert worst["status"] == "refuted"
    assert worst["counterexample"] == worst["slowest"]
    assert worst["counterexample"]["largest_real_part"] >= -worst["wanted_1_s"]
    assert worst["counterexample"]["factors"]
    for parameter, factor in worst["counterexample"]["factors"].items():
        assert abs(factor - 1.0) == pytest.approx(sizes[parameter])


def test_too_much_is_refuted_and_has_no_certificate(
    client: TestClient, design: dict[str, Any], refused: Refused
) -> None:
    cells = client.get(f"{design['links']['verification']}?controller=lqr&decay_rate_1_s=500").json()
    cells = cells["controllers"]["lqr"]["cells"]
    for cell in cells:
        assert (cell["status"], cell["decay_rate_1_s"], cell["wanted_1_s"]) == ("refuted", None, 500.0)
        assert cell["counterexample"]["largest_real_part"] > -500.0
        assert "decays slower than 500" in cell["reason"]
    problem = refused(client.get(f"{design['links']['certificate']['lqr']}?decay_rate_1_s=500"), 409)
    assert problem["code"] == "study_not_possible"
    assert "3 refuted" in problem["detail"]


@pytest.mark.parametrize("name", NAMES)
def test_the_certificate_is_a_file_that_the_command_takes(
    client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope, tmp_path: Path, name: str
) -> None:
    link = design["links"]["certificate"][name]
    response = client.get(link)
    proof = prove(envelope.study, envelope.plant, envelope.controller(name), ProofRequest(most_pieces=16))
    file = client.get(design["links"]["schedules"][name]["json"]).json()
    origin = Origin(design["id"], "wind_tunnel", file["request_digest"], file["version"])
    assert response.json() == json.loads(json.dumps(to_document(proof, origin)))
    assert response.headers["content-type"] == "application/json"
    disposition = f'attachment; filename="wind_tunnel_{name}_certificate.json"'
    assert response.headers["content-disposition"] == disposition
    again = client.get(link, headers={"If-None-Match": response.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    path = tmp_path / "proof.json"
    path.write_bytes(response.content)
    command = [sys.executable, "-m", "schedules.verify", str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("proved: 3 of 3 cells")
    table = response.json()["table_sha256"]
    for asked, passes in ((table, True), (table[::-1], False)):
        done = subprocess.run([*command, asked], cwd=ROOT, capture_output=True, text=True, check=False)
        assert (done.returncode == 0) is passes
