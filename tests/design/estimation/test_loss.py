"""The loss against the full state: Kalman's inequality and where it ends, margins and noise by other means."""

from dataclasses import fields, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg

from design.assess import assess
from design.estimation.kalman_filter import kalman_filter
from design.estimation.loss import estimation_loss
from design.estimation.noise_model import NoiseModel
from design.estimation.observer import with_kalman_filter
from design.estimation.rate_filters import with_rate_filters
from tests.design.estimation.estimation_cases import NOISE, full_state, open_response, with_holes

STEP = {"regulator": np.zeros(0), "lagged": np.array([0.1, 0.0])}
OMEGA = np.geomspace(0.1, 2e4, 4001)


@cache
def made(name, way):
    loop = full_state(name)
    return with_rate_filters(loop, 600.0) if way == "filters" else with_kalman_filter(loop, kalman_filter(loop, NOISE))


@cache
def loss(name, way):
    return estimation_loss(full_state(name), made(name, way), NOISE, STEP.get(name, np.array([0.1])), 0.8)


@pytest.mark.parametrize("name", ["ideal", "regulator", "lagged", "unsteady"])
def test_kalmans_inequality_holds_for_the_full_state_and_for_it_alone(name):
    """``|1 + L| >= 1`` at each actuator; an observer and filtered rates fall below it, at every point of the grid."""
    for way in ("filters", "kalman"):
        found = loss(name, way)
        assert np.all(found.full.return_difference >= 1.0 - 1e-6)
        assert np.all(found.implemented.return_difference < 0.95)
        assert np.all(found.full.return_difference <= 1.0)


@pytest.mark.parametrize("way", ["filters", "kalman"])
@pytest.mark.parametrize("name", ["ideal", "unsteady"])
def test_return_difference_and_margins_by_brute_force(name, way):
    found, loop = loss(name, way), made(name, way)
    for index in [(0, 0), (1, 2)]:
        L = open_response(loop.take(index), 1j * OMEGA)
        for i, j in ((0, 1), (1, 0)):
            cut = L[:, i, i] - L[:, i, j] * L[:, j, i] / (1.0 + L[:, j, j])
            lowest = np.abs(1.0 + cut).min()
            assert found.implemented.return_difference[index][i] == pytest.approx(lowest, rel=1e-4)
            crossing = np.flatnonzero(np.diff(np.sign(np.abs(cut) - 1.0)))
            margins = found.implemented.margins[i]
            assert margins.phase_margin[index] == pytest.approx(np.abs(np.angle(-cut[crossing])).min(), abs=5e-3)
            assert margins.disk_margin[index] == pytest.approx(2.0 / np.abs((1 - cut) / (1 + cut)).max(), rel=1e-4)


@pytest.mark.parametrize(("name", "way"), [("ideal", "kalman"), ("lagged", "filters"), ("unsteady", "kalman")])
def test_figures_are_those_of_assess(name, way):
    found = loss(name, way)
    assert found.actuators == ("tab", "aileron")
    for figures, loop in ((found.full, full_state(name)), (found.implemented, made(name, way))):
        judged = assess(loop, STEP.get(name, np.array([0.1])), 0.8)
        np.testing.assert_allclose(figures.damping_ratio, judged.damping_ratio, rtol=1e-9)
        np.testing.assert_allclose(figures.settling_time, judged.step.settling_time, rtol=1e-9)
        for ours, theirs in zip(figures.margins, judged.margins, strict=True):
            for field in fields(ours):
                np.testing.assert_allclose(getattr(ours, field.name), getattr(theirs, field.name), rtol=1e-9)


def _rms(loop, index, intensities):
    """Root mean squares of dt, da and the commands under white noises, by Lyapunov's equation of the closed loop."""
    drive = loop.disturbance_input[index]
    weight = np.diag([intensities.get(name, 0.0) for name in loop.disturbances])
    spread = scipy.linalg.solve_continuous_lyapunov(loop.closed[index], -drive @ weight @ drive.T)
    rows = np.concatenate([np.eye(len(loop.states))[[0, 2]], -loop.K[index]])
    return np.sqrt(np.diag(rows @ spread @ rows.T))


@pytest.mark.parametrize("name", ["ideal", "lagged", "unsteady"])
def test_root_mean_squares_by_lyapunovs_equation(name):
    torques = {"T_t_disturbance": NOISE.tab_torque, "T_a_disturbance": NOISE.aileron_torque}
    angles = {"dt_noise": NOISE.tab_angle, "da_noise": NOISE.aileron_angle}
    for way in ("filters", "kalman"):
        found = loss(name, way)
        assert found.signals == ("dt", "da", "tab", "aileron")
        for figures, loop in ((found.full, full_state(name)), (found.implemented, made(name, way))):
            heard = loop is full_state(name) or way == "filters"
            for index in [(0, 1), (1, 3)]:
                np.testing.assert_allclose(figures.disturbance_rms[index], _rms(loop, index, torques), rtol=1e-6)
                wanted = _rms(loop, index, angles)
                np.testing.assert_allclose(figures.noise_rms[index][:2], wanted[:2], rtol=1e-6)
                # The commands take the noise at once, unless the filter is between.
                commands = np.full(2, np.inf) if heard else wanted[2:]
                np.testing.assert_allclose(figures.noise_rms[index][2:], commands, rtol=1e-6)


