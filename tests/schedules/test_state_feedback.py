"""State feedback over a grid in every form that is flown, and away from its point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from design.assess import assess
from design.estimation.kalman_filter import kalman_filter
from design.estimation.observer import with_kalman_filter
from design.estimation.rate_filters import with_rate_filters
from design.frequency.fastest_mode import fastest_surface_mode
from design.lqr.coded_loop import CodedLoop
from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.lqr.sampled_design import design_lqr_sampled, sampled_lqr_loop
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.outcome import Outcome
from design.sampling import Sampling
from schedules.carried_loop import carried_loop
from schedules.run import run
from schedules.scaling_laws import scaling_law
from schedules.state_feedback import noise_of

KALMAN = KalmanMeasurement(0.002, 0.01, 2e-5, 4e-5)
FORMS = {
    "filtered": {"measurement": RateFilters(2000.0)},
    "estimated": {"measurement": KALMAN},
    "sampled": {"sampling": Sampling(2e-3, 2e-3)},
}


@pytest.fixture(scope="module")
def envelope(wind_tunnel_study):
    lqr = wind_tunnel_study.controllers[2]
    forms = (replace(lqr, name=name, **fields) for name, fields in FORMS.items())
    return run(replace(wind_tunnel_study, controllers=(lqr, *forms)))


def test_every_form_is_ok_and_judged_on_the_loop_that_is_flown(envelope):
    study, model = envelope.study, envelope.plant.model
    lqr = study.controllers[0]
    full = lqr_loop(model, design_lqr(model, lqr))
    wanted = {
        "lqr": full,
        "filtered": with_rate_filters(full, 2000.0),
        "estimated": with_kalman_filter(full, kalman_filter(full, noise_of(KALMAN))),
    }
    for name, loop in wanted.items():
        designed = envelope.controller(name)
        assert designed.outcomes.ok.all()
        found = assess(loop, np.array([study.reference.aileron]), study.reference.duration)
        for i in range(2):
            np.testing.assert_allclose(designed.assessment.margins[i].disk_margin, found.margins[i].disk_margin)
        np.testing.assert_allclose(designed.assessment.damping_ratio, found.damping_ratio)
    assert np.all(envelope.controller("lqr").assessment.return_difference >= 1.0 - 1e-9)
    for name in FORMS:
        assert np.all(envelope.controller(name).assessment.return_difference < 0.95)


def test_the_sampled_form_flies_as_code(envelope):
    study, model, designed = envelope.study, envelope.plant.model, envelope.controller("sampled")
    assert isinstance(designed.loop, CodedLoop)
    loop = sampled_lqr_loop(model, design_lqr_sampled(model, study.controllers[0], FORMS["sampled"]["sampling"]))
    np.testing.assert_array_equal(designed.loop.K, loop.K)
    names = [gain.name for gain in designed.gains]
    assert "K_T_t_T_a_1" in names
    assert names[-1] == "N_T_a_r_a"
    growth = np.log(np.abs(np.linalg.eigvals(loop.closed)).max(axis=-1)) / 2e-3
    np.testing.assert_allclose(designed.assessment.largest_real_part, growth, rtol=1e-8)
    # Fast sampling without delay has the fastest mode of the continuous design.
    prompt = sampled_lqr_loop(model, design_lqr_sampled(model, study.controllers[0], Sampling(1e-4, 0.0)))
    found = fastest_surface_mode(prompt.closed, prompt.states, ("dt", "da"), 1e-4)
    np.testing.assert_allclose(found, envelope.controller("lqr").fastest_mode, rtol=0.02)
    assert np.all(np.abs(designed.fastest_mode) < np.pi * np.sqrt(2.0) / 2e-3)


def test_filters_fly_with_gains_to_other_points(envelope):
    """Each pair by itself, from the matrices of the design."""
    study, plant, designed = envelope.study, envelope.plant, envelope.controller("filtered")
    for of, at in ((0, 5), (6, 1)):
        index = np.unravel_index(at, plant.grid.shape)
        model = plant.model.take(tuple(np.array([i]) for i in index))
        loop = carried_loop(study, plant, designed, model, np.array([of]))
        own = designed.optimum.take(np.unravel_index(of, plant.grid.shape))
        optimum = replace(own, outcomes=plant.outcomes.take(index))
        wanted = with_rate_filters(lqr_loop(plant.model.take(index), optimum), 2000.0)
        np.testing.assert_allclose(loop.closed[0], wanted.closed, rtol=1e-12)


@pytest.mark.parametrize("name", ["estimated", "sampled"])
def test_what_runs_a_model_of_its_point_is_not_flown_elsewhere(envelope, name):
    with pytest.raises(ValueError, match="flown away from its point"):
        carried_loop(
            envelope.study,
            envelope.plant,
            envelope.controller(name),
            envelope.plant.model.take(([0], [0])),
            np.zeros(1, int),
        )
    with pytest.raises(ValueError, match="could be replaced"):
        scaling_law(envelope.study, envelope.plant, envelope.controller(name))


def test_samples_and_estimates_at_once_are_refused(wind_tunnel_study):
    lqr = replace(wind_tunnel_study.controllers[2], sampling=Sampling(1e-3, 0.0), measurement=KALMAN)
    with pytest.raises(ValueError, match="measures every state"):
        run(replace(wind_tunnel_study, controllers=(lqr,)))


def test_filters_too_slow_for_the_plant_are_withdrawn(wind_tunnel_study):
    lqr = replace(wind_tunnel_study.controllers[2], measurement=RateFilters(3.0))
    (designed,) = run(replace(wind_tunnel_study, controllers=(lqr,))).controllers
    assert np.all(designed.outcomes.codes == Outcome.NOT_CERTIFIED)
    assert "real part" in designed.outcomes.reasons[0, 0]
    assert all(np.isnan(gain.values).all() for gain in designed.gains)


def test_laws_name_what_the_controller_does(envelope):
    laws = {designed.request.name: designed.request.law for designed in envelope.controllers}
    assert laws["lqr"] == "u = -K x + N r, u = [T_t, T_a]"
    assert "w = 2000 rad/s" in laws["filtered"]
    assert "z' = A z + B v + L" in laws["estimated"]
    assert "every 0.002 s" in laws["sampled"]
