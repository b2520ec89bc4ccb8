"""Loops taken apart add up again to the loops that are flown, anywhere between the grid points."""

from dataclasses import replace

import numpy as np
import pytest

from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.sampling import Sampling
from model.actuators import Actuator
from model.flight import flight_condition
from model.linearise import linearise
from model.trim import HeldTorque, TrimRequest, trim
from schedules.perturbations import PARAMETERS, Uncertainty, perturbed_model
from schedules.proof.cells import gains_at
from schedules.proof.family import family
from schedules.proof.flight_box import Flight
from schedules.proof.flown_with import NotProvable, closed_with
from schedules.proof.prove import prove
from schedules.run import run
from schedules.study import GridRequest
from tests.schedules.flown_cases import NF_RATE, given

HEIGHTS = (0.0, 3000.0)


def same_everywhere(study, envelope, designed, loops_at, count=200):
    made = family(study, envelope.plant, designed)
    assert not isinstance(made, NotProvable), made
    axes = envelope.plant.grid.axes
    rng = np.random.default_rng(1)
    h, s = (rng.uniform(axis.values[0], axis.values[-1], count) for axis in axes)
    flight = Flight(envelope.plant.system, study.grid.speed_axis, study.grid.temperature_offset)
    summed = made.closed(flight.terms(h, s, made.terms), made.products(gains_at(axes, made.tables, h, s)))[0]
    real = loops_at(study, envelope, designed, h, s)
    size = np.max(np.abs(real), axis=-1, keepdims=True)
    np.testing.assert_allclose(summed / size, real / size, rtol=0.0, atol=1e-12)
    return made


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
@pytest.mark.parametrize("example", ["example_a", "example_b"])
def test_the_parts_add_up_to_the_loop_between_grid_points(request, example, name, loops_at):
    study, envelope = request.getfixturevalue(example)
    same_everywhere(study, envelope, envelope.controller(name), loops_at)


def test_compressibility_and_quasi_steady_damping(airliner, loops_at):
    study, envelope = airliner
    same_everywhere(study, envelope, envelope.controllers[0], loops_at)


@pytest.mark.parametrize("speed", [("airspeed", (20.0, 32.0, 45.0)), ("mach", (0.06, 0.1, 0.14))])
@pytest.mark.parametrize("damping", ["thesis", "unsteady"])
def test_every_speed_axis_and_lag_states(envelope_of, only_lqr, wind_tunnel_study, loops_at, speed, damping):
    study, envelope = envelope_of(
        grid=GridRequest(HEIGHTS, *speed, temperature_offset=12.0), controllers=only_lqr,
        aerodynamics=replace(wind_tunnel_study.aerodynamics, damping=damping),
    )  # fmt: skip
    made = same_everywhere(study, envelope, envelope.controllers[0], loops_at)
    assert made.terms == (("1", "Q", "D", "V") if damping == "unsteady" else ("1", "Q", "D"))


def test_torque_lags_and_filtered_rates(envelope_of, only_lqr, wind_tunnel_study, loops_at):
    controller = replace(only_lqr[0], measurement=RateFilters(2000.0))
    study, envelope = envelope_of(
        controllers=(controller,), tab_actuator=Actuator(torque_loop_bandwidth=900.0),
        aileron_actuator=Actuator(torque_loop_bandwidth=700.0),
    )  # fmt: skip
    made = same_everywhere(study, envelope, envelope.controllers[0], loops_at)
    assert made.order == 9


def test_products_of_gains_of_a_rate_command(wind_tunnel_study, wind_tunnel_envelope, loops_at):
    study, envelope = wind_tunnel_study, wind_tunnel_envelope
    designed = given(study, envelope.plant, NF_RATE)
    made = same_everywhere(study, envelope, designed, loops_at)
    assert made.gain_degree == 2
    products = {tuple(made.gains[i] for i in monomial) for monomial in made.monomials}
    assert ("K_theta", "K_p") in products
    assert ("K_p",) not in products


