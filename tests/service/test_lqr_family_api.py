"""Structures, allocations and weights of state feedback over HTTP."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from design.sampling import Sampling
from model.linear_model import LinearModel
from schedules.run import run
from service.documentation.design_examples import design_requests
from service.schemas.requests import DesignRequest
from service.to_domain.study_of import study


def designed(client: TestClient, name: str) -> dict[str, Any]:
    response = client.post("/v1/designs", json=design_requests()[name][1])
    assert response.status_code in (200, 201), response.text
    document: dict[str, Any] = response.json()
    return document


def answered(client: TestClient, design: dict[str, Any], name: str, what: str) -> dict[str, Any]:
    response = client.get(f"/v1/designs/{design['id']}/controllers/{name}/{what}")
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


@pytest.mark.parametrize("example", ["lqr_structures", "lqr_power", "lqr_measured", "lqr_sampled"])
def test_everything_is_said_of_every_structure(client: TestClient, example: str) -> None:
    design = designed(client, example)
    point = client.get(f"/v1/designs/{design['id']}/points/0")
    assert point.status_code == 200, point.text
    for controller, here in zip(design["controllers"], point.json()["controllers"], strict=True):
        assert set(np.ravel(controller["outcomes"])) == {"ok"}, controller["reasons"]
        assert set(here["margins"]) == {"tab", "aileron"}
        for what in ("response?point=0", "frequency-response?point=0&count=50", "actuator-requirements", "verdicts"):
            answered(client, design, controller["name"], what)
        asked = next(c for c in design["request"]["controllers"] if c["name"] == controller["name"])
        refused = {"root-locus?point=0"} if asked["sample_time_s"] is not None else set()
        refused |= {"scaling"} if refused or asked["measurement"] is not None else set()
        for what in ("root-locus?point=0", "scaling"):
            answer = client.get(f"/v1/designs/{design['id']}/controllers/{controller['name']}/{what}")
            assert answer.status_code == (409 if what in refused else 200), answer.text
            assert answer.json().get("code") == ("study_not_possible" if what in refused else None)
        for suffix in ("json", "csv", "mat"):
            file = client.get(f"/v1/designs/{design['id']}/schedules/{controller['name']}.{suffix}")
            assert file.status_code == 200, file.text


def test_both_references_are_followed(client: TestClient) -> None:
    design = designed(client, "lqr_structures")
    (both,) = [c["name"] for c in design["request"]["controllers"] if c.get("reference") == "aileron_and_tab"]
    found = answered(client, design, both, "response?point=0&duration_s=20")
    signals, step = found["signals"], design["request"]["reference"]
    assert found["reference"] == {
        "kind": "step",
        **{k: step[k] for k in ("aileron_deg", "tab_deg")},
        "rate_limit_deg_s": None,
        "duration_s": 20.0,
    }
    assert signals["da_deg"][-1] - signals["da_deg"][0] == pytest.approx(step["aileron_deg"], abs=1e-3)
    assert signals["dt_deg"][-1] - signals["dt_deg"][0] == pytest.approx(step["tab_deg"], abs=1e-3)
    names = {g["name"] for g in design["controllers"][-1]["gains"]}
    assert {"K_T_t_int_t", "N_T_a_r_t"} <= names


def test_weighed_power_is_less(client: TestClient) -> None:
    design = designed(client, "lqr_power")
    peak = {}
    for name in ("before", "after"):
        demand = answered(client, design, name, "actuator-requirements")["actuators"]
        peak[name] = sum(np.array(demand[a]["peak_power_w"]) for a in ("tab", "aileron"))
    assert np.all(peak["after"] < peak["before"])


def values(gains: list[dict[str, Any]], symbol: str) -> dict[str, float]:
    return {g["name"]: g["value"] for g in gains if g["name"].startswith(symbol + "_")}


def matrix(gains: list[dict[str, Any]], symbol: str, rows: list[str], columns: list[str]) -> Any:
    """A matrix of the named gains; kinematic entries of a filter's model, which are not named, put in."""
    named = values(gains, symbol)
    kinematic = lambda row, column: float(symbol == "A" and column == f"{row}_rate")  # noqa: E731
    return np.array([[named.get(f"{symbol}_{r}_{c}", kinematic(r, c)) for c in columns] for r in rows])


