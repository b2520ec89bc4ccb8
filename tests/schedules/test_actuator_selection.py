"""Actuators selected for a design: requirement, candidates and the rotor fed back, by routes of their own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from design.actuator_sizing.load_cases import GUST_SPEED
from design.actuator_sizing.outer_samples import octant, outer_samples
from design.actuator_sizing.selection import Candidate, RatioRange, headroom
from design.classical.controller import ClassicalController
from design.lqr.controller import LqrController
from design.lqr.weights import BrysonWeights
from design.manoeuvre import doublet, sine, step
from design.outcome import Outcome
from design.response.manoeuvre_response import manoeuvre_response
from design.sampling import Sampling
from design.specs import Spec
from model.actuators import Actuator
from model.aerodynamics import Aerodynamics
from model.examples import WIND_TUNNEL_TRIM, wind_tunnel
from model.linearise import linearise
from model.section import Body, Inertia
from schedules.actuator_selection import FedBack, most_designs, select_actuator
from schedules.analysis import analyse
from schedules.rotor_inertia import model_with_rotor, plant_with_rotor
from schedules.run import design, run
from schedules.study import GridRequest, Reference, Study
from schedules.surface_requirement import GroundGust, LoadCases, Sized, actuator_requirement

WEIGHTS = BrysonWeights(
    aileron=0.035, aileron_rate=3.5, tab=0.17, tab_rate=7.0, aileron_integral=0.0017, tab_torque=0.5, aileron_torque=2.0
)
NF = ClassicalController("nf", "negative_feedback", (Spec("damping_ratio", "min", 0.5),), rate_filter=600.0)
LQR = LqrController("lqr", WEIGHTS)
RANGE = Candidate("range", 0.15, 520.0, 0.05, 80.0, 1e-6, RatioRange(1.0, 60.0), 0.9)
SOME = replace(RANGE, name="some", gear_ratio=(5.0, 20.0, 35.0))
LOADS = LoadCases()
STEP = step(np.array([np.deg2rad(10.0)]))


def study_of(**changes):
    system = wind_tunnel()
    plain = Study(
        name="sizing", geometry=system.geometry, inertia=system.inertia, aerodynamics=system.aerodynamics,
        trim=WIND_TUNNEL_TRIM, grid=GridRequest((0.0, 3000.0), "dynamic_pressure", (245.0, 980.0)),
        tab_actuator=Actuator(servo_bandwidth=250.0, servo_damping_ratio=0.7), aileron_actuator=Actuator(),
        reference=Reference(np.deg2rad(10.0), 1.0), controllers=(NF, LQR),
    )  # fmt: skip
    return replace(plain, **changes)


@pytest.fixture(scope="module")
def envelope():
    return run(study_of())


def of(envelope, name, actuator="tab", manoeuvre=STEP, loads=LOADS):
    return envelope.study, envelope.plant, envelope.controller(name), Sized(actuator, manoeuvre, 1.0, loads)


@pytest.mark.parametrize(("name", "actuator"), [("nf", "tab"), ("lqr", "tab"), ("lqr", "aileron")])
def test_the_requirement_of_the_step_is_that_of_the_design(envelope, name, actuator):
    _, plant, designed, sized = of(envelope, name, actuator)
    found = actuator_requirement(plant, designed, sized)
    known = designed.assessment.demand[designed.assessment.actuators.index(actuator)]
    for field in ("peak_torque", "rms_torque", "holding_torque", "peak_rate", "peak_power", "peak_acceleration"):
        np.testing.assert_allclose(getattr(found.demand, field), getattr(known, field), rtol=1e-7)
    np.testing.assert_array_equal(found.surface.peak_torque, found.demand.peak_torque)


@pytest.mark.parametrize("actuator", ["tab", "aileron"])
def test_the_hinge_moment_is_that_of_the_air(envelope, actuator):
    """Peak of the air's torque on the linear model, along a dense response of the state itself."""
    _, plant, designed, sized = of(envelope, "lqr", actuator)
    found = actuator_requirement(plant, designed, sized)
    response = manoeuvre_response(designed.loop, STEP, 1.0, 20001)
    i = ["tab", "aileron"].index(actuator)
    air = response.states[..., :4] @ plant.model.air_torque[..., i, :, None]
    trim = plant.model.input_offset[..., i, None]
    dense = np.abs(air[..., 0] - trim).max(axis=-1)
    np.testing.assert_allclose(found.peak_hinge_moment, dense, rtol=1e-5)
    assert np.all(found.peak_hinge_moment >= dense * (1.0 - 1e-9))


