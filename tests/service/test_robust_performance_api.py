"""Gains flown on plants that are off over HTTP, and what both kinds of flight refuse."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from schedules.designed import DesignedEnvelope
from schedules.judging import asked
from schedules.perturbations import Cases, Uncertainty
from schedules.robust_performance import corners, least_fraction, monte_carlo, perturbed_performance
from service.app import create_app
from service.examples import example
from service.settings import Settings
from tests.service.flown_answers import (
    FIGURES,
    address,
    answered,
    at_one_point,
    exactly,
    least_damping,
    numbers,
    posted,
    wind_tunnel,
)

DERIVATIVES = ("C_Ha_da", "C_Ha_dt", "C_Ht_da", "C_Ht_dt")
INERTIAS = ("aileron_inertia", "tab_inertia")


def off(derivatives: float = 0.2, inertias: float = 0.1) -> list[Uncertainty]:
    changes = dict.fromkeys(DERIVATIVES, derivatives) | dict.fromkeys(INERTIAS, inertias)
    return [Uncertainty(name, change) for name, change in changes.items()]  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def envelope() -> DesignedEnvelope:
    return wind_tunnel()


@pytest.fixture
def one_point(wanted: dict[str, Any]) -> dict[str, Any]:
    return at_one_point(wanted)


@pytest.mark.parametrize(
    ("field", "group"), [("inertia_kg_m2", "inertia"), ("mass_kg", "mass"), ("cg_offset_m", "cg_offset")]
)
def test_a_perturbed_plant_is_a_design_of_another_section(
    client: TestClient, design: dict[str, Any], one_point: dict[str, Any], field: str, group: str
) -> None:
    """The worst case's section, posted with the gains of the nominal one."""
    others = "hinge_moment_percent=0&inertia_percent=0&mass_percent=0&cg_offset_percent=0"
    query = f"robust-performance?{others}".replace(f"{group}_percent=0", f"{group}_percent=15")
    worst = answered(client, design, "nf", query)["figures"]["damping_ratio"]
    asked_for = design["controllers"][0]
    assert asked_for["name"] == "nf"
    one_point["controllers"] = [
        {**one_point["controllers"][0], "gains": {g["name"]: g["values"][0][2] for g in asked_for["gains"]}}
    ]
    for surface in ("aileron", "tab"):
        one_point["inertia"][surface][field] *= worst["worst_factors"][f"{surface}_{group}"][0][2]
    assert least_damping(client, one_point) == pytest.approx(worst["worst"][0][2], rel=1e-9)
    assert worst["worst"][0][2] < worst["nominal"][0][2]


def test_a_controller_without_any_design(client: TestClient, wanted: dict[str, Any]) -> None:
    specs = {"damping_ratio_min": 0.5, "gain_margin_db_min": 6.0, "phase_margin_deg_min": 45.0}
    wanted["controllers"] = [{"name": "pf", "kind": "positive_feedback", "specs": specs}]
    document = posted(client, wanted)
    found = answered(client, document, "pf", "cross-flight?margins=true")
    assert found["best"] is found["worst_pair"] is None
    assert found["reason"] == "no point carries a design"
    assert {code for row in found["pairs"]["outcomes"] for code in row} == {"no_design"}
    assert found["points_held"] == [[None] * 4] * 2
    assert all(reason for row in found["reasons"] for reason in row)
    found = answered(client, document, "pf", "robust-performance?method=monte_carlo&draws=3")
    assert found["stable"] == found["held"] == {"part": [[None] * 4] * 2, "at_least": [[None] * 4] * 2}
    assert found["everywhere"]["stable"] == {"part": None, "at_least": None}
    for figure in found["figures"].values():
        assert figure["worst"] == figure["worst_case"] == figure["nominal"] == figure["reasons"] == [[None] * 4] * 2
        assert figure["worst_of_all"] is None
        assert figure["influence"]["reasons"] == [[None] * 4] * 2


