"""Designs within the limits of a given actuator: judged again by the pipeline, and against brute force."""

from dataclasses import replace

import numpy as np
import pytest

from design.classical.controller import ClassicalController
from design.lqr.controller import LqrController
from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.lqr.power_weights import PowerBalancedWeights, ReferenceStep
from design.lqr.weights import BrysonWeights, ExplicitWeights, weight_matrices
from design.outcome import Outcome
from design.sampling import Sampling
from design.specs import Spec
from model.actuators import Actuator, ActuatorLimits
from model.aerodynamics import Aerodynamics
from model.examples import WIND_TUNNEL_TRIM, wind_tunnel
from schedules.inverse_sizing import held, inverse_sizing
from schedules.priced_feedback import FAMILIES
from schedules.run import run
from schedules.study import GridRequest, Reference, Study

WEIGHTS = BrysonWeights(
    aileron=0.035, aileron_rate=3.5, tab=0.17, tab_rate=7.0, aileron_integral=0.0017, tab_torque=0.5, aileron_torque=2.0
)
NF = ClassicalController(
    "nf", "negative_feedback", (Spec("damping_ratio", "min", 0.5), Spec("settling_time", "max", 0.6)), rate_filter=600.0
)
LQR = LqrController("lqr", WEIGHTS)
DEG = np.pi / 180.0


def study_of(*controllers, **changes):
    system = wind_tunnel()
    plain = Study(
        name="limits", geometry=system.geometry, inertia=system.inertia, aerodynamics=system.aerodynamics,
        trim=WIND_TUNNEL_TRIM, grid=GridRequest((0.0, 3000.0), "dynamic_pressure", (245.0, 980.0)),
        tab_actuator=Actuator(servo_bandwidth=250.0, servo_damping_ratio=0.7), aileron_actuator=Actuator(),
        reference=Reference(np.deg2rad(10.0), 1.0), controllers=controllers,
    )  # fmt: skip
    return replace(plain, **changes)


@pytest.fixture(scope="module")
def envelope():
    return run(study_of(NF, LQR))


def sized(envelope, name, actuator="tab", **limits):
    designed = envelope.controller(name)
    return inverse_sizing(envelope.study, envelope.plant, designed, actuator, ActuatorLimits(**limits))


def _peaks(designed, actuator="tab"):
    return designed.assessment.demand[designed.assessment.actuators.index(actuator)]


@pytest.mark.parametrize(("name", "actuator"), [("nf", "tab"), ("lqr", "tab"), ("lqr", "aileron")])
def test_limits_that_hold_change_nothing(envelope, name, actuator):
    designed = envelope.controller(name)
    asked = _peaks(designed, actuator)
    limits = {what: 1.001 * float(getattr(asked, f"peak_{what}").max()) for what in ("rate", "torque", "power")}
    found = sized(envelope, name, actuator, **limits)
    assert found.before.held.all()
    assert not found.before.breaks.any()
    assert found.after.held.all()
    assert (found.slower.factor == 1.0).all()
    assert set(found.slower.steered_by.ravel()) == {None}
    for before, after in zip(designed.gains, found.slower.designed.gains, strict=True):
        np.testing.assert_allclose(after.values, before.values, rtol=1e-9)


def test_what_breaks_is_said_point_by_point(envelope):
    asked = _peaks(envelope.controller("lqr"))
    limits = ActuatorLimits(torque=float(np.median(asked.peak_torque)), rate=1.01 * float(asked.peak_rate.max()))
    found = held(envelope.controller("lqr"), "tab", limits)
    assert found.limited.names == ("rate", "torque")
    np.testing.assert_array_equal(found.peaks, np.stack([asked.peak_rate, asked.peak_torque], axis=-1))
    np.testing.assert_array_equal(found.breaks[..., 1], asked.peak_torque > limits.torque)
    assert not found.breaks[..., 0].any()
    np.testing.assert_array_equal(found.held, ~found.breaks.any(axis=-1))


def test_the_rate_of_a_tab_only_design_is_a_spec_like_others(envelope):
    found = sized(envelope, "nf", rate=200.0 * DEG)
    again = run(study_of(replace(NF, specs=(*NF.specs, Spec("tab_rate", "max", 200.0 * DEG))))).controller("nf")
    assert not found.before.held.any()
    assert found.after.held.all()
    assert set(found.slower.steered_by.ravel()) == {"specs"}
    for one, other in zip(found.slower.designed.gains, again.gains, strict=True):
        np.testing.assert_allclose(one.values, other.values, rtol=1e-6)
    np.testing.assert_allclose(
        found.slower.factor, _peaks(again).peak_rate / _peaks(envelope.controller("nf")).peak_rate
    )


