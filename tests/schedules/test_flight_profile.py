"""Manoeuvres flown over profiles: against frozen simulations, equations written out for scipy, orders and limits."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, RegularGridInterpolator
from scipy.optimize import root

from design.classical.controller import ClassicalController
from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.manoeuvre import doublet, recorded, sine, step
from design.sampling import Sampling
from design.simulation.plant import AirResidual, NonlinearPlant
from design.simulation.request import SimulationRequest
from design.simulation.simulate import simulate
from model.aerodynamics import Aerodynamics
from model.examples import wind_tunnel_23012
from model.flight import flight_condition
from model.hinge_moments.taylor import fit_taylor
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
from model.motion import acceleration, aerodynamic_torque, required_torque
from model.trim import HeldTorque, TrimRequest, trim
from schedules import profile_steps
from schedules.analysis import analyse
from schedules.flight_profile import fly_profile, profile_work
from schedules.interpolate import interpolate
from schedules.profile import FlightProfile, ProfileRefused
from schedules.profile_instants import Course
from schedules.profile_response import ProfileRequest
from schedules.profile_steps import _torque_of_source
from schedules.profile_time import flight_segments
from schedules.run import design
from schedules.schedule import GainSchedule
from schedules.study import GridRequest
from tests.schedules.conftest import PROVENANCE
from tests.schedules.flown_cases import NF, NF_RATE, PF, given

STEP = step(np.array([0.08]))
BOTH = step(np.array([0.08, -0.05]))
#: A trim whose angles change with the dynamic pressure.
FLOATING = TrimRequest(0.08, aileron=HeldTorque("aileron", 0.3), tab=0.02)


def constant(altitude, speed, axis="dynamic_pressure"):
    return FlightProfile([0.0], [altitude], axis, [speed])


@pytest.fixture(scope="module")
def study(wind_tunnel_study):
    return replace(wind_tunnel_study, trim=FLOATING)


@pytest.fixture(scope="module")
def plant(study):
    return analyse(study)


@pytest.fixture(scope="module")
def lqr(study, plant):
    return design(study, plant, study.controllers[2])


def variant(study, kind):
    """Study, plant and controller of a kind, and a manoeuvre of it."""
    request, manoeuvre = study.controllers[2], STEP
    lagging = replace(study.tab_actuator, torque_loop_bandwidth=300.0)
    if kind == "unsteady":
        air = replace(study.aerodynamics, damping="unsteady", virtual_inertia=True)
        study = replace(study, aerodynamics=air, tab_actuator=lagging, aileron_actuator=lagging)
        request = replace(request, measurement=RateFilters(900.0))
    elif kind == "both":
        study = replace(study, aileron_actuator=lagging)
        weights = replace(request.weights, tab_integral=0.05)
        request, manoeuvre = replace(request, reference="aileron_and_tab", weights=weights), BOTH
    elif kind in ("table", "table_first"):
        base = wind_tunnel_23012()
        air = Aerodynamics(fit_taylor(xfoil_naca23012(), 3))
        study = replace(study, geometry=base.geometry, inertia=base.inertia, aerodynamics=air)
        if kind == "table_first":
            study = replace(study, tab_actuator=replace(study.tab_actuator, servo_damping_ratio=None))
            request = NF
    elif kind == "linear":
        study = replace(study, aerodynamics=replace(study.aerodynamics, damping="quasi_steady"))
    classical = {"nf": NF, "nf_rate": NF_RATE, "pf": PF}
    if kind in classical:
        request = classical[kind]
    plant = analyse(study)
    if isinstance(request, ClassicalController):
        return study, plant, given(study, plant, request), manoeuvre
    return study, plant, design(study, plant, request), manoeuvre


KINDS = ["lqr", "linear", "unsteady", "both", "table", "table_first", "nf", "nf_rate", "pf"]
FIGURES = ("peak_torque", "rms_torque", "holding_torque", "peak_rate", "peak_acceleration", "rms_power")


KNOWN = [(kind, "scheduled") for kind in KINDS] + [
    (kind, trim) for kind in ("unsteady", "pf") for trim in ("exact", "held")
]


@pytest.mark.parametrize(("kind", "trim_known"), KNOWN)
def test_a_constant_profile_is_the_simulation_at_that_point(study, kind, trim_known):
    study, plant, designed, manoeuvre = variant(study, kind)
    index = (1, 2)
    altitude, speed = (axis.values[i] for axis, i in zip(plant.grid.axes, index, strict=True))
    request = ProfileRequest(0.3, 61, trim_known, substeps=16)
    found = fly_profile(study, plant, designed, constant(altitude, speed), manoeuvre, request)
    at = NonlinearPlant.of(*(each.take(index) if each is not plant.system else each for each in (
        plant.system, plant.grid.condition, plant.trim, plant.model
    )))  # fmt: skip
    same = simulate(at, designed.loop.take(index), manoeuvre, SimulationRequest(0.3, 61, substeps=16))
    np.testing.assert_allclose(found.time, same.time, rtol=0, atol=1e-15)
    scale = np.abs(same.outputs).max(axis=0)
    assert found.names == same.names
    assert np.all(np.abs(found.outputs - same.outputs) <= 1e-9 * scale + 1e-13)
    for ours, theirs in zip(found.demand, same.demand, strict=True):
        for figure in FIGURES:
            np.testing.assert_allclose(getattr(ours, figure), getattr(theirs, figure), rtol=1e-8, err_msg=figure)
        # The sign of a power that begins at zero decides how its first step is split.
        np.testing.assert_allclose(ours.energy_out, theirs.energy_out, rtol=1e-4)
    assert not found.clipped.any()
    assert np.ptp(found.slowest) == 0.0


def _tables(plant, values):
    """Tables (*G, ...) between the grid points, by scipy."""
    return RegularGridInterpolator([axis.values for axis in plant.grid.axes], values)


CLIMB = FlightProfile([0.0, 0.1, 0.22, 0.4], [200.0, 900.0, 2200.0, 2800.0], "dynamic_pressure", [400, 700, 1400, 1200])


@pytest.mark.parametrize("trim_known", ["scheduled", "exact", "held"])
def test_state_feedback_against_equations_written_out(study, trim_known):
    """Totals, `model.motion`, tables by scipy, steps by DOP853: only the gains of the design are shared."""
    lagging = replace(study.tab_actuator, torque_loop_bandwidth=300.0)
    study = replace(study, aileron_actuator=lagging)
    plant = analyse(study)
    designed = design(study, plant, study.controllers[2])
    manoeuvre = doublet(np.array([0.06]), 0.15)
    request = ProfileRequest(0.4, 81, trim_known, tolerance=1e-8)
    found = fly_profile(study, plant, designed, CLIMB, manoeuvre, request)
    gains, forward = (_tables(plant, each) for each in (designed.loop.K, designed.loop.N))
    angles, torques = (_tables(plant, each) for each in (plant.trim.state, plant.trim.torque))
    system = plant.system

    def at(t):
        q, h = np.interp(t, CLIMB.times, CLIMB.speed), np.interp(t, CLIMB.times, CLIMB.altitude)
        return flight_condition(h, "dynamic_pressure", q), np.array([h, q])

    def known(t):
        _, place = at(t)
        if trim_known == "scheduled":
            return angles(place)[0], torques(place)[0]
        if trim_known == "held":
            return held.state, held.torque
        exact = splines[min(np.searchsorted(CLIMB.times, t, side="right"), 3) - 1](t)
        return exact[:4], exact[4:]

    def spline(begin, end):
        times = np.linspace(begin, end, 200)
        exact = trim(system, at(times)[0], study.trim)
        return CubicSpline(times, np.concatenate([exact.state, exact.torque], axis=-1))

    held, splines = trim(system, at(0.0)[0], study.trim), [spline(*ends) for ends in pairwise(CLIMB.times)]

    def f(t, y, r):
        condition, place = at(t)
        rest, torque = known(t)
        u = torque - gains(place)[0] @ np.append(y[:5] - np.append(rest, 0.0), y[5] - torque[1]) + forward(place)[0] @ r
        moved = acceleration(system, condition, study.trim.alpha, y[:4], np.array([u[0], y[5]]))
        return np.array([y[1], moved[0], y[3], moved[1], rest[2] + r[0] - y[2], 300.0 * (u[1] - y[5])])

    # The beginning is at rest: in balance with the controller's trim.
    first = known(0.0)
    begin = np.array([first[0][0], 0.0, first[0][2], 0.0, 0.0, first[1][1]])
    if trim_known == "scheduled":
        begin = root(lambda y: f(0.0, y, np.zeros(1)), begin, tol=1e-13).x
    states, begun = [], 0.0
    for end in (0.1, 0.15, 0.22, 0.3, 0.4):
        r = manoeuvre.at(np.array(begun))
        t = found.time[(found.time >= begun) & (found.time < end)]
        course = solve_ivp(f, (begun, end), begin, method="DOP853", rtol=1e-9, atol=1e-11, t_eval=[*t, end], args=(r,))
        states.append(course.y[:, :-1])
        begin, begun = course.y[:, -1], end
    y = np.concatenate([*states, begin[:, None]], axis=1)
    expected = {"dt": y[0], "dt_rate": y[1], "da": y[2], "da_rate": y[3], "T_a": y[5]}
    for name, course in expected.items():
        error = np.abs(found.output(name) - course).max() / np.abs(course).max()
        assert error < 3e-6, (name, error)


@pytest.mark.parametrize("trim_known", ["scheduled", "held"])
def test_a_tab_only_loop_against_equations_written_out(study, plant, trim_known):
    designed = given(study, plant, NF)
    manoeuvre = sine(np.array([0.05]), 9.0)
    found = fly_profile(study, plant, designed, CLIMB, manoeuvre, ProfileRequest(0.4, 81, trim_known, tolerance=1e-8))
    gains = {gain.name: _tables(plant, gain.values) for gain in designed.gains}
    angles = _tables(plant, plant.trim.state)
    system, servo = plant.system, study.tab_actuator
    w, z, corner = servo.servo_bandwidth, servo.servo_damping_ratio, NF.rate_filter

    first = flight_condition(CLIMB.altitude[0], "dynamic_pressure", CLIMB.speed[0])
    held = trim(system, first, study.trim)

    def conditions(t):
        q, h = np.interp(t, CLIMB.times, CLIMB.speed), np.interp(t, CLIMB.times, CLIMB.altitude)
        condition = flight_condition(h, "dynamic_pressure", q)
        place = np.array([h, q])
        rest = held.state if trim_known == "held" else angles(place)[0]
        return condition, place, rest

    def f(t, y, moving=1.0):
        dt, dt_rate, da, da_rate, integral, filtered = y
        condition, place, rest = conditions(t * moving)
        K_d, K_p, K_i = (float(gains[name](place)[0]) for name in ("K_d", "K_p", "K_i"))
        command = rest[0] - (K_i * integral - K_p * (da - rest[2]) - K_d * corner * (da - filtered))
        air = aerodynamic_torque(system, condition, study.trim.alpha, y[:4])
        J = system.moving_inertia(condition)
        r = 0.05 * np.sin(9.0 * t) * moving
        servo_moves = w**2 * (command - dt) - 2.0 * z * w * dt_rate
        return np.array(
            [
                dt_rate,
                servo_moves,
                da_rate,
                (air[1] + study.trim.aileron.torque) / J[1, 1],
                rest[2] + r - da,
                corner * (da - filtered),
            ]
        )

    rest = conditions(0.0)[2]
    begin = np.array([rest[0], 0.0, rest[2], 0.0, 0.0, rest[2]])
    y = [root(lambda y: f(0.0, y, 0.0), begin, tol=1e-13).x]
    for begun, end in ((0.0, 0.1), (0.1, 0.22), (0.22, 0.4)):
        t = found.time[(found.time > begun) & (found.time <= end)]
        course = solve_ivp(f, (begun, end), y[-1], method="DOP853", rtol=1e-9, atol=1e-11, t_eval=t)
        y.extend(course.y.T)
    y = np.array(y).T
    for name, course in {"dt": y[0], "dt_rate": y[1], "da": y[2], "da_rate": y[3]}.items():
        error = np.abs(found.output(name) - course).max() / np.abs(course).max()
        assert error < 1e-5, (name, error)
    # The tab's torque is that of inverse dynamics with both accelerations, which the equations give again.
    k = len(found.time) // 2
    rates = f(found.time[k], y[:, k])
    condition, *_ = conditions(found.time[k])
    torque = required_torque(system, condition, study.trim.alpha, y[:4, k], rates[[1, 3]])
    np.testing.assert_allclose(found.output("T_t")[k], torque[0], rtol=1e-4)


@pytest.mark.parametrize("kind", ["lqr", "unsteady", "table_first", "nf_rate"])
def test_the_method_is_of_order_four_across_knots_and_grid_lines(study, kind):
    study, plant, designed, manoeuvre = variant(study, kind)
    ends = []
    for substeps in (24, 48, 192):
        request = ProfileRequest(0.2, 11, substeps=substeps)
        found = fly_profile(study, plant, designed, CLIMB, manoeuvre, request)
        ends.append(found.outputs[-1, [found.names.index(name) for name in ("da", "dt", "da_rate", "dt_rate")]])
    scale = np.abs(ends[-1]).max()
    errors = [np.abs(end - ends[-1]).max() / scale for end in ends[:-1]]
    assert errors[1] < 1e-4
    assert errors[0] / errors[1] > 12.0


def test_a_slow_profile_tends_to_the_frozen_point(study, plant, lqr):
    """A step at the middle of a crossing that takes longer and longer."""
    frozen = fly_profile(study, plant, lqr, constant(1500.0, 800.0), STEP, ProfileRequest(0.4, 41, "exact"))
    errors = []
    for slowness in (1.0, 2.0, 4.0):
        profile = FlightProfile([0.0, 2.0 * slowness], [1000.0, 2000.0], "dynamic_pressure", [600.0, 1000.0])
        late = recorded(np.array([0.0, slowness, slowness]), np.array([[0.0], [0.0], [0.08]]))
        request = ProfileRequest(slowness + 0.4, int(100 * slowness) + 41, "exact")
        found = fly_profile(study, plant, lqr, profile, late, request)
        after = found.output("da")[found.time >= slowness - 1e-12]
        ours = np.interp(frozen.time, found.time[found.time >= slowness - 1e-12] - slowness, after)
        errors.append(np.abs(ours - frozen.output("da")).max())
    assert errors[2] < 8e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.2)


def test_nothing_moves_at_rest(study, plant, lqr):
    """Between the points a table of trims is not quite the trim: the loop begins where it rests with it."""
    nothing = step(np.zeros(1))
    for designed in (lqr, given(study, plant, NF), given(study, plant, NF_RATE), given(study, plant, PF)):
        found = fly_profile(study, plant, designed, constant(1234.0, 700.0), nothing, ProfileRequest(0.5, 11))
        moved = np.ptp(found.outputs, axis=0) / np.abs(found.outputs).max()
        assert moved.max() < 1e-8
        assert found.tracking[0].peak < 1e-9


def test_gains_are_those_of_the_schedule_and_clipped_outside(study, plant, lqr):
    profile = FlightProfile([0.0, 0.5], [-500.0, 3500.0], "airspeed", [15.0, 60.0])
    found = fly_profile(study, plant, lqr, profile, STEP, ProfileRequest(0.5, 26))
    schedule = GainSchedule("lqr", "lqr", plant.grid.axes, lqr.gains, lqr.outcomes, "", PROVENANCE)
    same = interpolate(schedule, (found.condition.air.altitude, found.condition.dynamic_pressure))
    for ours, theirs in zip(found.gains, same.gains, strict=True):
        assert (ours.name, ours.unit) == (theirs.name, theirs.unit)
        np.testing.assert_array_equal(ours.values, theirs.values)
    np.testing.assert_array_equal(found.clipped, same.clipped)
    assert found.clipped[0]
    assert found.clipped[-1]
    assert not found.clipped.all()
    # The gains that are told are those of the loop.
    course = Course(study, plant, lqr, profile, "exact").at(found.time)
    by_name = {gain.name: gain.values for gain in found.gains}
    for j, state in enumerate(course.loop.states):
        np.testing.assert_allclose(by_name[f"K_T_a_{state}"], course.loop.K[:, 1, j], rtol=1e-14)
    np.testing.assert_allclose(found.condition.airspeed, np.interp(found.time, [0, 0.5], [15, 60]), rtol=1e-14)


def test_stretches_end_at_every_grid_line_and_layer(plant):
    """In the grid's axis crossings are those of straight lines; in another one the coordinate is on the line."""
    axes = plant.grid.axes
    profile = FlightProfile([0.0, 1.0, 3.0], [0.0, 12000.0, 500.0], "dynamic_pressure", [300.0, 900.0, 1600.0])
    ends = np.array([s.end for s in flight_segments(profile, axes, STEP, 3.0, 2)])
    expected = [
        (551.25 - 300) / 600,
        1 + 80 / 350,
        1 + (1531.25 - 900) / 350,
        0.25,
        11 / 12,
        1 + 2 / 11.5,
        1 + 18 / 11.5,
    ]
    for time in expected:
        assert np.abs(ends - time).min() < 1e-12, time
    other = FlightProfile([0.0, 2.0], [0.0, 3000.0], "airspeed", [25.0, 65.0])
    marks = [s.end for s in flight_segments(other, axes, STEP, 2.0, 2)][:-1]
    q = other.condition(np.array(marks)).dynamic_pressure
    np.testing.assert_allclose(q, [551.25, 980.0, 1531.25], rtol=1e-12)


