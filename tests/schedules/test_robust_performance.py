"""Perturbed plants against studies made anew one by one, closed forms of one parameter, and their statistics."""

from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.stats import binomtest

import schedules.flown_figures as room
import schedules.step_quality as step_room
from design.assess import assess
from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.lqr.torque_loop import lqr_loop
from design.outcome import Outcomes
from design.specs import Spec
from model.actuators import Actuator
from schedules.analysis import analyse
from schedules.flown_figures import MARGIN_QUANTITIES, FlownFigures
from schedules.perturbations import BLOCK, Cases, Uncertainty, drawn_cases
from schedules.robust_performance import (
    RobustPerformance,
    corners,
    least_fraction,
    monte_carlo,
    perturbed_performance,
)
from schedules.run import run
from tests.schedules.flown_cases import NF, NF_RATE, designed_of, given, turned_system

OF_AILERON = [Uncertainty("C_Ha_da", 0.3), Uncertainty("C_Ha_dt", 0.3, 0.15), Uncertainty("aileron_inertia", 0.2)]
OF_ALL = [*OF_AILERON, Uncertainty("C_Ht_da", 0.3), Uncertainty("C_Ht_dt", 0.3), Uncertainty("tab_inertia", 0.2)]
STEPS = ("settling_time", "overshoot")


@pytest.fixture(scope="module")
def study(wind_tunnel_study):
    return replace(wind_tunnel_study, controllers=wind_tunnel_study.controllers[2:])


@pytest.fixture(scope="module")
def envelope(study):
    return run(study)


@pytest.fixture(scope="module")
def plant(envelope):
    return envelope.plant


@pytest.fixture(scope="module")
def designs(study, envelope):
    plant = envelope.plant
    return {"nf": given(study, plant, NF), "nf_rate": given(study, plant, NF_RATE), "lqr": envelope.controllers[0]}


def _anew(study, factors):
    """The plant of a perturbed study, from its section and its air on."""
    # A study has the parts of a section, and this one the same trim angles at every point.
    return analyse(turned_system(study, analyse(study).trim.take((0, 0)), factors))


@pytest.mark.parametrize("kind", ["nf", "nf_rate", "lqr"])
def test_against_studies_made_anew(study, plant, designs, kind):
    """Trim, hinge moments, linear model and loop of every perturbed section, one by one, judged by `assess`."""
    designed, names = designs[kind], tuple(u.parameter for u in OF_ALL)
    cases = drawn_cases(OF_ALL, 5, 2)
    found = perturbed_performance(study, plant, designed, cases, margins=True)
    for d in range(5):
        fresh = _anew(study, dict(zip(names, cases.factors[d], strict=True)))
        for i in [(0, 0), (1, 3)]:
            model = fresh.model.take(i)
            if kind == "lqr":
                loop = lqr_loop(model, replace(designed.optimum.take(i), outcomes=Outcomes.all_ok(())))
            else:
                gains = {gain.name: gain.values[i] for gain in designed.gains}
                loop = tab_loop(model, fresh.servo_tab.take(i), study.tab_actuator, designed.request, gains)
            wanted = assess(loop, np.array([study.reference.aileron]), 1.0)
            got = found.figures.take((*i, d))
            assert got.stable == (wanted.largest_real_part < 0.0)
            np.testing.assert_allclose(got.damping_ratio, wanted.damping_ratio, rtol=1e-11)
            np.testing.assert_allclose(got.largest_real_part, wanted.largest_real_part, rtol=1e-11)
            np.testing.assert_allclose(got.settling_time, wanted.step.settling_time, rtol=1e-10)
            np.testing.assert_allclose(got.overshoot, wanted.step.overshoot, rtol=1e-10, atol=1e-12)
            np.testing.assert_allclose(got.disk_margin, min(m.disk_margin for m in wanted.margins), rtol=1e-9)