def test_a_grid_of_one_point(client: TestClient, one_point: dict[str, Any]) -> None:
    document = posted(client, one_point)
    for name in ("nf", "pf", "lqr"):
        found = answered(client, document, name, "cross-flight")
        assert found["points_held"] == found["points_flown"] == [[1]]
        assert found["best"]["point"] == found["worst_pair"]["design"] == found["worst_pair"]["flown"] == 0
        found = answered(client, document, name, "robust-performance?method=monte_carlo&draws=1")
        assert found["figures"]["damping_ratio"]["worst_case"] == [[0]]
        assert found["stable"]["part"] == [[found["everywhere"]["stable"]["part"]]]


def test_a_regulator_has_no_step_to_follow(client: TestClient, one_point: dict[str, Any]) -> None:
    one_point["controllers"] = [{**one_point["controllers"][2], "reference": "none"}]
    document = posted(client, one_point)
    pairs = answered(client, document, "lqr", "cross-flight")["pairs"]
    assert (pairs["outcomes"], pairs["settling_time_s"], pairs["stable"]) == ([["no_step"]], [[None]], [[True]])
    figures = answered(client, document, "lqr", "robust-performance")["figures"]
    assert figures["overshoot_percent"]["reasons"] == [["without a step to follow in 64 of 64 cases"]]
    assert figures["overshoot_percent"]["influence"]["reasons"] == [["fewer than 8 cases have a value"]]
    assert figures["damping_ratio"]["reasons"] == [[None]]


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
@pytest.mark.parametrize("method", ["corners", "monte_carlo"])
def test_robust_performance_is_the_domains(
    client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope, name: str, method: str
) -> None:
    designed = envelope.controller(name)
    of, specs = (envelope.study, envelope.plant, designed, off()), asked(designed.request)
    if method == "corners":
        wanted, query = corners(*of, specs, margins=True), "robust-performance?margins=true"
    else:
        wanted = monte_carlo(*of, 70, 9, specs, margins=True)
        query = "robust-performance?margins=true&method=monte_carlo&draws=70&seed=9&confidence=0.9"
    found = answered(client, design, name, query)
    cases = len(wanted.cases)
    assert (found["method"], found["cases"]) == (method, cases)
    for part in ("stable", "held"):
        fraction = getattr(wanted, f"{part}_fraction")
        together = getattr(wanted, f"{part}_everywhere").mean()
        exactly(found[part]["part"], fraction)
        assert found["everywhere"][part]["part"] == pytest.approx(together)
        if method == "corners":
            assert found[part]["at_least"] is found["everywhere"][part]["at_least"] is None
        else:
            exactly(found[part]["at_least"], least_fraction(fraction, cases, 0.9))
            least = least_fraction(np.array(together), cases, 0.9)
            assert found["everywhere"][part]["at_least"] == pytest.approx(float(least))
    assert set(found["figures"]) == set(FIGURES)
    for field, (attribute, scale) in FIGURES.items():
        got = found["figures"][field]
        over, influence = wanted.distribution(attribute), wanted.influence(attribute)  # type: ignore[arg-type]
        exactly(got["nominal"], getattr(wanted.nominal, attribute) * scale)
        assert got["worst_case"] == over.worst_case.tolist()
        for statistic in ("worst", "p05", "p50", "p95"):
            exactly(got[statistic], getattr(over, statistic) * scale)
        for k, parameter in enumerate((*DERIVATIVES, *INERTIAS)):
            exactly(got["worst_factors"][parameter], over.worst_factors[..., k])
            exactly(got["influence"]["standardised"][parameter], influence.standardised[..., k])
            exactly(got["influence"]["change_per_percent"][parameter], influence.slope[..., k] * scale / 100.0)
        exactly(got["influence"]["explained"], influence.explained)
        for index, named in np.ndenumerate(np.array(got["influence"]["most_influential"], dtype=object)):
            strength = np.abs(influence.standardised[index])
            reason = got["influence"]["reasons"][index[0]][index[1]]
            assert (named is None) == bool(reason) == bool(np.isnan(strength).any())
            assert named is None or named == (*DERIVATIVES, *INERTIAS)[int(np.argmax(strength))]
        missing = np.isnan(getattr(wanted.figures, attribute)).sum(axis=-1)
        for index, reason in np.ndenumerate(np.array(got["reasons"], dtype=object)):
            counts = [int(part.split(" in ")[-1].split(" of ")[0]) for part in (reason or "").split("; ") if part]
            assert sum(counts) == missing[index]