def test_the_load_cases_by_hand(envelope):
    _, plant, designed, sized = of(envelope, "lqr", "aileron", loads=LoadCases(1.5, GroundGust(0.5)))
    found = actuator_requirement(plant, designed, sized)
    assert found.cases == ("holding", "peak_hinge_moment", "ground_gust")
    held, peak, gust = np.moveaxis(found.surface.static_torque, -1, 0)
    np.testing.assert_allclose(held, 1.5 * found.demand.holding_torque)
    np.testing.assert_allclose(peak, 1.5 * found.peak_hinge_moment)
    chord = 0.28 * 0.6
    np.testing.assert_allclose(gust, 0.5 * 0.5 * 1.225 * GUST_SPEED**2 * chord * chord * 0.8, rtol=1e-12)
    tab = actuator_requirement(plant, designed, replace(sized, actuator="tab"))
    np.testing.assert_allclose(tab.surface.static_torque[..., 2] / gust, (0.04 / 0.28) ** 2, rtol=1e-12)
    none = actuator_requirement(plant, designed, replace(sized, loads=LoadCases(None, None)))
    assert (none.cases, none.surface.static_torque.shape) == ((), (2, 2, 0))


def test_nothing_is_held_after_a_manoeuvre_that_goes_on(envelope):
    study, plant, designed, sized = of(envelope, "lqr", "tab", sine(np.array([0.05]), 12.0))
    found = actuator_requirement(plant, designed, sized)
    assert np.all(np.isnan(found.demand.holding_torque))
    assert np.all(found.surface.static_torque[..., 0] == 0.0)
    (choice,) = select_actuator(study, plant, designed, sized, [RANGE]).choices
    assert np.isfinite(choice.least)


def test_the_outer_samples_ask_for_what_the_whole_response_asks_for(envelope):
    """Of parts |a T + b w'| + c |w|, driving and braking, against 20001 samples: hardly less, and in all never more.

    The samples miss some of driving, or of braking, where one becomes the other between two of them.
    """
    rng = np.random.default_rng(3)
    for manoeuvre in (STEP, doublet(np.array([0.1]), 0.2)):
        _, plant, designed, sized = of(envelope, "lqr", "tab", manoeuvre)
        surface = actuator_requirement(plant, designed, sized).surface
        response = manoeuvre_response(designed.loop, manoeuvre, 1.0, 20001)
        torque, rate = (response.outputs[..., response.index(name)] for name in ("T_t", "dt_rate"))
        bend = _bend(response)
        scale = [np.abs(x).max(axis=-1)[..., None] for x in (torque, rate, bend)]
        for a, b, c in rng.uniform(0.0, 1.0, (40, 3)):
            for braking in (False, True):
                whole = _asked(torque, rate, bend, scale, (a, b, c), braking)
                outer = _asked(surface.torque, surface.rate, surface.acceleration, scale, (a, b, c), braking)
                assert np.all(outer >= whole * (1.0 - 3e-3))
            whole = _asked(torque, rate, bend, scale, (a, b, c))
            outer = _asked(surface.torque, surface.rate, surface.acceleration, scale, (a, b, c))
            assert np.all(outer <= whole * (1.0 + 1e-4))


def _bend(response):
    """Acceleration of the tab at the samples of a manoeuvre without slopes and sines."""
    n = response.states.shape[-1]
    row = (response.rows[..., response.index("dt_rate"), :][..., None, :] @ response.generator)[..., 0, :]
    bend = np.einsum("...tn,...n->...t", response.states, row[..., :n])
    return bend + response.references[..., 0] * row[..., n, None]


