"""How slowly the code may run: ends of passing, gaps, and both ways side by side, against single designs."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from design.assess import achieved
from design.frequency.sampled import sampled_margins
from design.lqr.power_weights import PowerBalancedWeights, ReferenceStep
from design.lqr.sample_time_sweep import sweep_sample_time
from design.lqr.sample_time_trials import FIGURES, unbroken
from design.lqr.sampled_assessment import assess_sampled
from design.lqr.sampled_design import design_lqr_sampled, emulated_lqr_loop, sampled_lqr_loop
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.weights import ExplicitWeights
from design.outcome import Outcome, Outcomes
from design.sampling import Sampling, digital_loop
from design.specs import Spec
from model.actuators import Actuator
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, example

STEP = np.array([np.deg2rad(10.0)])
SCAN = np.geomspace(6e-4, 1e-2, 9)
SPECS = (
    Spec("damping_ratio", "min", 0.4),
    Spec("gain_margin", "min", 6.0),
    Spec("phase_margin", "min", np.deg2rad(30.0)),
    Spec("overshoot", "max", 0.3),
    Spec("settling_time", "max", 0.25),
)


@pytest.fixture(scope="module")
def swept():
    model, controller = example("wind_tunnel")
    return model, controller, sweep_sample_time(model, controller, SCAN, SPECS, STEP, 0.5, halvings=3)


def judged(model, controller, way, time, computation=1.0):
    sampling = Sampling(time, computation * time)
    if way == "redesigned":
        loop = sampled_lqr_loop(model, design_lqr_sampled(model, controller, sampling))
    else:
        loop = emulated_lqr_loop(model, design_lqr(model, controller), sampling)
    return assess_sampled(loop, STEP, 0.5)


def passes(found, specs, index=()):
    return found.stable[index] and all(spec.met(achieved(found, spec.quantity)[index]) for spec in specs)


@pytest.mark.parametrize("way", ["redesigned", "emulated"])
def test_the_ends_are_what_they_are_said_to_be(swept, way):
    """Judged anew: the slowest passes, and the next slower time that was tried does not."""
    model, controller, sweep = swept
    found = getattr(sweep, way).by_point
    times = np.array(found.times)
    assert np.all(np.diff(times) > 0)
    assert found.limited.all()
    for index in [(0, 0), (1, 2)]:
        slowest = found.slowest[index]
        place = int(np.flatnonzero(times == slowest)[0])
        tried = np.flatnonzero(found.tried[index])
        after = tried[tried > place][0]
        # Three halvings of a step of the scan.
        assert times[after] / slowest == pytest.approx((SCAN[1] / SCAN[0]) ** (1 / 8), rel=1e-9)
        at = model.take(index)
        assert passes(judged(at, controller, way, slowest), SPECS)
        assert not passes(judged(at, controller, way, times[after]), SPECS)
        assert found.passed[(*index, place)]
        assert found.reasons[(*index, place)] is None
        assert found.reasons[(*index, after)]
    np.testing.assert_array_equal(found.unbroken, found.slowest)


@pytest.mark.parametrize("way", ["redesigned", "emulated"])
def test_all_points_at_once(swept, way):
    model, controller, sweep = swept
    found = getattr(sweep, way)
    time = found.slowest_together
    assert found.unbroken_together == time
    assert found.together.tried.all()
    assert time <= found.by_point.slowest.min() * (SCAN[1] / SCAN[0]) ** (1 / 8)
    everywhere = judged(model, controller, way, time)
    assert all(passes(everywhere, SPECS, index) for index in np.ndindex(2, 4))
    later = found.together.times[found.together.times.index(time) + 1]
    slower = judged(model, controller, way, later)
    assert not all(passes(slower, SPECS, index) for index in np.ndindex(2, 4))


def test_redesigned_gains_outlast_emulated_ones(swept):
    _, _, sweep = swept
    assert np.all(sweep.redesigned.by_point.slowest > 1.8 * sweep.emulated.by_point.slowest)
    assert sweep.redesigned.slowest_together > 1.8 * sweep.emulated.slowest_together
    radius = sweep.emulated.together.figure("spectral_radius")
    assert np.all(radius[..., -1] > 1.0)
    assert np.all(sweep.redesigned.together.figure("spectral_radius") < 1.0)
    unstable = sweep.emulated.together.reasons[0, 0, -1]
    assert unstable == f"the coded loop has a pole of modulus {radius[0, 0, -1]:.6g}"


def test_figures_are_those_of_the_designs(swept):
    model, controller, sweep = swept
    together = sweep.redesigned.together
    assert together.names == FIGURES
    for k in (0, 6):
        found = judged(model, controller, "redesigned", together.times[k])
        for name in FIGURES:
            radius = np.exp(found.largest_real_part * together.times[k])
            own = {"spectral_radius": radius, "return_difference": found.return_difference.min(axis=-1)}
            wanted = own[name] if name in own else achieved(found, name)
            np.testing.assert_allclose(together.figure(name)[..., k], wanted, rtol=1e-9)
        for q, spec in enumerate(SPECS):
            np.testing.assert_array_equal(together.met[..., k, q], spec.met(achieved(found, spec.quantity)))
    assert together.figure("return_difference").max() < 1.0


def test_emulation_is_the_digital_loop(swept):
    """The stability limit of the emulated gains by bisection over the loop that others build, and its margins."""
    model, controller, sweep = swept
    loop = lqr_loop(model, design_lqr(model, controller))

    def digital(time):
        return digital_loop(loop.take((0, 1)), Sampling(time, time))

    low, high = 5e-4, 1e-2
    for _ in range(40):
        middle = 0.5 * (low + high)
        stable = np.abs(np.linalg.eigvals(digital(middle).closed)).max() < 1.0
        low, high = (middle, high) if stable else (low, middle)
    found = sweep_sample_time(model.take((0, 1)), controller, SCAN, (), STEP, 0.2, halvings=12).emulated.by_point
    assert found.slowest == pytest.approx(low, rel=2e-4)
    assert found.slowest <= low
    time = sweep.emulated.together.times[0]
    margin = sampled_margins(digital(time).cuts()).phase_margin.min()
    assert sweep.emulated.together.figure("phase_margin")[0, 1, 0] == pytest.approx(margin, rel=1e-7)


def test_a_gap():
    """The tab's largest rate rises and falls with the sample time: times pass, fail, and pass again."""
    model, controller = example("wind_tunnel")
    model, specs = model.take((0, 2)), (Spec("tab_rate", "max", 10.0),)
    sweep = sweep_sample_time(model, controller, np.geomspace(1e-3, 1.6e-2, 13), specs, STEP, 0.3)
    found = sweep.redesigned.by_point
    assert 2.6e-3 < found.unbroken < 2.9e-3
    assert found.slowest == max(found.times) == pytest.approx(1.6e-2)
    assert not found.limited
    between = [
        t for t, p in zip(found.times, found.passed, strict=True) if found.unbroken < t < found.slowest and not p
    ]
    assert min(between) / found.unbroken == pytest.approx((16 ** (1 / 12)) ** (1 / 16), rel=1e-9)
    for time in (found.unbroken, min(between)):
        rate = achieved(judged(model, controller, "redesigned", float(time)), "tab_rate")
        assert (rate <= 10.0) == (time == found.unbroken)
    assert sweep.redesigned.unbroken_together == float(found.unbroken)
    assert sweep.redesigned.slowest_together == float(found.slowest)


