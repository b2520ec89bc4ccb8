"""Every source of hinge moments over HTTP: the numbers of the model, the fit's error, and bad tables refused."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from model.hinge_moments.expansion import Angles
from model.hinge_moments.taylor import fit_taylor
from model.hinge_moments.xfoil_naca23012 import _FILE, xfoil_naca23012
from service.app import create_app
from service.documentation.body_examples import DERIVATIVES, ROWS, TABLE, plant
from service.settings import Settings

JSON = {"Content-Type": "application/json"}
HINGES = {"aileron_hinge": 0.70, "tab_hinge": 0.88}
CSV = _FILE.read_text(encoding="ascii")
XFOIL = {"source": "table", "csv": CSV, "where": {"case": "trip", "Re": 3e6}}
REST = [{"alpha_deg": 0.0, "aileron_deg": 0.0, "tab_deg": 0.0}]


def hinge_moments(aerodynamics: Any, **more: Any) -> dict[str, Any]:
    return {"geometry": HINGES, "aerodynamics": aerodynamics, "states": REST, **more}


def table(rows: Any, **fit: Any) -> dict[str, Any]:
    return {"source": "table", "rows": rows} | ({"fit": fit} if fit else {})


@pytest.fixture
def linear(client: TestClient) -> Any:
    def ask(aerodynamics: Any, trim: Any = None) -> dict[str, Any]:
        body = plant() | {"aerodynamics": aerodynamics} | ({"trim": trim} if trim else {})
        response = client.post("/v1/linear-models", json=body)
        assert response.status_code == 200, response.text
        document: dict[str, Any] = response.json()
        return document

    return ask


def test_theory_through_the_other_sources(client: TestClient, linear: Any) -> None:
    """Thin-aerofoil derivatives posted as numbers, and as a table of its values, give the same linear models."""
    theory = {"source": "thin_aerofoil", "section": "NACA 23012"}
    angles = [(a, da, dt) for a in (-5.0, 5.0) for da in (-10.0, 10.0) for dt in (-10.0, 10.0)]
    states = [{"alpha_deg": a, "aileron_deg": da, "tab_deg": dt} for a, da, dt in angles]
    geometry = {name: plant()["geometry"][name] for name in HINGES}
    body = {"geometry": geometry, "aerodynamics": theory, "states": states}
    answered = client.post("/v1/hinge-moments", json=body).json()
    rows = [[*angle, state["C_Ha"], state["C_Ht"]] for angle, state in zip(angles, answered["states"], strict=True)]
    expected = linear(theory)
    assert expected["hinge_moment_fit"] is None
    for source in (
        {"source": "derivatives"} | answered["derivatives"],
        table(rows),
        table(rows, method="multilinear"),
    ):
        found = linear(source)
        for point, same in zip(found["points"], expected["points"], strict=True):
            np.testing.assert_allclose(point["linear_model"]["A"], same["linear_model"]["A"], rtol=1e-6)
            assert point["trim"]["T_a_n_m"] == pytest.approx(same["trim"]["T_a_n_m"], rel=1e-6)


def test_reference_angles_of_derivatives(client: TestClient) -> None:
    shifted = DERIVATIVES | {"reference": {"alpha_deg": 2.0, "aileron_deg": -3.0, "tab_deg": 4.0}}
    states = [{"alpha_deg": 2.0, "aileron_deg": -3.0, "tab_deg": 4.0}]
    document = client.post("/v1/hinge-moments", json=hinge_moments(shifted) | {"states": states}).json()
    assert document["states"][0]["C_Ha"] == pytest.approx(DERIVATIVES["C_Ha_0"], rel=1e-12)
    slopes = document["derivatives"]
    at_zero = DERIVATIVES["C_Ht_0"] - np.deg2rad([2.0, -3.0, 4.0]) @ [
        DERIVATIVES[f"C_Ht_{x}"] for x in ("alpha", "da", "dt")
    ]
    assert slopes["C_Ht_0"] == pytest.approx(at_zero, rel=1e-12)
    assert slopes["C_Ht_dt"] == DERIVATIVES["C_Ht_dt"]


def test_mean_line_through_points(client: TestClient) -> None:
    """The parabola z = 4 m x (1 - x), which the spline holds exactly, against its closed-form slope in quadrature."""
    x = np.linspace(0.0, 1.0, 7)
    points = np.stack([x, 0.08 * x * (1 - x)], axis=-1).tolist()
    mean_line = {"source": "thin_aerofoil", "section": points}
    theta = (np.arange(2000) + 0.5) * np.pi / 2000
    places = 0.5 * (1 - np.cos(theta))
    body = hinge_moments(mean_line, chordwise=places[::2].tolist())
    (state,) = client.post("/v1/hinge-moments", json=body).json()["states"]
    # Glauert: A_0 = 0, A_1 = 4 m, so the load is 4 A_1 sin(theta) = 32 m sqrt(x (1 - x)), with m = 0.02.
    load = 32 * 0.02 * np.sqrt(places * (1 - places))
    np.testing.assert_allclose(state["pressure_difference"], load[::2], atol=1e-9)
    weight = 0.5 * np.sin(theta) * np.pi / 2000
    for hinge, coefficient in ((0.70, state["C_Ha"]), (0.88, state["C_Ht"])):
        assert -np.sum((load * (places - hinge) * weight)[places > hinge]) == pytest.approx(coefficient, abs=1e-6)


def test_the_fit_of_the_xfoil_table_is_judged_in_the_answer(client: TestClient) -> None:
    cubic = XFOIL | {"fit": {"method": "cubic"}}
    fit = client.post("/v1/hinge-moments", json=hinge_moments(cubic)).json()["hinge_moment_fit"]
    assert (fit["method"], fit["errors"], fit["rows"]["used"], fit["rows"]["given"]) == ("cubic", "left_out", 242, 242)
    assert fit["C_Ha"]["max_percent_of_range"] == pytest.approx(100 * fit["C_Ha"]["max"] / fit["C_Ha"]["range"])
    window = XFOIL | {"fit": {"method": "taylor", "order": 1, "window_deg": 2.0}}
    document = client.post("/v1/hinge-moments", json=hinge_moments(window)).json()
    assert document["hinge_moment_fit"]["rows"] | {"C_Ha_disagreement": 0, "C_Ht_disagreement": 0} == {
        "given": 242,
        "used": 9,
        "outside_window": 233,
        "dropped": 0,
        "averaged": 0,
        "C_Ha_disagreement": 0,
        "C_Ht_disagreement": 0,
    }
    width = np.deg2rad(2.0)
    expected = fit_taylor(xfoil_naca23012(), 1, Angles(), Angles(width, width, width))
    slope = expected.at(0.0, 0.0, 0.0).gradient[1, 2]
    assert document["derivatives"]["C_Ha_da"] == pytest.approx(slope, rel=1e-12)
    # Loss of C_Ha,da against thin-aerofoil theory at a Reynolds number of three million: about a fifth.
    assert document["derivatives"]["C_Ha_da"] / 8.688623941e-02 == pytest.approx(0.78, abs=0.01)


def test_the_fit_stands_in_designs_and_linear_models(client: TestClient, quick: Any, linear: Any) -> None:
    quick["aerodynamics"] = TABLE
    response = client.post("/v1/designs", json=quick)
    assert response.status_code == 201, response.text
    design = response.json()
    assert design["controllers"][0]["outcomes"] == [["ok"]]
    assert design["hinge_moment_fit"]["rows"]["used"] == 18
    assert design["hinge_moment_fit"] == linear(TABLE)["hinge_moment_fit"]
    assert client.get(f"/v1/designs/{design['id']}/points/0").status_code == 200


def test_both_ways_of_writing_rows_are_one_request(client: TestClient, quick: Any) -> None:
    names = ("alpha_deg", "aileron_deg", "tab_deg", "C_Ha", "C_Ht")
    quick["aerodynamics"] = TABLE
    listed = client.post("/v1/designs", json=quick).json()
    quick["aerodynamics"] = TABLE | {"rows": [dict(zip(names, row, strict=True)) for row in ROWS]}
    again = client.post("/v1/designs", json=quick)
    assert (again.status_code, again.json()["id"]) == (200, listed["id"])


def test_gaps_and_duplicates_are_counted(client: TestClient) -> None:
    rows = [*copy.deepcopy(ROWS), [0.0, 0.0, 0.0, None, 0.5], [0.0, 0.0, 0.0, 0.002, 0.0]]
    fit = client.post("/v1/hinge-moments", json=hinge_moments(table(rows))).json()["hinge_moment_fit"]
    assert (fit["rows"]["given"], fit["rows"]["dropped"], fit["rows"]["averaged"]) == (20, 1, 1)
    assert fit["rows"]["C_Ha_disagreement"] == pytest.approx(0.001)


def test_beyond_the_table(client: TestClient, linear: Any) -> None:
    states = [*REST, {"alpha_deg": 0.0, "aileron_deg": 15.0, "tab_deg": 0.0}]
    body = hinge_moments(TABLE, about={"alpha_deg": 6.0}) | {"states": states}
    document = client.post("/v1/hinge-moments", json=body).json()
    assert document["derivatives"] is None
    assert "lie outside the hinge-moment data" in document["reason"]
    assert [state["covered"] for state in document["states"]] == [True, False]
    assert document["states"][1]["C_Ha"] is None
    outside = linear(TABLE, {"alpha_deg": 5.0, "tab_deg": 11.0})
    assert {outcome for row in outside["outcomes"] for outcome in row} == {"outside_model"}
    assert "outside the hinge-moment data" in outside["points"][0]["reason"]


@pytest.mark.parametrize(
    ("trim", "zero"),
    [
        ({"tab_deg": "zero_aileron_torque"}, "T_a_n_m"),
        ({"tab_deg": "zero_tab_torque"}, "T_t_n_m"),
        ({"aileron_deg": "zero_aileron_torque", "tab_deg": 3.0}, "T_a_n_m"),
    ],
)
def test_trims_without_torque(linear: Any, trim: Any, zero: str) -> None:
    for point in linear(DERIVATIVES, {"alpha_deg": 2.0} | trim)["points"]:
        assert point["outcome"] == "ok"
        assert point["trim"][zero] == pytest.approx(0.0, abs=1e-12)


def test_a_held_torque_and_a_limit_in_its_way(linear: Any) -> None:
    held = {"alpha_deg": 2.0, "tab_deg": {"surface": "aileron", "torque_n_m": 0.4}}
    free = linear(DERIVATIVES, held)
    for point in free["points"]:
        assert point["trim"]["T_a_n_m"] == 0.4
        assert point["trim"]["residual_n_m"] < 1e-9
    steepest = max(abs(point["trim"]["tab_deg"]) for point in free["points"])
    limited = linear(DERIVATIVES, held | {"tab_limit_deg": 0.5 * steepest})
    outcomes = [point["outcome"] for point in limited["points"]]
    expected = ["ok" if abs(p["trim"]["tab_deg"]) <= 0.5 * steepest else "outside_model" for p in free["points"]]
    assert outcomes == expected
    assert "outside_model" in outcomes


@pytest.mark.parametrize(
    "trim",
    [
        {"aileron_deg": "zero_aileron_torque", "tab_deg": "zero_aileron_torque"},
        {"aileron_deg": {"surface": "tab", "torque_n_m": 1.0}, "tab_deg": "zero_tab_torque"},
        {"aileron_deg": "zero_aileron_torque", "tab_deg": "least_torque"},
    ],
)
def test_one_equation_for_two_angles(client: TestClient, refused: Any, trim: Any) -> None:
    (error,) = refused(client.post("/v1/linear-models", json=plant() | {"trim": trim}), 422)["errors"]
    assert error["pointer"] == "/trim/tab_deg"


def changed(row: int, cell: int, value: Any) -> Any:
    rows: list[list[Any]] = copy.deepcopy(ROWS)
    rows[row][cell] = value
    return rows


BAD_TABLES = {
    "a row too short": (table([row[:4] for row in ROWS[:1]] + ROWS[1:]), "/rows/0", "5 items"),
    "text in a number": (table(changed(3, 2, "ten")), "/rows/3/2", "number"),
    "a number in quotes": (table(changed(3, 3, "0.1")), "/rows/3/3", "number"),
    "an angle missing": (table(changed(1, 0, None)), "/rows/1/0", "alpha_deg cannot be null"),
    "an angle in radians beyond": (table(changed(1, 1, 91.0)), "/rows/1/1", "aileron_deg cannot be 91"),
    "a column missing": (
        table([{"alpha_deg": 0.0, "aileron_deg": 0.0, "tab_deg": 0.0, "C_Ha": 0.0}]),
        "/rows/0/C_Ht",
        "required",
    ),
    "a column too many": (
        table([{"alpha_deg": 0, "aileron_deg": 0, "tab_deg": 0, "C_Ha": 0, "C_Ht": 0, "C_L": 0}]),
        "/rows/0/C_L",
        "unknown field",
    ),
    "rows of neither form": (table([3.0]), "/rows/0", "neither"),
    "no rows": (table([]), "/rows", "at least 1"),
    "one tab angle": (table([row for row in ROWS if row[2] == 0]), "/rows", "one tab angle only"),
    "one aileron angle": (table([row for row in ROWS if row[1] == 0]), "/rows", "one aileron angle only"),
    "no coefficients": (table([[*row[:3], None, None] for row in ROWS]), "/rows", "no row"),
    "gaps in a grid": (table(ROWS[1:], method="cubic"), "/fit", "combination"),
    "too few rows": (table(ROWS, method="taylor", order=6, window_deg=5.0), "/fit", ""),
    "deflected together": (table([[0, x, x, 0.1 * x, x] for x in (-2, -1, 0, 1, 2)]), "/fit", "apart"),
    "order too high": (table(ROWS, method="taylor", order=7), "/fit/order", "6"),
    "an unknown fit": (table(ROWS, method="spline"), "/fit/method", "kind"),
    "no table": ({"source": "table"}, "/rows", "once"),
    "two tables": ({"source": "table", "rows": ROWS, "csv": "x"}, "/rows", "once"),
    "columns of rows": ({"source": "table", "rows": ROWS, "where": {"Re": 1.0}}, "/where", "csv"),
    "CSV without a column": ({"source": "table", "csv": CSV.replace("C_Ht", "C_Hx")}, "/csv", "lacks columns: C_Ht"),
    "CSV with text": ({"source": "table", "csv": CSV.replace("0.029637", "high")}, "/csv", "line 6, column C_Ha"),
    "CSV that is none": ({"source": "table", "csv": "\x00\x01"}, "/csv", ""),
    "CSV of nothing chosen": (XFOIL | {"where": {"case": "none"}}, "/csv", "no rows"),
    "CSV without that column": (XFOIL | {"where": {"Mach": 0.0}}, "/csv", "Mach"),
    "a choice of no kind": (XFOIL | {"where": {"Re": []}}, "/where/Re", "neither"),
    "mean line backwards": (
        {"source": "thin_aerofoil", "section": [[1, 0], [0.5, 0.1], [0.2, 0.1], [0, 0]]},
        "/section",
        "x must increase",
    ),
    "mean line of three points": (
        {"source": "thin_aerofoil", "section": [[0, 0], [0.5, 0.1], [1, 0]]},
        "/section",
        "4",
    ),
    "a derivative missing": ({k: v for k, v in DERIVATIVES.items() if k != "C_Ht_dt"}, "/C_Ht_dt", "required"),
    "no source": ({"section": "symmetric"}, "/source", "kind"),
}


@pytest.mark.parametrize(("aerodynamics", "pointer", "words"), BAD_TABLES.values(), ids=BAD_TABLES)
def test_bad_tables(client: TestClient, refused: Any, aerodynamics: Any, pointer: str, words: str) -> None:
    (error,) = refused(client.post("/v1/hinge-moments", json=hinge_moments(aerodynamics)), 422)["errors"]
    assert error["pointer"] == "/aerodynamics" + pointer
    assert words in error["detail"]
    assert error["allowed"]
    (again,) = refused(client.post("/v1/linear-models", json=plant() | {"aerodynamics": aerodynamics}), 422)["errors"]
    assert again["pointer"] == error["pointer"]


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-1e999"])
def test_numbers_of_a_table_are_finite(client: TestClient, refused: Any, number: str) -> None:
    body = json.dumps(hinge_moments(table(changed(4, 3, "here")))).replace('"here"', number)
    (error,) = refused(client.post("/v1/hinge-moments", content=body, headers=JSON), 422)["errors"]
    assert (error["pointer"], error["detail"]) == ("/aerodynamics/rows/4/3", "must be a finite number")


def test_pressure_is_known_to_theory_only(client: TestClient, refused: Any) -> None:
    (error,) = refused(client.post("/v1/hinge-moments", json=hinge_moments(DERIVATIVES, chordwise=[0.5])), 422)[
        "errors"
    ]
    assert error["pointer"] == "/chordwise"


def test_one_incidence_is_enough_and_said(client: TestClient) -> None:
    """Nothing that moves depends on the derivative by incidence; by deflection everything does."""
    rows = [row for row in ROWS if row[0] == 0.0]
    document = client.post("/v1/hinge-moments", json=hinge_moments(table(rows))).json()
    assert document["derivatives"]["C_Ha_alpha"] == 0.0
    assert any("one incidence only" in note for note in document["hinge_moment_fit"]["notes"])


def test_too_many_rows(client: TestClient, refused: Any, tmp_path: Any) -> None:
    """A million rows are more than a body; fewer rows than bytes are refused by their own limit."""
    million = b'{"aerodynamics":{"source":"table","rows":[' + b"[0,0,0,0,0]," * 1_000_000 + b"[0,0,0,0,0]]}}"
    assert refused(client.post("/v1/hinge-moments", content=million, headers=JSON), 413)["code"] == "body_too_large"
    with TestClient(create_app(Settings(data_dir=tmp_path, max_table_rows=17))) as small:
        for path, body in (
            ("/v1/hinge-moments", hinge_moments(TABLE)),
            ("/v1/linear-models", plant() | {"aerodynamics": TABLE}),
            ("/v1/steady-state-maps", plant() | {"aerodynamics": TABLE}),
            ("/v1/similarity", plant() | {"aerodynamics": TABLE}),
        ):
            problem = refused(small.post(path, json=body), 422)
            assert problem["code"] == "limit_exceeded"
            assert "GAINFIELD_MAX_TABLE_ROWS" in problem["detail"]
            assert problem["errors"][0]["pointer"] == "/aerodynamics/rows"
        csv = TABLE | {"rows": None, "csv": "a\n" * 18}
        problem = refused(small.post("/v1/hinge-moments", json=hinge_moments(csv)), 422)
        assert problem["errors"][0] == {
            "pointer": "/aerodynamics/csv",
            "detail": "18 lines",
            "unit": "1",
            "allowed": "<= 17",
        }