def _asked(torque, rate, bend, scale, weights, braking=None):
    a, b, c = weights
    parts = np.abs(a * torque / scale[0] + b * bend / scale[2]) + c * np.abs(rate) / scale[1]
    if braking is None:
        return np.max(parts, axis=-1)
    # Power that is rounding is neither: it counts where samples stand for the response, and nowhere else.
    power = (-1.0 if braking else 1.0) * torque * rate
    least = 1e-9 * scale[0] * scale[1] * (-1.0 if torque.shape[-1] < 1000 else 1.0)
    return np.max(np.where(power > least, parts, 0.0), axis=-1)


def test_outer_samples_of_points_together_are_those_of_each(envelope):
    loop = envelope.controller("lqr").loop
    scale = np.ones((2, 2, 3))
    together = outer_samples(manoeuvre_response(loop, STEP, 1.0, 2), "tab", scale)
    for index in np.ndindex(2, 2):
        alone = outer_samples(manoeuvre_response(loop.take(index), STEP, 1.0, 2), "tab", scale[index])
        for field in ("torque", "rate", "acceleration"):
            np.testing.assert_allclose(
                np.sort(getattr(alone, field)), np.sort(getattr(together, field)[index]), rtol=1e-6, atol=1e-9
            )
    assert np.all(octant(5) >= 0.0)
    np.testing.assert_allclose(np.linalg.norm(octant(5), axis=-1), 1.0)
    assert len(octant(5)) == 21


@pytest.mark.parametrize("damping", ["thesis", "unsteady"])
def test_a_rotor_on_the_aileron_is_a_heavier_aileron(damping):
    system = wind_tunnel()
    study = study_of(aerodynamics=replace(system.aerodynamics, damping=damping))
    plant = analyse(study)
    heavier = replace(system.inertia.aileron, inertia=system.inertia.aileron.inertia + 3e-3)
    other = analyse(replace(study, inertia=Inertia(heavier, system.inertia.tab)))
    found = plant_with_rotor(plant, "aileron", 3e-3)
    for field in ("A", "B", "inertia", "input_offset"):
        np.testing.assert_allclose(getattr(found.model, field), getattr(other.model, field), rtol=1e-10, atol=1e-12)
    for field in ("F", "G", "dc_gain"):
        np.testing.assert_allclose(getattr(found.servo_tab, field), getattr(other.servo_tab, field), rtol=1e-10)


def test_a_rotor_on_the_tab_is_no_heavier_tab():
    """Only ``J_tt`` grows: a body of the tab that has it all, by its mass moment ahead of its hinge, is the same."""
    system = wind_tunnel()
    plant = analyse(study_of())
    rotor, tab, aileron = 5e-5, system.inertia.tab, system.inertia.aileron
    ahead = tab.cg_offset - rotor / (tab.mass * system.geometry.hinge_distance)
    own = tab.inertia + tab.mass * (tab.cg_offset**2 - ahead**2) + rotor
    lever = system.geometry.hinge_distance
    moved = tab.mass * ((lever + tab.cg_offset) ** 2 - (lever + ahead) ** 2) + tab.inertia - own
    body = Inertia(replace(aileron, inertia=aileron.inertia + moved), Body(tab.mass, ahead, own))
    same = linearise(replace(system, inertia=body), plant.grid.condition, plant.trim)
    found = model_with_rotor(plant.model, "tab", rotor)
    np.testing.assert_allclose(found.inertia, same.inertia, rtol=1e-10)
    np.testing.assert_allclose(found.A, same.A, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.inertia[..., 0, 0] - plant.model.inertia[..., 0, 0], rotor)
    np.testing.assert_array_equal(found.inertia[..., 1, :], plant.model.inertia[..., 1, :])