def test_against_python_control(study, plant, designs):
    """The law written out as transfer functions around the perturbed servo tab of the section made anew."""
    cases = Cases(("C_Ha_da", "C_Ha_dt", "aileron_inertia"), np.array([[0.8, 1.2, 0.9], [1.3, 0.8, 1.2]]))
    found = perturbed_performance(study, plant, designs["nf"], cases)
    gains = {gain.name: float(gain.values[1, 1]) for gain in designs["nf"].gains}
    w, z, f = study.tab_actuator.servo_bandwidth, study.tab_actuator.servo_damping_ratio, NF.rate_filter
    s = control.tf("s")
    for d in range(2):
        servo = _anew(study, dict(zip(cases.parameters, cases.factors[d], strict=True))).servo_tab.take((1, 1))
        P = control.tf(servo.numerator, servo.denominator)
        drive = w**2 / (s**2 + 2.0 * z * w * s + w**2)
        inner = control.feedback(-drive * P, gains["K_p"] + gains["K_d"] * f * s / (s + f))
        closed = control.feedback(inner * gains["K_i"] / s, 1.0).minreal(1e-6)
        poles = closed.poles()
        assert found.figures.damping_ratio[1, 1, d] == pytest.approx((-poles.real / np.abs(poles)).min(), rel=1e-5)
        assert found.figures.largest_real_part[1, 1, d] == pytest.approx(poles.real.max(), rel=1e-5)
        time = np.linspace(0.0, 1.0, 4001)
        info = control.step_info(control.step_response(closed, time).outputs, time, yfinal=1.0)
        assert found.figures.settling_time[1, 1, d] == pytest.approx(info["SettlingTime"], abs=5e-4)
        assert 100.0 * found.figures.overshoot[1, 1, d] == pytest.approx(info["Overshoot"], abs=2e-3)


# One parameter, in closed form.

#: Regenerative feedback through an ideal deflection, its integral next to none: what is left is of second order.
REGENERATIVE = ClassicalController("pf", "positive_feedback")
K_F = 0.6


@pytest.fixture(scope="module")
def second_order(study, plant):
    ideal = replace(study, tab_actuator=Actuator())
    full = np.ones(plant.grid.shape)
    return ideal, designed_of(ideal, plant, REGENERATIVE, {"K_f": K_F * full, "K_i": 1e-9 * full}, plant.outcomes)


def _closed_form(plant, f_aileron, f_tab):
    """Natural frequency squared and damping ratio of ``da'' = ...`` with ``dt = -K_F da``, all by hand."""
    geometry, condition = plant.system.geometry, plant.grid.condition
    I = plant.model.inertia[..., 1, 1]  # noqa: E741
    q = condition.dynamic_pressure * geometry.chord**2 * geometry.span / I
    gradient = plant.system.aerodynamics.source.at(0.0, 0.0, 0.0).gradient
    by_da, by_dt = f_aileron * gradient[1, 2], f_tab * gradient[1, 1]
    ca, ct, V = geometry.aileron_chord, geometry.tab_chord, condition.airspeed
    drag = q / V * (by_da * ca / 4.0 + by_dt * ca - K_F * by_dt * ct / 4.0)
    stiffness = q * (by_da - K_F * by_dt)
    return stiffness, drag / (2.0 * np.sqrt(np.where(stiffness > 0.0, stiffness, np.nan)))


@pytest.mark.parametrize("parameter", ["C_Ha_da", "C_Ha_dt"])
def test_damping_of_a_servo_tab_with_one_scaled_derivative(plant, second_order, parameter):
    study, designed = second_order
    factors = np.linspace(0.85, 1.15, 7)
    found = perturbed_performance(study, plant, designed, Cases((parameter,), factors[:, None]), steps=False)
    for d, factor in enumerate(factors):
        scaled = {"f_aileron": 1.0, "f_tab": 1.0} | {"f_aileron" if parameter == "C_Ha_da" else "f_tab": factor}
        stiffness, damping = _closed_form(plant, **scaled)
        assert np.all(stiffness > 0.0)
        np.testing.assert_allclose(found.figures.damping_ratio[..., d], np.minimum(damping, 1.0), rtol=1e-7)


def test_stability_ends_where_the_stiffness_is_used_up(plant, second_order):
    """Positive feedback by K_f takes ``K_f |K_ss|`` of the stiffness: below that factor on C_Ha_da it is gone."""
    study, designed = second_order
    edge = K_F * np.abs(plant.servo_tab.dc_gain[0, 0])
    assert 0.3 < edge < 0.99
    mc = monte_carlo(study, plant, designed, [Uncertainty("C_Ha_da", 0.9)], 3000, 3, steps=False)
    stands = mc.cases.factors[:, 0] > edge
    np.testing.assert_array_equal(mc.figures.stable, np.broadcast_to(stands, (2, 4, 3000)))
    np.testing.assert_array_equal(mc.stable_everywhere, stands)
    assert np.all(mc.stable_fraction == stands.mean())
    # Of uniform draws, the part above the edge; four standard deviations of it.
    wanted = (1.9 - edge) / 1.8
    assert mc.stable_fraction[0, 0] == pytest.approx(wanted, abs=4.0 * np.sqrt(wanted * (1.0 - wanted) / 3000))
    worst = mc.distribution("largest_real_part")
    np.testing.assert_array_equal(worst.worst_factors[..., 0], mc.cases.factors.min())


