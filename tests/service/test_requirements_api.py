"""Manoeuvres over HTTP: responses and requirements, linear and simulated."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.examples import example
from service.settings import Settings

STEP = {"kind": "step", "aileron_deg": 10.0}


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
def test_the_designs_own_step_asks_for_the_same(client: TestClient, here: str, name: str) -> None:
    wanted = client.get(f"{here}/{name}/actuator-requirements").json()
    found = posted(client, f"{here}/{name}/actuator-requirements", {"manoeuvre": STEP, "duration_s": 1.0})
    assert found["nonlinear"] is None
    for actuator, figures in wanted["actuators"].items():
        for figure, values in figures.items():
            ours = found["linear"]["actuators"][actuator][figure]
            np.testing.assert_allclose(np.array(ours, float), np.array(values, float), rtol=1e-7, atol=1e-12)
        hull = found["linear"]["torque_speed"][actuator]["hull"]
        largest = max(abs(corner["torque_n_m"]) for corner in hull)
        assert largest == pytest.approx(wanted["envelope"][actuator]["peak_torque_n_m"]["value"], rel=1e-3)
    error = np.array(found["linear"]["tracking"]["aileron"]["peak_deg"], float)
    assert np.all(error >= 10.0 - 1e-9)


def test_a_limited_rate_asks_for_less(client: TestClient, here: str) -> None:
    body = {"manoeuvre": STEP | {"rate_limit_deg_s": 60.0}, "duration_s": 1.0}
    slow = posted(client, f"{here}/lqr/actuator-requirements", body)["linear"]
    fast = client.get(f"{here}/lqr/actuator-requirements").json()
    for actuator in ("tab", "aileron"):
        for figure in ("peak_rate_deg_s", "peak_power_w"):
            assert np.all(np.array(slow["actuators"][actuator][figure]) < np.array(fast["actuators"][actuator][figure]))
    # A design whose own reference has this limit answers the same, and is judged on it.
    limited = example("wind_tunnel")
    limited["reference"]["rate_limit_deg_s"] = 60.0
    design = client.post("/v1/designs", json=limited).json()
    own = client.get(f"/v1/designs/{design['id']}/controllers/lqr/actuator-requirements").json()
    assert own["reference"]["rate_limit_deg_s"] == pytest.approx(60.0)
    np.testing.assert_allclose(
        own["actuators"]["aileron"]["peak_torque_n_m"], slow["actuators"]["aileron"]["peak_torque_n_m"], rtol=1e-9
    )
    judged = [v for v in design["controllers"][2]["verdicts"] if v["spec"] == "aileron_torque_n_m_max"]
    assert judged[0]["worst_value"] == pytest.approx(own["envelope"]["aileron"]["peak_torque_n_m"]["value"])
    one, two = (
        client.get(f"/v1/designs/{design['id']}/controllers/lqr/response?point=3&kind={kind}").json()
        for kind in ("linear", "nonlinear")
    )
    assert one["simulation"] is None
    assert two["simulation"]["outcome"] == "completed"
    np.testing.assert_allclose(one["signals"]["da_deg"][-1], two["signals"]["da_deg"][-1], atol=0.05)


@pytest.mark.parametrize("name", ["nf", "lqr"])
def test_a_small_manoeuvre_is_linear(client: TestClient, here: str, name: str) -> None:
    """The difference of the two routes falls with the size."""
    errors = []
    for size in (2.0, 1.0):
        body = {
            "point": 2, "manoeuvre": {"kind": "doublet", "aileron_deg": size, "length_s": 0.2}, "duration_s": 0.8,
        }  # fmt: skip
        linear = posted(client, f"{here}/{name}/response", body)
        flown = posted(client, f"{here}/{name}/response", body | {"nonlinear": {"limits": False}})
        assert flown["simulation"]["outcome"] == "completed"
        assert not any(np.any(reached) for reached in flown["simulation"]["limits_reached"]["tab"].values())
        ours = np.interp(linear["time_s"], flown["time_s"], flown["signals"]["da_deg"])
        course = np.array(linear["signals"]["da_deg"])
        errors.append(np.max(np.abs(ours - course)) / size)
        work = flown["simulation"]["energy"]
        assert np.max(np.abs(work["residual_j"])) < 1e-4 * np.max(np.abs(work["tab_actuator_j"]))
    assert errors[0] < 0.05
    # Samples of the two are not at the same times beside the knots: interpolation leaves a floor.
    assert errors[1] < 0.75 * errors[0]


def test_friction_leaves_an_error_and_costs_work(client: TestClient, here: str) -> None:
    body: dict[str, Any] = {"manoeuvre": STEP, "duration_s": 1.0, "nonlinear": {}}
    free = posted(client, f"{here}/lqr/actuator-requirements", body)
    body["nonlinear"] = {"friction": {"aileron": {"static_n_m": 0.4, "kinetic_n_m": 0.3}}}
    rough = posted(client, f"{here}/lqr/actuator-requirements", body)
    assert set(np.ravel(rough["nonlinear"]["simulation"])) == {"completed"}
    for document in (free, rough):
        found = document["nonlinear"]
        for actuator in ("tab", "aileron"):
            for figure in ("peak_torque_n_m", "peak_rate_deg_s", "rms_torque_n_m"):
                plain = np.array(document["linear"]["actuators"][actuator][figure])
                flown = np.array(found["actuators"][actuator][figure])
                np.testing.assert_allclose(
                    found["difference_percent"][actuator][figure], 100.0 * (flown / plain - 1.0), rtol=1e-9
                )
        assert np.max(np.array(found["energy_residual_j"], float)) < 1e-3
    assert [gain["name"] for gain in free["nonlinear"]["anti_windup"]] == ["W_int_a_T_t", "W_int_a_T_a"]
    work = [np.array(d["nonlinear"]["actuators"]["aileron"]["energy_out_j"]) for d in (free, rough)]
    assert np.all(work[1] > work[0])


def test_a_limit_that_is_reached_is_timed_and_not_passed(client: TestClient) -> None:
    weak = example("wind_tunnel")
    weak["actuators"]["tab"]["limits"] |= {"rate_deg_s": 60.0}
    design = client.post("/v1/designs", json=weak).json()
    address = f"/v1/designs/{design['id']}/controllers/pf/actuator-requirements"
    found = posted(client, address, {"manoeuvre": STEP, "duration_s": 1.0, "nonlinear": {}})
    tab, linear = found["nonlinear"]["actuators"]["tab"], found["linear"]["actuators"]["tab"]
    reached = np.array(linear["peak_rate_deg_s"]) > 60.0
    assert reached.any()
    assert np.all(np.array(tab["peak_rate_deg_s"]) <= 60.0 * (1 + 1e-6))
    assert np.all(np.array(tab["time_at_rate_limit_s"])[reached] > 0.0)
    assert np.all(np.array(linear["time_at_rate_limit_s"])[reached] > 0.0)
    assert linear["time_at_power_limit_s"][0][0] is None


def test_a_sine_in_the_long_run_is_the_frequency_response(client: TestClient, here: str) -> None:
    body = {
        "point": 1, "manoeuvre": {"kind": "sine", "aileron_deg": 1.0, "frequency_hz": 2.0}, "duration_s": 6.0,
        "samples": 4001,
    }  # fmt: skip
    found = posted(client, f"{here}/lqr/response", body)
    time, da = np.array(found["time_s"]), np.array(found["signals"]["da_deg"])
    late = time > 4.0
    omega = 2.0 * np.pi * 2.0
    basis = np.stack([np.sin(omega * time[late]), np.cos(omega * time[late]), np.ones(late.sum())], axis=-1)
    fit = np.linalg.lstsq(basis, da[late], rcond=None)[0]
    query = f"frequency-response?point=1&from={omega}&to={omega * 1.0001}&count=2"
    response = client.get(f"{here}/lqr/{query}").json()
    (transfer,) = (one for one in response["reference"] if one["to"] == "da")
    assert np.hypot(fit[0], fit[1]) == pytest.approx(transfer["magnitude"][0], rel=1e-6)


BAD: list[tuple[str, Any, str]] = [
    ("response", {"manoeuvre": {"kind": "jerk"}}, "/manoeuvre/kind"),
    ("response", {"manoeuvre": {"kind": "sine", "aileron_deg": 1.0, "frequency_hz": 0.0}}, "/manoeuvre/frequency_hz"),
    ("response", {"manoeuvre": {"kind": "doublet", "aileron_deg": 1.0}}, "/manoeuvre/length_s"),
    ("response", {"manoeuvre": STEP | {"rate_limit_deg_s": 0.0}}, "/manoeuvre/rate_limit_deg_s"),
    ("response", {"manoeuvre": STEP | {"aileron_deg": 61.0}}, "/manoeuvre/aileron_deg"),
    ("response", {"manoeuvre": STEP, "duration_s": 0.0}, "/duration_s"),
    ("response", {"manoeuvre": STEP, "point": 8}, "/point"),
    ("response", {"manoeuvre": STEP, "samples": 5001}, "/samples"),
    ("response", {"manoeuvre": STEP, "nonlinear": {"tolerance": 1.0}}, "/nonlinear/tolerance"),
    ("response", {"manoeuvre": STEP, "nonlinear": {"freeplay": {"gap_deg": 1.0}}}, "/nonlinear/freeplay/stiffness"),
    (
        "response",
        {"manoeuvre": STEP, "nonlinear": {"friction": {"tab": {"static_n_m": 0.1, "kinetic_n_m": 0.2}}}},
        "/nonlinear/friction/tab/kinetic_n_m",
    ),
    (
        "response",
        {"manoeuvre": {"kind": "recorded", "times_s": [0.0, 0.2, 0.1], "aileron_deg": [0.0, 1.0, 2.0]}},
        "/manoeuvre/times_s",
    ),
    (
        "response",
        {"manoeuvre": {"kind": "recorded", "times_s": [0.0, 1e-320], "aileron_deg": [0.0, 60.0]}},
        "/manoeuvre/times_s",
    ),
    (
        "response",
        {"manoeuvre": {"kind": "recorded", "times_s": [0.0, 0.2], "aileron_deg": [0.0, 1.0, 2.0]}},
        "/manoeuvre/aileron_deg",
    ),
    ("actuator-requirements", {"manoeuvre": STEP, "duration_s": 1000.0, "nonlinear": {}}, "/duration_s"),
    ("actuator-requirements", {"manoeuvre": STEP, "point": 1}, "/point"),
]


@pytest.mark.parametrize(("what", "fields", "pointer"), BAD)
def test_what_cannot_be_flown_is_refused(
    client: TestClient, here: str, refused: Callable[..., dict[str, Any]], what: str, fields: Any, pointer: str
) -> None:
    whole = {"duration_s": 1.0} | ({"point": 0} if what == "response" else {}) | fields
    problem = refused(client.post(f"{here}/nf/{what}", json=whole), 422)
    assert problem["errors"][0]["pointer"] == pointer


def test_what_the_simulation_has_no_place_for_is_a_conflict(
    client: TestClient, here: str, refused: Callable[..., dict[str, Any]]
) -> None:
    link = {"gap_deg": 0.5, "stiffness": 200.0}
    body = {"point": 0, "manoeuvre": STEP, "duration_s": 0.3, "nonlinear": {"freeplay": link}}
    problem = refused(client.post(f"{here}/lqr/response", json=body), 409)
    assert problem["code"] == "study_not_possible"
    assert "freeplay" in problem["detail"]
    assert posted(client, f"{here}/nf/response", body)["simulation"]["outcome"] == "completed"


def test_sampled_state_feedback_has_no_manoeuvres(client: TestClient, refused: Callable[..., dict[str, Any]]) -> None:
    document = example("wind_tunnel")
    document["controllers"] = [document["controllers"][2] | {"sample_time_s": 0.002}]
    design = client.post("/v1/designs", json=document).json()
    address = f"/v1/designs/{design['id']}/controllers/lqr"
    body = {"manoeuvre": STEP, "duration_s": 1.0}
    for what, more in (("response", {"point": 0}), ("actuator-requirements", {})):
        assert refused(client.post(f"{address}/{what}", json=body | more), 409)["code"] == "study_not_possible"
    assert refused(client.get(f"{address}/response?point=0&kind=nonlinear"), 409)["code"] == "study_not_possible"
    document["reference"]["rate_limit_deg_s"] = 60.0
    problem = refused(client.post("/v1/designs", json=document), 422)
    assert problem["errors"][0]["pointer"] == "/reference/rate_limit_deg_s"


def test_limits_name_themselves(tmp_path: Any, refused: Callable[..., dict[str, Any]]) -> None:
    settings = Settings(data_dir=tmp_path, max_manoeuvre_stretches=30, max_simulated_steps=100_000)
    with TestClient(create_app(settings)) as small:
        here = f"/v1/designs/{small.post('/v1/designs', json=example('wind_tunnel')).json()['id']}/controllers/nf"
        times = [0.1 * k for k in range(40)]
        series = {"kind": "recorded", "times_s": times, "aileron_deg": [1.0] * 40}
        body = {"manoeuvre": series, "duration_s": 1.0}
        for what, more in (("response", {"point": 0}), ("actuator-requirements", {})):
            problem = refused(small.post(f"{here}/{what}", json=body | more), 422)
            assert (problem["code"], "max_manoeuvre_stretches" in problem["detail"]) == ("limit_exceeded", True)
        body = {"manoeuvre": STEP, "duration_s": 1.0, "nonlinear": {}}
        problem = refused(small.post(f"{here}/actuator-requirements", json=body), 422)
        assert (problem["code"], "max_simulated_steps" in problem["detail"]) == ("limit_exceeded", True)
