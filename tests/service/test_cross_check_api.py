"""The second opinion over HTTP."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import control as ct
import numpy as np
import pytest
from fastapi.testclient import TestClient

import service.routes.cross_check as route
from service.app import create_app
from service.documentation.design_examples import design_requests
from service.settings import Settings
from tests.service.flown_answers import posted
from tests.service.lqr_by_hand import by_hand


def checked(client: TestClient, design: dict[str, Any], **query: Any) -> dict[str, Any]:
    response = client.get(f"/v1/designs/{design['id']}/cross-check", params=query)
    assert response.status_code == 200, response.text
    document: dict[str, Any] = response.json()
    return document


def named(figures: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    return {figure["name"]: figure for figure in figures}


def test_every_figure_is_the_points_own(client: TestClient, design: dict[str, Any]) -> None:
    """Under `value` stands what the point of the design says, and it agrees with python-control."""
    found = checked(client, design, points=[6, 0])
    assert found["python_control"] == ct.__version__
    assert found["agrees"] is True
    assert [each["point"] for each in found["points"]] == [6, 0]
    for each in found["points"]:
        point = client.get(f"/v1/designs/{design['id']}/points/{each['point']}").json()
        assert each["coordinates"] == point["coordinates"]
        assert [c["name"] for c in each["controllers"]] == ["nf", "pf", "lqr"]
        for controller, own in zip(each["controllers"], point["controllers"], strict=True):
            assert controller["agrees"] is True
            for name, figure in named(controller["gains"]).items():
                assert figure["value"] == {g["name"]: g["value"] for g in own["gains"]}[name]
            for name, figure in named(controller["step"]).items():
                assert figure["value"] == pytest.approx(own["step"][name], rel=1e-12, abs=1e-12)
            for cut, figures in controller["margins"].items():
                for name, figure in named(figures).items():
                    wanted = own["margins"][cut][name]
                    assert figure["value"] == (None if wanted is None else pytest.approx(wanted, rel=1e-12))
            poles = [complex(p["value"]["re"], p["value"]["im"]) for p in controller["poles"]]
            assert poles == [complex(p["re"], p["im"]) for p in own["poles"]]


def test_gains_are_those_of_lqr_by_hand(client: TestClient, design: dict[str, Any]) -> None:
    """python-control's column against its own function on the weights of the request, put together from the wire."""
    (point,) = checked(client, design, points=3, controller="lqr")["points"]
    (controller,) = point["controllers"]
    hand = by_hand(client.get(f"/v1/designs/{design['id']}/points/3").json(), "lqr")
    rad = np.deg2rad
    Q = np.diag(1.0 / np.array([rad(10.0), rad(400.0), rad(2.0), rad(200.0), rad(0.1)]) ** 2)
    R = np.diag(1.0 / np.array([0.5, 2.0]) ** 2)
    K, _, _ = ct.lqr(hand.A, hand.B, Q, R)
    np.testing.assert_allclose([g["python_control"] for g in controller["gains"]], K.ravel(), rtol=1e-9)
    assert {each["figure"] for each in controller["left_out"]} == {"N_T_t_r_a N_T_a_r_a"}


def test_largest_differences_are_those_of_the_points(client: TestClient, design: dict[str, Any]) -> None:
    found = checked(client, design, points=[0, 5])
    for worst in found["largest_differences"]:
        (point,) = [p for p in found["points"] if p["point"] == worst["point"]]
        (controller,) = [c for c in point["controllers"] if c["name"] == worst["controller"]]
        group = controller[worst["figure"]]
        figure = named(group if worst["cut"] is None else group[worst["cut"]])[worst["name"]]
        assert figure["difference"] == worst["difference"]
        assert figure["agrees"] == worst["agrees"]
    everything = [c for p in found["points"] for c in p["controllers"]]
    poles = max(pole["difference"] for c in everything for pole in c["poles"])
    assert {w["figure"]: w["difference"] for w in found["largest_differences"]}["poles"] == poles
    figures = {(w["figure"], w["name"]) for w in found["largest_differences"] if w["figure"] in ("margins", "step")}
    assert ("margins", "phase_margin_deg") in figures
    assert ("step", "settling_time_s") in figures


