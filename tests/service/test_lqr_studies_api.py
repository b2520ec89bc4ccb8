"""Power comparison and phase planes over HTTP, against the domain and scipy; what every study refuses."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.linalg import expm, solve_continuous_are

import service.designs
from design.lqr.controller import LqrController
from design.lqr.measurement import RateFilters
from design.lqr.phase_plane import step_trajectory
from design.lqr.power_comparison import power_comparison
from design.sampling import Sampling
from schedules.designed import DesignedEnvelope
from tests.service.lqr_bodies import BALANCED, asked
from tests.service.lqr_by_hand import ByHand, Posted, example, posted

STUDIES = ("power-comparison", "phase-plane", "simultaneous-margins", "norms", "sample-time-sweep")
WHERE = (1, 2)
POINT = 6
STEP = np.deg2rad(10.0)


@pytest.fixture(scope="module")
def power(client: TestClient) -> Posted:
    return posted(client, example("lqr_power"))


def followed(hand: ByHand, x: Any, reference: float, times: Any) -> tuple[Any, Any]:
    """States (T, n) and total torques (T, 2) from states x with the reference held."""
    n, step = len(hand.A), times[1] - times[0]
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = hand.closed, ((hand.E + hand.B @ hand.N) * reference)[:, 0]
    one, z = expm(whole * step), [np.append(x, 1.0)]
    for _ in times[1:]:
        z.append(one @ z[-1])
    states = np.array(z)[:, :n]
    return states, states @ -hand.K.T + hand.N[:, 0] * reference + hand.torques


def by_riccati(hand: ByHand, factors: tuple[float, float, float]) -> ByHand:
    """The gains of Bryson's rule of the examples, torques and rates and the integral weighed by factors more."""
    tab, aileron, integral = factors
    degrees = np.deg2rad([10.0, 400.0, 2.0, 200.0, 0.1])
    Q = np.diag(np.array([1.0, tab, 1.0, aileron, integral]) / degrees**2)
    R = np.diag(np.array([tab, aileron]) / np.array([0.5, 2.0]) ** 2)
    K = np.linalg.solve(R, hand.B.T @ solve_continuous_are(hand.A, hand.B, Q, R))
    # At rest the aileron is on its reference and needs no torque from trim; the integral is at zero.
    A, B = hand.A[:4, :4], hand.B[:4]
    rest = np.linalg.solve(np.column_stack([A[[1, 3]][:, [0]], B[[1, 3]][:, [0]]]), -A[[1, 3]][:, [2]])
    N = K @ np.array([[rest[0, 0]], [0.0], [1.0], [0.0], [0.0]]) + np.array([[rest[1, 0]], [0.0]])
    return replace(hand, K=K, N=N)


def figures(hand: ByHand) -> dict[str, float]:
    times = np.linspace(0.0, 1.0, 20001)
    states, torques = followed(hand, np.zeros(5), STEP, times)
    tab, aileron = np.abs(torques[:, 0] * states[:, 1]), np.abs(torques[:, 1] * states[:, 3])
    outside = np.flatnonzero(np.abs(states[:, 2] / STEP - 1.0) > 0.02)
    return {
        "tab_peak_power_w": tab.max(),
        "aileron_peak_power_w": aileron.max(),
        "total_peak_power_w": (tab + aileron).max(),
        "settling_time_s": times[outside[-1]],
        "overshoot_percent": 100.0 * (states[:, 2].max() / STEP - 1.0),
    }