def test_a_spec_that_is_stricter_than_the_limit_stays():
    strict = replace(NF, specs=(*NF.specs, Spec("tab_rate", "max", 150.0 * DEG)))
    envelope = run(study_of(strict))
    # Its power is met at some rate above that of the spec, which the design must not take.
    power = _peaks(envelope.controller("nf")).peak_power
    found = sized(envelope, "nf", rate=200.0 * DEG, power=0.999 * float(power.max()))
    assert not found.before.held.all()
    assert found.after.held.all()
    assert np.all(_peaks(found.slower.designed).peak_rate <= 150.0 * DEG * (1.0 + 1e-9))


@pytest.mark.parametrize("limits", [{"torque": 0.1}, {"power": 0.2, "deflection": 12.0 * DEG}])
def test_torque_and_power_are_met_by_the_largest_rate_that_does(envelope, limits):
    found = sized(envelope, "nf", **limits)
    after, designed = found.after, found.slower.designed
    assert after.held.all()
    assert np.all(found.slower.factor < 1.0)
    # The design is again the fastest within its tab rate, all gains by the pipeline itself.
    rate = _peaks(designed).peak_rate
    again = run(study_of(replace(NF, specs=(*NF.specs, Spec("tab_rate", "max", rate))))).controller("nf")
    np.testing.assert_allclose(again.assessment.step.bandwidth, designed.assessment.step.bandwidth, rtol=2e-2)
    # A little more rate is too much.
    more = run(study_of(replace(NF, specs=(*NF.specs, Spec("tab_rate", "max", 1.05 * rate))))).controller("nf")
    asked = _peaks(more)
    excess = np.max([getattr(asked, f"peak_{what}") / limit for what, limit in limits.items()], axis=0)
    assert np.all(excess > 1.0)


def test_a_torque_below_the_one_that_holds_the_reference_is_hopeless(envelope):
    holding = _peaks(envelope.controller("nf")).holding_torque
    limit = 0.5 * float(holding.max() + holding.min())
    found = sized(envelope, "nf", torque=limit)
    hopeless = holding > limit
    outcomes = found.slower.designed.outcomes
    np.testing.assert_array_equal(outcomes.codes == Outcome.INFEASIBLE, hopeless)
    np.testing.assert_array_equal(np.isnan(found.slower.factor), hopeless)
    np.testing.assert_allclose(found.slower.least[hopeless][..., 0], holding[hopeless])
    assert np.isnan(found.slower.least[~hopeless]).all()
    assert "to hold the reference alone takes torque" in outcomes.reasons[0, 1]
    assert found.after.held[~hopeless].all()


def test_a_deflection_out_of_reach_says_what_can_be_reached(envelope):
    found = sized(envelope, "nf", deflection=5.0 * DEG)
    assert not found.slower.designed.outcomes.ok.any()
    assert found.slower.designed.assessment is None
    reached = found.slower.least[..., 0]
    assert np.all(reached > 5.0 * DEG)
    easier = replace(NF, specs=(*NF.specs, Spec("tab_deflection", "max", 1.02 * reached)))
    assert run(study_of(easier)).controller("nf").outcomes.ok.all()
    assert "within the limits of the actuator" in found.slower.designed.outcomes.reasons[0, 0]


@pytest.mark.parametrize(
    ("actuator", "limits"),
    [
        ("tab", {"torque": 0.5}),
        ("tab", {"torque": 0.2, "rate": 400.0 * DEG}),
        ("aileron", {"torque": 6.0}),
        ("aileron", {"torque": 4.0, "power": 8.0}),
    ],
)
def test_a_state_feedback_within_limits_is_the_design_of_its_weights(envelope, actuator, limits):
    """Posed at every point with explicit weights, the factor multiplied in by hand: the pipeline's own design."""
    found = sized(envelope, "lqr", actuator, **limits)
    after = found.slower
    assert found.after.held.all()
    assert np.all(after.factor >= 1.0)
    plain = weight_matrices(WEIGHTS)
    i = ("tab", "aileron").index(actuator)
    for index in np.ndindex(2, 2):
        Q, R = plain.Q.copy(), plain.R.copy()
        R[i, i] *= after.factor[index]
        if after.steered_by[index] == "torque_and_rate":
            Q[1 + 2 * i, 1 + 2 * i] *= after.factor[index]
        grid = GridRequest(
            (envelope.study.grid.altitude[index[0]],), "dynamic_pressure", (envelope.study.grid.speed[index[1]],)
        )
        (again,) = run(study_of(LqrController("lqr", ExplicitWeights(Q, R)), grid=grid)).controllers
        for one, other in zip(after.designed.gains, again.gains, strict=True):
            np.testing.assert_allclose(one.values[index], other.values[0, 0], rtol=1e-6, atol=1e-9)
        asked = _peaks(again, actuator)
        used = max(float(getattr(asked, f"peak_{what}")[0, 0]) / limit for what, limit in limits.items())
        assert used <= 1.0 + 1e-9
        if after.steered_by[index] is not None:
            assert used > 0.99