def test_the_rotor_takes_its_torque_off_the_requirement(envelope):
    """The torque at the surface is ``T - J d''`` of the loop that carries the rotor."""
    study, plant, designed, sized = of(envelope, "lqr", "tab")
    rotor = 4e-4
    changed = plant_with_rotor(plant, "tab", rotor)
    again = design(study, changed, designed.request)
    found = actuator_requirement(changed, again, sized, rotor)
    response = manoeuvre_response(again.loop, STEP, 1.0, 20001)
    torque = response.outputs[..., response.index("T_t")] - rotor * _bend(response)
    np.testing.assert_allclose(found.demand.peak_torque, np.abs(torque).max(axis=-1), rtol=1e-4)
    # The moment of the air is none of the rotor's.
    air = np.einsum("...tn,...n->...t", response.states[..., :4], plant.model.air_torque[..., 0, :])
    dense = np.abs(air - plant.model.input_offset[..., 0, None]).max(axis=-1)
    np.testing.assert_allclose(found.peak_hinge_moment, dense, rtol=1e-5)


def _on_its_own_design(study, plant, designed, sized, candidate, ratio):
    """Least headroom at a ratio, judged anew from a study with the rotor on the surface."""
    rotor = candidate.inertia * ratio**2
    changed = plant_with_rotor(plant, sized.actuator, rotor)
    needed = actuator_requirement(changed, design(study, changed, designed.request), sized, rotor)
    return float(np.min(headroom(candidate, ratio, needed.surface).least))


def test_of_some_ratios_the_best_on_its_own_design_is_taken(envelope):
    args = of(envelope, "lqr")
    (choice,) = select_actuator(*args, [SOME], feed_back=True).choices
    by_hand = {ratio: _on_its_own_design(*args, SOME, ratio) for ratio in SOME.ratios}
    best = max(by_hand, key=by_hand.get)
    found = choice.fed_back
    assert (found.fit.ratio, found.designs, found.converged, found.lost) == (best, 3, True, ())
    assert found.fit.least == pytest.approx(by_hand[best], rel=1e-9)
    # It is not the ratio that is best for the design without a rotor.
    assert choice.fit.ratio != best
    assert found.fit.least > by_hand[choice.fit.ratio] + 0.02


def test_of_a_range_the_best_is_that_of_brute_force(envelope):
    args = of(envelope, "lqr")
    (choice,) = select_actuator(*args, [RANGE], feed_back=True).choices
    found = choice.fed_back
    coarse = np.geomspace(1.0, 60.0, 24)
    values = [_on_its_own_design(*args, RANGE, ratio) for ratio in coarse]
    k = int(np.argmax(values))
    near = minimize_scalar(
        lambda x: -_on_its_own_design(*args, RANGE, np.exp(x)),
        bounds=np.log(coarse[[max(k - 1, 0), min(k + 1, 23)]]), method="bounded", options={"xatol": 1e-4},
    )  # fmt: skip
    assert found.converged
    assert found.designs <= most_designs(RANGE)
    assert found.fit.least >= -near.fun - 2e-3
    assert found.rotor_inertia == RANGE.inertia * found.fit.ratio**2
    judged_anew = headroom(RANGE, found.fit.ratio, found.required.surface)
    np.testing.assert_array_equal(judged_anew.least, found.fit.headroom.least)


def test_the_tab_of_a_tab_only_controller_flies_the_same_with_a_rotor(envelope):
    study, plant, designed, sized = of(envelope, "nf")
    changed = plant_with_rotor(plant, "tab", 1e-3)
    again = design(study, changed, designed.request)
    for one, other in zip(designed.gains, again.gains, strict=True):
        np.testing.assert_allclose(one.values, other.values, rtol=1e-9)
    (choice,) = select_actuator(study, plant, designed, sized, [RANGE], feed_back=True).choices
    assert choice.fed_back.designs == 0
    assert choice.fed_back.fit is choice.fit
    assert most_designs(replace(RANGE, inertia=0.0)) == 0


