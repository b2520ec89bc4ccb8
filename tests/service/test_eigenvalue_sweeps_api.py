"""Eigenvalue sweeps over HTTP: named quantities, any field by its pointer, and refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.documentation.body_examples import DERIVATIVES, TABLE, plant
from service.settings import Settings


@pytest.fixture
def sweep(client: TestClient) -> Any:
    def ask(values: Any, quantity: str | None = None, pointer: str | None = None, **change: Any) -> dict[str, Any]:
        thing = {"quantity": quantity} if quantity else {"pointer": pointer}
        response = client.post("/v1/eigenvalue-sweeps", json=plant() | change | {"vary": thing | {"values": values}})
        assert response.status_code == 200, response.text
        document: dict[str, Any] = response.json()
        return document

    return ask


def at_sea_level(airspeed: float) -> dict[str, Any]:
    return {"altitude_m": [0.0], "airspeed_m_s": [airspeed]}


def branches(point: Any, model: str = "coupled") -> Any:
    return np.array([[z["re"] + 1j * z["im"] for z in branch] for branch in point[model]["branches"]])


def test_data_set_a_over_airspeed(sweep: Any) -> None:
    """Rupert's Figs 2.8 to 2.11 on data set A: proportional to airspeed, unstable at each, by undamped flutter."""
    document = sweep([20.0, 35.0, 50.0], "airspeed_m_s", grid=at_sea_level(30.0))
    assert document["varied"] == {"name": "airspeed_m_s", "unit": "m/s", "values": [20.0, 35.0, 50.0]}
    (point,) = document["points"]
    found = branches(point)
    expected = [-43.82129843 - 44.57193446j, -43.82129843 + 44.57193446j, 29.11076492 - 43.17431354j]
    np.testing.assert_allclose(np.sort_complex(found[:, 2])[:3], expected, rtol=1e-4)
    np.testing.assert_allclose(found[:, 0] / 20.0, found[:, 2] / 50.0, rtol=1e-9)
    assert point["verdict"]["stable"] is False
    assert point["verdict"]["mechanisms"] == ["undamped_flutter"]
    assert point["verdict"]["at"] == 50.0
    assert point["coupled"]["mechanism"] == ["undamped_flutter"] * 3
    assert point["decoupled"]["stable"] == [True] * 3
    servo = branches(point, "decoupled")[:, 2]
    np.testing.assert_allclose(np.sort(servo.imag), [-76.08852493, 76.08852493], rtol=1e-4)
    criterion = point["flutter_criterion"]
    assert all(left < right for left, right in zip(criterion["left"], criterion["right"], strict=True))


def test_participation_and_branches(sweep: Any) -> None:
    (point,) = sweep({"from": 10, "to": 60, "count": 26}, "airspeed_m_s", grid=at_sea_level(30.0))["points"]
    coupled = point["coupled"]
    assert coupled["states"] == ["dt", "dt_rate", "da", "da_rate"]
    assert coupled["outputs"] == ["dt", "da"]
    shares = np.array(coupled["participation"])
    assert shares.shape == (4, 4, 26)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, rtol=1e-9)
    assert np.array(coupled["output"]).shape == (4, 2, 26)
    found = branches(point)
    assert np.max(np.abs(np.diff(found, axis=1))) < 0.1 * np.max(np.abs(found))
    np.testing.assert_allclose(np.max(found.real, axis=0), coupled["growth_1_s"], rtol=1e-12)
    np.testing.assert_allclose(np.abs(found), coupled["omega_n_rad_s"], rtol=1e-12)


@pytest.mark.parametrize(
    ("quantity", "pointer", "values"),
    [
        ("tab_deg", "/trim/tab_deg", [-10.0, 0.0, 12.0]),
        ("aileron_deg", "/trim/aileron_deg", [-10.0, 5.0]),
        ("alpha_deg", "/trim/alpha_deg", [0.0, 5.0]),
        ("airspeed_m_s", "/grid/airspeed_m_s/0", [20.0, 60.0]),
    ],
)
def test_a_pointer_and_its_name_agree(sweep: Any, quantity: str, pointer: str, values: Any) -> None:
    grid = at_sea_level(30.0)
    named, pointed = sweep(values, quantity, grid=grid), sweep(values, pointer=pointer, grid=grid)
    assert named["varied"]["unit"] == pointed["varied"]["unit"]
    np.testing.assert_allclose(branches(named["points"][0]), branches(pointed["points"][0]), rtol=1e-9)


