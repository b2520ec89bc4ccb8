"""Flights over profiles over HTTP."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.examples import example
from service.settings import Settings
from tests.service.lqr_bodies import KALMAN

STEP = {"kind": "step", "aileron_deg": 5.0}
PROFILE = {
    "times_s": [0.0, 0.3, 0.6],
    "altitude_m": [0.0, 900.0, 2500.0],
    "dynamic_pressure_pa": [300.0, 900.0, 1400.0],
}
BODY: dict[str, Any] = {"profile": PROFILE, "manoeuvre": STEP, "duration_s": 0.6, "samples": 61}


@pytest.fixture(scope="module")
def here(client: TestClient) -> str:
    """Address of the example's controllers."""
    return f"/v1/designs/{client.post('/v1/designs', json=example('wind_tunnel')).json()['id']}/controllers"


def posted(client: TestClient, address: str, body: Any) -> dict[str, Any]:
    response = client.post(address, json=body)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_a_constant_profile_is_the_non_linear_response_there(client: TestClient, here: str, name: str) -> None:
    """At the grid point of index 6: 3000 m and 980 Pa."""
    profile = {"times_s": [0.0], "altitude_m": [3000.0], "dynamic_pressure_pa": [980.0]}
    flown = posted(client, f"{here}/{name}/flight-profile", BODY | {"profile": profile})
    asked = {"point": 6, "manoeuvre": STEP, "duration_s": 0.6, "samples": 61, "nonlinear": {"limits": False}}
    same = posted(client, f"{here}/{name}/response", asked)
    np.testing.assert_allclose(flown["time_s"], same["time_s"], atol=1e-12)
    assert flown["signals"].keys() == same["signals"].keys()
    for signal, values in same["signals"].items():
        np.testing.assert_allclose(flown["signals"][signal], values, atol=1e-6 * np.max(np.abs(values)))
    query = "gains?altitude_m=3000&dynamic_pressure_pa=980"
    gains = client.get(f"{here}/{name}/{query}").json()["gains"]
    assert {gain["name"]: gain["values"][7] for gain in flown["gains"]} == gains
    assert not any(flown["clipped"])