@pytest.mark.parametrize("parameter", PARAMETERS)
def test_plants_that_are_off_are_those_of_the_perturbations(example_a, parameter):
    study, envelope = example_a
    designed = envelope.controller("lqr")
    made = family(study, envelope.plant, designed, (Uncertainty(parameter, 0.3),))
    if parameter.endswith("cg_offset") and isinstance(made, NotProvable):
        assert "straight line" in made.reason
        return
    assert made.variants.factors.tolist() == [[1.0], [0.7], [1.3]]
    point = np.array([6])
    at = np.unravel_index(point, (2, 4))
    for row, factor in enumerate((1.0, 0.7, 1.3)):
        model = perturbed_model(envelope.plant, point, (parameter,), np.array([[factor]]))
        K = {gain.name: gain.values[at] for gain in designed.gains}
        real = closed_with(study, envelope.plant, designed, model, K)[0]
        condition = envelope.plant.grid.condition
        flight = Flight(envelope.plant.system, "dynamic_pressure", 0.0)
        terms = flight.terms(condition.air.altitude[at], condition.dynamic_pressure[at], made.terms)
        summed = made.closed(terms, made.products(made.tables[at]))[row, 0]
        np.testing.assert_allclose(summed, real, rtol=1e-11, atol=1e-11 * np.max(np.abs(real)))


@pytest.mark.parametrize("parameter", ["aileron_inertia", "tab_inertia", "tab_mass"])
@pytest.mark.parametrize("name", ["nf", "lqr"])
def test_an_inertia_moves_the_loop_on_a_straight_line(example_a, parameter, name):
    """Every loop in between is a mixture of those at the ends: found by solving for the mixture."""
    study, envelope = example_a
    designed = envelope.controller(name)
    made = family(study, envelope.plant, designed, (Uncertainty(parameter, 0.4),))
    gains = {gain.name: gain.values.reshape(-1)[:1].repeat(9) for gain in designed.gains}
    model = perturbed_model(envelope.plant, np.zeros(9, dtype=int), (parameter,), np.linspace(0.6, 1.4, 9)[:, None])
    loops = closed_with(study, envelope.plant, designed, model, gains)
    low, high = loops[0], loops[-1]
    if np.array_equal(low, high):
        return
    assert made.variants.factors[1:].tolist() == [[0.6], [1.4]]
    along = (high - low).ravel()
    for loop in loops:
        share = (loop - low).ravel() @ along / (along @ along)
        assert -1e-9 <= share <= 1.0 + 1e-9
        np.testing.assert_allclose(loop, low + share * (high - low), rtol=0.0, atol=1e-9 * np.max(np.abs(loop)))


def test_two_inertias_together_are_refused(example_a):
    study, envelope = example_a
    both = (Uncertainty("aileron_inertia", 0.1), Uncertainty("tab_inertia", 0.1))
    made = family(study, envelope.plant, envelope.controller("lqr"), both, together=True)
    assert isinstance(made, NotProvable)
    assert "two inertias" in made.reason
    assert not isinstance(family(study, envelope.plant, envelope.controller("lqr"), both), NotProvable)


def test_what_cannot_be_taken_apart_says_why(envelope_of, wind_tunnel_study, only_lqr):
    aerodynamics, lqr = wind_tunnel_study.aerodynamics, only_lqr[0]
    late = replace(wind_tunnel_study.tab_actuator, delay=0.002)
    coded = replace(lqr, sampling=Sampling(0.002, 0.0))
    kalman = replace(lqr, measurement=KalmanMeasurement(1e-3, 1e-3, 1e-5, 1e-5))
    cases = [
        ({"aerodynamics": replace(aerodynamics, virtual_inertia=True)}, "mass matrix", True),
        ({"tab_actuator": late}, "delay", False),
        ({"controllers": (coded,)}, "computer", False),
        ({"controllers": (kalman,)}, "model of the plant", False),
    ]
    for change, word, known in cases:
        study, envelope = envelope_of(**{"controllers": only_lqr, **change})
        made = family(study, envelope.plant, envelope.controllers[0])
        assert isinstance(made, NotProvable)
        assert word in made.reason
        assert made.known == known


