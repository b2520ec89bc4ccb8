"""Gains flown at every other point over HTTP."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

import service.routes.cross_flight as cross_flight_route
from schedules.cross_flight import cross_flight
from schedules.designed import DesignedEnvelope
from schedules.flown_figures import FlownFigures
from schedules.judging import asked
from service.app import create_app
from service.examples import example
from service.presenters.cross_flight import flown_outcomes
from service.settings import Settings
from tests.service.flown_answers import (
    FIGURES,
    MARGINS,
    address,
    answered,
    at_one_point,
    exactly,
    least_damping,
    numbers,
    posted,
    wind_tunnel,
)


@pytest.fixture(scope="module")
def envelope() -> DesignedEnvelope:
    return wind_tunnel()


@pytest.fixture
def one_point(wanted: dict[str, Any]) -> dict[str, Any]:
    return at_one_point(wanted)


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_cross_flight_is_the_domains(
    client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope, name: str
) -> None:
    designed = envelope.controller(name)
    specs = asked(designed.request)
    wanted = cross_flight(envelope.study, envelope.plant, designed, specs, margins=True)
    found = answered(client, design, name, "cross-flight?margins=true")
    pairs = found["pairs"]
    assert set(pairs["margins"]) == set(MARGINS)
    for field, (attribute, scale) in FIGURES.items():
        got = pairs["margins"][field] if field in MARGINS else pairs[field]
        exactly(got, (getattr(wanted.figures, attribute) * scale).reshape(8, 8))
    assert pairs["stable"] == wanted.figures.stable.reshape(8, 8).tolist()
    assert pairs["held"] == wanted.held.reshape(8, 8).tolist()
    assert found["points_held"] == wanted.points_held.tolist()
    assert found["points_flown"] == [[8] * 4] * 2
    exactly(found["worst_damping_ratio"], wanted.worst_damping_ratio)
    assert found["best"]["point"] == wanted.best
    assert found["best"]["points_held"] == wanted.points_held.max()
    worst = found["worst_pair"]
    assert (worst["design"], worst["flown"]) == wanted.worst_pair
    assert worst["damping_ratio"] == np.min(numbers(pairs["damping_ratio"]))
    assert worst["outcome"] == pairs["outcomes"][worst["design"]][worst["flown"]]
    assert found["reason"] is None
    assert [s["spec"] for s in found["specs"] if s["judged"]] == list(
        {c["name"]: c for c in example("wind_tunnel")["controllers"]}[name].get("specs", {})
    )


def test_without_margins_there_are_none_and_the_rest_is_the_same(client: TestClient, design: dict[str, Any]) -> None:
    plain = answered(client, design, "pf", "cross-flight")
    assert plain["pairs"]["margins"] is None
    more = answered(client, design, "pf", "cross-flight?margins=true")
    more["pairs"]["margins"] = None
    assert plain == more


def test_at_home_a_pair_is_its_point(client: TestClient, design: dict[str, Any]) -> None:
    pairs = answered(client, design, "nf", "cross-flight?margins=true")["pairs"]
    for point in (0, 5):
        controllers = client.get(f"/v1/designs/{design['id']}/points/{point}").json()["controllers"]
        here = next(c for c in controllers if c["name"] == "nf")
        assert pairs["settling_time_s"][point][point] == pytest.approx(here["step"]["settling_time_s"], rel=1e-9)
        assert pairs["overshoot_percent"][point][point] == pytest.approx(here["step"]["overshoot_percent"], rel=1e-9)
        margins = here["margins"]["tab"]
        assert pairs["margins"]["phase_margin_deg"][point][point] == pytest.approx(margins["phase_margin_deg"])
        assert pairs["outcomes"][point][point] == "ok"
        assert pairs["held"][point][point]


@pytest.mark.parametrize("name", ["nf", "pf"])
def test_a_pair_is_a_design_of_given_gains(
    client: TestClient, design: dict[str, Any], one_point: dict[str, Any], name: str
) -> None:
    """The gains of one point, posted as given gains at another."""
    pairs = answered(client, design, name, "cross-flight")["pairs"]
    gains = {
        g["name"]: np.ravel(g["values"]) for g in next(c for c in design["controllers"] if c["name"] == name)["gains"]
    }
    asked_for = next(c for c in one_point["controllers"] if c["name"] == name)
    for i, j in [(0, 2), (2, 0), (7, 1)]:
        given = {gain: float(values[i]) for gain, values in gains.items()}
        one_point["controllers"] = [{**asked_for, "gains": given}]
        for axis, values in design["request"]["grid"].items():
            if values is not None:
                one_point["grid"][axis] = [values[j // 4 if axis == "altitude_m" else j % 4]]
        flown = pairs["damping_ratio"][i][j]
        assert flown != pytest.approx(pairs["damping_ratio"][i][i], rel=1e-3)
        if pairs["stable"][i][j]:
            assert least_damping(client, one_point) == pytest.approx(flown, rel=1e-9)
        else:
            reason = posted(client, one_point)["controllers"][0]["reasons"][0][0]
            assert f"real part {pairs['largest_real_part'][i][j]:.4g} 1/s" in reason


def test_every_null_of_a_pair_is_explained(client: TestClient, wanted: dict[str, Any]) -> None:
    """Points without a design and outside the model, loops that are not stable or do not settle."""
    wanted["grid"] = {"altitude_m": [0.0, 11000.0], "dynamic_pressure_pa": [245.0, 980.0, 60000.0]}
    wanted["aerodynamics"]["compressibility"] = "prandtl_glauert"
    document = posted(client, wanted)
    seen = set()
    for name in ("nf", "pf", "lqr"):
        found = answered(client, document, name, "cross-flight")
        assert found["plant_outcomes"][1][2] == "outside_model"
        assert "Mach" in found["plant_reasons"][1][2]
        pairs, ok = found["pairs"], np.array(found["outcomes"]).ravel() == "ok"
        inside = np.array(found["plant_outcomes"]).ravel() == "ok"
        for i in range(6):
            for j in range(6):
                code = pairs["outcomes"][i][j]
                seen.add(code)
                assert (code == "no_design") == (not ok[i])
                assert (code == "outside_model") == (ok[i] and not inside[j])
                flown = code not in ("no_design", "outside_model")
                assert (pairs["stable"][i][j] is not None) == (pairs["held"][i][j] is not None) == flown
                assert (pairs["damping_ratio"][i][j] is not None) == flown
                assert (pairs["overshoot_percent"][i][j] is not None) == (code in ("ok", "not_settled"))
                assert (pairs["settling_time_s"][i][j] is not None) == (code == "ok")
                assert bool(pairs["stable"][i][j]) == (code in ("ok", "not_settled"))
        for i, (h, q) in enumerate(np.ndindex(2, 3)):
            assert (found["points_held"][h][q] is None) == (not ok[i])
            assert (found["worst_damping_ratio"][h][q] is None) == (not ok[i])
            assert found["points_flown"][h][q] == (int(inside.sum()) if ok[i] else None)
    assert seen >= {"ok", "no_design", "outside_model", "unstable", "not_settled"}


def test_stability_that_is_not_known_is_said_to_be_unproved() -> None:
    nan = np.nan
    figures = FlownFigures(
        stable=np.array([False, True, False, True, True, True]),
        largest_real_part=np.array([nan, -1.0, 1.0, -1.0, -1.0, -1.0]),
        damping_ratio=np.array([0.2, nan, -0.1, 0.2, 0.2, 0.2]),
        overshoot=np.array([nan, 0.1, nan, nan, 0.1, 0.1]),
        settling_time=np.array([nan, 0.1, nan, nan, nan, 0.1]),
        **dict.fromkeys(("gain_margin", "phase_margin", "delay_margin", "disk_margin"), np.full(6, nan)),
    )
    expected = ["unproved", "unproved", "unstable", "no_step", "not_settled", "ok"]
    assert flown_outcomes(figures).tolist() == expected


def test_what_the_domain_refuses_is_a_refused_request(
    client: TestClient,
    design: dict[str, Any],
    refused: Callable[..., dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def too_many(*_: object, **__: object) -> None:
        raise ValueError("300000 loops are too many to fly at once")

    monkeypatch.setattr(cross_flight_route, "cross_flight", too_many)
    problem = refused(client.get(address(design, "nf", "cross-flight")), 422)
    assert "300000 loops are too many" in problem["detail"]


def test_flights_are_bounded_and_light_work_goes_on(
    tmp_path: Path, one_point: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even of a design that is ready in memory, no more fly at once than designs are computed."""
    lock, now, most, release = threading.Lock(), [0], [0], threading.Event()
    real, statuses = cross_flight_route.cross_flight, []

    def slow(*of: Any, **how: Any) -> Any:
        with lock:
            now[0] += 1
            most[0] = max(most[0], now[0])
        release.wait(10)
        with lock:
            now[0] -= 1
        return real(*of, **how)

    monkeypatch.setattr(cross_flight_route, "cross_flight", slow)
    with TestClient(create_app(Settings(data_dir=tmp_path, max_concurrent_designs=2))) as client:
        document = posted(client, one_point)
        where = address(document, "pf", "cross-flight")
        threads = [threading.Thread(target=lambda: statuses.append(client.get(where).status_code)) for _ in range(50)]
        for thread in threads:
            thread.start()
        while now[0] < 2:
            threading.Event().wait(0.01)
        assert client.get(f"/v1/designs/{document['id']}/points/0").status_code == 200
        release.set()
        for thread in threads:
            thread.join()
    assert (most[0], statuses) == (2, [200] * 50)