def test_power_before_and_after(power: Posted) -> None:
    """Both designs anew by scipy, from Bryson's rule and the factors that are answered."""
    found = power.answered("after", "power-comparison")
    hand = power.by_hand("after", POINT)
    tab, aileron, integrals = (found["factors"][name][1][2] for name in ("tab", "aileron", "integrals"))
    for when, weighed in (("before", (1.0, 1.0, 1.0)), ("after", (tab, aileron, integrals))):
        again = by_riccati(hand, weighed)
        if when == "after":
            np.testing.assert_allclose(again.K, hand.K, rtol=1e-7)
            np.testing.assert_allclose(again.N, hand.N, rtol=1e-7)
        for name, value in figures(again).items():
            assert found[when][name][1][2] == pytest.approx(value, rel=2e-4), (when, name)
    assert found["after"]["tab_peak_power_w"][1][2] == pytest.approx(1.2, rel=1e-6)
    assert found["after"]["aileron_peak_power_w"][1][2] == pytest.approx(20.0, rel=1e-6)
    settled = np.array(found["before"]["settling_time_s"])
    np.testing.assert_allclose(found["after"]["settling_time_s"], settled, rtol=1e-5)
    assert found["after_is_flown"] is True
    assert found["traces"] is None
    ratio = np.array(found["after"]["total_peak_power_w"]) / np.array(found["before"]["total_peak_power_w"])
    np.testing.assert_allclose(found["total_ratio"], ratio, rtol=1e-12)
    worst = found["largest_total_power_w"]["before"]
    totals = np.array(found["before"]["total_peak_power_w"])
    assert worst == {"value": totals.max(), "point": int(totals.argmax())}
    weights = {c["name"]: c["weights"] for c in power.design["request"]["controllers"]}
    assert found["weights"] == {"before": weights["after"]["base"], "after": weights["after"]}
    assert found["weights"]["before"] == weights["before"]