def test_of_the_two_families_the_quicker_is_taken(envelope):
    """Every family and factor by brute force at one point: none that meets the limits settles sooner."""
    limits = ActuatorLimits(torque=0.2, rate=400.0 * DEG)
    found = inverse_sizing(envelope.study, envelope.plant, envelope.controller("lqr"), "tab", limits)
    settled = found.slower.designed.assessment.step.settling_time[0, 1]
    plain, quickest = weight_matrices(WEIGHTS), {}
    for family in FAMILIES:
        for factor in np.geomspace(1.0, 1e3, 61):
            Q, R = plain.Q.copy(), plain.R.copy()
            R[0, 0] *= factor
            if family == "torque_and_rate":
                Q[1, 1] *= factor
            grid = GridRequest((0.0,), "dynamic_pressure", (980.0,))
            (again,) = run(study_of(LqrController("lqr", ExplicitWeights(Q, R)), grid=grid)).controllers
            asked = _peaks(again)
            if asked.peak_torque[0, 0] <= 0.2 and asked.peak_rate[0, 0] <= 400.0 * DEG:
                quickest[family] = float(again.assessment.step.settling_time[0, 0])
                break
    assert settled <= min(quickest.values()) * (1.0 + 1e-3)


def test_where_no_price_helps_the_nearest_is_told(envelope):
    holding = _peaks(envelope.controller("lqr"), "aileron").holding_torque
    limit = 0.5 * float(holding.max() + holding.min())
    found = sized(envelope, "lqr", "aileron", torque=limit)
    hopeless = holding > limit
    np.testing.assert_array_equal(~found.slower.designed.outcomes.ok, hopeless)
    least = found.slower.least[hopeless][..., 0]
    assert np.all(least >= holding[hopeless] * (1.0 - 1e-6))
    assert np.all(least <= 1.05 * holding[hopeless])
    nowhere = sized(envelope, "lqr", "aileron", torque=1e-3 * float(holding.min()))
    assert not nowhere.slower.designed.outcomes.ok.any()
    assert np.isnan(nowhere.slower.factor).all()
    assert np.isfinite(nowhere.slower.least).all()


def test_points_together_are_each_alone(envelope):
    whole = sized(envelope, "lqr", torque=0.3, rate=400.0 * DEG)
    for j, q in enumerate((245.0, 980.0)):
        alone = run(study_of(LQR, grid=GridRequest((3000.0,), "dynamic_pressure", (q,))))
        found = sized(alone, "lqr", torque=0.3, rate=400.0 * DEG)
        np.testing.assert_allclose(found.slower.factor[0, 0], whole.slower.factor[1, j], rtol=1e-9)
        assert found.slower.steered_by[0, 0] == whole.slower.steered_by[1, j]


