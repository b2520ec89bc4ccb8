"""Schedules in motion over HTTP, and gains by other rules."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from schedules.designed import DesignedEnvelope
from schedules.hidden_coupling import hidden_coupling
from schedules.interpolate import interpolate
from schedules.rules import OUTS_OF_RANGE, ScheduleRules
from schedules.schedule import GainSchedule, Provenance
from schedules.schedule_of import schedule_of
from service.schemas.controller_answers import InterpolatedGains
from service.schemas.hidden_coupling_answers import HiddenCoupling
from tests.service.flown_answers import address, answered, at_one_point, exactly, numbers, posted, wind_tunnel

NOWHERE = Provenance("", "", "", "", "")


@pytest.fixture(scope="module")
def envelope() -> DesignedEnvelope:
    return wind_tunnel()


def schedule(envelope: DesignedEnvelope, name: str, rules: ScheduleRules) -> GainSchedule:
    return schedule_of(envelope, envelope.controller(name), NOWHERE, rules)


def complex_array(values: Any) -> Any:
    if isinstance(values, list):
        return np.array([complex_array(value) for value in values])
    return complex(np.nan, np.nan) if values is None else complex(values["re"], values["im"])


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_it_is_the_domains(client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope, name: str) -> None:
    rules = ScheduleRules("monotone_cubic", "refuse")
    wanted = hidden_coupling(
        envelope.study, envelope.plant, envelope.controller(name), schedule(envelope, name, rules), 0.1
    )
    query = "hidden-coupling?signal_lag_s=0.1&rule=monotone_cubic&out_of_range=refuse&point=5"
    found = answered(client, design, name, query)
    HiddenCoupling.model_validate(found)
    assert (found["scheduling_variable"], found["signal_lag_s"]) == ("dynamic_pressure_pa", 0.1)
    assert found["units"] == {"growth": "1/s per (Pa/s)", "deviation": "deg per (Pa/s)"}
    np.testing.assert_allclose(complex_array(found["eigenvalues"]), wanted.eigenvalues, rtol=1e-12)
    for placement, placed in wanted.placed.items():
        for field in ("settled", "peak"):
            exactly(found[placement][field], np.rad2deg(getattr(placed, field)))
        np.testing.assert_allclose(complex_array(found[placement]["growth"]), placed.rate_shift, rtol=1e-12)
        worst = found[placement]["worst"]
        at = np.rad2deg(placed.peak).reshape(-1, 2)[worst["point"], found["sides"].index(worst["side"])]
        assert worst["peak"] == at == np.nanmax(np.rad2deg(placed.peak))
    assert [(one["placement"], one["side"]) for one in found["linearised"]] == [
        (placement, side) for placement in ("before_gain", "after_gain") for side in ("below", "above")
    ]
    for one in found["linearised"]:
        placed, side = wanted.placed[one["placement"]], found["sides"].index(one["side"])
        exactly(one["A"], placed.A[1, 1, side])
        exactly(one["B"], placed.B[1, 1, side])
        assert one["states"] == [*wanted.states, "scheduling_signal"]


def test_placements_are_compared(client: TestClient, design: dict[str, Any]) -> None:
    found = answered(client, design, "pf", "hidden-coupling")
    before, after = (numbers(found[placement]["peak"]) for placement in ("before_gain", "after_gain"))
    ratio = numbers(found["comparison"]["peak_ratio"])
    known = np.isfinite(ratio)
    np.testing.assert_allclose(ratio[known], (after / before)[known], rtol=1e-9)
    counts = [found["comparison"][field] for field in ("smaller_after_gain", "smaller_before_gain", "alike")]
    assert sum(counts) == ratio.size
    assert counts[0] == np.count_nonzero(ratio[known] < 0.99) > 0
    assert found["linearised"] is None


def test_links_and_refusals(client: TestClient, design: dict[str, Any], refused: Any) -> None:
    assert design["links"]["hidden_coupling"]["nf"] == address(design, "nf", "hidden-coupling")
    for query, pointer in (
        ("signal_lag_s=-1", "/signal_lag_s"), ("rule=spline", "/rule"), ("out_of_range=extrapolate", "/out_of_range"),
        ("point=99", "/point"), ("lag=1", "/lag"),
    ):  # fmt: skip
        problem = refused(client.get(address(design, "nf", f"hidden-coupling?{query}")), 422)
        assert problem["errors"][0]["pointer"] == pointer
    refused(client.get(address(design, "none", "hidden-coupling")), 404)


def test_what_is_not_taken_into_motion_is_a_conflict(client: TestClient, wanted: dict[str, Any], refused: Any) -> None:
    late = at_one_point(wanted)
    late["actuators"]["tab"]["delay_s"] = 0.002
    document = posted(client, late)
    problem = refused(client.get(address(document, "nf", "hidden-coupling")), 409)
    assert "transport delay" in problem["detail"]


def test_one_point_has_edges_only(client: TestClient, wanted: dict[str, Any]) -> None:
    document = posted(client, at_one_point(wanted))
    found = answered(client, document, "nf", "hidden-coupling?out_of_range=refuse")
    assert found["before_gain"]["peak"] == [[[None, None]]]
    assert found["before_gain"]["worst"] is None
    assert found["comparison"] == {
        "peak_ratio": [[[None, None]]], "smaller_after_gain": 0, "smaller_before_gain": 0, "alike": 0,
    }  # fmt: skip
    assert found["eigenvalues"][0][0][0] is not None


def test_gains_by_other_rules(
    client: TestClient, design: dict[str, Any], envelope: DesignedEnvelope, refused: Any
) -> None:
    here = "gains?altitude_m=1000&dynamic_pressure_pa=700"
    plain = answered(client, design, "nf", here)
    cubic = answered(client, design, "nf", f"{here}&rule=monotone_cubic")
    wanted = interpolate(schedule(envelope, "nf", ScheduleRules("monotone_cubic")), (1000.0, 700.0))
    assert cubic["gains"] == {gain.name: float(gain.values) for gain in wanted.gains}
    assert cubic["gains"] != plain["gains"]
    assert "monotone cubic" in cubic["rule"]
    assert "multilinear" in plain["rule"]
    outside = "gains?altitude_m=9000&dynamic_pressure_pa=700"
    clipped = answered(client, design, "nf", outside)
    held = answered(client, design, "nf", f"{outside}&out_of_range=hold")
    InterpolatedGains.model_validate(held)
    assert held["gains"] == clipped["gains"]
    assert (clipped["clipped"], clipped["held"], held["clipped"], held["held"]) == (True, False, True, True)
    assert held["out_of_range"] == OUTS_OF_RANGE["hold"]
    problem = refused(client.get(address(design, "nf", f"{outside}&out_of_range=refuse")), 422)
    assert [(error["pointer"], error["unit"]) for error in problem["errors"]] == [("/altitude_m", "m")]
    assert problem["errors"][0]["allowed"].startswith(">= ")
    answered(client, design, "nf", f"{here}&out_of_range=refuse")