def test_power_is_that_of_the_domain(power: Posted) -> None:
    found, envelope = power.answered("after", f"power-comparison?point={POINT}&samples=2001"), power.envelope
    request = envelope.controller("after").request
    assert isinstance(request, LqrController)
    domain = power_comparison(envelope.plant.model, request, samples=2001)
    for when, step in (("before", domain.before), ("after", domain.after)):
        np.testing.assert_allclose(found[when]["total_peak_power_w"], step.figures.total, rtol=1e-9)
        np.testing.assert_allclose(found[when]["net_peak_power_w"], step.figures.net, rtol=1e-9)
        trace = found["traces"][when]
        np.testing.assert_allclose(found["traces"]["time_s"], step.time[WHERE], rtol=1e-12)
        np.testing.assert_allclose(trace["aileron_deg"], np.rad2deg(step.aileron[WHERE]), rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(trace["tab_power_w"], step.tab_power[WHERE], rtol=1e-6, atol=1e-8)
        total = np.abs(trace["tab_power_w"]) + np.abs(trace["aileron_power_w"])
        np.testing.assert_allclose(trace["total_power_w"], total, rtol=1e-12)
        assert max(trace["total_power_w"]) == pytest.approx(found[when]["total_peak_power_w"][1][2], rel=5e-3)
        assert max(trace["total_power_w"]) <= found[when]["total_peak_power_w"][1][2] * (1.0 + 1e-6)


def test_weights_that_do_not_keep_the_settling_time_are_retuned_to_it(power: Posted, client: TestClient) -> None:
    """A price of work makes the response slower; the comparison is at equal terms and says that nobody flies it."""
    found = power.answered("net_work", "power-comparison?point=0")
    assert (found["form"], found["after_is_flown"]) == ("net_work", False)
    np.testing.assert_allclose(found["after"]["settling_time_s"], found["before"]["settling_time_s"], rtol=1e-5)
    kept = example("lqr_power")
    kept["controllers"][2]["weights"]["keep_settling"] = True
    flown = posted(client, kept).answered("net_work", "power-comparison?point=0")
    assert flown["after_is_flown"] is True
    for part in ("before", "after", "factors", "traces", "total_ratio"):
        assert flown[part] == found[part], part


def test_phase_plane(power: Posted) -> None:
    query = f"phase-plane?point={POINT}&starts=5&aileron_deg=8&tab_deg=3&duration_s=0.4&samples=81"
    found, hand = power.answered("after", query), power.by_hand("after", POINT)
    times = np.linspace(0.0, 0.4, 81)
    trim = np.array([found["trim"]["tab_deg"], found["trim"]["aileron_deg"]])
    starts = [(0.0, 0.0, found["step"])]
    for k, free in enumerate(found["free"]):
        turn = 2.0 * np.pi * k / 5
        assert free["aileron_start_deg"] == pytest.approx(8.0 * np.cos(turn), abs=1e-12)
        assert free["tab_start_deg"] == pytest.approx(3.0 * np.sin(turn), abs=1e-12)
        starts.append((free["tab_start_deg"], free["aileron_start_deg"], free["trajectory"]))
    assert len(starts) == 6
    for place, (tab, aileron, trajectory) in enumerate(starts):
        x = np.deg2rad([tab, 0.0, aileron, 0.0, 0.0])
        states, torques = followed(hand, x, 0.0 if place else STEP, times)
        np.testing.assert_allclose(trajectory["time_s"], times, rtol=1e-12)
        angles = np.rad2deg(states[:, [0, 2]]) + trim
        expected = {
            "tab_deg": angles[:, 0],
            "aileron_deg": angles[:, 1],
            "tab_rate_deg_s": np.rad2deg(states[:, 1]),
            "aileron_rate_deg_s": np.rad2deg(states[:, 3]),
            "tab_torque_n_m": torques[:, 0],
            "aileron_torque_n_m": torques[:, 1],
        }
        for name, values in expected.items():
            np.testing.assert_allclose(trajectory[name], values, rtol=1e-7, atol=1e-7 * np.abs(values).max())
    loop = power.controller("after").loop.take(WHERE)
    domain = step_trajectory(loop, np.array([STEP]), 0.4, 81)
    np.testing.assert_allclose(found["step"]["aileron_torque_n_m"], domain.aileron_torque, rtol=1e-9)
    assert found["reference"]["duration_s"] == 0.4


def test_phase_planes_of_other_structures(client: TestClient) -> None:
    structures = posted(client, example("lqr_structures"))
    regulator = structures.answered("regulator", "phase-plane?point=0&starts=3")
    assert regulator["step"] is None
    assert len(regulator["free"]) == 3
    assert regulator["delays"] == "exact_after_the_step"
    # The half axes are those of the reference step, unless they are given.
    assert regulator["free"][0]["aileron_start_deg"] == 10.0
    assert max(abs(f["tab_start_deg"]) for f in regulator["free"]) == pytest.approx(10.0 * np.sin(2 * np.pi / 3))
    assert structures.answered("both", "phase-plane?point=0&starts=0")["free"] == []
    last = structures.answered("both", "phase-plane?point=0&duration_s=20&starts=1")
    assert last["step"]["tab_deg"][-1] - last["trim"]["tab_deg"] == pytest.approx(5.0, abs=1e-3)
    assert last["free"][0]["trajectory"]["aileron_deg"][-1] == pytest.approx(last["trim"]["aileron_deg"], abs=1e-3)


@pytest.mark.parametrize("study", STUDIES)
def test_only_of_state_feedback(client: TestClient, design: dict[str, Any], refused: Any, study: str) -> None:
    here = f"/v1/designs/{design['id']}/controllers"
    for name in ("nf", "pf"):
        problem = refused(client.get(f"{here}/{name}/{study}?point=0"), 409)
        assert problem["code"] == "study_not_possible"
        assert "of the kind" in problem["detail"]
    refused(client.get(f"{here}/none/{study}?point=0"), 404)
    refused(client.get(f"/v1/designs/none/controllers/lqr/{study}?point=0"), 404)


@pytest.mark.parametrize("study", STUDIES)
@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"sampling": Sampling(0.001, 0.001)}, "runs on a computer"),
        ({"measurement": RateFilters(600.0)}, "works its states out from the angles"),
    ],
)
def test_only_of_continuous_designs_with_all_states_measured(
    power: Posted, refused: Any, monkeypatch: pytest.MonkeyPatch, study: str, changed: dict[str, Any], words: str
) -> None:
    """Whatever loop such a controller has, it is not looked at."""

    def envelope(designs: Any, ident: str) -> DesignedEnvelope:
        request = power.controller("after").request
        other = replace(
            power.controller("after"),
            request=replace(request, **changed),
            loop=None,  # type: ignore[arg-type]
        )
        return replace(power.envelope, controllers=(other,))

    monkeypatch.setattr(service.designs.Designs, "envelope", envelope)
    problem = refused(power.get("after", f"{study}?point=0"), 409)
    assert problem["code"] == "study_not_possible"
    assert words in problem["detail"]
    assert "continuous design with all states measured" in problem["detail"]