@pytest.mark.parametrize(
    ("controller", "tab"),
    [
        (replace(LQR, measurement=RateFilters(600.0)), Actuator()),
        (replace(LQR, measurement=KalmanMeasurement(0.1, 0.5, 1e-4, 1e-4)), Actuator()),
        (LQR, Actuator(torque_loop_bandwidth=400.0, delay=0.001)),
        (replace(LQR, delay_states=2), Actuator(delay=0.004)),
        (replace(LQR, reference="aileron_and_tab", weights=replace(WEIGHTS, tab_integral=0.01)), Actuator()),
        (
            replace(LQR, weights=PowerBalancedWeights(WEIGHTS, 1.0, None, ReferenceStep(10.0 * DEG, 1.0), False)),
            Actuator(),
        ),
    ],
)
def test_every_form_of_state_feedback_is_slowed_as_it_flies(controller, tab):
    grid = GridRequest((0.0,), "dynamic_pressure", (245.0, 980.0))
    envelope = run(study_of(controller, tab_actuator=tab, grid=grid))
    designed = envelope.controller("lqr")
    assert designed.outcomes.ok.all()
    limit = 0.6 * float(_peaks(designed).peak_torque.min())
    same = sized(envelope, "lqr", torque=2.0 * float(_peaks(designed).peak_torque.max()))
    for before, after in zip(designed.gains, same.slower.designed.gains, strict=True):
        assert before.name == after.name
        np.testing.assert_allclose(after.values, before.values, rtol=1e-7, atol=1e-9)
    found = sized(envelope, "lqr", torque=limit)
    assert found.after.held.all()
    np.testing.assert_allclose(_peaks(found.slower.designed).peak_torque, limit, rtol=5e-3)


@pytest.mark.parametrize("name", ["nf", "lqr"])
def test_a_reference_at_a_limited_rate_is_what_is_held(name):
    envelope = run(study_of(NF, LQR, reference=Reference(np.deg2rad(10.0), 1.0, rate_limit=60.0 * DEG)))
    asked = _peaks(envelope.controller(name)).peak_torque
    at_once = _peaks(run(study_of(NF, LQR)).controller(name)).peak_torque
    assert np.all(asked < 0.9 * at_once)
    same = sized(envelope, name, torque=1.001 * float(asked.max()))
    assert same.before.held.all()
    least = float(_peaks(envelope.controller(name)).holding_torque.max())
    limit = 0.5 * (float(asked.max()) + least)
    found = sized(envelope, name, torque=limit)
    assert not found.before.held.all()
    assert found.after.held.all()
    assert np.all(_peaks(found.slower.designed).peak_torque <= limit * (1.0 + 1e-9))


def test_a_regulator_stands_still_and_holds_its_trim():
    envelope = run(study_of(LqrController("lqr", replace(WEIGHTS, aileron_integral=None), reference="none")))
    trim = np.abs(envelope.plant.model.input_offset[..., 0])
    found = sized(envelope, "lqr", torque=1.5 * float(trim.max()))
    assert found.before.held.all()
    none = sized(envelope, "lqr", torque=0.5 * float(trim.min()))
    assert not none.slower.designed.outcomes.ok.any()


def test_gains_that_are_given_leave_nothing_to_choose():
    given = replace(NF, gains={"K_d": 0.01, "K_p": 0.3, "K_i": 8.0})
    found = sized(run(study_of(given)), "nf", rate=1.0 * DEG)
    assert (found.slower, found.after) == (None, None)
    assert found.reason == "all gains of the controller nf are given"
    assert not found.before.held.any()


def test_points_outside_the_model_stay_outside():
    air = Aerodynamics(wind_tunnel().aerodynamics.source, compressibility="prandtl_glauert")
    grid = GridRequest((0.0,), "dynamic_pressure", (245.0, 980.0, 80000.0))
    envelope = run(study_of(NF, LQR, aerodynamics=air, grid=grid))
    for name in ("nf", "lqr"):
        found = sized(envelope, name, torque=0.12)
        assert found.after.held.tolist() == [[True, True, False]]
        assert found.slower.designed.outcomes.codes[0, 2] == Outcome.OUTSIDE_MODEL
        assert not found.before.breaks[0, 2].any()


def test_what_cannot_be_sized_is_refused(envelope):
    designed = envelope.controller("nf")
    with pytest.raises(ValueError, match="one at least"):
        held(designed, "tab", ActuatorLimits())
    with pytest.raises(ValueError, match="positive and finite"):
        held(designed, "tab", ActuatorLimits(torque=0.0))
    with pytest.raises(ValueError, match="no actuator aileron, only tab"):
        held(designed, "aileron", ActuatorLimits(torque=1.0))
    coded = run(study_of(replace(LQR, sampling=Sampling(0.002, 0.002))))
    with pytest.raises(ValueError, match="runs as code"):
        held(coded.controller("lqr"), "tab", ActuatorLimits(torque=1.0))
    nothing = replace(designed, outcomes=designed.outcomes.failing(designed.outcomes.ok, Outcome.INFEASIBLE, str))
    with pytest.raises(ValueError, match="no design at any point"):
        inverse_sizing(envelope.study, envelope.plant, nothing, "tab", ActuatorLimits(torque=1.0))
