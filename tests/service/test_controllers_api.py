"""Points and controllers over HTTP, their figures checked by other routes than the service's own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import expm

from service.schemas import controller_answers as answers
from service.schemas import requirement_answers
from service.schemas.point import LinearModels, Point

NAMES = ("nf", "pf", "lqr")


def complex_array(pairs: Any) -> Any:
    """Nested lists of {re, im} as a complex array."""
    if isinstance(pairs, list):
        return np.array([complex_array(pair) for pair in pairs])
    return complex(pairs["re"], pairs["im"])


@pytest.fixture(scope="module")
def here(design: dict[str, Any]) -> str:
    return f"/v1/designs/{design['id']}"


@pytest.fixture(scope="module")
def point(client: TestClient, here: str) -> dict[str, Any]:
    document: dict[str, Any] = client.get(f"{here}/points/3").json()
    Point.model_validate(document)
    return document


def test_point_agrees_with_the_design(design: dict[str, Any], point: dict[str, Any]) -> None:
    assert point["coordinates"] == {"altitude_m": 0.0, "dynamic_pressure_pa": 1531.25}
    assert point["air"]["mach"] == design["air"]["mach"][0][3]
    for on_grid, here in zip(design["controllers"], point["controllers"], strict=True):
        assert {g["name"]: g["value"] for g in here["gains"]} == {
            g["name"]: g["values"][0][3] for g in on_grid["gains"]
        }


def test_plant_of_a_point_is_consistent(point: dict[str, Any]) -> None:
    model = point["linear_model"]
    poles = np.sort_complex(np.linalg.eigvals(np.array(model["A"])))
    np.testing.assert_allclose(np.sort_complex(complex_array(point["poles"])), poles, rtol=1e-12)
    assert model["states"] == ["dt", "dt_rate", "da", "da_rate"]
    assert model["inputs"] == ["T_t", "T_a"]
    assert model["outputs"] == ["dt", "da"]
    # Open loop, the coupled section is unstable at every speed (seed 2.4).
    assert max(pole.real for pole in poles) > 0
    servo = point["servo_tab"]
    assert servo["dc_gain"] == pytest.approx(servo["numerator"][1] / servo["denominator"][2])
    assert servo["dc_gain"] < 0
    assert servo["omega_n_rad_s"] ** 2 == pytest.approx(servo["denominator"][2])
    trim, moments, air = point["trim"], point["hinge_moments"]["values"], point["air"]
    load = air["dynamic_pressure_pa"] * 0.6**2 * 0.8
    assert trim["T_a_n_m"] == pytest.approx(load * moments["C_Ha"])
    assert trim["T_t_n_m"] == pytest.approx(load * moments["C_Ht"])
    assert (trim["alpha_deg"], trim["aileron_deg"]) == (5.0, 0.0)


def test_lqr_poles_are_those_of_its_gains(point: dict[str, Any]) -> None:
    """Closed loop rebuilt from the point's own A, B and gains, with the integral of the error."""
    model, lqr = point["linear_model"], point["controllers"][2]
    gains = {g["name"]: g["value"] for g in lqr["gains"]}
    A, B = np.zeros((5, 5)), np.zeros((5, 2))
    A[:4, :4], A[4, 2], B[:4] = model["A"], -1.0, model["B"]
    K = [[gains[f"K_{u}_{x}"] for x in ("dt", "dt_rate", "da", "da_rate", "int_a")] for u in ("T_t", "T_a")]
    poles = np.sort_complex(np.linalg.eigvals(A - B @ np.array(K)))
    np.testing.assert_allclose(np.sort_complex(complex_array(lqr["poles"])), poles, rtol=1e-9)
    riccati = lqr["riccati"]
    assert riccati["residual"] <= 1e-12
    assert riccati["largest_real_part"] == pytest.approx(poles.real.max(), rel=1e-9)
    assert riccati["return_difference_min"] >= 1 - 1e-6
    assert set(lqr["margins"]) == {"tab", "aileron"}


