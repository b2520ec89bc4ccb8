"""Simultaneous margins and norms over HTTP, against the domain, dense sweeps, scipy and python-control."""

from __future__ import annotations

from typing import Any

import control as ct
import numpy as np
import pytest
from fastapi.testclient import TestClient
from scipy.linalg import solve_continuous_lyapunov
from scipy.optimize import minimize_scalar

from design.disturbance.closed_system import closed_system
from design.disturbance.h2 import h2_norm
from design.disturbance.h_infinity import h_infinity_norm
from design.robustness.simultaneous import simultaneous_margins
from service.studies.state_feedback import refused_by_the_domain
from service.wire.refusals import StudyNotPossible
from tests.service.lqr_by_hand import ByHand, Posted, by_hand, example, posted

DENSE = np.concatenate([[0.0], np.geomspace(1e-2, 1e5, 6000)])
LAG = 2.0 * np.pi * 80.0


@pytest.fixture(scope="module")
def tunnel(client: TestClient) -> Posted:
    return posted(client, example("wind_tunnel"))


@pytest.fixture(scope="module")
def late(client: TestClient) -> Posted:
    """Torque loops with a lag, that of the tab late by a millisecond."""
    return posted(client, example("lqr_structures"))


def largest_mu(S: Any) -> float:
    """Peak of mu(S - T), by the scaling of one channel that is best: exact for two blocks."""
    M = 2.0 * S - np.eye(2)

    def scaled(log_d: float, matrix: Any) -> float:
        D = np.diag([np.exp(log_d), 1.0])
        return float(np.linalg.norm(D @ matrix @ np.linalg.inv(D), 2))

    bound = np.linalg.norm(M, 2, axis=(-2, -1))
    best = 1.0
    for i in np.argsort(-bound):
        if bound[i] <= best:
            break
        found = minimize_scalar(scaled, bounds=(-12.0, 12.0), args=(M[i],), method="bounded", options={"xatol": 1e-9})
        best = max(best, float(found.fun))
    return best


@pytest.mark.parametrize("point", [0, 3])
def test_simultaneous_margins(tunnel: Posted, point: int) -> None:
    found, hand = tunnel.answered("lqr", f"simultaneous-margins?point={point}&count=300"), tunnel.by_hand("lqr", point)
    loop = tunnel.controller("lqr").loop.take(np.unravel_index(point, (2, 4)))
    domain = simultaneous_margins(loop.A, loop.B, loop.K)
    assert found["disk_margin"] == pytest.approx(float(domain.disk_margin), rel=1e-12)
    assert found["return_difference"] == pytest.approx(float(domain.return_difference), rel=1e-12)
    assert found["phase_margin_deg"] == pytest.approx(np.rad2deg(float(domain.phase_margin)), rel=1e-12)
    assert found["proved"] is True
    assert found["actuators"] == ["tab", "aileron"]
    L = hand.loop(DENSE[1:])
    S = np.linalg.inv(np.eye(2) + L)
    assert found["disk_margin"] == pytest.approx(2.0 / largest_mu(S), rel=1e-5)
    lowest = np.linalg.svd(np.eye(2) + L, compute_uv=False)[:, -1].min()
    assert found["return_difference"] == pytest.approx(lowest, rel=1e-4)
    assert found["sensitivity_peak"] == pytest.approx(1.0 / lowest, rel=1e-4)


def test_worst_factors_put_a_pole_on_the_axis(tunnel: Posted) -> None:
    found, hand = tunnel.answered("lqr", "simultaneous-margins?point=3"), tunnel.by_hand("lqr", 3)
    factors = [complex(z["re"], z["im"]) for z in (found["worst_factors"][name] for name in ("tab", "aileron"))]
    poles = np.linalg.eigvals(hand.A - hand.B @ np.diag(factors) @ hand.K)
    omega = found["disk_omega_rad_s"]
    assert np.abs(poles - 1j * omega).min() < 1e-6 * omega
    sizes = [abs(2.0 * (f - 1.0) / (f + 1.0)) for f in factors]
    assert max(sizes) == pytest.approx(found["disk_margin"], rel=1e-9)
    up = 10.0 ** (found["gain_margin_up_db"] / 20.0)
    assert up == pytest.approx((2.0 + found["disk_margin"]) / (2.0 - found["disk_margin"]), rel=1e-12)


