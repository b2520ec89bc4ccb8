"""The four tab-only controllers over HTTP: designs, given gains, delays, digital ones, and all that is said of them."""

from __future__ import annotations

import copy
import io
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.io import loadmat

from service.examples import example

FOUR = ("nf", "nf_rate", "pf", "pf_rate")


def four_controllers(name: str) -> dict[str, Any]:
    """A shipped request with its two tab-only controllers, each by both commands of the tab's actuator."""
    request = copy.deepcopy(example(name))
    classical = [c for c in request["controllers"] if c["kind"] != "lqr"]
    by_rate = [{**c, "name": f"{c['name']}_rate", "tab_command": "rate"} for c in classical]
    request["controllers"] = classical + by_rate
    return request


def posted(client: TestClient, request: dict[str, Any]) -> dict[str, Any]:
    response = client.post("/v1/designs", json=request)
    assert response.status_code in (200, 201), response.text
    document: dict[str, Any] = response.json()
    return document


def controllers(document: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {c["name"]: c for c in document["controllers"]}


def answered(client: TestClient, design: dict[str, Any], name: str, what: str) -> dict[str, Any]:
    response = client.get(f"/v1/designs/{design['id']}/controllers/{name}/{what}")
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


@pytest.fixture(scope="module", params=["wind_tunnel", "wind_tunnel_23012"])
def four(client: TestClient, request: pytest.FixtureRequest) -> dict[str, Any]:
    return posted(client, four_controllers(request.param))


@pytest.fixture(scope="module")
def one(client: TestClient) -> dict[str, Any]:
    """The four controllers at one point."""
    request = four_controllers("wind_tunnel")
    request["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    return posted(client, request)


def test_every_point_of_all_four_is_ok(four: dict[str, Any]) -> None:
    found = controllers(four)
    assert set(found) == set(FOUR)
    for name, controller in found.items():
        assert np.all(np.array(controller["outcomes"]) == "ok"), name
        asked = [v for v in controller["verdicts"] if v["source"] == "request"]
        assert asked, name
        assert all(v["passed"] for v in asked), name
        assert ("K_theta" in {g["name"] for g in controller["gains"]}) == name.endswith("_rate")


def test_positive_feedback_cannot_have_margins_and_damping(client: TestClient, wanted: dict[str, Any]) -> None:
    specs = {"damping_ratio_min": 0.5, "gain_margin_db_min": 6.0, "phase_margin_deg_min": 45.0}
    wanted["controllers"] = [{"name": "pf", "kind": "positive_feedback", "specs": specs}]
    document = posted(client, wanted)
    assert np.all(np.array(controllers(document)["pf"]["outcomes"]) == "infeasible")
    point = client.get(f"/v1/designs/{document['id']}/points/3").json()["controllers"][0]
    why = point["infeasibility"]
    assert why["nearest_design_misses"]
    assert {miss["spec"] for miss in why["nearest_design_misses"]} <= set(specs)
    for miss in why["nearest_design_misses"]:
        assert miss["nearest"] < miss["limit"]
    assert why["blocking"] == why["relaxations"][0]["spec"]
    relaxed = {**specs, why["blocking"]: 0.99 * why["relaxations"][0]["reachable"]}
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [1531.25]}
    wanted["controllers"][0]["specs"] = relaxed
    assert controllers(posted(client, wanted))["pf"]["outcomes"] == [["ok"]]
    margin = answered(client, document, "pf", "design-margin")
    assert np.all(np.array(margin["margin_percent"]) < 0.0)


def test_given_gains_are_judged_and_not_chosen(client: TestClient, one: dict[str, Any], wanted: dict[str, Any]) -> None:
    chosen = {g["name"]: g["values"][0][0] for g in controllers(one)["nf"]["gains"]}
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    nf = wanted["controllers"][0]
    slack = {**chosen, "K_d": 0.5 * chosen["K_d"]}
    some = {"K_p": 0.8 * chosen["K_p"]}
    wanted["controllers"] = [{**nf, "name": "all", "gains": slack}, {**nf, "name": "some", "gains": some}]
    found = controllers(posted(client, wanted))
    assert {g["name"]: g["values"][0][0] for g in found["all"]["gains"]} == slack
    assert found["all"]["outcomes"] == [["ok"]]
    assert not all(v["passed"] for v in found["all"]["verdicts"] if v["source"] == "request")
    kept = {g["name"]: g["values"][0][0] for g in found["some"]["gains"]}
    assert kept["K_p"] == some["K_p"]
    assert all(v["passed"] for v in found["some"]["verdicts"] if v["source"] == "request")


def test_too_much_positive_feedback_is_flagged(client: TestClient, wanted: dict[str, Any]) -> None:
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    wanted["controllers"] = [{"name": "pf", "kind": "positive_feedback", "gains": {"K_f": 5.0, "K_i": 1.0}}]
    found = controllers(posted(client, wanted))["pf"]
    assert found["outcomes"] == [["not_certified"]]
    assert "stiffness" in found["reasons"][0][0]
    assert found["gains"][0]["values"] == [[None]]


@pytest.mark.parametrize("name", ["nf", "pf_rate"])
def test_delay_and_sampling_cost_speed_and_are_met(
    client: TestClient, one: dict[str, Any], wanted: dict[str, Any], name: str
) -> None:
    """What they cost shows in the gains; the specs hold on what is flown."""
    controller = next(c for c in one["request"]["controllers"] if c["name"] == name)
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    controller["specs"] = {key: value for key, value in controller["specs"].items() if value is not None}
    wanted["controllers"] = [
        {**controller, "name": "plain"},
        {**controller, "name": "digital", "sample_time_s": 0.002, "computational_delay_s": 0.001},
    ]
    wanted["actuators"]["tab"]["delay_s"] = 0.002
    document = posted(client, wanted)
    found = controllers(document)
    free = controllers(one)[name]["gains"][-1]["values"][0][0]
    integral = {each: controller["gains"][-1]["values"][0][0] for each, controller in found.items()}
    for each in ("plain", "digital"):
        assert found[each]["outcomes"] == [["ok"]], found[each]["reasons"]
        assert all(v["passed"] for v in found[each]["verdicts"] if v["source"] == "request")
    assert len({integral["digital"], integral["plain"], free}) == 3
    assert answered(client, document, "plain", "response?point=0")["signals"]["da_deg"][0] == 0.0


@pytest.mark.parametrize("name", FOUR)
def test_frequency_responses_agree_with_each_other_and_with_the_margins(
    client: TestClient, one: dict[str, Any], name: str
) -> None:
    found = answered(client, one, name, "frequency-response?point=0&count=2000&from=0.1&to=10000")
    omega = np.array(found["omega_rad_s"])

    def transfer(kind: str, source: str, to: str) -> Any:
        (entry,) = [t for t in found[kind] if (t["from"], t["to"]) == (source, to)]
        return np.array(entry["magnitude"]) * np.exp(1j * np.deg2rad(entry["phase_deg"])), entry["unit"]

    L, S = transfer("loop", "tab", "tab")[0], transfer("sensitivity", "tab", "tab")[0]
    np.testing.assert_allclose(S * (1.0 + L), 1.0, rtol=1e-8)
    np.testing.assert_allclose(transfer("complementary", "tab", "tab")[0], L * S, rtol=1e-8)
    margins = next(
        c for c in client.get(f"/v1/designs/{one['id']}/points/0").json()["controllers"] if c["name"] == name
    )["margins"]["tab"]
    at = margins["crossover_rad_s"]
    assert np.interp(at, omega, np.abs(L)) == pytest.approx(1.0, rel=1e-3)
    assert np.max(np.abs(S)) == pytest.approx(margins["sensitivity_peak"], rel=1e-3)
    da, unit = transfer("reference", "r_a", "da")
    assert unit == "1"
    assert abs(da[0]) == pytest.approx(1.0, rel=1e-2)
    torque, unit = transfer("disturbance", "T_a_disturbance", "da")
    assert unit == "deg/(N m)"
    assert abs(torque[0]) < abs(torque).max()


def test_disturbance_figures_of_a_point(client: TestClient, one: dict[str, Any]) -> None:
    point = client.get(f"/v1/designs/{one['id']}/points/0").json()["controllers"]
    for controller in point:
        found = {(pair["from"], pair["to"]): pair for pair in controller["disturbance"]}
        held = found["T_a_disturbance", "da"]
        assert held["unit"] == "deg/(N m)"
        assert held["step"]["residual"] == 0.0  # the integral brings it back
        assert 0.0 < held["step"]["rejection_time_s"] < 20.0
        assert 0.0 < abs(held["step"]["peak"]) <= held["peak_gain"] * 1.5
        assert held["h2"] > 0.0
        assert found["da_noise", "da"]["unit"] == "1"
        swept = answered(client, one, controller["name"], "frequency-response?point=0&count=2000")
        (entry,) = [t for t in swept["noise"] if (t["from"], t["to"]) == ("da_noise", "da")]
        assert max(entry["magnitude"]) == pytest.approx(found["da_noise", "da"]["peak_gain"], rel=1e-3)


def test_verdicts_at_every_point(client: TestClient, four: dict[str, Any]) -> None:
    for name in FOUR:
        over_grid = {v["spec"]: v for v in controllers(four)[name]["verdicts"] if v["source"] == "request"}
        found = answered(client, four, name, "verdicts")
        for verdict in found["verdicts"]:
            if verdict["source"] != "request":
                continue
            # null stands for a margin that nothing uses up
            values, limits = (np.array(verdict[each], dtype=float) for each in ("values", "limits"))
            inside = values - limits if verdict["spec"].endswith("_min") else limits - values
            np.testing.assert_allclose(np.array(verdict["distances"], dtype=float), inside, atol=1e-9)
            assert np.all(verdict["passes"])
            worst = over_grid[verdict["spec"]]
            worst_value = np.nan if worst["worst_value"] is None else worst["worst_value"]
            np.testing.assert_equal(values.flat[worst["worst_point"]], worst_value)


def test_design_margin_is_what_specs_can_be_tightened_by(client: TestClient, one: dict[str, Any]) -> None:
    found = answered(client, one, "pf", "design-margin")
    margin = found["margin_percent"][0][0]
    assert found["worst"] == {"value": margin, "point": 0}
    assert found["binding"] == [["damping_ratio_min"]]
    request = copy.deepcopy(one["request"])
    (pf,) = [c for c in request["controllers"] if c["name"] == "pf"]
    for part, outcome in ((0.99, "ok"), (1.01, "infeasible")):
        tightened = {**pf, "specs": {"damping_ratio_min": min(0.4 * (1.0 + part * margin / 100.0), 1.0)}}
        request["controllers"] = [tightened]
        assert controllers(posted(client, request))["pf"]["outcomes"] == [[outcome]]


def test_scaling_laws_and_their_loss(client: TestClient, four: dict[str, Any]) -> None:
    found = answered(client, four, "pf", "scaling")
    laws = {law["gain"]: law for law in found["laws"]}
    q = np.array(four["air"]["dynamic_pressure_pa"])
    for gain in found["gains"]:
        law = laws[gain["name"]]
        np.testing.assert_allclose(
            gain["values"], law["coefficient"] * (q / law["reference"]) ** law["exponent"], rtol=1e-9
        )
    assert np.all(found["loss"]["stable"])
    ratio = np.array(found["loss"]["bandwidth_ratio"])
    assert ratio.flat[found["loss"]["slowest"]["point"]] == ratio.min() == found["loss"]["slowest"]["value"]


def test_smoothing_has_a_price(client: TestClient, wanted: dict[str, Any]) -> None:
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [245.0, 551.25, 980.0, 1531.25]}
    wanted["controllers"] = [{**wanted["controllers"][0], "smoothing": {"bandwidth_loss_percent_max": 10.0}}]
    found = controllers(posted(client, wanted))["nf"]
    assert np.all(np.array(found["outcomes"]) == "ok")
    smoothing = found["smoothing"]
    assert np.max(smoothing["bandwidth_lost_percent"]) <= 10.0 + 1e-6
    before = sum(rough["rms_percent"] ** 2 for rough in smoothing["roughness_before"].values())
    after = sum(gain["roughness"]["rms_percent"] ** 2 for gain in found["gains"])
    assert after < before