def test_scalar_air_is_that_of_the_simulation(study):
    for damping in ("thesis", "quasi_steady"):
        base = wind_tunnel_23012()
        air = Aerodynamics(fit_taylor(xfoil_naca23012(), 3), damping)
        plant = analyse(replace(study, geometry=base.geometry, inertia=base.inertia, aerodynamics=air))
        flat = [each.take(plant.outcomes.ok) for each in (plant.grid.condition, plant.trim, plant.model)]
        of = NonlinearPlant.of(plant.system, *flat)
        rng = np.random.default_rng(1)
        motion = rng.normal(size=(4, len(of.alpha))) * np.array([[0.1], [2.0], [0.1], [2.0]])
        batch = AirResidual(of).torque(*motion)
        alone = _torque_of_source(of)
        for k in range(len(of.alpha)):
            dt, dt_rate, da, da_rate = motion[:, k]
            one = alone(k, of.angles[k, 0] + dt, dt_rate, of.angles[k, 1] + da, da_rate)
            np.testing.assert_allclose(one, batch[:, k], rtol=1e-9, atol=1e-14)


def test_halved_steps_say_how_far_off_the_flight_is(study, plant, lqr):
    rough = ProfileRequest(0.3, 31, substeps=8, estimate_error=True)
    found = fly_profile(study, plant, lqr, CLIMB, STEP, rough)
    exact = fly_profile(study, plant, lqr, CLIMB, STEP, replace(rough, substeps=256, estimate_error=False))
    coarse = fly_profile(study, plant, lqr, CLIMB, STEP, replace(rough, estimate_error=False))
    true = np.abs(coarse.outputs - exact.outputs).max(axis=0)
    np.testing.assert_allclose(found.error_estimate, true, rtol=0.1)
    assert found.steps == 2 * coarse.steps
    assert profile_work(study, plant, lqr, CLIMB, STEP, rough) == 3 * coarse.steps
    changed, there, designed, _ = variant(study, "table")
    assert profile_work(changed, there, designed, CLIMB, STEP, rough) == 60 * coarse.steps