def test_grid_equals_points(swept):
    model, controller, sweep = swept
    for index in [(0, 3), (1, 0)]:
        alone = sweep_sample_time(model.take(index), controller, SCAN, SPECS, STEP, 0.5, halvings=3)
        for way in ("redesigned", "emulated"):
            grid, point = getattr(sweep, way).by_point, getattr(alone, way).by_point
            assert grid.slowest[index] == point.slowest
            assert grid.unbroken[index] == point.unbroken
            own = [time for time, tried in zip(grid.times, grid.tried[index], strict=True) if tried]
            assert own == list(point.times)
            figures = grid.figures[index][grid.tried[index]]
            np.testing.assert_allclose(figures, point.figures, rtol=1e-8)
            # Of one point its own limit and that of all are the same.
            together = getattr(alone, way)
            assert together.slowest_together == point.slowest


def test_limits_over_the_grid_and_points_that_do_not_count():
    model, controller = example("wind_tunnel")
    limit = np.full((2, 4), 0.3)
    limit[0, 1], limit[1, 3] = 0.22, 0.0
    outcomes = Outcomes.all_ok((2, 4)).failing(
        np.arange(8).reshape(2, 4) == 7, Outcome.EXCLUDED, lambda index: "not flown"
    )
    specs = (Spec("overshoot", "max", limit), Spec("bandwidth", "min", 50.0))
    sweep = sweep_sample_time(model, controller, SCAN[:6], specs, STEP, 0.4, outcomes=outcomes, halvings=1)
    found = sweep.redesigned
    assert found.by_point.names == (*FIGURES, "bandwidth")
    assert not found.counted[1, 3]
    assert np.isnan(found.by_point.slowest[1, 3])
    assert not found.by_point.tried[1, 3].any()
    assert found.slowest_together is not None
    assert found.by_point.slowest[0, 1] < found.by_point.slowest[0, 0]
    nobody = Outcomes.all_ok((2, 4)).failing(np.ones((2, 4), dtype=bool), Outcome.EXCLUDED, lambda index: "not flown")
    none = sweep_sample_time(model, controller, SCAN[:2], specs, STEP, 0.4, outcomes=nobody)
    assert none.redesigned.slowest_together is None
    assert np.isnan(none.emulated.by_point.slowest).all()
    assert not none.emulated.by_point.limited.any()


