"""Steady-state maps and similarity over HTTP: against the closed forms of a linear source, and refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.documentation.body_examples import DERIVATIVES, TABLE, plant
from service.settings import Settings

AILERON, TAB = [-18.0, -2.0, 6.0], [-20.0, -5.0, 0.0, 15.0]
ALPHA = 4.0


@pytest.fixture(scope="module")
def asked() -> dict[str, Any]:
    return plant() | {
        "aerodynamics": DERIVATIVES,
        "trim": {"alpha_deg": ALPHA},
        "deflections": {"aileron_deg": AILERON, "tab_deg": TAB},
        "limits": {"tab": {"deflection_deg": 10.0, "torque_n_m": 2.0}, "aileron": {"deflection_deg": 25.0}},
    }


@pytest.fixture(scope="module")
def maps(client: TestClient, asked: Any) -> dict[str, Any]:
    response = client.post("/v1/steady-state-maps", json=asked)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def coefficient(surface: str, da_deg: Any, dt_deg: Any) -> Any:
    C = {name: DERIVATIVES[f"C_H{surface}_{name}"] for name in ("0", "alpha", "da", "dt")}
    return C["0"] + C["alpha"] * np.deg2rad(ALPHA) + C["da"] * np.deg2rad(da_deg) + C["dt"] * np.deg2rad(dt_deg)


def line(document: Any, name: str) -> Any:
    return np.array(document[name], dtype=float)


def test_planes_are_the_coefficients_times_the_load(maps: Any) -> None:
    assert maps["deflections"] == {"aileron_deg": pytest.approx(AILERON), "tab_deg": pytest.approx(TAB)}
    aileron, tab = np.meshgrid(AILERON, TAB, indexing="ij")
    for point in maps["points"]:
        load = point["coordinates"]["dynamic_pressure_pa"] * 0.6**2 * 0.8
        for surface in ("a", "t"):
            expected = coefficient(surface, aileron, tab)
            np.testing.assert_allclose(point["plane"][f"C_H{surface}"], expected, rtol=1e-12)
            np.testing.assert_allclose(point["plane"][f"T_{surface}_n_m"], load * expected, rtol=1e-12)
        total = np.hypot(line(point["plane"], "T_a_n_m"), line(point["plane"], "T_t_n_m"))
        np.testing.assert_allclose(point["plane"]["total_torque_n_m"], total, rtol=1e-12)


def test_lines_of_equilibrium(maps: Any) -> None:
    point = maps["points"][2]
    for name, surface in (("zero_aileron_torque", "a"), ("zero_tab_torque", "t")):
        found = point[name]
        needed = -coefficient(surface, np.array(AILERON), 0.0) / DERIVATIVES[f"C_H{surface}_dt"]
        within = np.abs(np.rad2deg(needed)) <= 10.0
        np.testing.assert_allclose(line(found, "tab_deg")[within], np.rad2deg(needed)[within], rtol=1e-9)
        assert [reason is None for reason in found["reasons"]] == within.tolist()
        assert np.isnan(line(found, "tab_deg")[~within]).all()
    assert "tab angle within +-10 deg" in point["zero_aileron_torque"]["reasons"][0]


def test_least_torque_beside_a_brute_force(maps: Any) -> None:
    point, tab = maps["points"][0], np.linspace(-10.0, 10.0, 200_001)
    for aileron, found in zip(AILERON, point["least_torque"]["tab_deg"], strict=True):
        squares = coefficient("a", aileron, tab) ** 2 + coefficient("t", aileron, tab) ** 2
        assert found is None or found == pytest.approx(tab[np.argmin(squares)], abs=1e-4)
    assert any(found is not None for found in point["least_torque"]["tab_deg"])


def test_the_tab_alone(maps: Any) -> None:
    point = maps["points"][3]
    gain = -DERIVATIVES["C_Ha_dt"] / DERIVATIVES["C_Ha_da"]
    floating = point["floating"]
    held = coefficient("a", line(floating, "aileron_deg"), np.array(TAB))
    np.testing.assert_allclose(held[~np.isnan(held)], 0.0, atol=1e-15)
    assert floating["gain"][2] == pytest.approx(gain, rel=1e-12)
    assert floating["stable"][2] is True
    lower, upper = point["reachable"]["lower"], point["reachable"]["upper"]
    ends = [np.rad2deg(-coefficient("a", 0.0, dt) / DERIVATIVES["C_Ha_da"]) for dt in (10.0, -10.0)]
    assert [lower["aileron_deg"], upper["aileron_deg"]] == pytest.approx(ends, rel=1e-9)
    assert (lower["tab_deg"], upper["tab_deg"]) == (pytest.approx(10.0), pytest.approx(-10.0))
    assert (lower["limit"], upper["limit"]) == ("tab deflection", "tab deflection")
    holds = [lower["aileron_deg"] <= wanted <= upper["aileron_deg"] for wanted in AILERON]
    assert point["tab_only"]["holds"] == holds
    free = point["free"]
    assert coefficient("a", free["aileron_deg"], free["tab_deg"]) == pytest.approx(0.0, abs=1e-12)
    assert coefficient("t", free["aileron_deg"], free["tab_deg"]) == pytest.approx(0.0, abs=1e-12)


def test_a_weak_tab_actuator_ends_the_range(client: TestClient, asked: Any) -> None:
    weak = asked | {"limits": {"tab": {"torque_n_m": 0.01}}}
    point = client.post("/v1/steady-state-maps", json=weak).json()["points"][3]
    for end in (point["reachable"]["lower"], point["reachable"]["upper"]):
        assert end["limit"] == "tab torque"
        assert abs(end["T_t_n_m"]) == pytest.approx(0.01, rel=1e-6)


def test_maps_beyond_the_table_and_beyond_mach_one(client: TestClient, asked: Any) -> None:
    grid = {"altitude_m": [0.0], "airspeed_m_s": [50.0, 400.0]}
    document = client.post("/v1/steady-state-maps", json=asked | {"aerodynamics": TABLE, "grid": grid}).json()
    inside, outside = document["points"]
    known = [[abs(da) <= 10 and abs(dt) <= 10 for dt in TAB] for da in AILERON]
    assert [[value is not None for value in row] for row in inside["plane"]["C_Ha"]] == known
    assert (outside["outcome"], outside["plane"], outside["trim"]) == ("outside_model", None, None)
    assert document["hinge_moment_fit"]["rows"]["used"] == 18


def test_a_map_by_default(client: TestClient) -> None:
    document = client.post("/v1/steady-state-maps", json=plant()).json()
    assert len(document["deflections"]["tab_deg"]) == 17
    assert (document["deflections"]["tab_deg"][0], document["deflections"]["tab_deg"][-1]) == pytest.approx((-20, 20))


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"deflections": {"aileron_deg": []}}, "/deflections/aileron_deg"),
        ({"deflections": {"tab_deg": [0.0, 61.0]}}, "/deflections/tab_deg/1"),
        ({"deflections": {"tab_deg": {"from": 5, "to": -5, "count": 3}}}, "/deflections/tab_deg/to"),
        ({"deflections": {"flap_deg": [0.0]}}, "/deflections/flap_deg"),
        ({"limits": {"tab": {"torque_n_m": 0}}}, "/limits/tab/torque_n_m"),
        ({"limits": {"aileron": {"torque_n_m": 1}}}, "/limits/aileron/torque_n_m"),
        ({"grid": {"altitude_m": [0], "airspeed_m_s": [400]}}, "/grid"),
    ],
)
def test_bad_maps(client: TestClient, refused: Any, change: Any, pointer: str) -> None:
    (error,) = refused(client.post("/v1/steady-state-maps", json=plant() | change), 422)["errors"]
    assert error["pointer"] == pointer
    assert error["allowed"]


@pytest.mark.parametrize("path", ["/v1/steady-state-maps", "/v1/eigenvalue-sweeps", "/v1/similarity"])
def test_an_empty_body_names_what_is_missing(client: TestClient, refused: Any, path: str) -> None:
    problem = refused(client.post(path, json={}), 422)
    missing = {"/geometry", "/inertia", "/aerodynamics", "/grid"} | ({"/vary"} if "sweeps" in path else set())
    assert {error["pointer"] for error in problem["errors"]} == missing
    assert {error["detail"] for error in problem["errors"]} == {"this field is required"}


def test_maps_and_sweeps_over_their_limits(asked: Any, refused: Any, tmp_path: Any) -> None:
    with TestClient(create_app(Settings(data_dir=tmp_path, max_map_cells=95, max_sweep_models=15))) as small:
        problem = refused(small.post("/v1/steady-state-maps", json=asked), 422)
        assert (problem["code"], problem["errors"][0]["pointer"]) == ("limit_exceeded", "/deflections")
        assert "GAINFIELD_MAX_MAP_CELLS" in problem["detail"]
        vary = {"vary": {"quantity": "tab_deg", "values": [0.0, 1.0]}}
        problem = refused(small.post("/v1/eigenvalue-sweeps", json=plant() | vary), 422)
        assert (problem["code"], problem["errors"][0]["pointer"]) == ("limit_exceeded", "/vary/values")
        assert "GAINFIELD_MAX_SWEEP_MODELS" in problem["detail"]


def test_similarity_from_sea_level_to_eleven_kilometres(client: TestClient) -> None:
    """Natural frequency goes with q, the damping ratio with the root of density: 1.83 between 0 and 11 km."""
    grid = {"altitude_m": [0.0, 11000.0], "dynamic_pressure_pa": [245.0, 980.0]}
    document = client.post("/v1/similarity", json=plant() | {"grid": grid}).json()
    frequency, damping = document["exponents"]["omega_n"], document["exponents"]["damping_ratio"]
    for powers, values in (
        (frequency, {"dynamic_pressure": 0.5, "airspeed": 1.0, "density": 0.0, "density_at_airspeed": 0.5}),
        (damping, {"dynamic_pressure": 0.0, "airspeed": 0.0, "density": 0.5, "density_at_airspeed": 0.5}),
    ):
        for name, power in values.items():
            np.testing.assert_allclose(powers[name], power, atol=1e-6)
    schedule = document["pressure_schedule"]
    assert schedule["sufficient"] is False
    assert schedule["worst_factor"] == pytest.approx(np.sqrt(1.225 / 0.363918), rel=1e-4)
    assert schedule["worst_factor"] == pytest.approx(1.83, abs=0.005)
    np.testing.assert_allclose(schedule["frequency_factor"], 1.0, rtol=1e-12)
    one_altitude = plant() | {"grid": grid | {"altitude_m": [3000.0]}}
    assert client.post("/v1/similarity", json=one_altitude).json()["pressure_schedule"]["sufficient"] is True


@pytest.mark.parametrize("unit", ["chords", "servo_period"])
def test_nondimensional_models_have_the_eigenvalues_times_the_time_unit(client: TestClient, unit: str) -> None:
    models = client.post("/v1/linear-models", json=plant()).json()["points"]
    found = client.post("/v1/similarity", json=plant() | {"time_unit": unit}).json()["nondimensional"]
    for model, plain in zip(found["points"], models, strict=True):
        expected = np.linalg.eigvals(plain["linear_model"]["A"]) * model["time_unit_s"]
        np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(model["A"])), np.sort_complex(expected), rtol=1e-9)
        if unit == "chords":
            assert model["time_unit_s"] == pytest.approx(0.6 / plain["air"]["airspeed_m_s"], rel=1e-12)
        else:
            assert model["time_unit_s"] == pytest.approx(1 / plain["servo_tab"]["omega_n_rad_s"], rel=1e-12)


def test_a_measured_servo_tab_scaled_to_its_own_size_stays(client: TestClient) -> None:
    """A servo-tab of the model, taken as measured, is found again; twice the altitude's density changes zeta alone."""
    (point, *_) = client.post("/v1/linear-models", json=plant()).json()["points"]
    servo, model = point["servo_tab"], point["linear_model"]
    J = -float(np.linalg.inv(np.array(model["B"])[[1, 3]])[1, 1])
    measured = {
        "omega_n_rad_s": servo["omega_n_rad_s"],
        "damping_ratio": servo["damping_ratio"],
        "dc_gain": servo["dc_gain"],
        "chord_m": 0.6,
        "span_m": 0.8,
        "inertia_kg_m2": abs(J),
        "dynamic_pressure_pa": 245.0,
    }
    scaled = client.post("/v1/similarity", json=plant() | {"measured": measured}).json()["scaled"]
    models = client.post("/v1/linear-models", json=plant()).json()["points"]
    for place, plain in enumerate(models):
        index = np.unravel_index(place, (2, 4))
        for name in ("omega_n_rad_s", "damping_ratio", "dc_gain"):
            assert np.array(scaled[name])[index] == pytest.approx(plain["servo_tab"][name], rel=1e-9)
    assert len(scaled["assumptions"]) > 3


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"tolerance": 0}, "/tolerance"),
        ({"time_unit": "seconds"}, "/time_unit"),
        ({"measured": {}}, "/measured/omega_n_rad_s"),
        ({"aerodynamics": TABLE, "trim": {"alpha_deg": 9.0}}, "/grid"),
    ],
)
def test_bad_similarity(client: TestClient, refused: Any, change: Any, pointer: str) -> None:
    error = refused(client.post("/v1/similarity", json=plant() | change), 422)["errors"][0]
    assert error["pointer"] == pointer
