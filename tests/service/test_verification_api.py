"""Proofs between the grid points over HTTP: of designs, their certificates, and of uploaded tables."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from schedules.designed import DesignedEnvelope
from schedules.perturbations import Uncertainty
from schedules.proof.certificate import to_document
from schedules.proof.prove import ProofRequest, prove
from schedules.proof.reading_error import reading_margins
from schedules.proof.scheduling_rates import scheduling_rates
from schedules.rules import INTEGRATOR_PLACEMENTS, INTERPOLATIONS
from schedules.run import run
from schedules.verify import verify
from service.app import create_app
from service.body_examples import BODIES
from service.examples import example
from service.schemas.requests import DesignRequest
from service.settings import Settings
from service.study_of import study
from tests.service.flown_answers import posted, wind_tunnel

ROOT = Path(__file__).parents[2]
VERIFY = "/v1/schedules/verify"
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


@pytest.fixture
def body() -> dict[str, Any]:
    """The uploaded table of the documentation that holds, free to be changed."""
    return copy.deepcopy(BODIES[VERIFY]()["proved"]["value"])


def uploaded(client: TestClient, request: dict[str, Any]) -> dict[str, Any]:
    response = client.post(VERIFY, json=request)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def statuses(document: dict[str, Any], name: str) -> list[str]:
    return [cell["status"] for cell in document["controllers"][name]["cells"]]


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
    assert response.json() == json.loads(json.dumps(to_document(proof)))
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


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("by", ["design_id", "design"])
def test_a_designs_own_file_posted_back_is_the_designs_proof(
    client: TestClient, design: dict[str, Any], proofs: dict[str, Any], name: str, by: str
) -> None:
    file = client.get(design["links"]["schedules"][name]["json"]).json()
    request: dict[str, Any] = {"schedule": file, "certificate": True}
    if by == "design_id":
        request |= {"design_id": design["id"], "controller": name}
    else:
        parts = ("geometry", "inertia", "aerodynamics", "atmosphere", "trim", "actuators")
        request["design"] = {part: design["request"][part] for part in parts}
        request["controller"] = {"name": name, "kind": file["kind"]}
        if name == "nf":
            request["controller"]["rate_filter_hz"] = 100.0
    found = uploaded(client, request)
    assert found["controllers"][name] == proofs["controllers"][name]
    assert found["grid"] == proofs["grid"]
    assert found["certificate"] == client.get(design["links"]["certificate"][name]).json()
    assert verify(found["certificate"]).startswith("proved: 3 of 3")


@pytest.mark.parametrize(("name", "gain"), [("nf", "K_p"), ("pf", "K_f"), ("lqr", "K_T_a_int_a")])
def test_one_gain_edited_beyond_its_slack_is_refuted(
    client: TestClient, design: dict[str, Any], name: str, gain: str
) -> None:
    file = client.get(design["links"]["schedules"][name]["json"]).json()
    (edited,) = (one for one in file["gains"] if one["name"] == gain)
    edited["values"][1][2] *= -30.0 if name == "lqr" else 30.0
    request = {"schedule": file, "design_id": design["id"], "controller": name, "certificate": True}
    found = uploaded(client, request)
    assert statuses(found, name) == ["proved", "refuted", "refuted"]
    for cell in found["controllers"][name]["cells"][1:]:
        point = cell["counterexample"]
        assert point["largest_real_part"] > 0.0
        assert 0.0 <= point["altitude_m"] <= 3000.0
        assert 551.25 <= point["dynamic_pressure_pa"] <= 1531.25
    assert found["certificate"]["proved"] == 1


def test_a_table_that_is_stable_at_its_points_only(client: TestClient) -> None:
    """Two speeds are too few: what no sample at the points would see."""
    request = BODIES[VERIFY]()["refuted"]["value"]
    (cell,) = uploaded(client, request)["controllers"]["uploaded"]["cells"]
    assert cell["status"] == "refuted"
    assert 245.0 < cell["counterexample"]["dynamic_pressure_pa"] < 3000.0
    # Flown at the four points as given gains, it is a design without fault.
    table = {g["name"]: {"values": g["values"]} for g in request["schedule"]["gains"]}
    wanted = example("wind_tunnel") | {"name": "coarse"}
    wanted["grid"] = {axis["name"]: axis["values"] for axis in request["schedule"]["axes"]}
    wanted["controllers"] = [request["controller"] | {"name": "given", "gains": table}]
    document = posted(client, wanted)
    assert document["controllers"][0]["outcomes"] == [["ok", "ok"], ["ok", "ok"]]
    (same_cell,) = client.get(f"{document['links']['verification']}?fraction=0").json()["controllers"]["given"]["cells"]
    assert same_cell == cell


def test_the_answer_to_a_bare_table_on_other_axes(client: TestClient, body: dict[str, Any]) -> None:
    body["proof"] = {"fraction": 0.2, "pieces": 4, "margins": True}
    found = uploaded(client, body)
    assert statuses(found, "uploaded") == ["proved", "proved"]
    assert found["certificate"] is None
    assert found["grid"]["shape"] == [2, 3]
    assert found["controllers"]["uploaded"]["summary"]["signal_error"]["proved_percent"] > 0.0
    # The same speeds as airspeeds at sea level, one line of altitude.
    speeds = [float(np.sqrt(2.0 * q / 1.225)) for q in body["schedule"]["axes"][1]["values"]]
    body["schedule"]["axes"][0]["values"] = [0.0]
    body["schedule"]["axes"][1] = {"name": "airspeed_m_s", "unit": "m/s", "values": speeds}
    for gain in body["schedule"]["gains"]:
        gain["values"] = gain["values"][:1]
    assert statuses(uploaded(client, body), "uploaded") == ["proved", "proved"]


def test_points_without_gains(client: TestClient, body: dict[str, Any]) -> None:
    for gain in body["schedule"]["gains"]:
        gain["values"][1][2] = None
    found = uploaded(client, body)["controllers"]["uploaded"]["cells"]
    assert [cell["status"] for cell in found] == ["proved", "undecided"]
    assert found[1]["reason"] == "grid point [1, 2] is excluded: the table has no gains there"
    assert found[1]["wanted_1_s"] is found[1]["slowest"] is None
    body["schedule"]["outcomes"] = [["ok"] * 3, ["ok", "ok", "infeasible"]]
    body["schedule"]["reasons"] = [[None] * 3, [None, None, "overshoot"]]
    found = uploaded(client, body)["controllers"]["uploaded"]["cells"]
    assert found[1]["reason"] == "grid point [1, 2] is infeasible: overshoot"
    for gain in body["schedule"]["gains"]:
        gain["values"] = [[None] * 3] * 2
    del body["schedule"]["outcomes"], body["schedule"]["reasons"]
    found = uploaded(client, body | {"certificate": True})
    assert statuses(found, "uploaded") == ["undecided", "undecided"]
    assert found["certificate"] is None


def test_loops_that_cannot_be_proved_say_why(client: TestClient, body: dict[str, Any], wanted: dict[str, Any]) -> None:
    body["design"]["actuators"]["tab"]["delay_s"] = 0.002
    body["proof"] = {"margins": True, "rates": True}
    found = uploaded(client, body)["controllers"]["uploaded"]
    assert [cell["status"] for cell in found["cells"]] == ["sampled", "sampled"]
    assert "transport delay" in found["reason"]
    assert "transport delay" in found["summary"]["signal_error_reason"]
    assert "transport delay" in found["summary"]["rate_bound_reason"]
    body["design"]["aerodynamics"]["virtual_inertia"] = True
    body["design"]["actuators"]["tab"]["delay_s"] = 0.0
    found = uploaded(client, body)["controllers"]["uploaded"]
    assert "virtual inertia" in found["reason"]
    assert all(cell["slowest"] for cell in found["cells"])
    wanted["controllers"] = [wanted["controllers"][2] | {"sample_time_s": 0.005}]
    document = posted(client, wanted | {"name": "digital"})
    cells = client.get(document["links"]["verification"]).json()["controllers"]["lqr"]
    assert {cell["status"] for cell in cells["cells"]} == {"sampled"}
    assert "computer" in cells["reason"]


def test_a_delayed_table_that_is_not_stable_does_not_pass_as_sampled(client: TestClient, body: dict[str, Any]) -> None:
    body["design"]["actuators"]["tab"]["delay_s"] = 0.002
    body["schedule"]["gains"][1]["values"][0][0] *= 50.0
    cells = uploaded(client, body)["controllers"]["uploaded"]["cells"]
    assert [cell["status"] for cell in cells] == ["undecided", "sampled"]
    assert "grid point [0, 0] is not_certified" in cells[0]["reason"]


def at(pointer: str, value: Any) -> Callable[[dict[str, Any]], None]:
    """A change of the body: the value put there."""

    def change(document: Any) -> None:
        *parents, last = pointer.split("/")[1:]
        for part in parents:
            document = document[int(part) if part.isdigit() else part]
        document[int(last) if last.isdigit() else last] = value

    return change


def first_gains(count: int) -> Callable[[dict[str, Any]], None]:
    def change(document: dict[str, Any]) -> None:
        document["schedule"]["gains"] = document["schedule"]["gains"][:count]

    return change


BAD: list[tuple[Callable[[dict[str, Any]], None], str]] = [
    (first_gains(2), "/schedule/gains"),
    (first_gains(0), "/schedule/gains"),
    (at("/schedule/gains/1/name", "K_q"), "/schedule/gains/1/name"),
    (at("/schedule/gains/1/name", "K_d"), "/schedule/gains/1/name"),
    (at("/schedule/gains/1/name", "N_T_t_r_a"), "/schedule/gains/1/name"),
    (at("/schedule/gains/0/unit", "deg"), "/schedule/gains/0/unit"),
    (at("/schedule/gains/2/values", [[1.0, 2.0, 3.0]]), "/schedule/gains/2/values"),
    (at("/schedule/gains/2/values/1", [1.0, 2.0]), "/schedule/gains/2/values/1"),
    (at("/schedule/gains/2/values/1/2", None), "/schedule/gains/2/values/1/2"),
    (at("/schedule/gains/2/values/1/2", "1"), "/schedule/gains/2/values/1/2"),
    (at("/schedule/gains/2/values/1/2", 1e300), "/schedule/gains/2/values/1/2"),
    (at("/schedule/gains/2/values/1/2", -1.0), "/schedule/gains/2/values/1/2"),
    (at("/schedule/axes/0/name", "height_m"), "/schedule/axes/0/name"),
    (at("/schedule/axes/0", {"name": "mach", "values": [0.1, 0.2]}), "/schedule/axes/0/name"),
    (at("/schedule/axes/1", {"name": "altitude_m", "values": [0.0, 1.0, 2.0]}), "/schedule/axes/1/name"),
    (at("/schedule/axes/1/unit", "kPa"), "/schedule/axes/1/unit"),
    (at("/schedule/axes/1/values/1", 200.0), "/schedule/axes/1/values/1"),
    (at("/schedule/axes/0/values/1", 1e9), "/schedule/axes/0/values/1"),
    (at("/schedule/axes", []), "/schedule/axes"),
    (at("/schedule/outcomes", [["ok"] * 3]), "/schedule/outcomes"),
    (at("/schedule/outcomes", [["ok"] * 3, ["ok", "infeasible", "ok"]]), "/schedule/outcomes/1/1"),
    (at("/schedule/outcomes", [["ok"] * 3, ["ok", "fine", "ok"]]), "/schedule/outcomes/1/1"),
    (at("/schedule/interpolation", "cubic"), "/schedule/interpolation"),
    (at("/schedule/out_of_range", "extrapolated"), "/schedule/out_of_range"),
    (at("/schedule/interpolation", INTERPOLATIONS["monotone_cubic"]), "/schedule/interpolation"),
    (at("/schedule/integrator_placement", INTEGRATOR_PLACEMENTS["after_gain"]), "/schedule/integrator_placement"),
    (at("/schedule/sign_convention", "trailing edge down"), "/schedule/sign_convention"),
    (at("/schedule/schema_version", 3), "/schedule/schema_version"),
    (at("/schedule/format", "other"), "/schedule/format"),
    (at("/schedule/kind", "lqr"), "/schedule/kind"),
    (at("/schedule/extra", 1), "/schedule/extra"),
    (at("/controller", "nf"), "/controller"),
    (at("/controller", 3), "/controller"),
    (at("/controller/kind", "pid"), "/controller/kind"),
    (at("/controller/reference", "none"), "/controller/reference"),
    (at("/controller/specs", {}), "/controller/specs"),
    (at("/controller/sample_time_s", 1e-4), "/controller/computational_delay_s"),
    (at("/controller", {"kind": "lqr", "rate_filter_hz": 10.0}), "/controller/rate_filter_hz"),
    (at("/controller", {"kind": "lqr", "sample_time_s": 0.01}), "/controller/sample_time_s"),
    (at("/controller", {"kind": "lqr", "measurement": {"kind": "kalman"}}), "/controller/measurement/kind"),
    (at("/controller", {"kind": "lqr"}), "/schedule/gains/0/name"),
    (at("/design", None), "/design"),
    (at("/design_id", "abc"), "/design"),
    (at("/design/geometry/chord_m", 0.0), "/design/geometry/chord_m"),
    (at("/design/grid", {}), "/design/grid"),
    (at("/design/aerodynamics", {"source": "table", "rows": [[0, 0, 0, 0, 0]] * 3}), "/design/aerodynamics/rows"),
    (at("/proof/fraction", 1.0), "/proof/fraction"),
    (at("/proof/decay_rate_1_s", -1.0), "/proof/decay_rate_1_s"),
    (at("/proof/pieces", 0), "/proof/pieces"),
    (at("/proof", {"hinge_moment_percent": 1.0, "inertia_percent": 1.0, "mass_percent": 1.0, "together": True}),
     "/proof/together"),
    (at("/certificate", "yes"), "/certificate"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "pointer"), BAD)
def test_what_is_refused_names_the_field(
    client: TestClient, body: dict[str, Any], refused: Refused, change: Callable[[dict[str, Any]], None], pointer: str
) -> None:
    if pointer == "/controller/computational_delay_s":
        body["controller"]["computational_delay_s"] = 0.5
    change(body)
    problem = refused(client.post(VERIFY, json=body), 422)
    assert problem["errors"][0]["pointer"] == pointer, problem
    assert problem["errors"][0]["allowed"]


def test_outside_the_model(client: TestClient, body: dict[str, Any], refused: Refused) -> None:
    speeds = body["schedule"]["axes"][1]["values"]
    speeds[2] = 9e4
    found = uploaded(client, body)["controllers"]["uploaded"]["cells"]
    assert [cell["status"] for cell in found] == ["proved", "undecided"]
    assert "outside_model" in found[1]["reason"]
    speeds[:] = [8e4, 9e4, 9.5e4]
    problem = refused(client.post(VERIFY, json=body), 422)
    assert problem["errors"][0]["pointer"] == "/schedule/axes"
    assert "Mach" in problem["detail"]


def test_things_that_are_not_there(
    client: TestClient, design: dict[str, Any], body: dict[str, Any], refused: Refused
) -> None:
    link = design["links"]["verification"]
    refused(client.get(f"{link}?controller=none"), 404)
    refused(client.get("/v1/designs/0/verification"), 404)
    refused(client.get(design["links"]["certificate"]["nf"].replace("/nf/", "/none/")), 404)
    for query in ("fraction=1", "pieces=0", "controller=1x", "margins=perhaps", "decay=1", "together=2",
                  "hinge_moment_percent=100", "tab_mass_percent=nan"):  # fmt: skip
        problem = refused(client.get(f"{link}?{query}"), 422)
        assert problem["errors"][0]["pointer"].startswith(f"/{query.partition('=')[0]}")
    refused(client.get(f"{design['links']['certificate']['nf']}?margins=true"), 422)
    del body["design"]
    refused(client.post(VERIFY, json=body | {"design_id": "0"}), 404)
    refused(client.post(VERIFY, json=body | {"design_id": design["id"], "controller": "none"}), 404)


def test_controllers_that_no_table_flies(
    client: TestClient, wanted: dict[str, Any], body: dict[str, Any], refused: Refused
) -> None:
    wanted["controllers"] = [wanted["controllers"][2] | {"sample_time_s": 0.005}]
    document = posted(client, wanted | {"name": "digital"})
    del body["design"]
    problem = refused(client.post(VERIFY, json=body | {"design_id": document["id"], "controller": "lqr"}), 409)
    assert problem["code"] == "study_not_possible"


def test_limits_name_their_setting(tmp_path: Path, body: dict[str, Any], refused: Refused) -> None:
    few = Settings(data_dir=tmp_path, max_proof_pieces=144, max_grid_points=8, max_delayed_loops=5)
    with TestClient(create_app(few), raise_server_exceptions=False) as client:
        document = posted(client, example("wind_tunnel"))
        link = document["links"]["verification"]
        assert client.get(link).status_code == 200  # 3 controllers, 3 cells, 16 pieces
        for query, size in (("pieces=17", 153), ("hinge_moment_percent=1", 1152), ("margins=true", 378),
                            ("rates=true", 1494), ("hinge_moment_percent=1&together=true", 2304)):  # fmt: skip
            problem = refused(client.get(f"{link}?{query}"), 422)
            assert problem["code"] == "limit_exceeded"
            assert "GAINFIELD_MAX_PROOF_PIECES" in problem["detail"]
            (error,) = problem["errors"]
            assert (error["pointer"], error["allowed"]) == ("/pieces", "<= 144")
            assert problem["detail"].startswith(f"{size} ")
        problem = refused(client.get(f"{document['links']['certificate']['nf']}?pieces=49"), 422)
        assert problem["detail"].startswith("147 ")
        problem = refused(client.post(VERIFY, json=body | {"proof": {"pieces": 73}}), 422)
        assert problem["errors"][0]["pointer"] == "/proof/pieces"
        body["design"]["actuators"]["tab"]["delay_s"] = 0.01
        problem = refused(client.post(VERIFY, json=body), 422)
        assert "GAINFIELD_MAX_DELAYED_LOOPS" in problem["detail"]
        body["schedule"]["axes"][0]["values"] = [0.0, 1.0, 2.0]
        for gain in body["schedule"]["gains"]:
            gain["values"] = [[1.0] * 3] * 3
        assert "GAINFIELD_MAX_GRID_POINTS" in refused(client.post(VERIFY, json=body), 422)["detail"]


WILD = st.one_of(
    st.none(), st.floats(allow_nan=False, allow_infinity=False), st.sampled_from([0.0, -0.0, 5e-324, 1e6, 1e12, -1.0])
)
TAME = st.one_of(st.floats(0.0, 1e6), st.floats(0.0, 10.0), st.sampled_from([0.0, 5e-324, 1e-300, 1e6]))


@given(
    values=st.one_of(
        *(st.lists(st.lists(g, min_size=3, max_size=3), min_size=6, max_size=6) for g in (TAME, TAME, WILD))
    ),
    holes=st.lists(st.tuples(st.integers(0, 1), st.integers(0, 2)), max_size=3),
    altitude=st.tuples(st.floats(-1000.0, 32000.0), st.floats(1e-9, 20000.0)),
    speed=st.tuples(st.floats(0.1, 2e4), st.floats(1e-9, 2e4), st.one_of(st.floats(1e-9, 2e4), st.just(1e5))),
    delay=st.sampled_from([0.0, 0.0, 1e-12, 1e-3, 1.0]),
    servo=st.sampled_from([40.0, 1e-3, 1e4, None]),
    law=st.sampled_from(["measured", "filtered", "sampled", "rate"]),
    damping=st.sampled_from(["thesis", "quasi_steady", "unsteady"]),
)
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
def test_no_table_is_a_fault_of_the_server(
    client: TestClient, values: Any, holes: Any, altitude: Any, speed: Any, delay: float, servo: float | None, law: str,
    damping: str,
) -> None:  # fmt: skip
    body = copy.deepcopy(BODIES[VERIFY]()["proved"]["value"])
    for axis, steps in zip(body["schedule"]["axes"], (altitude, speed), strict=True):
        axis["values"] = np.cumsum(steps).tolist()
    for k, gain in enumerate(body["schedule"]["gains"]):
        gain["values"] = values[2 * k : 2 * k + 2]
        for i, j in holes:
            gain["values"][i][j] = None
    tab = body["design"]["actuators"]["tab"]
    tab |= {"delay_s": delay, "servo_bandwidth_hz": servo, "servo_damping_ratio": None if servo is None else 0.7}
    body["design"]["aerodynamics"]["damping"] = damping
    if law == "measured":
        body["controller"]["rate_filter_hz"] = None
    if law == "sampled":
        body["controller"] |= {"sample_time_s": 1e-3}
    if law == "rate":
        body["controller"] |= {"tab_command": "rate"}
        body["schedule"]["gains"].append(body["schedule"]["gains"][0] | {"name": "K_theta", "unit": "1/s"})
    body["proof"] = {"decay_rate_1_s": 0.0, "pieces": 2}
    response = client.post(VERIFY, json=body)
    assert response.status_code in (200, 422), response.text