# Cases, parts, seeds.


@pytest.mark.parametrize("kind", ["nf", "lqr"])
def test_parts_do_not_matter(study, plant, designs, kind, monkeypatch):
    whole = monte_carlo(study, plant, designs[kind], OF_ALL, 40, 4, margins=True)
    monkeypatch.setattr(room, "AT_ONCE", 7)
    monkeypatch.setattr(step_room, "GROUP_BYTES", 100_000)
    parts = monte_carlo(study, plant, designs[kind], OF_ALL, 40, 4, margins=True)
    _same(parts.figures, whole.figures)


def _same(got, wanted, exact=("stable", "damping_ratio", "largest_real_part")):
    for name in vars(wanted):
        if name in exact:
            np.testing.assert_array_equal(getattr(got, name), getattr(wanted, name))
        else:
            np.testing.assert_allclose(getattr(got, name), getattr(wanted, name), rtol=1e-11, atol=1e-12)


def test_a_shorter_run_is_the_beginning_of_a_longer_one(study, plant, designs):
    one, other = (
        monte_carlo(study, plant, designs["nf"], OF_AILERON, draws, 9, steps=False) for draws in (BLOCK - 3, BLOCK + 5)
    )
    np.testing.assert_array_equal(one.cases.factors, other.cases.factors[: BLOCK - 3])
    _same(one.figures, other.figures.take((..., slice(BLOCK - 3))))
    again = monte_carlo(study, plant, designs["nf"], OF_AILERON, BLOCK + 5, 9, steps=False)
    np.testing.assert_array_equal(again.figures.damping_ratio, other.figures.damping_ratio)
    seed = monte_carlo(study, plant, designs["nf"], OF_AILERON, BLOCK + 5, 10, steps=False)
    assert not np.any(seed.figures.damping_ratio == other.figures.damping_ratio)


def test_one_point_is_what_it_is_in_the_grid(study, plant, designs):
    whole = corners(study, plant, designs["nf"], OF_AILERON)
    for h, q in [(0, 0), (1, 2)]:
        grid = replace(study.grid, altitude=study.grid.altitude[h : h + 1], speed=study.grid.speed[q : q + 1])
        alone = replace(study, grid=grid)
        here = analyse(alone)
        gains = {gain.name: gain.values[h : h + 1, q : q + 1] for gain in designs["nf"].gains}
        found = corners(alone, here, given(alone, here, NF, gains), OF_AILERON)
        _same(found.figures.take((0, 0)), whole.figures.take((h, q)))


def test_memory_stays_bounded(study, plant, designs, monkeypatch):
    sizes = []
    real = room.figures_of
    monkeypatch.setattr(room, "figures_of", lambda loop, flight: sizes.append(len(loop.A)) or real(loop, flight))
    monte_carlo(study, plant, designs["nf"], OF_AILERON, 1200, 1, steps=False)
    assert max(sizes) <= room.AT_ONCE
    assert sum(sizes) == 8 * 1200 + 8


def test_the_worst_case_can_be_flown_again(study, plant, designs):
    specs = (Spec("damping_ratio", "min", 0.1),)
    mc = monte_carlo(study, plant, designs["nf"], OF_ALL, 150, 1, specs)
    for quantity in ("damping_ratio", "largest_real_part", *STEPS):
        found = mc.distribution(quantity)
        values = getattr(mc.figures, quantity)
        for i in [(0, 0), (1, 3)]:
            again = perturbed_performance(
                study, plant, designs["nf"], Cases(mc.cases.parameters, found.worst_factors[i][None])
            )
            got = getattr(again.figures, quantity)[(*i, 0)]
            np.testing.assert_allclose(got, found.worst[i], rtol=1e-11)
            np.testing.assert_allclose(got, values[(*i, found.worst_case[i])], rtol=1e-11)
            if np.isfinite(values[i]).all():
                assert found.worst[i] == (values[i].min() if quantity == "damping_ratio" else values[i].max())


def test_nominal_is_the_design_as_it_was_judged(study, plant, designs):
    found = corners(study, plant, designs["lqr"], OF_AILERON)
    judged = designs["lqr"].assessment
    np.testing.assert_allclose(found.nominal.damping_ratio, judged.damping_ratio, rtol=1e-12)
    np.testing.assert_allclose(found.nominal.largest_real_part, judged.largest_real_part, rtol=1e-12)
    np.testing.assert_allclose(found.nominal.settling_time, judged.step.settling_time, rtol=1e-10)
    assert found.figures.damping_ratio.shape == (2, 4, 8)


