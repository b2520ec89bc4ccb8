"""Designs flown at every other point, against loops taken one by one and against polynomials put together by hand."""

from dataclasses import replace

import numpy as np
import pytest

import schedules.flown_figures as room
from design.assess import assess
from design.classical.tab_loop import tab_loop
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.weights import BrysonWeights
from design.outcome import Outcomes
from design.specs import Spec
from model.actuators import Actuator
from model.servo_tab import servo_tab
from schedules.analysis import analyse
from schedules.carried_loop import carried_loop
from schedules.cross_flight import CrossFlight, cross_flight
from schedules.flown_figures import MARGIN_QUANTITIES, FlownFigures
from schedules.perturbations import perturbed_model
from schedules.run import run
from schedules.scaling_laws import scaling_law
from schedules.study import GridRequest
from tests.schedules.flown_cases import NF, NF_RATE, PF, given


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
def lqr(envelope):
    return envelope.controllers[0]


def _characteristic(plant, actuator, request, gains, i, j):
    """Characteristic polynomial of the gains of point i around the servo tab of point j."""
    P, Q = plant.servo_tab.numerator[j], plant.servo_tab.denominator[j]
    k = {name: float(values[i]) for name, values in gains.items()}
    if request.kind == "negative_feedback":
        f = request.rate_filter
        # (K_i + K_p s) / s + K_d f s / (s + f), over s (s + f)
        top, bottom = np.polyadd(np.polymul([k["K_p"], k["K_i"]], [1.0, f]), [k["K_d"] * f, 0.0, 0.0]), [1.0, f, 0.0]
    else:
        top, bottom = np.array([-k["K_f"], k["K_i"]]), [1.0, 0.0]
    if request.tab_command == "rate":
        w = actuator.rate_loop_bandwidth
        # w K_theta / (s^2 + w s + w K_theta) from the commanded deflection to the tab
        drive, lag = w * k["K_theta"], [1.0, w, w * k["K_theta"]]
    else:
        w, z = actuator.servo_bandwidth, actuator.servo_damping_ratio
        drive, lag = w**2, [1.0, 2.0 * z * w, w**2]
    return np.polysub(np.polymul(np.polymul(Q, lag), bottom), drive * np.polymul(P, top))


@pytest.mark.parametrize("request_", [NF, NF_RATE, PF], ids=["nf", "nf_rate", "pf"])
def test_classical_poles_are_roots_of_a_polynomial(study, plant, request_):
    designed = given(study, plant, request_)
    gains = {gain.name: gain.values for gain in designed.gains}
    found = cross_flight(study, plant, designed, steps=False)
    for i in np.ndindex(plant.grid.shape):
        for j in np.ndindex(plant.grid.shape):
            roots = np.roots(_characteristic(plant, study.tab_actuator, request_, gains, i, j))
            assert found.figures.largest_real_part[i + j] == pytest.approx(roots.real.max(), rel=1e-7)
            damping = (-roots.real / np.abs(roots)).min()
            assert found.figures.damping_ratio[i + j] == pytest.approx(damping, rel=1e-7)
            assert found.figures.stable[i + j] == (roots.real.max() < 0.0)


@pytest.mark.parametrize("kind", ["nf", "lqr"])
def test_against_the_assessment_of_each_pair_alone(study, plant, lqr, kind):
    designed = lqr if kind == "lqr" else given(study, plant, NF)
    found = cross_flight(study, plant, designed, margins=True)
    step = np.array([study.reference.aileron])
    for i in [(0, 0), (0, 3), (1, 1)]:
        for j in [(0, 0), (1, 3), (0, 2)]:
            model = plant.model.take(j)
            if kind == "lqr":
                loop = lqr_loop(model, replace(lqr.optimum.take(i), outcomes=Outcomes.all_ok(())))
            else:
                gains = {gain.name: gain.values[i] for gain in designed.gains}
                loop = tab_loop(model, plant.servo_tab.take(j), study.tab_actuator, NF, gains)
            wanted, got = assess(loop, step, 1.0), found.figures.take(i + j)
            assert got.stable
            np.testing.assert_allclose(got.damping_ratio, wanted.damping_ratio, rtol=1e-12)
            np.testing.assert_allclose(got.largest_real_part, wanted.largest_real_part, rtol=1e-12)
            np.testing.assert_allclose(got.settling_time, wanted.step.settling_time, rtol=1e-11)
            np.testing.assert_allclose(got.overshoot, wanted.step.overshoot, rtol=1e-11, atol=1e-13)
            cuts = wanted.margins
            gain = min(min(m.gain_margin_up_db, -m.gain_margin_down_db) for m in cuts)
            np.testing.assert_allclose(got.gain_margin, gain, rtol=1e-9)
            for name in MARGIN_QUANTITIES[1:]:
                np.testing.assert_allclose(getattr(got, name), min(getattr(m, name) for m in cuts), rtol=1e-9)