def test_one_loop_at_a_time_and_curves(tunnel: Posted) -> None:
    """Disk margins of python-control; a single loop promises more than both at once do."""
    found = tunnel.answered("lqr", "simultaneous-margins?point=3&from=0.1&to=1e4&count=400")
    hand = tunnel.by_hand("lqr", 3)
    curves = found["curves"]
    omega = np.array(curves["omega_rad_s"])
    assert (omega[0], omega[-1], omega.size) == (pytest.approx(0.1), pytest.approx(1e4), 400)
    for i, name in enumerate(("tab", "aileron")):
        j = 1 - i
        A = hand.A - hand.B[:, [j]] @ hand.K[[j]]
        cut = ct.ss(A, hand.B[:, [i]], hand.K[[i]], 0.0)
        expected, _, _ = ct.disk_margins(cut, DENSE[1:])
        alone = found["one_at_a_time"][name]
        assert alone["disk_margin"] == pytest.approx(expected, rel=1e-4)
        assert alone["disk_margin"] > found["disk_margin"]
        assert alone["return_difference"] == pytest.approx(1.0, abs=1e-6)
        assert min(curves["disk_margins"][name]) == pytest.approx(expected, rel=1e-3)
    assert min(curves["simultaneous_disk_margin"]) == pytest.approx(found["disk_margin"], rel=1e-3)
    assert min(curves["simultaneous_disk_margin"]) >= found["disk_margin"] * (1.0 - 1e-9)
    lowest = np.linalg.svd(np.eye(2) + hand.loop(omega), compute_uv=False)[:, -1]
    np.testing.assert_allclose(curves["return_difference"], lowest, rtol=1e-8)


def test_delays_are_in_the_margins_exactly(late: Posted) -> None:
    found = late.answered("aileron", "simultaneous-margins?point=1")
    point = late.client.get(f"/v1/designs/{late.design['id']}/points/1").json()
    hand = by_hand(point, "aileron", LAG)
    turn = np.exp(-1j * DENSE[1:, None] * np.array([1e-3, 0.0]))[:, None, :]
    S = np.linalg.inv(np.eye(2) + hand.loop(DENSE[1:]) * turn)
    assert found["disk_margin"] == pytest.approx(2.0 / largest_mu(S), rel=1e-4)
    assert found["sensitivity_peak"] == pytest.approx(np.linalg.norm(S, 2, axis=(-2, -1)).max(), rel=1e-4)
    assert found["proved"] is False
    assert found["disk_margin"] < found["one_at_a_time"]["tab"]["disk_margin"]


def systems(hand: ByHand) -> dict[tuple[str, str], Any]:
    """Closed systems of python-control by the first signals of both sides, angles in degrees."""
    n, turn = len(hand.A), 180.0 / np.pi
    angles, nothing = np.eye(n)[[2, 0]], np.zeros((2, 2))
    read = np.eye(n)[:, [0, 2]], np.eye(n)[:, [1, 3]]
    found = {}
    for source, G, D in (
        ("T_t_disturbance", hand.B, nothing),
        # The error is integrated of what is measured, and the law reads it.
        ("dt_noise", -hand.B @ hand.K @ read[0] + _integrated(hand, read[0]), -hand.K @ read[0]),
        ("dt_rate_noise", -hand.B @ hand.K @ read[1], -hand.K @ read[1]),
    ):
        per = 1.0 if source == "T_t_disturbance" else turn
        found[source, "da"] = ct.ss(hand.closed, G, angles * turn / per, nothing)
        found[source, "tab"] = ct.ss(hand.closed, G, -hand.K / per, D / per)
    return found