def test_the_worst_of_all_is_the_worst_anywhere(client: TestClient, design: dict[str, Any]) -> None:
    for name in ("nf", "pf"):
        found = answered(client, design, name, "robust-performance?margins=true")
        for field, figure in found["figures"].items():
            worst, overall = numbers(figure["worst"]), figure["worst_of_all"]
            assert worst.flat[overall["point"]] == overall["value"] or overall["value"] is None
            if np.isnan(worst).any():
                assert overall["value"] is None
            else:
                large = field in ("largest_real_part", "settling_time_s", "overshoot_percent")
                assert overall["value"] == (worst.max() if large else worst.min())
            assert overall["case"] == np.array(figure["worst_case"]).flat[overall["point"]]
            factors = {n: np.array(v).flat[overall["point"]] for n, v in figure["worst_factors"].items()}
            assert overall["factors"] == factors


def test_the_worst_case_can_be_flown_again(
    client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope
) -> None:
    """By its factors; and by seed and number, as the last of so many draws."""
    seeded = "robust-performance?method=monte_carlo&seed=4&draws="
    worst = answered(client, design, "nf", f"{seeded}60")["figures"]["damping_ratio"]["worst_of_all"]
    cases = Cases(tuple(worst["factors"]), np.array([list(worst["factors"].values())]))  # type: ignore[arg-type]
    again = perturbed_performance(envelope.study, envelope.plant, envelope.controller("nf"), cases)
    assert again.figures.damping_ratio[..., 0].flat[worst["point"]] == pytest.approx(worst["value"], rel=1e-11)
    fewer = answered(client, design, "nf", f"{seeded}{worst['case'] + 1}")["figures"]["damping_ratio"]["worst_of_all"]
    assert fewer == worst


def test_same_seed_same_bytes(client: TestClient, design: dict[str, Any]) -> None:
    where = address(design, "lqr", "robust-performance?method=monte_carlo&draws=40&seed=")
    first, again, other = (client.get(f"{where}{seed}") for seed in (7, 7, 8))
    assert first.content == again.content
    assert first.headers["etag"] == again.headers["etag"] != other.headers["etag"]
    assert client.get(f"{where}7", headers={"If-None-Match": first.headers["etag"]}).status_code == 304
    worst = "worst_factors"
    assert first.json()["figures"]["damping_ratio"][worst] != other.json()["figures"]["damping_ratio"][worst]


def test_what_is_off_and_how_far(client: TestClient, one_point: dict[str, Any]) -> None:
    document = posted(client, one_point)
    query = (
        "robust-performance?method=monte_carlo&distribution=normal&deviation_ratio=0.3&draws=500&hinge_moment_percent=0"
        "&C_Ha_da_percent=7&inertia_percent=12&tab_inertia_percent=0&mass_percent=3&cg_offset_percent=50"
    )
    found = answered(client, document, "lqr", query)
    changes = {p["parameter"]: (p["change_percent"], p["deviation_percent"]) for p in found["parameters"]}
    assert changes == {
        "C_Ha_da": (7.0, 2.1),
        "aileron_inertia": (12.0, 3.6),
        "aileron_mass": (3.0, 0.9),
        "tab_mass": (3.0, 0.9),
        "aileron_cg_offset": (50.0, 15.0),
        "tab_cg_offset": (50.0, 15.0),
    }
    assert (found["distribution"], found["seed"], found["confidence"]) == ("normal", 0, 0.95)
    for name, factor in found["figures"]["damping_ratio"]["worst_factors"].items():
        assert abs(factor[0][0] - 1.0) <= changes[name][0] / 100.0
    found = answered(client, document, "lqr", "robust-performance?inertia_percent=0")
    assert found["cases"] == 16
    assert found["seed"] is found["distribution"] is found["confidence"] is None