def test_what_does_not_reach_a_tab_only_loop_has_no_influence(study, plant, designs):
    """The tab's own hinge moments and its inertia are its servo's business, but for the part of its body in I_at."""
    changes = [Uncertainty("C_Ht_da", 0.3), Uncertainty("C_Ht_dt", 0.3), Uncertainty("C_Ha_da", 0.3)]
    found = corners(study, plant, designs["nf"], changes)
    for quantity in ("damping_ratio", *STEPS):
        influence = found.influence(quantity)
        np.testing.assert_allclose(influence.slope[..., :2], 0.0, atol=1e-9)
        assert np.all(np.abs(influence.slope[..., 2]) > 1e-4)
        np.testing.assert_allclose(influence.standardised[..., 2] ** 2, influence.explained, rtol=1e-9)
    of_lqr = corners(study, plant, designs["lqr"], changes).influence("damping_ratio")
    assert np.all(np.abs(of_lqr.slope) > 1e-6)


def test_small_changes_have_the_slopes_of_the_nominal_plant(study, plant, designs):
    """Against central differences of studies made anew."""
    small = [replace(u, change=1e-3, deviation=None) for u in OF_AILERON]
    found = corners(study, plant, designs["nf"], small, steps=False).influence("largest_real_part")
    gains = {gain.name: gain.values for gain in designs["nf"].gains}
    for k, u in enumerate(small):
        ends = []
        for factor in (1.0 + 1e-3, 1.0 - 1e-3):
            fresh = _anew(study, {u.parameter: factor})
            loop = tab_loop(fresh.model, fresh.servo_tab, study.tab_actuator, NF, gains)
            ends.append(np.linalg.eigvals(loop.closed).real.max(axis=-1))
        np.testing.assert_allclose(found.slope[..., k], (ends[0] - ends[1]) / 2e-3, rtol=1e-3)
    np.testing.assert_allclose(found.explained, 1.0, atol=1e-3)


# Specs, points without a design, delays, limits.


def test_held_is_stable_and_within_the_specs(study, plant, designs):
    limit = np.linspace(0.05, 0.25, 8).reshape(2, 4)
    specs = (Spec("damping_ratio", "min", limit), Spec("overshoot", "max", 0.5), Spec("phase_margin", "min", 0.3))
    found = corners(study, plant, designs["nf"], OF_AILERON, specs, steps=False)
    f = found.figures
    wanted = f.stable & (f.damping_ratio >= limit[..., None]) & (f.overshoot <= 0.5) & (f.phase_margin >= 0.3)
    np.testing.assert_array_equal(found.held, wanted)
    assert 0.0 < wanted.mean() < 1.0
    np.testing.assert_array_equal(found.held_fraction, wanted.mean(axis=-1))
    np.testing.assert_array_equal(found.held_everywhere, wanted.all(axis=(0, 1)))


def test_points_without_a_design(study, plant, designs):
    ok = np.ones(plant.grid.shape, dtype=bool)
    ok[0, 1] = False
    found = corners(study, plant, given(study, plant, NF, ok=ok), OF_AILERON)
    whole = corners(study, plant, designs["nf"], OF_AILERON)
    assert np.isnan(found.stable_fraction[0, 1])
    assert np.isnan(found.figures.damping_ratio[0, 1]).all()
    assert np.isnan(found.nominal.damping_ratio[0, 1])
    distribution = found.distribution("damping_ratio")
    assert distribution.worst_case[0, 1] == -1
    assert np.isnan(distribution.worst_factors[0, 1]).all()
    assert np.isnan(found.influence("damping_ratio").slope[0, 1]).all()
    np.testing.assert_array_equal(found.figures.damping_ratio[ok], whole.figures.damping_ratio[ok])
    np.testing.assert_array_equal(found.stable_everywhere, whole.figures.stable[ok].all(axis=0))
    nowhere = corners(study, plant, given(study, plant, NF, ok=np.zeros((2, 4), dtype=bool)), OF_AILERON)
    assert not nowhere.stable_everywhere.any()
    assert np.isnan(nowhere.stable_fraction).all()
    assert nowhere.distribution("overshoot").worst_case.max() == -1


def test_unstable_cases_do_not_make_the_rest_look_good():
    growth = np.array([[-1.0, 3.0, 5.0, -2.0]])
    settling = np.array([[1.0, np.nan, np.nan, 2.0]])
    none = np.full((1, 4), np.nan)
    figures = FlownFigures(growth < 0, -growth / 10.0, growth, settling, settling, *[none] * 4)
    cases = Cases(("C_Ha_da",), np.array([[0.8], [0.9], [1.1], [1.2]]))
    flown = np.array([True])
    found = RobustPerformance(cases, (), flown, figures.take((slice(None), 0)), figures, growth < 0)
    assert found.stable_fraction == 0.5
    distribution = found.distribution("settling_time")
    assert np.isnan(distribution.worst[0])
    assert distribution.worst_case[0] == 2
    assert distribution.worst_factors[0] == 1.1
    assert (distribution.p05[0], distribution.p50[0]) == (1.0, 2.0)
    assert np.isnan(distribution.p95[0])