def _integrated(hand: ByHand, read: Any) -> Any:
    integral = np.zeros_like(hand.A)
    integral[4] = hand.A[4]
    return integral @ read


@pytest.mark.parametrize("point", [0, 6])
def test_norms(tunnel: Posted, point: int) -> None:
    found = tunnel.answered("lqr", f"norms?point={point}")
    expected = systems(tunnel.by_hand("lqr", point))
    assert found["method"] == "level_sets"
    assert {(one["from"][0], one["to"][0]) for one in found["systems"]} == set(expected)
    loop = tunnel.controller("lqr").loop.take(np.unravel_index(point, (2, 4)))
    for one in found["systems"]:
        system = expected[one["from"][0], one["to"][0]]
        assert one["h_infinity"] == pytest.approx(ct.norm(system, "inf", tol=1e-9), rel=1e-6)
        assert one["h_infinity_reason"] is None
        domain = closed_system(loop, tuple(one["from"]), tuple(one["to"]))
        scale = one["h_infinity"] / float(h_infinity_norm(domain).gain)
        if np.any(system.D):
            assert one["h2"] is None
            assert "at once" in one["h2_reason"]
            assert np.isinf(h2_norm(domain).total)
            continue
        gramian = solve_continuous_lyapunov(system.A, -system.B @ system.B.T)
        assert one["h2"] == pytest.approx(np.sqrt(np.trace(system.C @ gramian @ system.C.T)), rel=1e-9)
        assert one["h2"] == pytest.approx(ct.norm(system, 2), rel=1e-6)
        assert one["h2"] == pytest.approx(float(h2_norm(domain).total) * scale, rel=1e-9)
    units = {(one["from"][0], one["to"][0]): (one["unit"], one["h2_unit"]) for one in found["systems"]}
    assert units["T_t_disturbance", "da"] == ("deg/(N m)", "deg/(N m) s^-1/2")
    assert units["dt_rate_noise", "da"] == ("s", "s s^-1/2")
    assert units["T_t_disturbance", "tab"] == ("1", "1 s^-1/2")


def test_norms_with_a_delay_are_of_the_exact_loop(late: Posted) -> None:
    point = late.client.get(f"/v1/designs/{late.design['id']}/points/2").json()
    hand, found = by_hand(point, "aileron", LAG), late.answered("aileron", "norms?point=2")
    assert found["method"] == "frequency_grid"
    omega = DENSE[1:]
    turn = np.exp(-1j * omega[:, None] * np.array([1e-3, 0.0]))[:, None, :]
    G = np.zeros((7, 2))
    G[:4] = point["linear_model"]["B"]
    closed = 1j * omega[:, None, None] * np.eye(7) - hand.A + (hand.B * turn) @ hand.K
    x = np.linalg.solve(closed, np.broadcast_to(G + 0j, (omega.size, 7, 2)))
    angles = x[:, [2, 0]] * (180.0 / np.pi)
    (torques,) = [s for s in found["systems"] if (s["from"][0], s["to"][0]) == ("T_t_disturbance", "da")]
    assert torques["h_infinity"] == pytest.approx(np.linalg.norm(angles, 2, axis=(-2, -1)).max(), rel=1e-5)
    square = np.sum(np.abs(angles) ** 2, axis=(-2, -1))
    whole = np.trapezoid(square, omega) + square[0] * omega[0]
    assert torques["h2"] == pytest.approx(np.sqrt(whole / np.pi), rel=1e-4)


@pytest.mark.parametrize("error", [ValueError("no"), np.linalg.LinAlgError("no"), ZeroDivisionError("no")])
def test_what_the_domain_refuses_is_no_fault(
    tunnel: Posted, refused: Any, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def raising(*args: Any) -> None:
        raise error

    monkeypatch.setattr("service.routes.norms.norms_document", raising)
    problem = refused(tunnel.get("lqr", "norms?point=0"), 409)
    assert problem["code"] == "study_not_possible"
    with pytest.raises(StudyNotPossible, match="for the controller lqr"), refused_by_the_domain("lqr"):
        raise error