@pytest.mark.parametrize("kind", ["lqr", "nf"])
def test_batches_of_steps_do_not_show(study, kind, monkeypatch):
    """Instants are made many at a time: the flight is the same, bit for bit, whatever the batch."""
    study, plant, designed, manoeuvre = variant(study, kind)
    request = ProfileRequest(0.2, 21, substeps=10)
    whole = fly_profile(study, plant, designed, CLIMB, manoeuvre, request)
    monkeypatch.setattr(profile_steps, "_BATCH", 7)
    parts = fly_profile(study, plant, designed, CLIMB, manoeuvre, request)
    np.testing.assert_array_equal(parts.time, whole.time)
    np.testing.assert_array_equal(parts.outputs, whole.outputs)
    assert parts.demand[0].energy_out == whole.demand[0].energy_out


def test_limits_are_watched(study, plant, lqr):
    found = fly_profile(study, plant, lqr, CLIMB, STEP, ProfileRequest(0.3))
    peak = float(found.demand[1].peak_torque)
    limits = replace(study.aileron_actuator.limits, torque=0.7 * peak)
    weak = replace(study, aileron_actuator=replace(study.aileron_actuator, limits=limits))
    watched = fly_profile(weak, plant, lqr, CLIMB, STEP, ProfileRequest(0.3))
    np.testing.assert_array_equal(watched.outputs, found.outputs)
    beyond = np.abs(found.output("T_a")) >= 0.99 * 0.7 * peak
    np.testing.assert_array_equal(watched.at_limit[:, 1, 2], beyond)
    assert 0.0 < watched.time_at_limit[1, 2] < 0.3
    torque, rate = found.output("T_a"), found.output("da_rate")
    assert np.max(np.abs(torque * rate)) == pytest.approx(float(found.demand[1].peak_power), rel=1e-2)