def test_the_named_gains_of_a_filter_are_a_controller_that_stabilises(client: TestClient) -> None:
    """Plant from the linear model of the answer, controller from the names alone: the poles are those answered."""
    design = designed(client, "lqr_measured")
    for index in (0, 5):
        point = client.get(f"/v1/designs/{design['id']}/points/{index}").json()
        plant = {name: np.array(point["linear_model"][name]) for name in "AB"}
        states, torques = point["linear_model"]["states"], ["T_t", "T_a"]
        for controller in point["controllers"][2:]:
            gains = controller["gains"]
            K = matrix(gains, "K", torques, [*states, "int_a"])
            L, A, B = (
                matrix(gains, symbol, states, columns)
                for symbol, columns in (("L", ["dt", "da"]), ("A", states), ("B", torques))
            )
            C, a = np.eye(4)[[0, 2]], np.eye(4)[[2]]
            # x, int_a, z
            closed = np.block(
                [
                    [plant["A"], -plant["B"] @ K[:, 4:], -plant["B"] @ K[:, :4]],
                    [-a, np.zeros((1, 5))],
                    [L @ C, -B @ K[:, 4:], A - L @ C - B @ K[:, :4]],
                ]
            )
            ours = np.array([p["re"] + 1j * p["im"] for p in controller["poles"]])
            np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(closed)), np.sort_complex(ours), rtol=1e-6)


def test_what_is_lost_by_measuring_angles_only(client: TestClient) -> None:
    """Kalman's inequality holds with all states measured, and with none of the others."""
    point = client.get(f"/v1/designs/{designed(client, 'lqr_measured')['id']}/points/3").json()
    all_states, filtered, estimated, recovered = (controller["estimation"] for controller in point["controllers"])
    assert all_states is None
    assert filtered["filter"] is None
    assert filtered["implemented"]["noise_rms"] is None
    for found in (filtered, estimated, recovered):
        assert all(value >= 1.0 - 1e-6 for value in found["full_state"]["return_difference_min"].values())
        assert all(value < 0.97 for value in found["implemented"]["return_difference_min"].values())
    for controller, found in zip(point["controllers"][1:], (filtered, estimated, recovered), strict=True):
        assert found["implemented"]["margins"] == controller["margins"]
        assert found["full_state"]["margins"] == point["controllers"][0]["margins"]
    plain, more = (min(found["implemented"]["return_difference_min"].values()) for found in (estimated, recovered))
    assert more > plain
    assert all(entry["value"] > 0.0 for entry in estimated["implemented"]["disturbance_rms"])
    assert [entry["unit"] for entry in estimated["filter"]["error_rms"]] == ["deg", "deg/s", "deg", "deg/s"]


def flown_by_samples(model: LinearModel, gains: dict[str, float], sampling: Sampling, duration: float) -> Any:
    """Aileron's response to a step of 10 deg, by a loop over samples in the gains' own names: (times, angles)."""
    from scipy.linalg import expm

    T, K, waiting = sampling.time, {}, round(sampling.delay / sampling.time)
    for name, value in gains.items():
        K[tuple(name.split("_", 3))] = value
    M = np.zeros((6, 6))
    M[:4, :4], M[:4, 4:] = model.A, model.B
    step = expm(M * T)
    x, integral, before, r = np.zeros(4), 0.0, 0.0, np.deg2rad(10.0)
    under_way = [np.zeros(2)] * waiting
    angles = [0.0]
    for k in range(round(duration / T)):
        error = r - x[2]
        integral += 0.5 * T * (error + before) if k else 0.5 * T * error
        before = error
        states = dict(zip(("dt", "dt_rate", "da", "da_rate", "int_a"), (*x, integral), strict=True))
        for age, command in enumerate(reversed(under_way)):
            states |= {f"T_t_{age + 1}": command[0], f"T_a_{age + 1}": command[1]}
        u = np.array(
            [
                gains[f"N_{t}_r_a"] * r - sum(gains[f"K_{t}_{name}"] * value for name, value in states.items())
                for t in ("T_t", "T_a")
            ]
        )
        under_way = [*under_way, u]
        arriving, under_way = under_way[0], under_way[1:]
        x = step[:4] @ np.concatenate([x, arriving])
        angles.append(x[2])
    return T * np.arange(len(angles)), np.array(angles)