def test_what_held_means_can_be_chosen(client: TestClient, design: dict[str, Any]) -> None:
    for what in ("cross-flight", "robust-performance"):
        none = answered(client, design, "pf", f"{what}?specs=none")
        assert none["specs"] == []
        if what == "cross-flight":
            assert none["pairs"]["held"] == none["pairs"]["stable"]
        else:
            assert none["held"] == none["stable"]
        pack = answered(client, design, "pf", f"{what}?specs=spec_pack")
        unknown = [s for s in pack["specs"] if not s["judged"]]
        assert [s["spec"] for s in unknown] == ["sensitivity_peak_max"]
        assert "not judged away from the design" in unknown[0]["reason"]
        assert {s["source"] for s in pack["specs"]} == {"spec_pack"}
        degrees = next(s for s in pack["specs"] if s["spec"] == "phase_margin_deg_min")
        assert (degrees["limit"], degrees["unit"], degrees["judged"]) == (45.0, "deg", True)
    # Positive feedback has no margins to speak of.
    assert pack["held"]["part"] == [[0.0] * 4] * 2


def test_delays_are_flown(client: TestClient, one_point: dict[str, Any]) -> None:
    one_point["actuators"]["tab"]["delay_s"] = 0.002
    one_point["controllers"] = one_point["controllers"][:1]
    late = posted(client, one_point)
    pairs = answered(client, late, "nf", "cross-flight")["pairs"]
    here = client.get(f"/v1/designs/{late['id']}/points/0").json()["controllers"][0]
    assert pairs["settling_time_s"][0][0] == pytest.approx(here["step"]["settling_time_s"], rel=1e-9)
    found = answered(client, late, "nf", "robust-performance?inertia_percent=0&C_Ht_da_percent=0&C_Ht_dt_percent=0")
    assert found["stable"]["part"] == [[1.0]]
    assert found["figures"]["damping_ratio"]["worst"][0][0] < found["figures"]["damping_ratio"]["nominal"][0][0]


def test_digital_controllers_fly_as_late_as_they_are(client: TestClient, one_point: dict[str, Any]) -> None:
    """At home the step is the one that was judged, to every digit."""
    one_point["controllers"] = [{**one_point["controllers"][0], "sample_time_s": 0.002}]
    document = posted(client, one_point)
    here = client.get(f"/v1/designs/{document['id']}/points/0").json()["controllers"][0]
    pairs = answered(client, document, "nf", "cross-flight")["pairs"]
    assert pairs["settling_time_s"][0][0] == pytest.approx(here["step"]["settling_time_s"], rel=1e-9)
    prompt = posted(client, one_point | {"controllers": [{**one_point["controllers"][0], "sample_time_s": None}]})
    other = answered(client, prompt, "nf", "cross-flight")["pairs"]
    assert other["settling_time_s"][0][0] != pytest.approx(here["step"]["settling_time_s"], rel=1e-3)


def test_controllers_that_run_a_model_of_their_point_are_refused(
    client: TestClient, one_point: dict[str, Any], refused: Callable[..., dict[str, Any]]
) -> None:
    lqr = next(c for c in example("wind_tunnel")["controllers"] if c["kind"] == "lqr")
    kalman = {
        "kind": "kalman", "tab_torque_noise": 0.002, "aileron_torque_noise": 0.01, "tab_angle_noise_deg": 0.001,
        "aileron_angle_noise_deg": 0.002,
    }  # fmt: skip
    one_point["controllers"] = [
        {**lqr, "name": "sampled", "sample_time_s": 0.002}, {**lqr, "name": "estimated", "measurement": kalman},
        {**lqr, "name": "filtered", "measurement": {"kind": "rate_filters", "cutoff_hz": 300.0}},
    ]  # fmt: skip
    document = posted(client, one_point)
    for what in ("cross-flight", "robust-performance"):
        for name in ("sampled", "estimated"):
            assert refused(client.get(address(document, name, what)), 409)["code"] == "study_not_possible"
        answered(client, document, "filtered", what)