def test_nothing_passes_and_everything_does():
    model, controller = example("wind_tunnel")
    model = model.take((0, slice(0, 2)))
    hard = sweep_sample_time(model, controller, [1e-3, 2e-3], (Spec("overshoot", "max", 0.01),), STEP, 0.4)
    assert np.isnan(hard.redesigned.by_point.slowest).all()
    assert np.isnan(hard.redesigned.by_point.unbroken).all()
    assert hard.redesigned.by_point.limited.all()
    assert hard.redesigned.slowest_together is None
    assert hard.redesigned.by_point.times == (1e-3, 2e-3)
    assert hard.redesigned.by_point.reasons[0, 0].startswith("overshoot is 0.2")
    easy = sweep_sample_time(model, controller, [2e-3, 1e-3, 1e-3], (), STEP, 0.4)
    assert easy.redesigned.slowest_together == 2e-3
    assert not easy.redesigned.by_point.limited.any()
    assert easy.redesigned.by_point.passed.all()


def test_a_time_that_has_no_design_does_not_pass():
    model, controller = example("wind_tunnel")
    sweep = sweep_sample_time(model.take((0, 0)), controller, [1e-3, 60.0], (), STEP, 0.4, halvings=0)
    found = sweep.redesigned.by_point
    assert found.slowest == 1e-3
    assert "leaves double precision" in found.reasons[1]
    assert np.isnan(found.figures[1]).all()


def test_delays_and_lags_of_actuators_are_in_it():
    """The later the commands of the same gains arrive, the faster the code must be; new gains make up for some."""
    model, controller = example("wind_tunnel")
    model, specs = model.take((0, 1)), (Spec("gain_margin", "min", 6.0),)

    def slowest(computation, **both):
        motor = Actuator(**both)
        sweep = sweep_sample_time(model, controller, SCAN, specs, STEP, 0.3, computation, None, motor, motor, 3)
        return [float(way.by_point.slowest) for way in (sweep.redesigned, sweep.emulated)]

    cases = [slowest(0.2), slowest(0.2, delay=3e-4), slowest(0.7, delay=3e-4), slowest(0.7, delay=6e-4)]
    for faster, slower in pairwise(cases):
        assert faster[1] > slower[1]
    assert all(redesigned > 1.5 * emulated for redesigned, emulated in cases)
    assert np.isfinite(slowest(0.2, torque_loop_bandwidth=1500.0)).all()


def test_scaled_weights_are_scaled_once():
    model, controller = example("wind_tunnel")
    model = model.take((0, slice(0, 2)))
    wanted = PowerBalancedWeights(WIND_TUNNEL_WEIGHTS, None, 8.0, ReferenceStep(STEP[0], 1.0), False)
    controller = replace(controller, weights=wanted)
    sweep = sweep_sample_time(model, controller, [1e-3], (), STEP, 0.3, halvings=0)
    alone = judged(model, controller, "redesigned", 1e-3)
    np.testing.assert_allclose(sweep.redesigned.by_point.figure("overshoot")[..., 0], alone.step.overshoot, rtol=1e-9)


def test_requests_that_cannot_work():
    model, controller = example("wind_tunnel")
    for times in ([], [0.0, 1e-3], [-1e-3], [1e-3, np.inf], [np.nan]):
        with pytest.raises(ValueError, match="sample times"):
            sweep_sample_time(model, controller, times, (), STEP, 0.3)
    for quantity in ("noise_gain", "colour"):
        with pytest.raises(ValueError, match=quantity):
            sweep_sample_time(model, controller, [1e-3], (Spec(quantity, "max", 1.0),), STEP, 0.3)
    with pytest.raises(ValueError, match="delay_states 0"):
        sweep_sample_time(model, replace(controller, delay_states=2), [1e-3], (), STEP, 0.3)


def test_unbroken():
    tried = np.array([[1, 1, 1, 1, 1], [1, 0, 1, 0, 1], [1, 1, 1, 1, 1]], dtype=bool)
    passed = np.array([[1, 1, 0, 1, 1], [1, 0, 1, 0, 0], [0, 1, 1, 1, 1]], dtype=bool)
    wanted = np.array([[1, 1, 0, 0, 0], [1, 1, 1, 1, 0], [0, 0, 0, 0, 0]], dtype=bool)
    np.testing.assert_array_equal(unbroken(tried, passed), wanted)


def test_a_sample_time_that_loses_a_mode_everywhere_is_one_that_fails():
    """A regulator's plant that swings many times within a sample: no weights see it, and the sweep goes on."""
    model, controller = example("wind_tunnel")
    model = model.take((0, 3))
    weights = ExplicitWeights(np.diag([33.0, 0.02, 820.0, 0.08]), np.diag([4.0, 0.25]), None)
    regulator = replace(controller, reference="none", weights=weights)
    sweep = sweep_sample_time(model, regulator, [1e-3, 4.9], (), np.zeros(0), 0.5)
    assert sweep.redesigned.by_point.slowest >= 1e-3
    assert sweep.redesigned.by_point.limited