def test_what_disagrees_says_so(client: TestClient, design: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    real = route.cross_check

    def wrong(*of: Any) -> Any:
        from dataclasses import replace

        found = real(*of)
        tab = found.margins["tab"]
        found.margins["tab"] = (replace(tab[0], by_control=np.inf, difference=np.nan), *tab[1:])
        return found

    monkeypatch.setattr(route, "cross_check", wrong)
    found = checked(client, design, points=[0, 0, 1], controller=["pf", "pf"])
    assert found["agrees"] is False
    assert [each["point"] for each in found["points"]] == [0, 1]
    figure = named(found["points"][0]["controllers"][0]["margins"]["tab"])["gain_margin_up_db"]
    assert (figure["python_control"], figure["difference"], figure["agrees"]) == (None, None, False)
    worst = named(found["largest_differences"])["gain_margin_up_db"]
    assert (worst["difference"], worst["agrees"], worst["cut"]) == (None, False, "tab")


@pytest.mark.parametrize("name", ["lqr_sampled", "lqr_structures", "lqr_measured", "given_gains"])
def test_every_kind_of_loop_is_answered(client: TestClient, name: str) -> None:
    """Code, delays, filters, observers: what is not compared has a reason, and nothing is missing in silence."""
    design = posted(client, design_requests()[name][1])
    (point,) = checked(client, design, points=0)["points"]
    for controller in point["controllers"]:
        assert controller["agrees"] is True, controller
        left_out = " ".join(each["figure"] for each in controller["left_out"])
        for group in ("gains", "poles", "margins", "step"):
            assert controller[group] or group in left_out


def test_a_point_without_gains_has_its_reason(client: TestClient, wanted: dict[str, Any]) -> None:
    wanted["grid"] = {"altitude_m": [11_000.0], "airspeed_m_s": [40.0, 320.0]}
    wanted["controllers"] = wanted["controllers"][2:]
    found = checked(client, posted(client, wanted), points=[0, 1])
    inside, outside = (point["controllers"][0] for point in found["points"])
    assert inside["agrees"] is True
    assert (outside["agrees"], outside["outcome"], outside["gains"]) == (None, "outside_model", [])
    assert "Mach 1.08" in outside["reason"]


@pytest.mark.parametrize(
    ("query", "status", "pointer"),
    [
        ("", 422, "/points"),
        ("points=", 422, "/points/0"),
        ("points=-1", 422, "/points/0"),
        ("points=0&points=8", 422, "/points/1"),
        ("points=99999999999999999999999", 422, "/points/0"),
        ("points=1.5", 422, "/points/0"),
        ("points=nan", 422, "/points/0"),
        ("point=0", 422, "/points"),
        ("points=0&margins=true", 422, "/margins"),
        ("points=0&controller=nobody", 404, None),
        ("points=0&controller=", 404, None),
        ("&".join(f"points={i}" for i in range(1001)), 422, "/points"),
    ],
)
def test_what_cannot_be_asked(
    client: TestClient, design: dict[str, Any], refused: Any, query: str, status: int, pointer: str | None
) -> None:
    problem = refused(client.get(f"/v1/designs/{design['id']}/cross-check?{query}"), status)
    if pointer is not None:
        assert pointer in [error["pointer"] for error in problem["errors"]]
    refused(client.get(f"/v1/designs/{'0' * 32}/cross-check?points=0"), 404)


def test_the_limit_names_its_setting(tmp_path: Path, quick: dict[str, Any], refused: Any) -> None:
    quick["grid"]["dynamic_pressure_pa"] = [500.0, 980.0]
    with TestClient(create_app(Settings(data_dir=tmp_path, max_cross_checks=1))) as client:
        design = posted(client, quick)
        problem = refused(client.get(f"/v1/designs/{design['id']}/cross-check?points=0&points=1"), 422)
        assert problem["code"] == "limit_exceeded"
        assert "max_cross_checks" in problem["detail"]
        assert "GAINFIELD_MAX_CROSS_CHECKS" in problem["detail"]
        assert checked(client, design, points=1)["agrees"] is True


def test_it_waits_for_a_slot(tmp_path: Path, quick: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Even of a design that is ready in memory, no more run at once than designs are computed."""
    lock, now, most, release = threading.Lock(), [0], [0], threading.Event()
    real, statuses = route.cross_check, []

    def slow(*of: Any) -> Any:
        with lock:
            now[0] += 1
            most[0] = max(most[0], now[0])
        release.wait(10)
        with lock:
            now[0] -= 1
        return real(*of)

    monkeypatch.setattr(route, "cross_check", slow)
    with TestClient(create_app(Settings(data_dir=tmp_path, max_concurrent_designs=1))) as client:
        where = f"/v1/designs/{posted(client, quick)['id']}/cross-check?points=0"
        threads = [threading.Thread(target=lambda: statuses.append(client.get(where).status_code)) for _ in range(4)]
        for thread in threads:
            thread.start()
        while now[0] < 1:
            threading.Event().wait(0.01)
        assert client.get("/healthz").status_code == 200
        release.set()
        for thread in threads:
            thread.join()
    assert (most[0], statuses) == (1, [200] * 4)