def test_margins_are_explained(point: dict[str, Any]) -> None:
    for controller in point["controllers"]:
        for margins in controller["margins"].values():
            null = {name for name, value in margins.items() if value is None}
            assert set(margins["reasons"]) == null
            for margin in margins["gain_margins"]:
                assert margin["db"] == pytest.approx(20 * np.log10(margin["ratio"]))
        step = controller["step"]
        assert set(step["reasons"]) == {name for name, value in step.items() if value is None}
        assert step["steady_state_error_deg"] == pytest.approx(0.0, abs=1e-9)
    nf = point["controllers"][0]
    assert nf["margins"]["tab"]["gain_margin_up_db"] >= 6.0 - 1e-6
    assert nf["margins"]["tab"]["phase_margin_deg"] >= 45.0 - 1e-6
    assert nf["step"]["overshoot_percent"] <= 20.0 + 1e-6


@pytest.mark.parametrize(
    ("name", "loop"),
    [("nf", None), ("nf", "K_d"), ("nf", "K_p"), ("nf", "K_i"), ("nf", "tab"), ("pf", "K_f"), ("lqr", "aileron")],
)
def test_root_locus(client: TestClient, here: str, point: dict[str, Any], name: str, loop: str | None) -> None:
    response = client.get(
        f"{here}/controllers/{name}/root-locus", params={"point": 3} | ({"loop": loop} if loop else {})
    )
    locus = answers.RootLocus.model_validate(response.json()).model_dump()
    branches = complex_array(locus["branches"])
    assert locus["loop"] == (loop or "K_d")
    assert locus["sign"] == (-1 if loop == "K_f" else 1)
    assert branches.shape == (len(branches), 300)
    chosen = locus["gains"].index(pytest.approx(locus["chosen_gain"], rel=1e-12))
    if loop in ("K_i", "tab", "aileron"):
        # The loop closed last ends where the point's closed-loop poles are.
        poles = next(c["poles"] for c in point["controllers"] if c["name"] == name)
        reached = np.sort_complex(branches[:, chosen])
        np.testing.assert_allclose(reached, np.sort_complex(complex_array(poles)), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("name", NAMES)
def test_response(client: TestClient, here: str, point: dict[str, Any], name: str) -> None:
    response = client.get(f"{here}/controllers/{name}/response", params={"point": 3, "kind": "linear"})
    document = requirement_answers.Response.model_validate(response.json()).model_dump()
    signals = {key: np.array(values) for key, values in document["signals"].items()}
    assert {"da_deg", "dt_deg", "T_t_n_m", "T_a_n_m"} <= set(signals)
    assert set(document["units"]) == set(signals)
    assert all(key.endswith(("_deg", "_deg_s", "_n_m")) for key in signals)
    time = np.array(document["time_s"])
    assert (time[0], time[-1], len(time)) == (0.0, 1.0, 501)
    trim, controller = point["trim"], next(c for c in point["controllers"] if c["name"] == name)
    assert signals["da_deg"][0] == pytest.approx(trim["aileron_deg"], abs=1e-12)
    settled = time > controller["step"]["settling_time_s"]
    assert np.all(np.abs(signals["da_deg"][settled] - 10.0) <= 0.2 * (1 + 1e-6))
    fine = client.get(f"{here}/controllers/{name}/response?point=3&samples=5000").json()
    rate = np.array(fine["signals"]["da_rate_deg_s"])
    travelled = cumulative_trapezoid(rate, fine["time_s"], initial=0.0)
    np.testing.assert_allclose(fine["signals"]["da_deg"], travelled + trim["aileron_deg"], atol=2e-3)


def test_response_of_the_regulator_by_the_matrix_exponential(
    client: TestClient, here: str, point: dict[str, Any]
) -> None:
    """x' = (A - B K) x + (B N + E) r from the point's own matrices, one exponential a sample."""
    model, lqr = point["linear_model"], point["controllers"][2]
    gains = {g["name"]: g["value"] for g in lqr["gains"]}
    states, inputs = ("dt", "dt_rate", "da", "da_rate", "int_a"), ("T_t", "T_a")
    A, B, E = np.zeros((5, 5)), np.zeros((5, 2)), np.array([0, 0, 0, 0, 1.0])
    A[:4, :4], A[4, 2], B[:4] = model["A"], -1.0, model["B"]
    K = np.array([[gains[f"K_{u}_{x}"] for x in states] for u in inputs])
    N = np.array([gains[f"N_{u}_r_a"] for u in inputs])
    M = np.zeros((6, 6))
    M[:5, :5], M[:5, 5] = A - B @ K, (E + B @ N) * np.deg2rad(10.0)
    document = client.get(f"{here}/controllers/lqr/response?point=3&samples=11&duration_s=0.5").json()
    trim = point["trim"]
    for k, t in enumerate(document["time_s"]):
        x = expm(M * t)[:5, 5]
        u = -K @ x + N * np.deg2rad(10.0)
        got = [document["signals"][key][k] for key in ("dt_deg", "da_deg", "T_t_n_m", "T_a_n_m")]
        expected = [np.rad2deg(x[0]), np.rad2deg(x[2]), u[0] + trim["T_t_n_m"], u[1] + trim["T_a_n_m"]]
        np.testing.assert_allclose(got, expected, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("name", NAMES)
def test_requirements(client: TestClient, here: str, name: str) -> None:
    response = client.get(f"{here}/controllers/{name}/actuator-requirements")
    document = requirement_answers.Requirements.model_validate(response.json()).model_dump()
    assert set(document["actuators"]) == ({"tab", "aileron"} if name == "lqr" else {"tab"})
    for actuator, figures in document["actuators"].items():
        letter = actuator[0]
        for figure, values in figures.items():
            over_grid, worst = np.array(values, dtype=float), document["envelope"][actuator][figure]
            assert over_grid.shape == (2, 4)
            if worst["point"] is not None and worst["value"] is not None:
                assert worst["value"] == np.nanmax(over_grid) == over_grid.flat[worst["point"]]
        # Peaks are at least those of the sampled response, and close to them.
        signals = client.get(f"{here}/controllers/{name}/response?point=3&samples=5000").json()["signals"]
        for figure, signal in (("peak_torque_n_m", f"T_{letter}_n_m"), ("peak_rate_deg_s", f"d{letter}_rate_deg_s")):
            peak, sampled = figures[figure][0][3], np.abs(signals[signal]).max()
            assert sampled * (1 - 1e-9) <= peak <= sampled * 1.001
    assert document["limits"]["tab"] == {
        "deflection_deg": 25.0,
        "rate_deg_s": pytest.approx(400.0, rel=1e-15),
        "torque_n_m": 2.0,
        "power_w": None,
    }


def test_gains_between_points_are_multilinear(client: TestClient, here: str, design: dict[str, Any]) -> None:
    query = {"altitude_m": 1000.0, "dynamic_pressure_pa": 700.0}
    document = client.get(f"{here}/controllers/lqr/gains", params=query).json()
    answers.InterpolatedGains.model_validate(document)
    (h0, h1), (q0, q1) = (0.0, 3000.0), (551.25, 980.0)
    wh, wq = (1000.0 - h0) / (h1 - h0), (700.0 - q0) / (q1 - q0)
    for gain in design["controllers"][2]["gains"]:
        v = gain["values"]
        expected = (1 - wh) * ((1 - wq) * v[0][1] + wq * v[0][2]) + wh * ((1 - wq) * v[1][1] + wq * v[1][2])
        assert document["gains"][gain["name"]] == pytest.approx(expected, rel=1e-12)
        assert document["units"][gain["name"]] == gain["unit"]
    assert (document["clipped"], document["rule"]) == (False, "multilinear in the grid's own axes")


def test_gains_outside_the_grid_are_clipped(client: TestClient, here: str, design: dict[str, Any]) -> None:
    query = {"altitude_m": -500.0, "dynamic_pressure_pa": 1e6}
    document = client.get(f"{here}/controllers/nf/gains", params=query).json()
    corner = {g["name"]: g["values"][0][3] for g in design["controllers"][0]["gains"]}
    assert (document["clipped"], document["gains"]) == (True, corner)


@pytest.mark.parametrize(
    ("path", "pointer", "allowed"),
    [
        ("root-locus", "/point", "an integer"),
        ("root-locus?point=8", "/point", ">= 0 and <= 7"),
        ("root-locus?point=-1", "/point", ">= 0 and <= 7"),
        ("root-locus?point=1.5", "/point", "an integer"),
        ("root-locus?point=0&loop=K_x", "/loop", "one of K_d, K_p, K_i, tab"),
        ("root-locus?point=0&count=99", "/count", "an integer >= 100"),
        ("root-locus?point=0&count=2001", "/count", "<= 2000"),
        ("root-locus?point=0&gain=3", "/gain", "fields point, loop, damping_ratio, count"),
        ("response?point=0&kind=exact", "/kind", "one of linear, nonlinear"),
        ("response?point=0&samples=5001", "/samples", "<= 5000"),
        ("response?point=0&samples=1", "/samples", "an integer >= 2"),
        ("response?point=0&duration_s=nan", "/duration_s", ">= 0.001 and <= 1000, or null"),
        ("response?point=0&duration_s=inf", "/duration_s", ">= 0.001 and <= 1000, or null"),
        ("gains?altitude_m=0", "/dynamic_pressure_pa", "the grid's axes: altitude_m, dynamic_pressure_pa"),
        ("gains?altitude_m=0&mach=0.5", "/dynamic_pressure_pa", "the grid's axes: altitude_m, dynamic_pressure_pa"),
        ("gains?altitude_m=nan&dynamic_pressure_pa=700", "/altitude_m", "a number"),
    ],
)
def test_bad_queries(client: TestClient, here: str, refused: Any, path: str, pointer: str, allowed: str) -> None:
    error = refused(client.get(f"{here}/controllers/nf/{path}"), 422)["errors"][0]
    assert (error["pointer"], error["allowed"]) == (pointer, allowed)


@pytest.mark.parametrize(
    "path",
    ["points/8", "points/-1", "points/99999999999999999999999", "controllers/x/root-locus?point=0", "schedules/x.csv"],
)
def test_what_is_not_there(client: TestClient, here: str, refused: Any, path: str) -> None:
    assert refused(client.get(f"{here}/{path}"), 404)["code"] == "not_found"


def test_schedule_formats_that_are_not_there(client: TestClient, here: str, refused: Any) -> None:
    assert "json, csv, mat" in refused(client.get(f"{here}/schedules/nf.exe"), 404)["detail"]


def test_no_gains_at_a_point(client: TestClient, wanted: Any, refused: Any) -> None:
    """Positive feedback cannot have 6 dB and 45 degrees with damping 0.5 here: infeasible, and it says so."""
    wanted["controllers"] = [
        wanted["controllers"][1]
        | {"specs": {"damping_ratio_min": 0.5, "gain_margin_db_min": 6.0, "phase_margin_deg_min": 45.0}}
    ]
    wanted["grid"] = {"altitude_m": [0.0], "dynamic_pressure_pa": [980.0]}
    document = client.post("/v1/designs", json=wanted).json()
    here, controller = f"/v1/designs/{document['id']}", document["controllers"][0]
    assert controller["outcomes"] == [["infeasible"]]
    assert {gain["values"][0][0] for gain in controller["gains"]} == {None}
    for path in ("root-locus?point=0", "response?point=0"):
        problem = refused(client.get(f"{here}/controllers/pf/{path}"), 409)
        assert problem["code"] == "no_design_at_point"
        assert controller["reasons"][0][0] in problem["detail"]
    requirements = client.get(f"{here}/controllers/pf/actuator-requirements").json()
    requirement_answers.Requirements.model_validate(requirements)
    assert requirements["actuators"]["tab"]["peak_torque_n_m"] == [[None]]
    assert requirements["envelope"]["tab"]["peak_torque_n_m"] == {"value": None, "point": None}
    assert requirements["reasons"] == controller["reasons"]
    gains = client.get(f"{here}/controllers/pf/gains?altitude_m=0&dynamic_pressure_pa=980").json()
    assert set(gains["gains"].values()) == {None}
    assert gains["reason"]
    point = client.get(f"{here}/points/0").json()
    Point.model_validate(point)
    assert point["controllers"][0]["margins"] is None
    assert client.get(f"{here}/schedules/pf.csv").status_code == 200


def test_linear_models_are_those_of_the_points(client: TestClient, here: str, wanted: Any) -> None:
    parts = {key: wanted[key] for key in ("geometry", "inertia", "aerodynamics", "atmosphere", "trim", "grid")}
    document = client.post("/v1/linear-models", json=parts).json()
    LinearModels.model_validate(document)
    assert [point["index"] for point in document["points"]] == list(range(8))
    for index, plant in enumerate(document["points"]):
        point = client.get(f"{here}/points/{index}").json()
        del point["controllers"]
        assert plant == point