def test_at_home_every_design_is_as_it_was_judged(study, plant, lqr):
    found = cross_flight(study, plant, lqr, margins=True)
    for i in np.ndindex(plant.grid.shape):
        home = found.figures.take(i + i)
        np.testing.assert_allclose(home.damping_ratio, lqr.assessment.damping_ratio[i], rtol=1e-12)
        np.testing.assert_allclose(home.settling_time, lqr.assessment.step.settling_time[i], rtol=1e-10)
        np.testing.assert_allclose(home.overshoot, lqr.assessment.step.overshoot[i], rtol=1e-10, atol=1e-13)
        np.testing.assert_allclose(home.disk_margin, min(m.disk_margin[i] for m in lqr.assessment.margins), rtol=1e-10)


@pytest.mark.parametrize("reference", ["aileron", "aileron_and_tab", "none"])
def test_state_feedback_flies_with_its_lags_delays_and_references(study, plant, lqr, reference):
    actuators = Actuator(torque_loop_bandwidth=300.0, delay=0.002), Actuator(torque_loop_bandwidth=200.0)
    bryson = BrysonWeights(0.03, 3.5, 0.17, 7.0, 0.0017, 0.5, 2.0, tab_integral=0.01)
    request = replace(lqr.request, weights=bryson, reference=reference, delay_states=1)
    found = design_lqr(plant.model, request, plant.outcomes, *actuators)
    loop = lqr_loop(plant.model, found)
    designed = replace(lqr, request=request, outcomes=found.outcomes, loop=loop, optimum=found, gains=())
    assert found.outcomes.ok.all()
    got = cross_flight(study, plant, designed).figures
    step = np.array([study.reference.aileron, 0.0])[: len(loop.references)]
    for i, j in [((0, 0), (0, 0)), ((1, 2), (0, 3))]:
        carried = replace(found.take(i), outcomes=Outcomes.all_ok(()))
        alone = lqr_loop(plant.model.take(j), carried)
        assert alone.delay == (0.002, 0.0)
        wanted = assess(alone, step, 1.0)
        np.testing.assert_allclose(got.largest_real_part[i + j], wanted.largest_real_part, rtol=1e-9)
        np.testing.assert_allclose(got.damping_ratio[i + j], wanted.damping_ratio, rtol=1e-9)
        assert got.stable[i + j] == (wanted.largest_real_part < 0.0)
        np.testing.assert_allclose(got.settling_time[i + j], wanted.step.settling_time, rtol=1e-8)
        assert np.isnan(got.overshoot[i + j]) == (reference == "none")