@pytest.mark.parametrize(
    ("query", "pointer"),
    [
        ("cross-flight?point=3", "/point"),
        ("cross-flight?margins=perhaps", "/margins"),
        ("cross-flight?specs=mine", "/specs"),
        ("robust-performance?method=guess", "/method"),
        ("robust-performance?hinge_moment_percent=100", "/hinge_moment_percent"),
        ("robust-performance?inertia_percent=-1", "/inertia_percent"),
        ("robust-performance?C_Ha_da_percent=nan", "/C_Ha_da_percent"),
        ("robust-performance?mass_percent=inf", "/mass_percent"),
        ("robust-performance?hinge_moment_percent=0&inertia_percent=0", "/hinge_moment_percent"),
        ("robust-performance?mass_percent=1", "/method"),
        ("robust-performance?draws=10", "/draws"),
        ("robust-performance?seed=0", "/seed"),
        ("robust-performance?distribution=uniform", "/distribution"),
        ("robust-performance?confidence=0.9", "/confidence"),
        ("robust-performance?method=monte_carlo&deviation_ratio=0.4", "/deviation_ratio"),
        ("robust-performance?method=monte_carlo&draws=0", "/draws"),
        ("robust-performance?method=monte_carlo&draws=100001", "/draws"),
        ("robust-performance?method=monte_carlo&seed=-1", "/seed"),
        ("robust-performance?method=monte_carlo&seed=1.5", "/seed"),
        ("robust-performance?method=monte_carlo&seed=99999999999999999999", "/seed"),
        ("robust-performance?method=monte_carlo&confidence=1", "/confidence"),
    ],
)
def test_bad_queries(
    client: TestClient, design: dict[str, Any], refused: Callable[..., dict[str, Any]], query: str, pointer: str
) -> None:
    problem = refused(client.get(address(design, "nf", query)), 422)
    assert [error["pointer"] for error in problem["errors"]] == [pointer]
    assert problem["errors"][0]["allowed"]


@pytest.mark.parametrize("what", ["cross-flight", "robust-performance"])
def test_nothing_of_that_name(
    client: TestClient, design: dict[str, Any], refused: Callable[..., dict[str, Any]], what: str
) -> None:
    refused(client.get(address(design, "nobody", what)), 404)
    refused(client.get(f"/v1/designs/{'0' * 32}/controllers/nf/{what}"), 404)


@pytest.mark.parametrize("change", ["5e-324", "1e-9", "99"])
def test_the_ends_of_every_range(client: TestClient, one_point: dict[str, Any], change: str) -> None:
    """Nothing, next to nothing and all but everything; as narrow and as wide as it can be drawn."""
    document = posted(client, one_point)
    groups = "&".join(f"{group}_percent={change}" for group in ("hinge_moment", "inertia", "mass", "cg_offset"))
    for name in ("nf", "lqr"):
        for how in ("uniform", "normal&deviation_ratio=0.01", "normal&deviation_ratio=10"):
            query = f"robust-performance?method=monte_carlo&draws=20&seed={2**53 - 1}&{groups}&distribution={how}"
            response = client.get(address(document, name, query))
            assert response.status_code == (422 if change == "5e-324" else 200), response.text


def test_limits_name_their_setting(
    tmp_path: Path, one_point: dict[str, Any], refused: Callable[..., dict[str, Any]]
) -> None:
    one_point["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [245.0, 980.0]}
    one_point["controllers"] = one_point["controllers"][:1]
    late = copy.deepcopy(one_point)
    late["actuators"]["tab"]["delay_s"] = 0.001
    with TestClient(create_app(Settings(data_dir=tmp_path, max_flown_loops=7, max_delayed_loops=3))) as small:
        listed = {limit["name"]: limit["value"] for limit in small.get("/v1/limits").json()["limits"]}
        assert (listed["max_flown_loops"], listed["max_delayed_loops"]) == (7, 3)
        prompt, late = posted(small, one_point), posted(small, late)
        drawn = "robust-performance?method=monte_carlo&draws="
        for document, setting, query, pointer in [
            (prompt, "FLOWN", f"{drawn}4", "/draws"),
            (prompt, "FLOWN", "robust-performance", "/method"),
            (late, "DELAYED", f"{drawn}2", "/draws"),
            (late, "DELAYED", "cross-flight", "/id"),
        ]:
            problem = refused(small.get(address(document, "nf", query)), 422)
            assert problem["code"] == "limit_exceeded"
            assert f"GAINFIELD_MAX_{setting}_LOOPS" in problem["detail"]
            assert problem["errors"][0]["pointer"] == pointer
        for document, query in [(prompt, "cross-flight"), (prompt, f"{drawn}3"), (late, f"{drawn}1")]:
            assert answered(small, document, "nf", query)["name"] == "nf"