@pytest.mark.parametrize("name", ["ideal", "unsteady"])
def test_recovery_buys_margins_with_noise(name):
    """Every margin of both cuts rises towards that of the full state; the noise in the commands rises with them."""
    loop, found = full_state(name), []
    for rho in (0.0, 1e2, 1e4, 1e6):
        noise = NoiseModel(NOISE.tab_torque, NOISE.aileron_torque, NOISE.tab_angle, NOISE.aileron_angle, recovery=rho)
        implemented = with_kalman_filter(loop, kalman_filter(loop, noise))
        found.append(estimation_loss(loop, implemented, noise, np.array([0.1]), 0.8))
    full = found[0].full
    for i in range(2):
        for field in ("phase_margin", "disk_margin"):
            wanted = getattr(full.margins[i], field)
            missing = [np.abs(wanted - getattr(each.implemented.margins[i], field)) for each in found]
            assert all(np.all(later < before) for before, later in pairwise(missing))
            # A torque behind a lag makes the plant fall off faster, and the recovery slower.
            assert np.all(missing[-1] < (0.03 if name == "ideal" else 0.08) * wanted)
        up = [each.implemented.margins[i].gain_margin_up_db for each in found]
        assert all(np.all(later > before) for before, later in pairwise(up))
        assert np.all(np.isinf(full.margins[i].gain_margin_up_db))
    lowest = [each.implemented.return_difference for each in found]
    assert all(np.all(later > before) for before, later in pairwise(lowest))
    assert np.all(lowest[-1] > (0.97 if name == "ideal" else 0.9))
    loud = [each.implemented.noise_rms[..., 2:] for each in found]
    assert all(np.all(later > 2.0 * before) for before, later in pairwise(loud))


def test_an_unstable_implementation_is_said_to_be_one():
    loop = full_state("ideal")
    found = estimation_loss(loop, with_rate_filters(loop, 10.0), NOISE, np.array([0.1]), 0.8)
    lost = found.implemented.damping_ratio < 0.0
    assert lost.any()
    for values in (
        found.implemented.return_difference, found.implemented.noise_rms, found.implemented.disturbance_rms,
        found.implemented.settling_time, found.implemented.margins[0].disk_margin,
    ):  # fmt: skip
        assert np.isnan(values[lost]).all()
    assert np.all(found.full.return_difference >= 1.0 - 1e-6)


def test_delays_count():
    """The loop's own delays are in every figure; the observer that knows them follows as the full state does."""
    found = loss("late", "kalman")
    assert np.all(found.full.return_difference < 1.0)
    np.testing.assert_allclose(found.implemented.settling_time, found.full.settling_time, rtol=1e-3)
    assert np.isfinite(found.implemented.noise_rms).all()
    assert np.isinf(found.full.noise_rms[..., 2:]).all()


def test_grid_equals_points_and_holes_stay_holes():
    over = np.geomspace(1e-6, 1e-4, 8).reshape(2, 4)
    loop, mask = with_holes(full_state("ideal"))
    noise = replace(NOISE, tab_torque=over)
    implemented = with_kalman_filter(loop, kalman_filter(loop, noise))
    found = estimation_loss(loop, implemented, noise, np.array([0.1]), 0.8)
    index = (1, 2)
    alone = replace(NOISE, tab_torque=over[index])
    point = estimation_loss(loop.take(index), implemented.take(index), alone, np.array([0.1]), 0.8)
    for ours, theirs in ((found.full, point.full), (found.implemented, point.implemented)):
        for field in ("return_difference", "damping_ratio", "settling_time", "disturbance_rms", "noise_rms"):
            values = getattr(ours, field)
            assert np.isnan(values[~mask]).all()
            np.testing.assert_allclose(values[index], getattr(theirs, field), rtol=1e-9)
        for cut, single in zip(ours.margins, theirs.margins, strict=True):
            assert np.isnan(cut.disk_margin[~mask]).all()
            np.testing.assert_allclose(cut.disk_margin[index], single.disk_margin, rtol=1e-9)
    nowhere = loop.take((slice(0, 1), slice(1, 2)))
    empty = estimation_loss(
        nowhere, with_kalman_filter(nowhere, kalman_filter(nowhere, NOISE)), NOISE, np.array([0.1]), 0.8
    )
    assert np.isnan(empty.full.damping_ratio).all()


def test_loops_that_do_not_belong_together():
    with pytest.raises(ValueError, match="the same grid"):
        estimation_loss(full_state("ideal"), made("ideal", "kalman").take(0), NOISE, np.array([0.1]), 0.8)