def test_an_ideal_deflection_cannot_be_taken_apart(envelope_of, wind_tunnel_study):
    fixed = replace(wind_tunnel_study.controllers[1], specs=(), gains={"K_f": 0.4, "K_i": 2.0})
    study, envelope = envelope_of(controllers=(fixed,), tab_actuator=Actuator())
    made = family(study, envelope.plant, envelope.controllers[0])
    assert isinstance(made, NotProvable)
    assert "ideal tab deflection" in made.reason


def test_a_trim_that_moves_with_the_flight_point_is_found_out(envelope_of, only_lqr, wind_tunnel_study):
    """A held torque moves the tab; with the thesis's induced angles the damping follows cos(dt0)."""
    study, envelope = envelope_of(
        controllers=only_lqr, trim=TrimRequest(alpha=0.05, aileron=0.0, tab=HeldTorque("aileron", 1.0))
    )
    assert np.ptp(envelope.plant.trim.state[..., 0]) > 0.05
    made = family(study, envelope.plant, envelope.controllers[0])
    assert isinstance(made, NotProvable)
    assert "not affine" in made.reason
    # Quasi-steady damping does not know the trim: thin-aerofoil slopes are constant, and the plant is affine again.
    quasi = replace(wind_tunnel_study.aerodynamics, damping="quasi_steady")
    study, envelope = envelope_of(controllers=only_lqr, trim=study.trim, aerodynamics=quasi)
    assert not isinstance(family(study, envelope.plant, envelope.controllers[0]), NotProvable)


def test_the_plant_is_affine_by_finite_difference(example_a):
    """Second differences of the product's own A along Q at constant D, and the other way about, vanish."""
    study, envelope = example_a
    system = envelope.plant.system
    # Density and speed chosen so that Q and D move on a rectangle: q = rho V^2/2, d = rho V/2.
    h = np.array([500.0, 1500.0, 2500.0])
    for quantity in ("Q", "D"):
        rho = flight_condition(h, "airspeed", 30.0).air.density
        speed = np.array([30.0, 30.0, 30.0]) * (rho[1] / rho) ** (1.0 if quantity == "Q" else 0.5)
        condition = flight_condition(h, "airspeed", speed)
        A = linearise(system, condition, trim(system, condition, study.trim)).A
        x = condition.dynamic_pressure if quantity == "Q" else condition.dynamic_pressure / condition.airspeed
        slopes = np.diff(A, axis=0) / np.diff(x)[:, None, None]
        np.testing.assert_allclose(slopes[0], slopes[1], rtol=1e-9, atol=1e-9)


def test_a_servo_of_first_order_multiplies_gains_by_the_flight_condition(envelope_of, wind_tunnel_study):
    """Its rate takes the command at once, so that the air's torque by the tab's rate carries the gains: found out."""
    fixed = replace(wind_tunnel_study.controllers[1], specs=(), gains={"K_f": 0.4, "K_i": 2.0})
    first_order = Actuator(servo_bandwidth=wind_tunnel_study.tab_actuator.servo_bandwidth)
    study, envelope = envelope_of(controllers=(fixed,), tab_actuator=first_order)
    made = family(study, envelope.plant, envelope.controllers[0])
    assert isinstance(made, NotProvable)
    assert "not a sum of matrices" in made.reason
    assert made.known


def test_points_outside_the_model_do_not_stop_the_proof_of_the_others(airliner):
    """With a compressibility correction a grid point at Mach 1 and more has no terms."""
    study, _ = airliner
    grid = GridRequest((0.0, 1000.0), "dynamic_pressure", (2000.0, 4000.0, 90_000.0))
    aerodynamics = replace(study.aerodynamics, compressibility="prandtl_glauert")
    study = replace(study, grid=grid, aerodynamics=aerodynamics)
    envelope = run(study)
    found = prove(study, envelope.plant, envelope.controllers[0])
    assert {cell.status.value for cell in found.cells if cell.index[1] == 0} == {"proved"}
    assert {cell.status.value for cell in found.cells if cell.index[1] == 1} == {"undecided"}