@pytest.mark.parametrize("study", STUDIES)
def test_points_without_gains(client: TestClient, refused: Any, study: str) -> None:
    """Powers that no retuning reaches: no design anywhere, and the reason is said."""
    without = posted(client, asked({"weights": BALANCED | {"tab_power_w": 1e-6}}))
    assert set(np.ravel(without.design["controllers"][0]["outcomes"])) == {"infeasible"}
    problem = refused(without.get("lqr", f"{study}?point=0"), 409)
    assert problem["code"] == "no_design_at_point"
    assert "point 0: infeasible" in problem["detail"]
    refused(without.get("lqr", f"{study}?point=1"), 422)
    if study == "power-comparison":
        found = without.answered("lqr", study)
        assert found["after"]["total_peak_power_w"] == [[None]]
        assert found["largest_total_power_w"]["after"] == {"value": None, "point": None}
    if study == "sample-time-sweep":
        assert refused(without.get("lqr", study), 409)["code"] == "no_design_at_point"


def test_nothing_to_compare(power: Posted, client: TestClient, refused: Any) -> None:
    problem = refused(power.get("before", "power-comparison"), 409)
    assert problem["code"] == "study_not_possible"
    assert "no regard to power" in problem["detail"]
    base = {"rule": "bryson", "aileron_deg": 2.0, "aileron_rate_deg_s": 200.0, "tab_deg": 10.0}
    base |= {"tab_rate_deg_s": 400.0, "tab_torque_n_m": 0.5, "aileron_torque_n_m": 2.0}
    price = {"rule": "power", "form": "net_work", "base": base, "tab_price": 1.0, "part": 0.5}
    regulator = posted(client, asked({"reference": "none", "weights": price}))
    assert "no reference" in refused(regulator.get("lqr", "power-comparison"), 409)["detail"]


@pytest.mark.parametrize(
    ("query", "pointer", "limit"),
    [
        ("power-comparison?samples=5001", "/samples", "max_response_samples"),
        ("phase-plane?point=0&starts=24&samples=201", "/starts", "max_response_samples"),
        ("simultaneous-margins?point=0&count=5001", "/count", "max_response_samples"),
        ("sample-time-sweep?from_s=1e-6", "/from_s", "max_step_samples"),
        ("sample-time-sweep?from_s=1e-4&to_s=2e-4&count=20", "/from_s", "max_swept_samples"),
    ],
)
def test_limits_name_themselves(
    power: Posted, client: TestClient, refused: Any, query: str, pointer: str, limit: str
) -> None:
    problem = refused(power.get("after", query), 422)
    assert problem["code"] == "limit_exceeded"
    assert limit in problem["detail"]
    assert f"GAINFIELD_{limit.upper()}" in problem["detail"]
    assert problem["errors"][0]["pointer"] == pointer
    assert limit in {one["name"] for one in client.get("/v1/limits").json()["limits"]}


@pytest.mark.parametrize(
    ("query", "pointer"),
    [
        ("phase-plane", "/point"),
        ("phase-plane?point=0&starts=-1", "/starts"),
        ("phase-plane?point=0&tab_deg=nan", "/tab_deg"),
        ("norms?point=8", "/point"),
        ("norms?point=0&count=3", "/count"),
        ("simultaneous-margins?point=0&from=10&to=1", "/from"),
        ("power-comparison?point=-1", "/point"),
        ("sample-time-sweep?from_s=0.1&to_s=0.01", "/from_s"),
        ("sample-time-sweep?noise_gain_max=1", "/noise_gain_max"),
        ("sample-time-sweep?halvings=7", "/halvings"),
    ],
)
def test_what_is_asked_wrongly(power: Posted, refused: Any, query: str, pointer: str) -> None:
    problem = refused(power.get("after", query), 422)
    assert problem["code"] == "invalid_request"
    assert problem["errors"][0]["pointer"] == pointer


def test_a_step_shorter_than_its_delay(client: TestClient, refused: Any) -> None:
    body = copy.deepcopy(example("lqr_structures"))
    body["actuators"]["tab"]["delay_s"] = 0.002
    late = posted(client, body)
    problem = refused(late.get("aileron", "phase-plane?point=0&duration_s=0.002"), 422)
    assert problem["errors"][0]["pointer"] == "/duration_s"
    assert late.get("aileron", "phase-plane?point=0&duration_s=0.0021").status_code == 200