def test_gains_and_conditions_follow_the_profile(client: TestClient, here: str) -> None:
    found = posted(client, f"{here}/lqr/flight-profile", BODY | {"duration_s": 0.8, "estimate_error": True})
    assert (found["outcome"], found["reason"], found["diverged_at_s"]) == ("completed", None, None)
    time = np.array(found["time_s"])
    pressure = np.interp(time, PROFILE["times_s"], PROFILE["dynamic_pressure_pa"])
    np.testing.assert_allclose(found["condition"]["dynamic_pressure_pa"], pressure, rtol=1e-14)
    np.testing.assert_allclose(found["condition"]["altitude_m"][-1], 2500.0)
    for k in (0, len(time) // 2, len(time) - 1):
        query = f"gains?altitude_m={found['condition']['altitude_m'][k]}&dynamic_pressure_pa={pressure[k]}"
        wanted = client.get(f"{here}/lqr/{query}").json()["gains"]
        for gain in found["gains"]:
            assert gain["values"][k] == pytest.approx(wanted[gain["name"]], rel=1e-12)
    error = np.array(found["target"]["da_deg"]) - np.array(found["signals"]["da_deg"])
    tracking = found["tracking"]["aileron"]
    assert tracking["peak_deg"] == pytest.approx(np.max(np.abs(error)), rel=1e-6)
    assert tracking["last_deg"] == pytest.approx(error[-1], abs=1e-9)
    torque, power = found["actuators"]["aileron"]["peak_torque_n_m"], found["actuators"]["aileron"]["peak_power_w"]
    rate = np.deg2rad(found["signals"]["da_rate_deg_s"])
    assert torque >= np.max(np.abs(found["signals"]["T_a_n_m"])) - 1e-12
    assert power >= np.max(np.abs(rate * np.array(found["signals"]["T_a_n_m"]))) - 1e-9
    assert found["error_estimate"]["da_deg"] < 1e-5
    assert max(found["slowest_pole_1_s"]) < 0.0
    assert found["limits_reached"].keys() == found["actuators"].keys() == {"tab", "aileron"}


def test_another_measure_of_speed_is_the_same_flight(client: TestClient, here: str) -> None:
    """At sea level a constant airspeed is a constant pressure."""
    one = {"times_s": [0.0, 1.0], "altitude_m": [0.0, 0.0], "airspeed_m_s": [30.0, 30.0]}
    two = {"times_s": [0.0], "altitude_m": [0.0], "dynamic_pressure_pa": [551.25]}
    found = [posted(client, f"{here}/nf/flight-profile", BODY | {"profile": p}) for p in (one, two)]
    np.testing.assert_allclose(found[0]["signals"]["da_deg"], found[1]["signals"]["da_deg"], atol=1e-4)
    assert found[0]["profile"] == one


def test_outside_the_grid_gains_are_clipped_and_the_answer_says_so(client: TestClient, here: str) -> None:
    profile = {"times_s": [0.0, 0.6], "altitude_m": [0.0, 0.0], "dynamic_pressure_pa": [1400.0, 2000.0]}
    found = posted(client, f"{here}/pf/flight-profile", BODY | {"profile": profile})
    outside = np.array(found["condition"]["dynamic_pressure_pa"]) > 1531.25
    assert found["clipped"] == outside.tolist()
    edge = [np.array(gain["values"])[outside] for gain in found["gains"]]
    assert all(np.all(values == values[0]) for values in edge)


def test_a_trim_that_is_held_is_left_to_the_integral(client: TestClient) -> None:
    """The hinge moments of the trim grow with the pressure: known ahead, or taken up by the integral."""
    document = example("wind_tunnel")
    document["controllers"] = document["controllers"][2:]
    here = f"/v1/designs/{client.post('/v1/designs', json=document).json()['id']}/controllers/lqr/flight-profile"
    nothing = BODY | {"manoeuvre": STEP | {"aileron_deg": 0.0}}
    known, held = (posted(client, here, nothing | {"trim": trim}) for trim in ("exact", "held"))
    assert known["tracking"]["aileron"]["peak_deg"] < 1e-9
    assert held["tracking"]["aileron"]["peak_deg"] > 1e-2
    np.testing.assert_allclose(held["signals"]["T_a_n_m"][-1], known["signals"]["T_a_n_m"][-1], rtol=0.3)


BAD: list[tuple[dict[str, Any], str]] = [
    ({"profile": PROFILE | {"times_s": [0.0, 0.3]}}, "/profile/altitude_m"),
    ({"profile": PROFILE | {"times_s": [0.0, 0.6, 0.3]}}, "/profile/times_s"),
    ({"profile": PROFILE | {"times_s": [0.1, 0.3, 0.6]}}, "/profile/times_s"),
    ({"profile": PROFILE | {"dynamic_pressure_pa": [300.0, 900.0]}}, "/profile/dynamic_pressure_pa"),
    ({"profile": PROFILE | {"dynamic_pressure_pa": [300.0, 900.0, 0.0]}}, "/profile/dynamic_pressure_pa/2"),
    ({"profile": PROFILE | {"altitude_m": [0.0, 1.0, 1e5]}}, "/profile/altitude_m/2"),
    ({"profile": PROFILE | {"mach": [0.1, 0.1, 0.1]}}, "/profile"),
    ({"profile": {"times_s": [0.0], "altitude_m": [0.0]}}, "/profile"),
    ({"profile": {"times_s": [], "altitude_m": [], "mach": []}}, "/profile/times_s"),
    ({"profile": PROFILE | {"dynamic_pressure_pa": [300.0, 900.0, 1e6]}}, "/profile"),
    ({"manoeuvre": {"kind": "jerk"}}, "/manoeuvre/kind"),
    ({"samples": 1}, "/samples"),
    ({"samples": 5001}, "/samples"),
    ({"duration_s": 0.0}, "/duration_s"),
    ({"duration_s": 900.0}, "/duration_s"),
    ({"trim": "guessed"}, "/trim"),
    ({"tolerance": 0.0}, "/tolerance"),
    ({"limits": True}, "/limits"),
]


@pytest.mark.parametrize(("fields", "pointer"), BAD)
def test_what_cannot_be_flown_is_refused(
    client: TestClient, here: str, refused: Callable[..., dict[str, Any]], fields: dict[str, Any], pointer: str
) -> None:
    problem = refused(client.post(f"{here}/nf/flight-profile", json=BODY | fields), 422)
    assert problem["errors"][0]["pointer"] == pointer, problem
    assert problem["errors"][0]["allowed"]


def test_a_profile_that_leaves_the_model_says_where(
    client: TestClient, here: str, refused: Callable[..., dict[str, Any]]
) -> None:
    fast = {"times_s": [0.0, 0.5], "altitude_m": [0.0, 10_000.0], "airspeed_m_s": [50.0, 500.0]}
    problem = refused(client.post(f"{here}/nf/flight-profile", json=BODY | {"profile": fast}), 422)
    assert "leaves the model: Mach" in problem["detail"]


def test_limits_name_themselves(tmp_path: Any, refused: Callable[..., dict[str, Any]]) -> None:
    settings = Settings(data_dir=tmp_path, max_manoeuvre_stretches=10, max_profile_steps=2000)
    with TestClient(create_app(settings)) as small:
        here = f"/v1/designs/{small.post('/v1/designs', json=example('wind_tunnel')).json()['id']}/controllers/nf"
        problem = refused(small.post(f"{here}/flight-profile", json=BODY), 422)
        assert (problem["code"], "max_profile_steps" in problem["detail"]) == ("limit_exceeded", True)
        many = {"times_s": [0.01 * k for k in range(20)], "altitude_m": [0.0] * 20, "mach": [0.1] * 20}
        problem = refused(small.post(f"{here}/flight-profile", json=BODY | {"profile": many}), 422)
        assert (problem["code"], "max_manoeuvre_stretches" in problem["detail"]) == ("limit_exceeded", True)


def test_controllers_that_cannot_be_flown_are_a_conflict(
    client: TestClient, refused: Callable[..., dict[str, Any]]
) -> None:
    document = example("wind_tunnel")
    nf, _, lqr = document["controllers"]
    document["controllers"] = [
        lqr | {"sample_time_s": 0.002},
        nf | {"sample_time_s": 0.001},
        lqr | {"name": "kf", "measurement": KALMAN},
    ]
    made = client.post("/v1/designs", json=document).json()
    document["controllers"] = [lqr]
    document["actuators"]["tab"]["delay_s"] = 0.001
    late = client.post("/v1/designs", json=document).json()
    flown = ((made, "lqr", "sampled"), (made, "nf", "computer"), (made, "kf", "estimates"), (late, "lqr", "delays"))
    for design, name, words in flown:
        address = f"/v1/designs/{design['id']}/controllers/{name}/flight-profile"
        problem = refused(client.post(address, json=BODY), 409)
        assert problem["code"] == "study_not_possible"
        assert words in problem["detail"]


def test_a_hole_in_the_schedule_is_a_conflict(client: TestClient, refused: Callable[..., dict[str, Any]]) -> None:
    """Positive feedback with margins that it cannot meet has no gains at any point, or only at some."""
    document = example("wind_tunnel")
    document["controllers"] = [
        document["controllers"][1] | {"specs": {"gain_margin_db_min": 6.0, "damping_ratio_min": 0.5}}
    ]
    design = client.post("/v1/designs", json=document).json()
    problem = refused(client.post(f"/v1/designs/{design['id']}/controllers/pf/flight-profile", json=BODY), 409)
    assert "no gains" in problem["detail"]