def test_a_rotor_that_costs_points_their_design_is_not_enough(envelope, monkeypatch):
    args = of(envelope, "lqr")
    import schedules.actuator_selection as module

    real = module.design

    def without_the_first(study, plant, request):
        found = real(study, plant, request)
        first = np.zeros((2, 2), dtype=bool)
        first[0, 0] = True
        return replace(found, outcomes=found.outcomes.failing(first, Outcome.INFEASIBLE, lambda _: "lost"))

    monkeypatch.setattr(module, "design", without_the_first)
    strong = Candidate("strong", 1e3, 1e5, inertia=1e-9)
    (choice,) = select_actuator(*args, [strong], feed_back=True).choices
    assert choice.fit.enough
    assert choice.fed_back.lost == (0,)
    assert choice.fed_back.fit.enough
    assert not choice.enough
    assert np.isnan(choice.fed_back.fit.headroom.least[0, 0])

    def nowhere(study, plant, request):
        found = real(study, plant, request)
        return replace(found, outcomes=found.outcomes.failing(found.outcomes.ok, Outcome.INFEASIBLE, lambda _: "lost"))

    monkeypatch.setattr(module, "design", nowhere)
    (choice,) = select_actuator(*args, [strong], feed_back=True).choices
    assert choice.fed_back.lost == (0, 1, 2, 3)
    assert np.isnan(choice.least)
    assert not choice.enough


def test_candidates_that_are_enough_come_first(envelope):
    args = of(envelope, "lqr")
    weak, strong = Candidate("weak", 1e-3, 10.0), Candidate("strong", 10.0, 100.0)
    found = select_actuator(*args, [weak, RANGE, strong], feed_back=True)
    assert [choice.enough for choice in found.choices] == [True, True, False]
    assert [choice.fit.candidate.name for choice in found.choices][-1] == "weak"
    assert all(isinstance(choice.fed_back, FedBack) for choice in found.choices)


def test_points_without_a_design_ask_for_nothing_and_harm_nobody():
    """One point outside the model: the others answer as they do alone."""
    air = Aerodynamics(wind_tunnel().aerodynamics.source, compressibility="prandtl_glauert")
    grid = GridRequest((0.0,), "dynamic_pressure", (245.0, 980.0, 80000.0))
    whole = run(study_of(aerodynamics=air, grid=grid, controllers=(LQR,)))
    part = run(study_of(aerodynamics=air, grid=replace(grid, speed=(245.0, 980.0)), controllers=(LQR,)))
    assert whole.plant.outcomes.ok.tolist() == [[True, True, False]]
    (one,) = select_actuator(*of(whole, "lqr"), [SOME], feed_back=True).choices
    (other,) = select_actuator(*of(part, "lqr"), [SOME], feed_back=True).choices
    assert one.fed_back.fit.least == pytest.approx(other.fed_back.fit.least, rel=1e-9)
    assert np.isnan(one.fit.headroom.least[0, 2])
    assert one.fed_back.lost == ()


def test_what_cannot_be_sized_is_refused(envelope):
    _, plant, designed, sized = of(envelope, "nf")
    with pytest.raises(ValueError, match="no actuator aileron, only tab"):
        actuator_requirement(plant, designed, replace(sized, actuator="aileron"))
    coded = run(study_of(controllers=(replace(LQR, sampling=Sampling(0.002, 0.002)),)))
    with pytest.raises(ValueError, match="runs as code"):
        actuator_requirement(coded.plant, coded.controller("lqr"), sized)
    nothing = designed.outcomes.failing(designed.outcomes.ok, Outcome.INFEASIBLE, lambda _: "none")
    with pytest.raises(ValueError, match="no design at any point"):
        actuator_requirement(plant, replace(designed, outcomes=nothing), sized)
    gains = {"K_d": 0.01, "K_p": 0.3, "K_i": 8.0}
    ideal = run(study_of(controllers=(replace(NF, gains=gains),), tab_actuator=Actuator()))
    with pytest.raises(ValueError, match="is ideal: its torque is not finite"):
        actuator_requirement(ideal.plant, ideal.controller("nf"), sized)