def test_delays_are_flown(study, plant):
    late = replace(study, tab_actuator=replace(study.tab_actuator, delay=0.004))
    designed = given(late, plant, NF)
    found = cross_flight(late, plant, designed, margins=True)
    assert 0 < found.figures.stable.sum() < found.figures.stable.size
    for i, j in [((0, 0), (1, 1)), ((1, 2), (0, 3)), ((0, 3), (0, 0))]:
        gains = {gain.name: gain.values[i] for gain in designed.gains}
        loop = tab_loop(plant.model.take(j), plant.servo_tab.take(j), late.tab_actuator, NF, gains)
        wanted, got = assess(loop, np.array([study.reference.aileron]), 1.0), found.figures.take(i + j)
        np.testing.assert_allclose(got.damping_ratio, wanted.damping_ratio, rtol=1e-9)
        np.testing.assert_allclose(got.largest_real_part, wanted.largest_real_part, rtol=1e-9)
        assert got.stable == (wanted.largest_real_part < 0.0)
        if got.stable:
            np.testing.assert_allclose(got.settling_time, wanted.step.settling_time, rtol=1e-8)
            np.testing.assert_allclose(got.overshoot, wanted.step.overshoot, rtol=1e-8, atol=1e-12)
            np.testing.assert_allclose(got.delay_margin, wanted.margins[0].delay_margin, rtol=1e-8)
        else:
            assert np.isnan([got.settling_time, got.overshoot, got.gain_margin]).all()
    on_time = cross_flight(study, plant, given(study, plant, NF))
    assert np.nanmax(np.abs(on_time.figures.damping_ratio - found.figures.damping_ratio)) > 0.01


def test_a_point_without_a_design_carries_none_but_others_fly_there(study, plant):
    ok = np.ones(plant.grid.shape, dtype=bool)
    ok[0, 1] = ok[1, 2] = False
    found, whole = (cross_flight(study, plant, given(study, plant, NF, ok=m)) for m in (ok, None))
    np.testing.assert_array_equal(found.flown, np.broadcast_to(ok[..., None, None], (2, 4, 2, 4)))
    for name in vars(found.figures):
        got, wanted = (getattr(f.figures, name) for f in (found, whole))
        np.testing.assert_allclose(got[ok], wanted[ok], rtol=1e-12, atol=1e-13)
        assert not np.any(got[~ok]) if name == "stable" else np.isnan(got[~ok]).all()
    assert found.points_flown.tolist() == [[8, 0, 8, 8], [8, 8, 0, 8]]
    assert np.isnan(found.worst_damping_ratio[0, 1])
    assert found.best not in (1, 6)


def test_nothing_flies_outside_the_model(study):
    outside = replace(study, grid=GridRequest((0.0, 3000.0), "dynamic_pressure", (245.0, 980.0, 80000.0)))
    envelope = run(outside)
    assert envelope.controllers[0].outcomes.ok.tolist() == [[True, True, False]] * 2
    inside = replace(outside, grid=GridRequest((0.0, 3000.0), "dynamic_pressure", (245.0, 980.0)))
    for designed in (envelope.controllers[0], given(outside, envelope.plant, NF)):
        found = cross_flight(outside, envelope.plant, designed)
        plant = analyse(inside)
        alone = run(inside).controllers[0]
        if designed.request is NF:
            gains = {gain.name: gain.values[:, :2] for gain in designed.gains}
            alone = given(inside, plant, NF, gains)
        wanted = cross_flight(inside, plant, alone)
        np.testing.assert_array_equal(found.flown, np.outer(*[designed.outcomes.ok.ravel()] * 2).reshape(2, 3, 2, 3))
        for name in vars(found.figures):
            got = getattr(found.figures, name)[:, :2][..., :2]
            np.testing.assert_allclose(got, getattr(wanted.figures, name), rtol=1e-9, atol=1e-12)
        assert np.isnan(found.figures.damping_ratio[:, 2]).all()
        assert np.isnan(found.figures.damping_ratio[..., 2]).all()


def test_no_design_at_all(study, plant):
    found = cross_flight(study, plant, given(study, plant, NF, ok=np.zeros((2, 4), dtype=bool)))
    assert found.best is None
    assert found.worst_pair is None
    assert not found.held.any()
    assert np.isnan(found.figures.largest_real_part).all()


