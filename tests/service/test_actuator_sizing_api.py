"""Actuators selected and sized the other way round over HTTP."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter

from design.actuator_sizing.selection import Candidate, RatioRange
from design.manoeuvre import doublet
from model.actuators import ActuatorLimits
from schedules.actuator_selection import select_actuator
from schedules.designed import DesignedEnvelope
from schedules.inverse_sizing import inverse_sizing
from schedules.surface_requirement import GroundGust, LoadCases, Sized
from service.app import create_app
from service.documentation.body_examples import BODIES
from service.schemas import actuator_sizing_answers as answers
from service.settings import Settings
from tests.service.flown_answers import address, at_one_point, exactly, numbers, posted, wind_tunnel

BELOW = "/v1/designs/{id}/controllers/{name}"
SELECTION, INVERSE = "actuator-selection", "inverse-sizing"
DEG = np.pi / 180.0
WANTED: dict[str, Any] = BODIES[f"{BELOW}/{SELECTION}"]()["tab"]["value"]
LIMITS: dict[str, Any] = BODIES[f"{BELOW}/{INVERSE}"]()["torque"]["value"]


@pytest.fixture(scope="module")
def envelope() -> DesignedEnvelope:
    return wind_tunnel()


def asked(client: TestClient, design: dict[str, Any], name: str, what: str, body: Any) -> dict[str, Any]:
    response = client.post(address(design, name, what), json=body)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    model = {SELECTION: answers.ActuatorSelection, INVERSE: answers.InverseSizing}[what]
    TypeAdapter(model).validate_python(document, strict=True)
    return document


@pytest.mark.parametrize(("name", "actuator"), [("nf", "tab"), ("lqr", "tab"), ("lqr", "aileron")])
def test_the_selection_is_the_domains(
    client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope, name: str, actuator: str
) -> None:
    loads = {"system_factor": 1.5, "ground_gust": {"factor": 0.5, "wind_m_s": 20.0}}
    body = copy.deepcopy(WANTED) | {
        "actuator": actuator, "load_cases": loads, "duration_s": 0.8,
        "manoeuvre": {"kind": "doublet", "aileron_deg": 5.0, "length_s": 0.2},
    }  # fmt: skip
    found = asked(client, design, name, SELECTION, body)
    candidates = [
        Candidate("small", 0.15, 30000.0 * DEG, 0.05, 80.0, 1e-6, RatioRange(1.0, 60.0), 0.9),
        Candidate("large", 0.5, 25000.0 * DEG, inertia=2e-5, gear_ratio=(5.0, 10.0, 20.0)),
    ]
    sized = Sized(actuator, doublet(np.array([5.0 * DEG]), 0.2), 0.8, LoadCases(1.5, GroundGust(0.5, 20.0)))
    designed = envelope.controller(name)
    known = select_actuator(envelope.study, envelope.plant, designed, sized, candidates, True)
    demand = known.required.demand
    exactly(found["requirement"]["peak_torque_n_m"], demand.peak_torque)
    exactly(found["requirement"]["peak_rate_deg_s"], demand.peak_rate / DEG)
    exactly(found["requirement"]["peak_hinge_moment_n_m"], known.required.peak_hinge_moment)
    assert found["envelope"]["peak_torque_n_m"] == {
        "value": demand.peak_torque.max(), "point": int(demand.peak_torque.argmax()),
    }  # fmt: skip
    assert [load["case"] for load in found["static_loads"]] == ["holding", "peak_hinge_moment", "ground_gust"]
    for i, load in enumerate(found["static_loads"]):
        exactly(load["torque_n_m"], known.required.surface.static_torque[..., i])
    assert [c["name"] for c in found["candidates"]] == [c.fit.candidate.name for c in known.choices]
    for got, choice in zip(found["candidates"], known.choices, strict=True):
        for part, fit in ((got, choice.fit), (got["fed_back"], choice.fed_back.fit if choice.fed_back else None)):
            assert fit is not None
            assert part["gear_ratio"] == pytest.approx(fit.ratio, rel=1e-9)
            assert part["least_headroom"] == pytest.approx(fit.least, rel=1e-9)
            assert (part["capability"], part["point"], part["enough"]) == (fit.capability, fit.point, fit.enough)
            exactly(part["least_headroom_over_grid"], fit.headroom.least)
            least = {name: worst["value"] for name, worst in part["headroom"].items()}
            assert min(least.values()) == pytest.approx(fit.least)
            assert part["at_surface"]["stall_torque_n_m"] == fit.candidate.stall_torque * fit.ratio
        assert got["fed_back"]["designs"] == (choice.fed_back.designs if choice.fed_back else None)


def test_the_default_manoeuvre_is_the_reference_of_the_design(client: TestClient, design: dict[str, Any]) -> None:
    plain = asked(client, design, "lqr", SELECTION, WANTED | {"feed_back_inertia": False})
    assert (plain["manoeuvre"], plain["duration_s"]) == (None, 1.0)
    step = WANTED | {"feed_back_inertia": False, "manoeuvre": {"kind": "step", "aileron_deg": 10.0}}
    same = asked(client, design, "lqr", SELECTION, step)
    assert same["manoeuvre"]["kind"] == "step"
    assert {k: v for k, v in plain.items() if k != "manoeuvre"} == {k: v for k, v in same.items() if k != "manoeuvre"}
    known = client.get(address(design, "lqr", "actuator-requirements")).json()["actuators"]["tab"]
    for figure in ("peak_torque_n_m", "rms_torque_n_m", "holding_torque_n_m", "peak_rate_deg_s", "peak_power_w"):
        np.testing.assert_allclose(numbers(plain["requirement"][figure]), numbers(known[figure]), rtol=1e-7)
    assert all(candidate["fed_back"] is None for candidate in plain["candidates"])


def test_a_series_of_ratios_in_any_order_and_nothing_but_what_is_required(
    client: TestClient, design: dict[str, Any]
) -> None:
    one = {"name": "x", "stall_torque_n_m": 1.0, "no_load_rate_deg_s": 9000.0, "gear_ratio": [9.0, 1.0, 3.0, 3.0]}
    found = asked(client, design, "nf", SELECTION, {"actuator": "tab", "candidates": [one]})
    (candidate,) = found["candidates"]
    assert candidate["gear_ratio"] in (1.0, 3.0, 9.0)
    assert candidate["at_surface"]["continuous_torque_n_m"] is None
    assert candidate["headroom"]["power"] == {"value": 1.0, "point": 0}


@pytest.mark.parametrize(
    ("name", "actuator", "limits"),
    [
        ("nf", "tab", {"torque_n_m": 0.05, "rate_deg_s": 300.0}),
        ("pf", "tab", {"rate_deg_s": 40.0}),
        ("lqr", "tab", {"torque_n_m": 0.2, "rate_deg_s": 400.0}),
        ("lqr", "aileron", {"torque_n_m": 2.0, "power_w": 10.0}),
    ],
)
def test_the_inverse_is_the_domains(
    client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope, name: str, actuator: str, limits: Any
) -> None:
    found = asked(client, design, name, INVERSE, {"actuator": actuator, "limits": limits})
    inside = ActuatorLimits(
        rate=limits["rate_deg_s"] * DEG if "rate_deg_s" in limits else None,
        torque=limits.get("torque_n_m"), power=limits.get("power_w"),
    )  # fmt: skip
    designed = envelope.controller(name)
    known = inverse_sizing(envelope.study, envelope.plant, designed, actuator, inside)
    assert known.slower is not None
    assert known.after is not None
    assert found["limits"] == {
        "deflection_deg": None, "rate_deg_s": None, "torque_n_m": None, "power_w": None,
    } | limits  # fmt: skip
    assert found["held"]["held"] == known.before.held.tolist()
    assert found["held"]["points_held"] == known.before.held.sum()
    for index in np.ndindex(2, 4):
        broken = [n for n, b in zip(known.before.limited.names, known.before.breaks[index], strict=True) if b]
        assert found["held"]["breaks"][index[0]][index[1]] == broken
    assert found["held"]["peaks"]["peak_deflection_deg"] is None
    within = found["within_limits"]
    assert within["outcomes"] == known.slower.designed.outcomes.codes.tolist()
    assert within["reasons"] == known.slower.designed.outcomes.reasons.tolist()
    assert within["steered_by"] == known.slower.steered_by.tolist()
    exactly(within["factor"], known.slower.factor)
    assert known.slower.designed.assessment is not None
    exactly(within["settling_time_s"], known.slower.designed.assessment.step.settling_time)
    for got, gain in zip(within["gains"], known.slower.designed.gains, strict=True):
        assert got["name"] == gain.name
        exactly(got["values"], gain.values)
    assert within["held"]["points_held"] == known.after.held.sum()
    for index in np.ndindex(2, 4):
        lost = within["outcomes"][index[0]][index[1]] != "ok"
        least = within["least_peaks"]["peak_torque_n_m"]
        assert (least is not None and least[index[0]][index[1]] is not None) == lost


def test_the_gains_within_limits_are_a_design_of_given_gains(client: TestClient, design: dict[str, Any]) -> None:
    """Posted as given gains they ask no more of the actuator than it has."""
    found = asked(client, design, "nf", INVERSE, LIMITS)
    request = copy.deepcopy(design["request"])
    (nf,) = [c for c in request["controllers"] if c["name"] == "nf"]
    values = {gain["name"]: {"values": gain["values"]} for gain in found["within_limits"]["gains"]}
    request["controllers"] = [nf | {"gains": values}]
    request["grid"] = {name: axis for name, axis in request["grid"].items() if axis is not None}
    again = posted(client, request)
    demand = client.get(address(again, "nf", "actuator-requirements")).json()["actuators"]["tab"]
    assert np.max(numbers(demand["peak_torque_n_m"])) <= 0.12 * (1.0 + 1e-9)
    assert np.max(numbers(demand["peak_deflection_deg"])) <= 20.0


def test_gains_that_are_given_are_said_to_leave_no_choice(client: TestClient, wanted: dict[str, Any]) -> None:
    wanted["controllers"] = [wanted["controllers"][0] | {"gains": {"K_p": 0.3, "K_d": 0.01, "K_i": 8.0}}]
    found = asked(client, posted(client, wanted), "nf", INVERSE, LIMITS)
    assert found["within_limits"] is None
    assert "all gains of the controller nf are given" in found["reason"]


def changed(body: dict[str, Any], pointer: str, value: Any) -> dict[str, Any]:
    found = copy.deepcopy(body)
    *path, last = pointer.split("/")[1:]
    node: Any = found
    for part in path:
        node = node[int(part)] if isinstance(node, list) else node[part]
    node[last] = value
    return found


BAD = [
    (SELECTION, "/actuator", "rudder", "/actuator", None, "one of tab, aileron"),
    (SELECTION, "/candidates", [], "/candidates", None, None),
    (SELECTION, "/candidates/0/power_w", 0.0, "/candidates/0/power_w", "W", ">= 1e-09 and <= 1e+09, or null"),
    (SELECTION, "/candidates/0/stall_torque_n_m", "1", "/candidates/0/stall_torque_n_m", "N m", None),
    (SELECTION, "/candidates/0/no_load_rate_deg_s", -1.0, "/candidates/0/no_load_rate_deg_s", "deg/s", None),
    (SELECTION, "/candidates/0/rotor_inertia_kg_m2", -1.0, "/candidates/0/rotor_inertia_kg_m2", "kg m^2", None),
    (SELECTION, "/candidates/0/efficiency", 1.1, "/candidates/0/efficiency", "1", ">= 0.001 and <= 1"),
    (SELECTION, "/candidates/0/gear_ratio", 0.0, "/candidates/0/gear_ratio", "1", None),
    (SELECTION, "/candidates/0/gear_ratio", [], "/candidates/0/gear_ratio", "1", None),
    (SELECTION, "/candidates/0/gear_ratio", "1:5", "/candidates/0/gear_ratio", "1", None),
    (SELECTION, "/candidates/0/gear_ratio", {"low": 5.0, "high": 5.0}, "/candidates/0/gear_ratio/high", "1", "> 5"),
    (SELECTION, "/candidates/1/name", "small", "/candidates/1/name", None, "another name"),
    (SELECTION, "/candidates/1/colour", "red", "/candidates/1/colour", None, None),
    (SELECTION, "/manoeuvre", {"kind": "spiral"}, "/manoeuvre/kind", None, None),
    (SELECTION, "/duration_s", 0.0, "/duration_s", "s", None),
    (SELECTION, "/load_cases", {"system_factor": 0.9}, "/load_cases/system_factor", "1", None),
    (SELECTION, "/load_cases", {"ground_gust": {"wind_m_s": 0.0}}, "/load_cases/ground_gust/wind_m_s", "m/s", None),
    (SELECTION, "/feed_back_inertia", 1, "/feed_back_inertia", None, "true or false"),
    (INVERSE, "/limits", {}, "/limits", None, "one limit at least that is not null"),
    (INVERSE, "/limits", {"torque_n_m": None}, "/limits", None, "one limit at least that is not null"),
    (INVERSE, "/limits", {"torque_n_m": 0.0}, "/limits/torque_n_m", "N m", None),
    (INVERSE, "/limits", {"torque": 1.0}, "/limits/torque", None, None),
    (INVERSE, "/actuator", None, "/actuator", None, None),
]  # fmt: skip


@pytest.mark.parametrize(("what", "pointer", "value", "named", "unit", "allowed"), BAD)
def test_names_field_unit_and_range(
    client: TestClient, design: dict[str, Any], refused: Any, what: str, pointer: str, value: Any, named: str,
    unit: str | None, allowed: str | None,
) -> None:  # fmt: skip
    body = changed({SELECTION: WANTED, INVERSE: LIMITS}[what], pointer, value)
    problem = refused(client.post(address(design, "lqr", what), json=body), 422)
    (error,) = problem["errors"]
    assert error["pointer"] == named
    assert error["unit"] == unit
    assert error["allowed"]
    assert allowed is None or error["allowed"] == allowed


@pytest.mark.parametrize("what", [SELECTION, INVERSE])
def test_controllers_that_cannot_be_sized(
    client: TestClient, design: dict[str, Any], wanted: dict[str, Any], refused: Any, what: str
) -> None:
    body = {SELECTION: WANTED, INVERSE: LIMITS}[what]
    (error,) = refused(client.post(address(design, "nf", what), json=body | {"actuator": "aileron"}), 422)["errors"]
    assert (error["pointer"], error["allowed"]) == ("/actuator", "one of tab")
    refused(client.post(address(design, "nobody", what), json=body), 404)
    refused(client.post(address({"id": "0" * 32}, "nf", what), json=body), 404)
    refused(client.post(address(design, "nf", what), content=b"{", headers={"Content-Type": "application/json"}), 400)
    refused(client.post(address(design, "nf", what), content=b"{}", headers={"Content-Type": "text/plain"}), 415)
    coded = copy.deepcopy(wanted)
    coded["controllers"] = [coded["controllers"][2] | {"sample_time_s": 0.002}]
    problem = refused(client.post(address(posted(client, coded), "lqr", what), json=body), 409)
    assert problem["code"] == "study_not_possible"
    assert "runs as code" in problem["detail"]
    wanted["controllers"] = [
        wanted["controllers"][0] | {"specs": {"damping_ratio_min": 0.9, "settling_time_s_max": 1e-3}}
    ]
    nowhere = posted(client, wanted)
    assert {code for row in nowhere["controllers"][0]["outcomes"] for code in row} == {"infeasible"}
    problem = refused(client.post(address(nowhere, "nf", what), json=body), 409)
    assert "has no gains at any point" in problem["detail"]


def test_an_ideal_deflection_has_no_torque_to_size(client: TestClient, wanted: dict[str, Any], refused: Any) -> None:
    gains = {"K_p": 0.3, "K_d": 0.01, "K_i": 8.0}
    wanted["controllers"] = [wanted["controllers"][0] | {"gains": gains}]
    wanted["actuators"]["tab"] = {}
    design = posted(client, wanted)
    problem = refused(client.post(address(design, "nf", SELECTION), json=WANTED), 409)
    assert "its torque is not finite" in problem["detail"]
    found = asked(client, design, "nf", INVERSE, LIMITS)
    assert found["held"]["points_held"] == 0
    assert found["held"]["breaks"][0][0] == ["torque"]


def test_too_much_work_is_refused(tmp_path: Path, refused: Callable[..., dict[str, Any]], quick: Any) -> None:
    small = Settings(
        data_dir=tmp_path, max_actuator_candidates=3, max_manoeuvre_stretches=60, max_point_designs=40,
        max_tab_only_designs=1,
    )  # fmt: skip

    def limit(client: TestClient, design: dict[str, Any], name: str, what: str, body: Any) -> str:
        problem = refused(client.post(address(design, name, what), json=body), 422)
        assert problem["code"] == "limit_exceeded"
        return str(problem["detail"])

    with TestClient(create_app(small), raise_server_exceptions=False) as client:
        design = posted(client, quick)
        one = WANTED["candidates"][0]
        several = [one | {"name": f"m{i}"} for i in range(4)]
        plain = WANTED | {"feed_back_inertia": False}
        assert "max_actuator_candidates" in limit(client, design, "lqr", SELECTION, plain | {"candidates": several})
        assert "max_point_designs" in limit(client, design, "lqr", SELECTION, WANTED | {"candidates": several[:3]})
        fast = {"kind": "sine", "aileron_deg": 1.0, "frequency_hz": 1000.0}
        assert "max_manoeuvre_stretches" in limit(
            client, design, "lqr", SELECTION, plain | {"manoeuvre": fast, "duration_s": 1000.0}
        )
        long = {"kind": "recorded", "times_s": [0.1 * i for i in range(61)], "aileron_deg": [1.0] * 61}
        assert "max_manoeuvre_stretches" in limit(client, design, "lqr", SELECTION, plain | {"manoeuvre": long})
        assert asked(client, design, "lqr", SELECTION, plain)["candidates"]
        quick["grid"] = {"altitude_m": [0.0, 1000.0], "dynamic_pressure_pa": [980.0]}
        more = posted(client, quick)
        assert "max_tab_only_designs" in limit(client, more, "lqr", INVERSE, LIMITS)


candidates = st.fixed_dictionaries(
    {
        "name": st.just("x"),
        "stall_torque_n_m": st.sampled_from([1e-9, 0.1, 1e9]),
        "no_load_rate_deg_s": st.sampled_from([1e-3, 3e4, 1e9]),
        "continuous_torque_n_m": st.sampled_from([None, 1e-9, 0.1, 1e9]),
        "power_w": st.sampled_from([None, 1e-9, 1e9]),
        "rotor_inertia_kg_m2": st.sampled_from([0.0, 5e-324, 1e-6, 1e3]),
        "gear_ratio": st.sampled_from([1e-4, 1e6, [1e-4, 20.0, 1e6], {"low": 1e-4, "high": 1e6}]),
        "efficiency": st.sampled_from([1e-3, 0.9, 1.0]),
    }
)
manoeuvres = st.sampled_from(
    [
        None,
        {"kind": "step", "aileron_deg": 0.0},
        {"kind": "step", "aileron_deg": 60.0, "rate_limit_deg_s": 1e-3},
        {"kind": "ramp", "aileron_deg_s": 1e5},
        {"kind": "sine", "aileron_deg": 5.0, "frequency_hz": 1e-3},
        {"kind": "doublet", "aileron_deg": 5.0, "length_s": 1e-3},
        {"kind": "recorded", "times_s": [0.0, 0.0, 1e-300, 1.0], "aileron_deg": [0.0, 60.0, -60.0, 0.0]},
    ]
)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(candidates, manoeuvres, st.sampled_from([None, 1e-3, 1e3]), st.sampled_from(["nf", "lqr"]), st.booleans())
def test_no_candidate_breaks_the_server(
    client: TestClient, design: dict[str, Any], one: Any, manoeuvre: Any, duration: Any, name: str, feed_back: bool
) -> None:
    body = {
        "actuator": "tab", "candidates": [one], "manoeuvre": manoeuvre, "duration_s": duration,
        "feed_back_inertia": feed_back,
    }  # fmt: skip
    response = client.post(address(design, name, SELECTION), json=body)
    assert response.status_code in (200, 409, 422), (json.dumps(body), response.text)
    if response.status_code == 200:
        TypeAdapter(answers.ActuatorSelection).validate_python(response.json(), strict=True)


@pytest.mark.parametrize("name", ["nf", "lqr"])
@pytest.mark.parametrize(
    "limits",
    [
        {"torque_n_m": 5e-324},
        {"torque_n_m": 1e9, "rate_deg_s": 1e6, "deflection_deg": 180.0, "power_w": 1e9},
        {"rate_deg_s": 1e-300},
        {"deflection_deg": 1e-9},
        {"power_w": 1e-12},
    ],
)
def test_no_limit_breaks_the_server(
    client: TestClient, wanted: dict[str, Any], name: str, limits: dict[str, float]
) -> None:
    wanted["controllers"] = [c for c in wanted["controllers"] if c["name"] == name]
    found = asked(client, posted(client, at_one_point(wanted)), name, INVERSE, {"actuator": "tab", "limits": limits})
    held = found["within_limits"]["held"]["points_held"]
    assert held == (1 if limits.get("torque_n_m") == 1e9 else 0)
    assert held or found["within_limits"]["reasons"][0][0]