def test_files_and_interpolation_carry_the_inner_gain(client: TestClient, one: dict[str, Any]) -> None:
    found = {g["name"]: g["values"][0][0] for g in controllers(one)["nf_rate"]["gains"]}
    gains = answered(client, one, "nf_rate", "gains?altitude_m=0&dynamic_pressure_pa=980")
    assert gains["gains"] == pytest.approx(found)
    assert "K_theta (dt_cmd - dt)" in gains["law"]
    for suffix in ("json", "csv"):
        response = client.get(f"/v1/designs/{one['id']}/schedules/nf_rate.{suffix}")
        assert response.status_code == 200
        assert b"K_theta" in response.content
    file = loadmat(io.BytesIO(client.get(f"/v1/designs/{one['id']}/schedules/nf_rate.mat").content))
    assert "K_theta" in str(file)


def test_loci_in_the_order_of_closure(client: TestClient, one: dict[str, Any]) -> None:
    signs = {"K_theta": 1, "K_d": 1, "K_p": 1, "K_f": -1, "K_i": 1}
    for name in FOUR:
        gains = {g["name"]: g["values"][0][0] for g in controllers(one)[name]["gains"]}
        loops = answered(client, one, name, "root-locus?point=0")["loops"]
        assert loops == [*gains, "tab"]
        for loop in gains:
            locus = answered(client, one, name, f"root-locus?point=0&loop={loop}")
            assert locus["sign"] == signs[loop]
            assert locus["chosen_gain"] == pytest.approx(gains[loop])
            assert len(locus["departures"]) <= len(locus["branches"])
            damped = locus["constant_damping"]
            assert damped["damping_ratio"] == 0.5
            for each in damped["gains"]:
                assert each["omega_n_rad_s"] > 0.0