def test_a_plant_that_is_not_finite_does_not_break_the_others(study, plant):
    A = plant.model.A.copy()
    stiffness = plant.model.stiffness.copy()
    A[1, 1] = stiffness[1, 1] = np.nan
    broken = replace(plant, model=replace(plant.model, A=A, stiffness=stiffness))
    designed = given(study, plant, NF)
    found, whole = cross_flight(study, broken, designed), cross_flight(study, plant, designed)
    assert np.isnan(found.figures.damping_ratio[..., 1, 1]).all()
    assert not found.figures.stable[..., 1, 1].any()
    rest = np.ones((2, 4), dtype=bool)
    rest[1, 1] = False
    np.testing.assert_array_equal(found.figures.damping_ratio[..., rest], whole.figures.damping_ratio[..., rest])


def test_a_loop_that_cannot_be_judged_is_left_out_alone(study, plant, monkeypatch):
    designed = given(study, plant, NF)
    whole = cross_flight(study, plant, designed)
    real, bad = room.poles, whole.figures.largest_real_part[0, 2, 1, 3]

    def gives_up(A):
        found = real(A)
        if np.any(found.real.max(axis=-1) == bad):
            raise np.linalg.LinAlgError("Eigenvalues did not converge")
        return found

    monkeypatch.setattr(room, "poles", gives_up)
    found = cross_flight(study, plant, designed)
    rest = np.ones(found.flown.shape, dtype=bool)
    rest[0, 2, 1, 3] = False
    assert np.isnan(found.figures.largest_real_part[~rest]).all()
    assert not found.figures.stable[0, 2, 1, 3]
    assert found.worst_pair == (2, 7)
    for name in vars(whole.figures):
        got, wanted = (getattr(f.figures, name)[rest] for f in (found, whole))
        np.testing.assert_allclose(got, wanted, rtol=1e-12, atol=1e-13)


def test_the_sign_of_the_law_is_that_of_the_design(study, plant):
    """A tab that works the other way is met with the sign of the design: the loop of the opposite gains."""
    designed, points = given(study, plant, NF), np.arange(8)
    turned = perturbed_model(plant, points, ("C_Ha_dt",), np.full((8, 1), -1.0))
    servo = servo_tab(turned)
    assert np.all(servo.dc_gain > 0.0)
    loop = carried_loop(study, plant, designed, turned, points)
    opposite = {gain.name: -gain.values.ravel() for gain in designed.gains}
    np.testing.assert_array_equal(loop.closed, tab_loop(turned, servo, study.tab_actuator, NF, opposite).closed)
    assert np.all(np.linalg.eigvals(loop.closed).real.max(axis=-1) > 0.0)


def test_scaling_laws_can_be_flown_too(study, plant, lqr):
    flown = scaling_law(study, plant, lqr).flown
    assert flown.optimum is None
    found = cross_flight(study, plant, flown, steps=False)
    for i in [(0, 0), (1, 3)]:
        np.testing.assert_allclose(found.figures.damping_ratio[i + i], flown.assessment.damping_ratio[i], rtol=1e-12)


def test_points_are_held_where_stable_and_within_the_specs_of_the_flown_point(study, plant):
    designed = given(study, plant, NF)
    limit = np.linspace(0.05, 0.3, 8).reshape(2, 4)
    specs = (Spec("damping_ratio", "min", limit), Spec("settling_time", "max", 0.8), Spec("gain_margin", "min", 6.0))
    found = cross_flight(study, plant, designed, specs, steps=False)
    f = found.figures
    assert np.isfinite(f.gain_margin).any()
    wanted = f.stable & (f.damping_ratio >= limit) & (f.settling_time <= 0.8) & (f.gain_margin >= 6.0)
    np.testing.assert_array_equal(found.held, wanted)
    assert 0 < found.held.sum() < found.held.size
    for i in np.ndindex(2, 4):
        assert found.points_held[i] == wanted[i].sum()
        assert found.worst_damping_ratio[i] == f.damping_ratio[i].min()
    score = [(found.points_held[i], found.worst_damping_ratio[i]) for i in np.ndindex(2, 4)]
    assert score[found.best] == max(score)
    i, j = (np.unravel_index(k, (2, 4)) for k in found.worst_pair)
    assert f.damping_ratio[i + j] == f.damping_ratio.min()


