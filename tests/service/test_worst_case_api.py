"""Guaranteed peaks and worst references over HTTP: against the domain, integrals by hand, and python-control."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import control as ct
import numpy as np
import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError

from design.worst_case.peaks import GuaranteedPeaks, guaranteed_peaks
from service.app import create_app
from service.presenters import worst_case as presenter
from service.schemas.manoeuvres import Recorded
from service.settings import Settings
from service.to_domain.manoeuvre_of import manoeuvre_of
from service.to_domain.worst_case_of import admissible
from tests.service.lqr_by_hand import Posted, example, posted

RAD = np.pi / 180.0
SIZE = {"_deg": 1.0 / RAD, "_deg_s": 1.0 / RAD, "_n_m": 1.0}


@pytest.fixture(scope="module")
def tunnel(client: TestClient) -> Posted:
    return posted(client, example("wind_tunnel"))


@pytest.fixture(scope="module")
def structures(client: TestClient) -> Posted:
    return posted(client, example("lqr_structures"))


def inside(name: str) -> tuple[str, float]:
    """Name of a signal of the wire inside, and its size."""
    suffix = next(s for s in ("_deg_s", "_deg", "_n_m") if name.endswith(s))
    return name.removesuffix(suffix), SIZE[suffix]


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
@pytest.mark.parametrize(
    ("query", "amplitude", "rate"), [("", 10.0, None), ("?aileron_deg=4&rate_deg_s=90", 4.0, 90.0)]
)
def test_values_are_those_of_the_domain(
    tunnel: Posted, name: str, query: str, amplitude: float, rate: float | None
) -> None:
    found = tunnel.answered(name, "worst-case" + query)
    loop = tunnel.controller(name).loop
    names = [inside(signal)[0] for signal in found["signals"]]
    assert names == [*loop.outputs, "da_error"]
    domain = guaranteed_peaks(loop, amplitude * RAD, None if rate is None else rate * RAD, tuple(names))
    assert found["references"] == {
        "aileron": {
            "amplitude_deg": pytest.approx(amplitude),
            "rate_limit_deg_s": None if rate is None else pytest.approx(rate),
        },
        "tab": None,
    }
    assert found["delays"] == "none"
    for o, (wire, signal) in enumerate(found["signals"].items()):
        size = inside(wire)[1]
        np.testing.assert_allclose(np.array(signal["upper"]), domain.upper[..., o] * size, rtol=1e-9)
        np.testing.assert_allclose(np.array(signal["lower"]), domain.lower[..., o] * size, rtol=1e-9)
        assert np.all(np.array(signal["lower"]) <= np.array(signal["upper"]))
        assert signal["reasons"] == [[None] * 4] * 2
        worst = signal["envelope"]
        assert worst["point"] == int(np.argmax(signal["upper"]))
        assert worst["upper"] == np.ravel(signal["upper"])[worst["point"]]
        assert worst["lower"] == np.ravel(signal["lower"])[worst["point"]]
        assert worst["reason"] is None


@pytest.mark.parametrize("point", [0, 6])
def test_without_a_rate_it_is_the_integral_of_the_impulse_response(tunnel: Posted, point: int) -> None:
    """By the trapezoidal rule on the modes of a loop that is put together here."""
    found, hand = tunnel.answered("lqr", "worst-case?aileron_deg=7"), tunnel.by_hand("lqr", point)
    values, V = np.linalg.eig(hand.closed)
    start = np.linalg.solve(V, (hand.E + hand.B @ hand.N).astype(complex))[:, 0]
    time = np.concatenate([np.linspace(0.0, 0.1, 40_001), np.linspace(0.1, 3.0, 40_001)[1:]])
    states = (V @ (start[:, None] * np.exp(values[:, None] * time))).real
    for signal, row in (("da_deg", 2), ("dt_rate_deg_s", 1), ("da_rate_deg_s", 3)):
        expected = 7.0 * np.trapezoid(np.abs(states[row]), time)
        assert np.ravel(found["signals"][signal]["upper"])[point] == pytest.approx(expected, rel=1e-5)
    for signal, row in (("T_t_n_m", 0), ("T_a_n_m", 1)):
        change = np.trapezoid(np.abs(hand.K[row] @ states), time) + abs(float(hand.N[row, 0]))
        expected = abs(hand.torques[row]) + 7.0 * RAD * change
        assert np.ravel(found["signals"][signal]["upper"])[point] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("signal", ["T_t_n_m", "da_error_deg", "dt_rate_deg_s"])
@pytest.mark.parametrize(("name", "rate"), [("lqr", 60.0), ("nf", 200.0), ("pf", None)])
def test_the_worst_reference_can_be_flown(tunnel: Posted, name: str, signal: str, rate: float | None) -> None:
    """Posted as a recorded manoeuvre it is admissible, and python-control finds the peak that is answered."""
    limit = "" if rate is None else f"&rate_deg_s={rate}"
    found = tunnel.answered(name, f"worst-case/reference?point=3&signal={signal}{limit}")
    assert (found["signal"], found["reason"]) == (signal, None)
    assert found["lower"] * (1.0 - 1e-6) <= found["reached"] <= found["upper"] * (1.0 + 1e-9)
    assert found["upper"] == pytest.approx(found["lower"], rel=2e-3)
    over_grid = tunnel.answered(name, f"worst-case?signal={signal}{limit}")["signals"]
    assert list(over_grid) == [signal]
    assert np.ravel(over_grid[signal]["upper"])[3] == pytest.approx(found["upper"], rel=1e-9)

    recorded = Recorded.model_validate(found["manoeuvre"])
    assert recorded.times_s[-1] == found["reached_at_s"]
    assert np.abs(recorded.aileron_deg).max() <= 10.0 * (1.0 + 1e-12)
    controller = tunnel.controller(name)
    manoeuvre = manoeuvre_of(recorded, controller.loop.references)
    if rate is not None:
        assert np.abs(manoeuvre.slopes).max() <= rate * RAD * (1.0 + 1e-4)
        assert np.abs(manoeuvre.jumps).max() < 1e-9

    loop = controller.loop.take((0, 3))
    output, size = inside(signal)
    angle = output.removesuffix("_error")
    row = loop.outputs.index(angle)
    C, D, y0 = loop.closed_outputs[row], loop.reference_feedthrough[row], loop.offset[row]
    if angle != output:
        C, D, y0 = -C, 1.0 - D, 0.0
    system = ct.ss(loop.closed, loop.reference_input, C[None], D[None])
    peak, state = 0.0, np.zeros(len(loop.A))
    for k, begin in enumerate(manoeuvre.times):  # stretch by stretch, since references may jump
        end = manoeuvre.times[k + 1] if k + 1 < len(manoeuvre.times) else begin + 0.01
        time = np.linspace(0.0, end - begin, 401)
        reference = manoeuvre.values[k] + manoeuvre.slopes[k] * time[:, None]
        answer = ct.forced_response(system, time, reference.T, state, return_states=True)
        state, peak = answer.states[:, -1], max(peak, float(np.abs(answer.outputs + y0).max()))
    assert found["reached"] == pytest.approx(peak * size, rel=1e-5)


def test_limits_of_actuators(tunnel: Posted) -> None:
    signals = tunnel.answered("lqr", "worst-case?rate_deg_s=120")["signals"]
    assert {name: signal["limit"] for name, signal in signals.items() if signal["limit"] is not None} == {
        "da_deg": pytest.approx(25.0),
        "dt_deg": pytest.approx(25.0),
        "dt_rate_deg_s": pytest.approx(400.0),
        "T_t_n_m": 2.0,
        "T_a_n_m": 10.0,
    }
    assert {signals[name]["limit_outcome"] for name in ("da_deg", "dt_rate_deg_s", "T_a_n_m")} == {"kept"}
    assert signals["da_error_deg"]["limit_outcome"] is signals["da_rate_deg_s"]["limit_outcome"] is None
    jumping = tunnel.answered("lqr", "worst-case")["signals"]
    assert jumping["T_a_n_m"]["limit_outcome"] == "exceeded"
    # The aileron has no actuator of its own here.
    assert tunnel.answered("nf", "worst-case")["signals"]["T_a_n_m"]["limit"] is None
    between = np.array([1.0]), np.array([0.9]), 0.95
    assert presenter._outcome(*between) == "undecided"
    assert presenter._outcome(np.array([]), np.array([]), 1.0) is None


def test_two_references_add_up(structures: Posted) -> None:
    """Each alone, and both: the peaks of the changes add up, delays and all."""
    both, aileron, tab = (
        structures.answered("both", f"worst-case?signal=da_deg&signal=dt_rate_deg_s&{query}")
        for query in ("aileron_deg=10&tab_deg=5", "aileron_deg=10&tab_deg=0", "aileron_deg=0&tab_deg=5")
    )
    assert both["delays"] == "approximants"
    assert both["references"]["tab"] == {"amplitude_deg": pytest.approx(5.0), "rate_limit_deg_s": None}
    for signal in both["signals"]:
        upper = [np.array(found["signals"][signal]["upper"]) for found in (both, aileron, tab)]
        np.testing.assert_allclose(upper[0], upper[1] + upper[2], rtol=1e-9)
    usual = structures.answered("both", "worst-case?signal=da_deg")
    for bound in ("upper", "lower"):
        found = [np.array(one["signals"]["da_deg"][bound]) for one in (usual, both)]
        np.testing.assert_allclose(*found, rtol=1e-12)
    rates = structures.answered("both", "worst-case?signal=da_deg&rate_deg_s=60&tab_rate_deg_s=30")["references"]
    assert [rates[name]["rate_limit_deg_s"] for name in ("aileron", "tab")] == [
        pytest.approx(60.0),
        pytest.approx(30.0),
    ]
    shared = structures.answered("both", "worst-case?signal=da_deg&rate_deg_s=60")["references"]
    assert shared["tab"]["rate_limit_deg_s"] == pytest.approx(60.0)
    worst = structures.answered("both", "worst-case/reference?point=1&signal=dt_error_deg&rate_deg_s=60")
    recorded = Recorded.model_validate(worst["manoeuvre"])
    assert recorded.tab_deg is not None
    assert np.abs(recorded.tab_deg).max() <= 5.0
    assert worst["lower"] * (1.0 - 1e-6) <= worst["reached"] <= worst["upper"]


@pytest.mark.parametrize("what", ["worst-case", "worst-case/reference?point=0&signal=da_deg"])
def test_whose_worst_case_there_is(structures: Posted, client: TestClient, refused: Any, what: str) -> None:
    problem = refused(structures.get("regulator", what), 409)
    assert (problem["code"], "no reference" in problem["detail"]) == ("study_not_possible", True)
    sampled = posted(client, example("lqr_sampled"))
    assert "runs as code" in refused(sampled.get("at_500_hz", what), 409)["detail"]
    for name in ("estimated", "filtered"):
        assert posted(client, example("lqr_measured")).get(name, what).status_code == 200


@pytest.mark.parametrize(
    ("query", "pointer"),
    [
        ("aileron_deg=-1", "/aileron_deg"),
        ("aileron_deg=61", "/aileron_deg"),
        ("aileron_deg=nan", "/aileron_deg"),
        ("rate_deg_s=0", "/rate_deg_s"),
        ("rate_deg_s=inf", "/rate_deg_s"),
        ("rate_deg_s=1e9", "/rate_deg_s"),
        ("tab_deg=5", "/tab_deg"),
        ("tab_rate_deg_s=5", "/tab_rate_deg_s"),
        ("signal=T_x", "/signal"),
        ("signal=" + "%00%F0%9F%9A%80" * 50, "/signal"),
        ("size=3", "/size"),
    ],
)
def test_bad_input(tunnel: Posted, refused: Any, query: str, pointer: str) -> None:
    problem = refused(tunnel.get("nf", f"worst-case?{query}"), 422)
    assert problem["errors"][0]["pointer"] == pointer
    if "signal" in query:
        assert "T_t_n_m" in problem["errors"][0]["allowed"]
        return
    problem = refused(tunnel.get("nf", f"worst-case/reference?point=0&signal=da_deg&{query}"), 422)
    assert problem["errors"][0]["pointer"] == pointer


def test_missing_things(tunnel: Posted, client: TestClient, refused: Any) -> None:
    assert refused(tunnel.get("nf", "worst-case/reference?point=0"), 422)["errors"][0]["pointer"] == "/signal"
    assert refused(tunnel.get("nf", "worst-case/reference?signal=da_deg"), 422)["errors"][0]["pointer"] == "/point"
    assert (
        refused(tunnel.get("nf", "worst-case/reference?point=8&signal=da_deg"), 422)["errors"][0]["pointer"] == "/point"
    )
    refused(tunnel.get("none", "worst-case"), 404)
    refused(client.get("/v1/designs/0123/controllers/nf/worst-case"), 404)


@pytest.fixture(scope="module")
def given(client: TestClient) -> Posted:
    """Gains that hold at some points only, at one of them with next to no damping."""
    body = copy.deepcopy(example("wind_tunnel"))
    gains = {"K_d": 0.002, "K_p": 0.6, "K_i": 20.0}
    body["controllers"] = [{"name": "few", "kind": "negative_feedback", "rate_filter_hz": 100.0, "gains": gains}]
    return posted(client, body)


def test_every_null_is_explained(given: Posted, refused: Any) -> None:
    found = given.answered("few", "worst-case")
    ok = np.array(found["outcomes"]) == "ok"
    assert 0 < ok.sum() < 8
    seen = set()
    for signal in found["signals"].values():
        for index in np.ndindex(2, 4):
            upper, reason = (np.array(signal[key], dtype=object)[index] for key in ("upper", "reasons"))
            assert (upper is None) == (reason is not None)
            assert (reason == "the controller has no gains there") == (not ok[index])
            seen.add(reason)
            if ok[index]:
                assert np.array(signal["lower"], dtype=object)[index] is not None
        assert ok.ravel()[signal["envelope"]["point"]]
    (light,) = [reason for reason in seen if reason and "damping ratio below 0.004" in reason]
    worst = found["signals"]["da_deg"]["envelope"]
    assert (worst["upper"], worst["reason"]) == (None, light)
    here = f"worst-case/reference?point={worst['point']}&signal=da_deg"
    problem = refused(given.get("few", here), 409)
    assert (problem["code"], "not stable, or next to it" in problem["detail"]) == ("study_not_possible", True)
    nowhere = int(np.flatnonzero(~ok)[0])
    problem = refused(given.get("few", f"worst-case/reference?point={nowhere}&signal=da_deg"), 409)
    assert problem["code"] == "no_design_at_point"


def test_light_damping_counts_many_times(given: Posted, tunnel: Posted, refused: Any, tmp_path: Path) -> None:
    problem = refused(given.get("few", "worst-case?rate_deg_s=120"), 422)
    assert (problem["code"], "max_worst_case_rows" in problem["detail"]) == ("limit_exceeded", True)
    with TestClient(create_app(Settings(data_dir=tmp_path, max_worst_case_rows=100))) as client:
        here = posted(client, example("wind_tunnel"))
        assert refused(here.get("nf", "worst-case"), 422)["code"] == "limit_exceeded"
        assert here.get("nf", "worst-case?signal=da_deg").status_code == 200
        assert here.get("nf", "worst-case/reference?point=0&signal=da_deg&rate_deg_s=50").status_code == 200
        listed = {limit["name"]: limit["value"] for limit in client.get("/v1/limits").json()["limits"]}
        assert listed["max_worst_case_rows"] == 100


def test_a_signal_that_takes_the_rate_of_a_jump_is_unlimited(tunnel: Posted) -> None:
    controller = tunnel.controller("lqr")
    upper = np.full((2, 4, 1), 1.0)
    upper[1, 1] = np.inf
    limits = admissible(controller.loop, tunnel.envelope.study.reference, None, None, None, None)
    peaks = GuaranteedPeaks(upper, upper, ("T_t",))
    document = presenter.worst_case_document(tunnel.envelope, controller, limits, peaks, np.ones((2, 4), dtype=bool))
    signal = document["signals"]["T_t_n_m"]
    assert "may jump" in signal["reasons"][1, 1]
    assert (signal["envelope"]["point"], signal["limit_outcome"]) == (5, "exceeded")
    assert signal["envelope"]["reason"] == signal["reasons"][1, 1]


def test_what_is_too_long_to_be_flown_says_so(tunnel: Posted) -> None:
    found = tunnel.answered("nf", "worst-case/reference?point=0&signal=da_deg&rate_deg_s=0.001&aileron_deg=60")
    assert "lasts" in found["reason"]
    assert found["lower"] * (1.0 - 1e-6) <= found["reached"] <= found["upper"] * (1.0 + 1e-9)
    # The numbers are those of the schema of a recorded manoeuvre.
    longest, most = presenter.LONGEST_S, presenter.MOST_SAMPLES
    fits = np.linspace(0.0, longest, most).tolist()
    assert presenter._why_not_flown(longest, most) is None
    Recorded(kind="recorded", times_s=fits, aileron_deg=[0.0] * most)
    assert presenter._why_not_flown(longest * (1.0 + 1e-9), most) is not None
    assert presenter._why_not_flown(longest, most + 1) is not None
    for times in ([*fits[:-1], longest * (1.0 + 1e-9)], [0.0, *fits]):
        with pytest.raises(ValidationError):
            Recorded(kind="recorded", times_s=times, aileron_deg=[0.0] * len(times))


def test_nothing_moves_nothing_is_reached(tunnel: Posted) -> None:
    found = tunnel.answered("nf", "worst-case/reference?point=0&signal=T_t_n_m&aileron_deg=0")
    trim = tunnel.client.get(f"/v1/designs/{tunnel.design['id']}/points/0").json()["trim"]["T_t_n_m"]
    assert found["reached"] == pytest.approx(abs(trim), rel=1e-9)
    assert found["upper"] == found["lower"] == pytest.approx(abs(trim), rel=1e-9)


@pytest.mark.parametrize("what", ["guaranteed_peaks", "worst_reference"])
def test_what_the_domain_refuses_is_no_fault(
    tunnel: Posted, refused: Callable[..., dict[str, Any]], monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    def raising(*_: object, **__: object) -> None:
        raise np.linalg.LinAlgError("no")

    monkeypatch.setattr(f"service.routes.worst_case.{what}", raising)
    where = "worst-case" if what == "guaranteed_peaks" else "worst-case/reference?point=0&signal=da_deg"
    assert refused(tunnel.get("nf", where), 409)["code"] == "study_not_possible"