def test_delays_are_flown(study, plant):
    late = replace(study, tab_actuator=replace(study.tab_actuator, delay=0.003))
    designed = given(late, plant, NF)
    cases = Cases(("C_Ha_da", "C_Ha_dt"), np.array([[0.8, 1.2], [1.2, 0.9]]))
    found = perturbed_performance(late, plant, designed, cases, margins=True)
    for d in range(2):
        fresh = _anew(late, dict(zip(cases.parameters, cases.factors[d], strict=True)))
        for i in [(0, 1), (1, 3)]:
            gains = {gain.name: gain.values[i] for gain in designed.gains}
            loop = tab_loop(fresh.model.take(i), fresh.servo_tab.take(i), late.tab_actuator, NF, gains)
            wanted, got = assess(loop, np.array([study.reference.aileron]), 1.0), found.figures.take((*i, d))
            assert got.stable == (wanted.largest_real_part < 0.0)
            np.testing.assert_allclose(got.damping_ratio, wanted.damping_ratio, rtol=1e-8)
            np.testing.assert_allclose(got.largest_real_part, wanted.largest_real_part, rtol=1e-8)
            if got.stable:
                np.testing.assert_allclose(got.settling_time, wanted.step.settling_time, rtol=1e-8)
                np.testing.assert_allclose(got.delay_margin, wanted.margins[0].delay_margin, rtol=1e-8)


def test_unsteady_air_is_flown(study):
    aerodynamics = replace(study.aerodynamics, damping="unsteady", virtual_inertia=True)
    unsteady = replace(study, aerodynamics=aerodynamics)
    envelope = run(unsteady)
    designed, cases = envelope.controllers[0], drawn_cases(OF_ALL, 2, 5)
    found = perturbed_performance(unsteady, envelope.plant, designed, cases)
    names = cases.parameters
    for d in range(2):
        fresh = _anew(unsteady, dict(zip(names, cases.factors[d], strict=True)))
        loop = lqr_loop(fresh.model, designed.optimum)
        np.testing.assert_allclose(
            found.figures.largest_real_part[..., d], np.linalg.eigvals(loop.closed).real.max(axis=-1), rtol=1e-10
        )


def test_figures_that_are_not_wanted_are_not_there(study, plant, designs):
    found = corners(study, plant, designs["nf"], OF_AILERON, steps=False).figures
    assert np.isnan([getattr(found, name) for name in (*STEPS, *MARGIN_QUANTITIES)]).all()
    assert np.isfinite(found.damping_ratio).all()


def test_too_much_is_refused(study, plant, designs, monkeypatch):
    monkeypatch.setattr(room, "MOST_LOOPS", 63)
    with pytest.raises(ValueError, match="64 loops are too many"):
        corners(study, plant, designs["nf"], OF_AILERON)
    with pytest.raises(ValueError, match="specs on noise_gain are not judged"):
        corners(study, plant, designs["nf"], OF_AILERON, (Spec("noise_gain", "max", 1.0),))
    with pytest.raises(ValueError, match="twice"):
        monte_carlo(study, plant, designs["nf"], [OF_AILERON[0]] * 2, 10, 1)


@pytest.mark.parametrize(("met", "draws"), [(0, 10), (3, 10), (10, 10), (1, 1), (997, 1000), (1000, 1000)])
def test_least_fraction_is_clopper_and_pearsons(met, draws):
    exact = binomtest(met, draws, alternative="greater").proportion_ci(0.95, method="exact").low
    assert least_fraction(np.array(met / draws), draws) == pytest.approx(exact, rel=1e-9, abs=1e-15)
    if met == draws:
        assert least_fraction(np.array(1.0), draws, 0.99) == pytest.approx(0.01 ** (1.0 / draws), rel=1e-12)


def test_least_fraction_of_nothing():
    found = least_fraction(np.array([np.nan, 0.5]), 10)
    assert np.isnan(found[0])
    assert 0.2 < found[1] < 0.5
    for wrong in ((0, 0.95), (10, 1.0), (10, 0.0)):
        with pytest.raises(ValueError, match="confidence"):
            least_fraction(np.array([0.5]), *wrong)