def _table(damping, growth=None, flown=None, held=None):
    damping = np.asarray(damping, dtype=float)
    growth = -damping if growth is None else np.asarray(growth, dtype=float)
    none = np.full(damping.shape, np.nan)
    flown = np.ones(damping.shape, dtype=bool) if flown is None else np.asarray(flown)
    figures = FlownFigures(growth < 0, damping, growth, *[none] * 6)
    return CrossFlight(figures, flown, (growth < 0) & flown if held is None else np.asarray(held), (), 1)


def test_the_best_design_and_the_worst_pair():
    assert _table([[0.5, -0.1], [0.2, 0.1]]).best == 1
    assert _table([[0.5, 0.2], [0.9, 0.1]]).best == 0
    assert _table([[0.5, 0.1], [0.9, 0.2]]).best == 1
    assert _table([[0.5, 0.2], [0.9, 0.2]]).best == 0
    assert _table([[0.5, -0.1], [0.2, 0.1]]).worst_pair == (0, 1)
    # All unstable real poles have a damping ratio of -1: the faster one is worse.
    assert _table([[-1.0, 0.5], [-1.0, -1.0]], [[1.0, -1.0], [2.0, 5.0]]).worst_pair == (1, 1)
    # What a delay leaves unproved is worst, and what is not flown has no part in it.
    unproved = _table([[0.5, np.nan], [np.nan, 0.4]], [[-1, np.nan], [np.nan, -1]], [[True, True], [False, True]])
    assert unproved.worst_pair == (0, 1)
    assert np.isnan(unproved.worst_damping_ratio[0])
    assert unproved.worst_damping_ratio[1] == 0.4
    # Held points come first, damping second; a design that holds none is still better than none at all.
    assert _table([[0.9, 0.9], [0.2, 0.2]], held=[[True, False], [True, True]]).best == 1
    assert _table([[np.nan] * 2, [-0.5] * 2], flown=[[False] * 2, [True] * 2]).best == 1


def test_designs_can_be_taken(study, plant):
    found = cross_flight(study, plant, given(study, plant, NF))
    row = found.take(1)
    assert row.points_held.tolist() == found.points_held[1].tolist()
    one = found.take((1, 2))
    assert one.points_held == found.points_held[1, 2]
    assert one.worst_damping_ratio == found.worst_damping_ratio[1, 2]


def test_parts_do_not_matter(study, plant, lqr, monkeypatch):
    for designed in (given(study, plant, NF), lqr):
        whole = cross_flight(study, plant, designed, margins=True)
        monkeypatch.setattr(room, "AT_ONCE", 5)
        parts = cross_flight(study, plant, designed, margins=True)
        monkeypatch.undo()
        for name in ("stable", "damping_ratio", "largest_real_part"):
            np.testing.assert_array_equal(getattr(parts.figures, name), getattr(whole.figures, name))
        for name in ("settling_time", "overshoot", *MARGIN_QUANTITIES):
            np.testing.assert_allclose(
                getattr(parts.figures, name), getattr(whole.figures, name), rtol=1e-12, atol=1e-13
            )


def test_too_many_pairs_are_refused(study, plant, monkeypatch):
    designed = given(study, plant, NF)
    monkeypatch.setattr(room, "MOST_LOOPS", 63)
    with pytest.raises(ValueError, match="64 loops are too many"):
        cross_flight(study, plant, designed)
    monkeypatch.undo()
    monkeypatch.setattr(room, "MOST_DELAYED_LOOPS", 63)
    cross_flight(study, plant, designed, steps=False)
    late = replace(study, tab_actuator=replace(study.tab_actuator, delay=0.004))
    with pytest.raises(ValueError, match="64 loops are too many"):
        cross_flight(late, plant, given(late, plant, NF), steps=False)


def test_specs_that_cannot_be_judged_are_refused(study, plant, lqr):
    with pytest.raises(ValueError, match="specs on bandwidth, tab_rate are not judged"):
        cross_flight(study, plant, lqr, (Spec("tab_rate", "max", 1.0), Spec("bandwidth", "min", 1.0)))