def test_a_pointer_gives_the_models_of_the_changed_requests(client: TestClient, sweep: Any) -> None:
    values = [1e-4, 2.1e-4, 5e-4]
    document = sweep(values, pointer="/inertia/tab/inertia_kg_m2")
    assert document["varied"]["unit"] == "kg m^2"
    assert [len(point["coupled"]["growth_1_s"]) for point in document["points"]] == [3] * 8
    for place, value in enumerate(values):
        changed = plant()
        changed["inertia"]["tab"]["inertia_kg_m2"] = value
        models = client.post("/v1/linear-models", json=changed).json()["points"]
        for point, model in zip(document["points"], models, strict=True):
            poles = np.linalg.eigvals(model["linear_model"]["A"])
            np.testing.assert_allclose(np.sort_complex(branches(point)[:, place]), np.sort_complex(poles), rtol=1e-8)


def test_density_at_given_airspeed(sweep: Any) -> None:
    """The servo-tab's frequency and damping ratio both go with the root of the density."""
    (point,) = sweep([0.3, 1.2], "density_kg_m3", grid=at_sea_level(50.0))["points"]
    for name in ("omega_n_rad_s", "damping_ratio"):
        thin, dense = point["decoupled"][name][0]
        assert dense / thin == pytest.approx(2.0, rel=1e-9)


def test_tab_chord(sweep: Any) -> None:
    """No tab chord stabilises fixed bodies (seed 2.4)."""
    values = {"from": 0.03, "to": 0.47, "count": 12}
    (point,) = sweep(values, "tab_chord_ratio", grid=at_sea_level(50.0))["points"]
    assert not any(point["coupled"]["stable"])


def test_beyond_the_table(sweep: Any) -> None:
    (point,) = sweep([0.0, 10.0, 11.0], "tab_deg", aerodynamics=TABLE, grid=at_sea_level(50.0))["points"]
    assert point["covered"] == [True, True, False]
    assert point["coupled"]["branches"][0][2] is None
    assert point["coupled"]["stable"][2] is None
    assert point["reasons"][:2] == [None, None]
    assert point["reasons"][2]
    assert "does not hold at 1 more" in point["verdict"]["detail"]
    (nothing,) = sweep([11.0], "tab_deg", aerodynamics=TABLE, grid=at_sea_level(50.0))["points"]
    assert nothing["verdict"]["stable"] is None


def test_six_states(sweep: Any) -> None:
    unsteady = plant()["aerodynamics"] | {"damping": "unsteady"}
    (point,) = sweep([20.0, 50.0], "airspeed_m_s", aerodynamics=unsteady, grid=at_sea_level(50.0))["points"]
    assert len(point["coupled"]["states"]) == len(point["coupled"]["branches"]) == 6