def test_gain_of_a_damping_ratio(client: TestClient, one: dict[str, Any]) -> None:
    """Where the design meets its damping exactly, its own gain is among those of that damping ratio."""
    (controller,) = [
        c for c in client.get(f"/v1/designs/{one['id']}/points/0").json()["controllers"] if c["name"] == "pf"
    ]
    poles = np.array([complex(p["re"], p["im"]) for p in controller["poles"]])
    least = float(np.min(-poles.real / np.abs(poles)))
    locus = answered(client, one, "pf", f"root-locus?point=0&loop=K_i&damping_ratio={least:.12f}")
    near = [g["gain"] / locus["chosen_gain"] for g in locus["constant_damping"]["gains"]]
    assert min(abs(ratio - 1.0) for ratio in near) < 1e-6
    assert locus["constant_damping"]["least_damping_ratio"] == pytest.approx(least)


def test_an_ideal_servo_with_given_gains(client: TestClient, wanted: dict[str, Any]) -> None:
    """Its torque is not finite, and the answer says so instead of a number."""
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    wanted["actuators"]["tab"] |= {"servo_bandwidth_hz": None, "servo_damping_ratio": None}
    wanted["controllers"] = [{"name": "pf", "kind": "positive_feedback", "gains": {"K_f": 0.3, "K_i": 2.0}}]
    document = posted(client, wanted)
    assert controllers(document)["pf"]["outcomes"] == [["ok"]]
    demand = answered(client, document, "pf", "actuator-requirements")["actuators"]["tab"]
    assert demand["peak_torque_n_m"] == [[None]]
    assert demand["peak_deflection_deg"][0][0] > 0.0
    assert "T_t_n_m" not in answered(client, document, "pf", "response?point=0")["signals"]
    client.get(f"/v1/designs/{document['id']}/points/0").raise_for_status()
    for what in ("frequency-response?point=0", "root-locus?point=0", "scaling", "verdicts"):
        answered(client, document, "pf", what)


def test_design_margins_are_of_specs(client: TestClient, one: dict[str, Any], wanted: dict[str, Any]) -> None:
    document = posted(client, wanted)
    response = client.get(f"/v1/designs/{document['id']}/controllers/lqr/design-margin")
    assert response.status_code == 422
    assert response.json()["errors"][0]["pointer"] == "/name"