def test_a_schedule_that_does_not_hold_the_plant_diverges(study, plant):
    values = {name: np.full(plant.grid.shape, size) for name, size in (("K_f", 3.0), ("K_i", 2.0))}
    found = fly_profile(study, plant, given(study, plant, PF, values), CLIMB, STEP, ProfileRequest(3.0))
    assert found.code == "diverged"
    assert found.diverged_at is not None
    assert found.time[-1] <= found.diverged_at < 3.0
    assert np.isfinite(found.outputs).all()
    assert np.isnan(found.demand[0].peak_torque)
    assert found.slowest.max() > 0.0


def test_profiles_that_cannot_be_flown(study, plant, lqr):
    bad = [
        ([0.0, 1.0], [0.0, 0.0], "mach", [0.2]), ([], [], "mach", []), ([0.0, 0.0], [0.0, 0.0], "mach", [0.2, 0.2]),
        ([0.1], [0.0], "mach", [0.2]), ([0.0], [np.nan], "mach", [0.2]), ([0.0], [0.0], "speed", [0.2]),
        ([0.0], [40000.0], "mach", [0.2]), ([0.0], [0.0], "mach", [0.0]), ([[0.0]], [[0.0]], "mach", [[0.2]]),
    ]  # fmt: skip
    for arguments in bad:
        with pytest.raises(ProfileRefused):
            FlightProfile(*arguments)
    fast = FlightProfile([0.0, 1.0], [0.0, 0.0], "mach", [0.2, 1.3])
    with pytest.raises(ProfileRefused, match=r"at 0\.\d+ s the profile leaves the model: Mach"):
        fly_profile(study, plant, lqr, fast, STEP, ProfileRequest(1.0))
    for wrong in ({"duration": 0.0}, {"samples": 1}, {"tolerance": 0.0}, {"substeps": 0}, {"trim": "none"}):
        with pytest.raises(ValueError, match=r"must|at least"):
            ProfileRequest(**({"duration": 1.0} | wrong))
    with pytest.raises(ValueError, match="references r_a"):
        fly_profile(study, plant, lqr, CLIMB, BOTH, ProfileRequest(1.0))
    with pytest.raises(ValueError, match="steps, more than"):
        fly_profile(study, plant, lqr, CLIMB, STEP, ProfileRequest(1.0, substeps=1_000_000))