def test_the_named_gains_of_a_sampled_design_fly_what_is_answered(client: TestClient) -> None:
    """A controller coded from the names alone, against the answered response, poles and certificate."""
    design = designed(client, "lqr_sampled")
    envelope = run(study(DesignRequest.model_validate(design["request"])))
    for controller in envelope.controllers:
        gains = {gain.name: float(gain.values[0, 2]) for gain in controller.gains}
        assert controller.request.sampling is not None
        times, angles = flown_by_samples(envelope.plant.model.take((0, 2)), gains, controller.request.sampling, 0.3)
        name = controller.request.name
        found = answered(client, design, name, "response?point=2&duration_s=0.3&samples=5000")
        ours = np.interp(found["time_s"], times, np.rad2deg(angles) + found["signals"]["da_deg"][0])
        at_samples = np.isin(np.round(found["time_s"], 9), np.round(times, 9))
        assert at_samples.sum() > 20
        np.testing.assert_allclose(np.array(found["signals"]["da_deg"])[at_samples], ours[at_samples], atol=1e-8)
        here = client.get(f"/v1/designs/{design['id']}/points/2").json()["controllers"]
        (point,) = (one for one in here if one["name"] == name)
        assert point["riccati"]["spectral_radius"] < 1.0
        assert point["riccati"]["return_difference_min"] < 1.0
        assert point["riccati"]["residual"] < 1e-12
        assert max(pole["re"] for pole in point["poles"]) == pytest.approx(point["riccati"]["largest_real_part"])


def test_frequencies_of_a_sampled_loop_end_at_half_the_sampling_rate(client: TestClient) -> None:
    design = designed(client, "lqr_sampled")
    found = answered(client, design, "at_500_hz", "frequency-response?point=2&count=300")
    nyquist = np.pi / 0.002
    assert max(found["omega_rad_s"]) == pytest.approx(nyquist)
    (reference,) = (one for one in found["reference"] if one["to"] == "da")
    assert reference["magnitude"][0] == pytest.approx(1.0, abs=2e-3)
    S, T = (np.array(found["singular_values"][name]) for name in ("sensitivity", "complementary"))
    assert np.all(S[0] + T[0] >= 1.0 - 1e-9)
    # S and T add up to the identity: their products with phases do, entry by entry.
    for one, other in zip(found["sensitivity"], found["complementary"], strict=True):
        both = sum(np.array(part["magnitude"]) * np.exp(1j * np.deg2rad(part["phase_deg"])) for part in (one, other))
        np.testing.assert_allclose(both, float(one["from"] == one["to"]), atol=1e-9)
    point = client.get(f"/v1/designs/{design['id']}/points/2").json()["controllers"][0]
    assert point["disturbance"] is None
    above = client.get(f"/v1/designs/{design['id']}/controllers/at_500_hz/frequency-response?point=2&to={2 * nyquist}")
    assert above.status_code == 422
    assert above.json()["errors"][0]["pointer"] == "/to"


def test_a_filter_of_a_plant_with_lags_late_torques_and_unsteady_air(client: TestClient) -> None:
    """All that a filter can estimate besides: torques behind a lag, lag states of the circulation."""
    document = design_requests()["lqr_measured"][1]
    document["aerodynamics"]["damping"] = "unsteady"
    document["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    for actuator in ("tab", "aileron"):
        document["actuators"][actuator] |= {"torque_loop_bandwidth_hz": 80.0}
    document["actuators"]["tab"]["delay_s"] = 0.0005
    document["controllers"] = document["controllers"][:1] + document["controllers"][2:3]
    design = client.post("/v1/designs", json=document).json()
    point = client.get(f"/v1/designs/{design['id']}/points/0")
    assert point.status_code == 200, point.text
    estimated = point.json()["controllers"][1]
    assert estimated["outcome"] == "ok", estimated["reason"]
    found = estimated["estimation"]["filter"]["error_rms"]
    assert {one["unit"] for one in found} == {"deg", "deg/s", "N m"}
    assert len(found) == 8
    assert all(one["value"] >= 0.0 for one in found)
    units = {gain["name"]: gain["unit"] for gain in estimated["gains"]}
    assert units["L_tab_torque_da"] == "N m/(rad s)"
    assert units["A_dt_rate_tab_torque"] == "rad/(s^2 N m)"