BAD = {
    "nothing varied": ({"values": [1.0]}, "/vary", "quantity, pointer"),
    "two things": ({"quantity": "tab_deg", "pointer": "/trim/tab_deg", "values": [1.0]}, "/vary", "quantity, pointer"),
    "no values": ({"quantity": "tab_deg", "values": []}, "/vary/values", "at least 1"),
    "a value out of range": ({"quantity": "tab_deg", "values": [0.0, 61.0]}, "/vary/values/1", ">= -60 and <= 60"),
    "a range out of range": (
        {"quantity": "alpha_deg", "values": {"from": 0, "to": 31, "count": 3}},
        "/vary/values/to",
        ">= -30 and <= 30",
    ),
    "text": ({"quantity": "tab_deg", "values": ["1"]}, "/vary/values/0", "number"),
    "an unknown quantity": ({"quantity": "mass", "values": [1.0]}, "/vary/quantity", "one of tab_deg"),
    "no pointer": ({"pointer": "tab_deg", "values": [1.0]}, "/vary/pointer", "matching"),
    "a pointer to nothing": ({"pointer": "/geometry/colour", "values": [1.0]}, "/vary/pointer", "/geometry"),
    "a pointer to text": ({"pointer": "/aerodynamics/section", "values": [1.0]}, "/vary/pointer", "/geometry"),
    "a pointer to a switch": ({"pointer": "/aerodynamics/virtual_inertia", "values": [1.0]}, "/vary/pointer", "/grid"),
    "a pointer to a part": ({"pointer": "/geometry", "values": [1.0]}, "/vary/pointer", "/grid"),
    "a pointer into the sweep": ({"pointer": "/vary/values/0", "values": [1.0]}, "/vary/pointer", "/grid"),
    "a pointer beyond a list": ({"pointer": "/grid/altitude_m/9", "values": [1.0]}, "/vary/pointer", "/grid"),
    "a bad value of a field": ({"pointer": "/geometry/chord_m", "values": [0.5, -1.0]}, "/vary/values/1", "0.001"),
    "a bad end of a field": (
        {"pointer": "/geometry/chord_m", "values": {"from": -1.0, "to": 1.0, "count": 3}},
        "/vary/values",
        "0.001",
    ),
    "fields that do not go together": (
        {"pointer": "/geometry/tab_hinge", "values": [0.9, 0.5]},
        "/vary/values/1",
        "> 0.72 and < 1",
    ),
    "beyond Mach 1 everywhere": (
        {"pointer": "/grid/dynamic_pressure_pa/3", "values": [2000.0, 100.0]},
        "/vary/values/1",
        "> 980",
    ),
}


@pytest.mark.parametrize(("vary", "pointer", "allowed"), BAD.values(), ids=BAD)
def test_bad_sweeps(client: TestClient, refused: Any, vary: Any, pointer: str, allowed: str) -> None:
    (error,) = refused(client.post("/v1/eigenvalue-sweeps", json=plant() | {"vary": vary}), 422)["errors"]
    assert error["pointer"] == pointer
    assert allowed in error["allowed"]


def test_the_chord_of_given_hinge_moments(client: TestClient, refused: Any) -> None:
    vary = {"quantity": "tab_chord_ratio", "values": [0.2]}
    body = plant() | {"aerodynamics": DERIVATIVES, "vary": vary}
    (error,) = refused(client.post("/v1/eigenvalue-sweeps", json=body), 422)["errors"]
    assert error["pointer"] == "/vary/quantity"


def test_the_number_of_grid_points_is_kept(client: TestClient, refused: Any) -> None:
    grid = {"altitude_m": {"from": 0, "to": 3000, "count": 2}, "airspeed_m_s": [50.0]}
    body = plant() | {"grid": grid, "vary": {"pointer": "/grid/altitude_m/count", "values": [3.0]}}
    (error,) = refused(client.post("/v1/eigenvalue-sweeps", json=body), 422)["errors"]
    assert error["pointer"] == "/vary/pointer"
    (point, _) = client.post(
        "/v1/eigenvalue-sweeps",
        json=plant() | {"grid": grid, "vary": {"pointer": "/grid/altitude_m/to", "values": [3000.0, 9000.0]}},
    ).json()["points"]
    assert point["covered"] == [True, True]


def test_a_table_is_fitted_anew_only_where_it_must_be(refused: Any, tmp_path: Any) -> None:
    """18 rows, 20 allowed: a sweep of the bodies fits them once, one of the table at each value."""
    with TestClient(create_app(Settings(data_dir=tmp_path, max_table_rows=20))) as small:
        for pointer, status in (
            ("/inertia/tab/mass_kg", 200),
            ("/geometry/chord_m", 200),
            ("/trim/tab_deg", 200),
            ("/aerodynamics/rows/0/3", 422),
        ):
            body = plant() | {"aerodynamics": TABLE, "vary": {"pointer": pointer, "values": [0.05, 0.06]}}
            response = small.post("/v1/eigenvalue-sweeps", json=body)
            assert response.status_code == status, (pointer, response.text)
        assert refused(response, 422)["errors"][0]["pointer"] == "/vary/values"