def test_controllers_that_cannot_be_flown(study, plant):
    ideal = replace(study.tab_actuator, servo_bandwidth=None, servo_damping_ratio=None)
    late = replace(study.tab_actuator, delay=0.01)
    request = study.controllers[2]
    kalman = KalmanMeasurement(1.0, 1.0, 0.01, 0.01)
    cases = [
        (study, replace(request, sampling=Sampling(0.002, 0.002)), "runs on a computer"),
        (study, replace(request, measurement=kalman), "estimates"),
        (replace(study, tab_actuator=late), request, "delays"),
        (replace(study, tab_actuator=late), NF, "delays"),
        (replace(study, tab_actuator=ideal), PF, "ideal"),
        (study, replace(PF, sampling=Sampling(0.002, 0.002)), "runs on a computer"),
    ]  # fmt: skip
    for changed, wanted, words in cases:
        there = analyse(changed)
        classical = isinstance(wanted, ClassicalController)
        designed = given(changed, there, wanted) if classical else design(changed, there, wanted)
        with pytest.raises(ValueError, match=words):
            fly_profile(changed, there, designed, CLIMB, STEP, ProfileRequest(0.1))


def test_holes_of_a_schedule(study, plant):
    """A point without gains is in the way of profiles that it carries weight for, of no other."""
    ok = np.ones(plant.grid.shape, dtype=bool)
    ok[0, 0] = False
    designed = given(study, plant, NF, ok=ok)
    with pytest.raises(ValueError, match="no gains at 0 s"):
        fly_profile(study, plant, designed, CLIMB, STEP, ProfileRequest(0.1))
    above = FlightProfile([0.0, 0.1], [0.0, 3000.0], "dynamic_pressure", [560.0, 1500.0])
    assert fly_profile(study, plant, designed, above, STEP, ProfileRequest(0.1)).code == "completed"
    none = given(study, plant, NF, ok=np.zeros_like(ok))
    with pytest.raises(ValueError, match="at any grid point"):
        fly_profile(study, plant, none, above, STEP, ProfileRequest(0.1))


def test_a_grid_of_one_point_and_another_axis(study):
    """Along an axis of one value gains do not change; everywhere else they are clipped."""
    study = replace(study, grid=GridRequest((1000.0,), "mach", (0.1, 0.15)))
    plant = analyse(study)
    designed = design(study, plant, study.controllers[2])
    profile = FlightProfile([0.0, 0.2], [1000.0, 1500.0], "mach", [0.11, 0.14])
    found = fly_profile(study, plant, designed, profile, STEP, ProfileRequest(0.2, 21))
    assert found.clipped.tolist() == [False] + [True] * (len(found.time) - 1)
    assert found.code == "completed"
