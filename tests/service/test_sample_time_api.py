"""Sweeps of sample times over HTTP, against the domain and loops put together by hand."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.linalg import block_diag, expm

from design.lqr.controller import LqrController
from design.lqr.sample_time_sweep import sweep_sample_time
from design.specs import SPEC_PACKS, Spec
from service.app import create_app
from service.settings import Settings
from tests.service.lqr_by_hand import ByHand, Posted, example, posted

POINT = 5
SWEEP = f"sample-time-sweep?point={POINT}&from_s=6e-4&to_s=6e-3&count=5&halvings=2"


@pytest.fixture(scope="module")
def tunnel(client: TestClient) -> Posted:
    return posted(client, example("wind_tunnel"))


@pytest.fixture(scope="module")
def swept(tunnel: Posted) -> dict[str, Any]:
    return tunnel.answered("lqr", SWEEP)


def coded(hand: ByHand, T: float, gain: Any = 1.0) -> Any:
    """Closed matrix of the continuous gains as code, one sample late: plant, commands under way, rectangular integral.

    ``int_k = w_k + T/2 e_k``, ``w_(k+1) = w_k + T e_k``; `gain` multiplies each command on its way.
    """
    held = expm(block_diag(np.block([[hand.A[:4, :4], hand.B[:4]], [np.zeros((2, 6))]])) * T)
    command = np.hstack([-hand.K[:, :4], np.zeros((2, 2)), -hand.K[:, 4:]])
    command[:, 2] += 0.5 * T * hand.K[:, 4]
    closed = np.zeros((7, 7))
    closed[:4, :4], closed[:4, 4:6] = held[:4, :4], held[:4, 4:]
    closed[4:6] = np.diag(np.broadcast_to(gain, 2)) @ command
    closed[6, 2], closed[6, 6] = -T, 1.0
    return closed


def test_gains_run_as_code(swept: dict[str, Any], tunnel: Posted) -> None:
    """Spectral radius, damping and gain margin of each trial, by a loop that is written down here."""
    hand = tunnel.by_hand("lqr", POINT)
    assert swept["points"] == [POINT]
    for trial in swept["emulated"]["trials"]:
        T, figures = trial["sample_time_s"], trial["figures"]
        poles = np.linalg.eigvals(coded(hand, T))
        assert figures["spectral_radius"] == [pytest.approx(np.abs(poles).max(), rel=1e-9)]
        if figures["spectral_radius"][0] >= 1.0:
            assert figures["damping_ratio"] == [None]
            assert "pole of modulus" in trial["reasons"][0]
            continue
        s = np.log(poles[np.abs(poles) > 1e-9])
        assert figures["damping_ratio"] == [pytest.approx((-s.real / np.abs(s)).min(), rel=1e-6)]
        margin = 10.0 ** (figures["gain_margin_db"][0] / 20.0)
        radii = [
            np.abs(np.linalg.eigvals(coded(hand, T, np.where(np.arange(2) == i, factor, 1.0)))).max()
            for i in range(2)
            for factor in (margin, 1.0 / margin)
        ]
        assert max(radii) == pytest.approx(1.0, abs=1e-7)


def test_what_passes(swept: dict[str, Any]) -> None:
    """The slowest passes, the next slower one tried does not, and the reason is a spec in its own unit."""
    limits = {spec["spec"]: spec["limits"][0] for spec in swept["specs"]}
    assert limits["phase_margin_deg_min"] == 45.0
    for way in ("redesigned", "emulated"):
        found = swept[way]
        times = [trial["sample_time_s"] for trial in found["trials"]]
        assert times == sorted(times)
        assert times[0] == pytest.approx(6e-4)
        (slowest,) = found["slowest_s"]
        passed = [trial["sample_time_s"] for trial in found["trials"] if trial["passed"][0]]
        assert slowest == max(passed, default=None)
        assert found["slowest_together_s"] == slowest
        assert all(trial["tried"] == [True] for trial in found["trials"])
        for trial in found["trials"]:
            figures = {name: values[0] for name, values in trial["figures"].items()}
            assert trial["passed"][0] == (trial["reasons"][0] is None)
            if figures["damping_ratio"] is None:
                assert not trial["passed"][0]
                continue
            met = all(
                figures[name.rpartition("_")[0]] >= limit * (1.0 - 1e-8)
                if name.endswith("_min")
                else figures[name.rpartition("_")[0]] <= limit * (1.0 + 1e-8)
                for name, limit in limits.items()
            )
            assert trial["passed"][0] == met
            if not met:
                missed = trial["reasons"][0].partition(":")[0]
                assert missed in limits
    assert swept["redesigned"]["slowest_s"] > swept["emulated"]["slowest_s"]
    assert swept["redesigned"]["limited"] == [True]


def test_values_are_those_of_the_domain(tunnel: Posted) -> None:
    """Over the grid; specs that are asked for stand beside the pack, or in its place."""
    query = "from_s=6e-4&to_s=4e-3&count=4&halvings=1&computation_samples=0.5&damping_ratio_min=0.3"
    query += "&settling_time_s_max=0.25&duration_s=0.5"
    found, envelope = tunnel.answered("lqr", f"sample-time-sweep?{query}"), tunnel.envelope
    pack = tuple(spec for spec in SPEC_PACKS["default"] if spec.quantity != "damping_ratio")
    specs = (*pack, Spec("damping_ratio", "min", 0.3), Spec("settling_time", "max", 0.25))
    request = envelope.controller("lqr").request
    assert isinstance(request, LqrController)
    domain = sweep_sample_time(
        envelope.plant.model, request, np.geomspace(6e-4, 4e-3, 4), specs, np.array([np.deg2rad(10.0)]), 0.5, 0.5,
        halvings=1,
    )  # fmt: skip
    assert found["points"] == list(range(8))
    assert found["reference"]["duration_s"] == 0.5
    assert [spec["spec"] for spec in found["specs"]][-2:] == ["damping_ratio_min", "settling_time_s_max"]
    for way in ("redesigned", "emulated"):
        here, there = found[way], getattr(domain, way)
        slowest = np.array(here["slowest_s"], dtype=float)
        np.testing.assert_allclose(slowest, there.by_point.slowest.ravel(), rtol=1e-12)
        unbroken = np.array(here["unbroken_s"], dtype=float)
        np.testing.assert_allclose(unbroken, there.by_point.unbroken.ravel(), rtol=1e-12)
        assert here["slowest_together_s"] == pytest.approx(there.slowest_together, rel=1e-12)
        assert [trial["sample_time_s"] for trial in here["trials"]] == pytest.approx(there.by_point.times, rel=1e-12)
        for k, trial in enumerate(here["trials"]):
            assert trial["tried"] == there.by_point.tried[..., k].ravel().tolist()
            assert trial["passed"] == there.by_point.passed[..., k].ravel().tolist()
            for name, scale in (("phase_margin_deg", np.rad2deg(1.0)), ("overshoot_percent", 100.0)):
                inside = there.by_point.figure(name.rpartition("_")[0])[..., k].ravel() * scale
                np.testing.assert_allclose(np.array(trial["figures"][name], dtype=float), inside, rtol=1e-8)


def test_specs_that_vary_and_those_without_a_figure(client: TestClient) -> None:
    body = example("wind_tunnel")
    dampings = {"axis": "dynamic_pressure_pa", "values": [0.1, 0.2, 0.3, 0.4]}
    body["spec_pack"] = {"name": "ours", "specs": {"damping_ratio_min": dampings, "noise_gain_max": 50.0}}
    found = posted(client, body).answered("lqr", "sample-time-sweep?from_s=1e-3&count=1&halvings=0")
    assert found["specs"] == [{"spec": "damping_ratio_min", "unit": "1", "limits": [0.1, 0.2, 0.3, 0.4] * 2}]
    assert found["not_judged"] == ["noise_gain_max"]
    assert [trial["sample_time_s"] for trial in found["emulated"]["trials"]] == [pytest.approx(1e-3)]


def test_loops_that_are_not_swept(client: TestClient, refused: Any) -> None:
    """A model of delays is not emulated; delays of too many samples are no state space to judge."""
    structures = posted(client, example("lqr_structures"))
    problem = refused(structures.get("both", "sample-time-sweep?point=0"), 409)
    assert (problem["code"], "delay_states" in problem["detail"]) == ("study_not_possible", True)
    assert structures.answered("regulator", "sample-time-sweep?point=0&count=3&halvings=1")["reference"]
    problem = refused(structures.get("aileron", "sample-time-sweep?point=0&from_s=2e-5&duration_s=0.05"), 422)
    assert "52 commands are under way" in problem["detail"]
    assert problem["errors"][0]["allowed"] == "a sample time with at most 26 commands under way"
    assert problem["errors"][0]["pointer"] == "/from_s"


def test_a_sweep_takes_the_place_of_a_design(tmp_path: Path) -> None:
    """It designs anew, so it waits for a slot even where the design itself is ready in memory."""
    with TestClient(create_app(Settings(data_dir=tmp_path, max_concurrent_designs=1))) as client:
        here = posted(client, example("wind_tunnel"))
        slots = client.app.state.shared.slots  # type: ignore[attr-defined]
        assert client.portal is not None
        client.portal.call(slots.acquire)
        answers: list[Any] = []
        query = "sample-time-sweep?point=0&count=1&halvings=0"
        thread = threading.Thread(target=lambda: answers.append(here.get("lqr", query)))
        thread.start()
        assert here.get("lqr", "norms?point=0").status_code == 200
        thread.join(0.3)
        assert not answers
        client.portal.call(slots.release)
        thread.join(20)
        assert [answer.status_code for answer in answers] == [200]
