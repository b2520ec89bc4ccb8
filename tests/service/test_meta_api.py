"""The server about itself, and the smaller routes of the model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from model.atmosphere import standard_atmosphere
from service.examples import NAMES
from service.version import code_version


def test_health_version_limits(client: TestClient) -> None:
    assert client.get("/healthz").json() == {"status": "ok"}
    version = client.get("/v1/version").json()
    assert version["code_version"] == code_version()
    assert version["code_version"].startswith(version["version"] + "+")
    assert "numpy" in version["solver"]
    limits = {limit["name"]: limit["value"] for limit in client.get("/v1/limits").json()["limits"]}
    assert limits["max_body_bytes"] == 1_048_576
    assert limits["max_grid_points"] == 2500


def test_examples(client: TestClient, refused: Any) -> None:
    everything = client.get("/v1/examples").json()
    assert tuple(everything) == NAMES
    for name in NAMES:
        assert client.get(f"/v1/examples/{name}").json() == everything[name]
    assert "wind_tunnel" in refused(client.get("/v1/examples/none"), 404)["detail"]


def test_unknown_routes_and_methods(client: TestClient, refused: Any) -> None:
    assert refused(client.get("/v1/nowhere"), 404)["code"] == "not_found"
    response = client.put("/v1/designs", json={})
    assert refused(response, 405)["code"] == "method_not_allowed"
    assert set(response.headers["allow"].split(", ")) <= {"GET", "POST"}
    refused(client.delete("/healthz"), 405)


def test_a_fault_of_the_server_tells_nothing_about_it(
    client: TestClient, refused: Any, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fault(*args: Any) -> None:
        raise RuntimeError("secret detail in /some/path.py")

    monkeypatch.setattr("service.routes.meta.listed", fault)
    response = client.get("/v1/limits")
    assert refused(response, 500)["code"] == "internal_error"
    assert "secret" not in response.text
    assert "secret detail" in caplog.text


# Temperature [K], pressure [Pa] and density [kg/m^3] of ISO 2533:1975, tables by geopotential altitude.
@pytest.mark.parametrize(
    ("altitude", "temperature", "pressure", "density"),
    [(0, 288.15, 101325.0, 1.225), (11000, 216.65, 22632.0, 0.363918), (20000, 216.65, 5474.88, 0.0880347)],
)
def test_atmosphere(client: TestClient, altitude: float, temperature: float, pressure: float, density: float) -> None:
    air = client.get("/v1/atmosphere", params={"altitude_m": altitude}).json()
    assert air["altitude_m"] == altitude
    assert air["temperature_k"] == pytest.approx(temperature, abs=5e-3)
    assert air["pressure_pa"] == pytest.approx(pressure, rel=1e-5)
    assert air["density_kg_m3"] == pytest.approx(density, rel=5e-6)


def test_atmosphere_at_several_altitudes(client: TestClient) -> None:
    query = {"altitude_m": [0, 3000, 12000], "temperature_offset_k": 10}
    air = client.get("/v1/atmosphere", params=query).json()
    expected = standard_atmosphere(np.array([0.0, 3000.0, 12000.0]), 10.0)
    assert air["density_kg_m3"] == expected.density.tolist()
    assert air["dynamic_viscosity_pa_s"] == expected.dynamic_viscosity.tolist()
    assert air["speed_of_sound_m_s"] == expected.speed_of_sound.tolist()


@pytest.mark.parametrize(
    ("query", "pointer", "unit"),
    [
        ("", "/altitude_m", "m"),
        ("altitude_m=40000", "/altitude_m/0", "m"),
        ("altitude_m=0&altitude_m=nan", "/altitude_m/1", "m"),
        ("altitude_m=high", "/altitude_m/0", "m"),
        ("altitude_m=0&temperature_offset_k=1e999", "/temperature_offset_k", "K"),
        ("altitude_m=0&temperature_offset_k=-300", "/temperature_offset_k", "K"),
        ("altitude_m=0&altitude_ft=0", "/altitude_ft", None),
        ("&".join(["altitude_m=0"] * 1001), "/altitude_m", "m"),
    ],
)
def test_bad_atmosphere(client: TestClient, refused: Any, query: str, pointer: str, unit: str | None) -> None:
    (error,) = refused(client.get(f"/v1/atmosphere?{query}"), 422)["errors"]
    assert (error["pointer"], error["unit"]) == (pointer, unit)
    assert error["allowed"]


HINGES = {
    "geometry": {"aileron_hinge": 0.7, "tab_hinge": 0.88},
    "aerodynamics": {"source": "thin_aerofoil", "section": "NACA 23012"},
    "states": [{"alpha_deg": 5, "aileron_deg": 10, "tab_deg": -10}, {"alpha_deg": 0, "aileron_deg": 0, "tab_deg": 0}],
}


def test_hinge_moments_are_linear_in_the_angles(client: TestClient) -> None:
    document = client.post("/v1/hinge-moments", json=HINGES).json()
    slopes = document["derivatives"]
    alpha, da, dt = np.deg2rad([5, 10, -10])
    for surface in ("a", "t"):
        expected = (
            slopes[f"C_H{surface}_0"]
            + slopes[f"C_H{surface}_alpha"] * alpha
            + slopes[f"C_H{surface}_da"] * da
            + slopes[f"C_H{surface}_dt"] * dt
        )
        assert document["states"][0][f"C_H{surface}"] == pytest.approx(expected, rel=1e-12)
        assert document["states"][1][f"C_H{surface}"] == slopes[f"C_H{surface}_0"]
    assert document["states"][0]["pressure_difference"] is None


def test_hinge_moments_are_the_moments_of_the_pressure(client: TestClient) -> None:
    """By quadrature: moment about each hinge of the answered pressure, lower minus upper, trailing edge up."""
    theta = (np.arange(1000) + 0.5) * np.pi / 1000
    x = 0.5 * (1 - np.cos(theta))
    weight = 0.5 * np.sin(theta) * np.pi / 1000
    document = client.post("/v1/hinge-moments", json=HINGES | {"chordwise": x.tolist()}).json()
    for state in document["states"]:
        load = np.array(state["pressure_difference"])
        for hinge, coefficient in ((0.7, state["C_Ha"]), (0.88, state["C_Ht"])):
            moment = np.sum((load * (x - hinge) * weight)[x > hinge])
            assert -moment == pytest.approx(coefficient, abs=2e-5)


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"chordwise": [0.5, 0.7]}, "/chordwise/1"),
        ({"chordwise": [0.0]}, "/chordwise/0"),
        ({"chordwise": []}, "/chordwise"),
        ({"states": []}, "/states"),
        ({"aerodynamics": {"source": "thin_aerofoil", "section": "NACA 64A010"}}, "/aerodynamics/section"),
        (
            {"aerodynamics": {"source": "thin_aerofoil", "compressibility": "prandtl_glauert"}},
            "/aerodynamics/compressibility",
        ),
        ({"geometry": {"aileron_hinge": 0.7, "tab_hinge": 0.7}}, "/geometry/tab_hinge"),
    ],
)
def test_bad_hinge_moments(client: TestClient, refused: Any, change: Any, pointer: str) -> None:
    (error,) = refused(client.post("/v1/hinge-moments", json=HINGES | change), 422)["errors"]
    assert error["pointer"] == pointer


def test_every_setting_is_in_the_readme() -> None:
    from pathlib import Path

    from service.settings import Settings

    page = (Path(__file__).parents[2] / "service" / "README.md").read_text()
    missing = [name for name in Settings.model_fields if f"`{name.upper()}`" not in page]
    assert missing == []
