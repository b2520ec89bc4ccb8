from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.flight import flight_condition, flight_grid
from model.hinge_moments.expansion import HingeMoments, every_angle
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.linearise import linearise
from model.similarity import pressure_schedule, servo_exponents
from model.trim import TrimRequest, trim

REQUEST = TrimRequest(0.08, aileron=0.05, tab=-0.1)
PRESSURES = np.array([245.0, 980.0, 1531.25])
EXPONENTS = ("frequency_by_pressure", "frequency_by_density", "damping_by_pressure", "damping_by_density")


def model_of(system, condition, request=REQUEST):
    return linearise(system, condition, trim(system, condition, request))


@pytest.mark.parametrize("damping", ["thesis", "quasi_steady"])
def test_frequency_goes_with_pressure_and_damping_with_density(grid, variant, damping):
    found = servo_exponents(variant(examples.wind_tunnel(), damping=damping), grid.condition, REQUEST)
    for name, power in zip(EXPONENTS, (0.5, 0.0, 0.0, 0.5), strict=True):
        np.testing.assert_allclose(getattr(found, name), power, atol=1e-9)
    # In airspeed and density: omega_n ~ V sqrt(rho), zeta ~ sqrt(rho) at any airspeed.
    np.testing.assert_allclose(found.frequency_by_airspeed, 1.0, atol=1e-9)
    np.testing.assert_allclose(found.damping_by_airspeed, 0.0, atol=1e-9)
    np.testing.assert_allclose(found.frequency_by_density_at_airspeed, 0.5, atol=1e-9)
    np.testing.assert_allclose(found.damping_by_density_at_airspeed, 0.5, atol=1e-9)


def test_exponents_with_compressibility_have_a_closed_form(variant):
    # phi = (1 - M^2)^-1/2 multiplies both squares; d ln(phi) / d ln(M) = M^2 / (1 - M^2), and M ~ sqrt(q / rho).
    system = variant(examples.wind_tunnel(), compressibility="prandtl_glauert")
    condition = flight_condition(4000.0, "mach", np.array([0.2, 0.5, 0.7]))
    found = servo_exponents(system, condition, REQUEST)
    bend = 0.25 * condition.mach**2 / (1.0 - condition.mach**2)
    np.testing.assert_allclose(found.frequency_by_pressure, 0.5 + bend, atol=1e-7)
    np.testing.assert_allclose(found.frequency_by_density, -bend, atol=1e-7)
    np.testing.assert_allclose(found.damping_by_pressure, bend, atol=1e-7)
    np.testing.assert_allclose(found.damping_by_density, 0.5 - bend, atol=1e-7)


def test_exponents_with_virtual_inertia_have_a_closed_form(variant):
    # J = J0 + rho a: d ln(J) / d ln(rho) is the air's share of it.
    system = variant(examples.wind_tunnel(), virtual_inertia=True)
    condition = flight_condition(np.array([0.0, 9000.0]), "dynamic_pressure", 900.0)
    found = servo_exponents(system, condition, REQUEST)
    share = 1.0 - system.inertia_matrix[1, 1] / system.moving_inertia(condition)[:, 1, 1]
    np.testing.assert_allclose(found.frequency_by_density, -0.5 * share, atol=1e-7)
    np.testing.assert_allclose(found.damping_by_density, 0.5 - 0.5 * share, atol=1e-7)
    assert np.all(share > 0.005)


def test_schedule_in_pressure_alone_from_sea_level_to_eleven_kilometres():
    grid = flight_grid(np.array([0.0, 5000.0, 11000.0]), "dynamic_pressure", PRESSURES)
    found = pressure_schedule(examples.wind_tunnel(), grid.condition, REQUEST)
    density = grid.condition.air.density
    np.testing.assert_allclose(found.damping_factor, np.sqrt(density[0] / density), rtol=1e-12)
    np.testing.assert_allclose(found.frequency_factor, 1.0, rtol=1e-12)
    assert found.worst_factor == pytest.approx(1.83, abs=6e-3)
    assert found.best_factor == pytest.approx(np.sqrt(found.worst_factor), rel=1e-12)
    assert found.reference_density == pytest.approx(1.225, rel=1e-6)
    assert not found.sufficient
    assert found.reason.startswith("a schedule in dynamic pressure alone is not enough: its damping ratio is off by")


def test_the_verdict_turns_at_the_tolerance():
    grid = flight_grid(np.array([0.0, 3000.0]), "dynamic_pressure", PRESSURES)
    worst = pressure_schedule(examples.wind_tunnel(), grid.condition, REQUEST).worst_factor
    assert 1.1 < worst < 1.2
    for tolerance, enough in ((worst - 1.0 + 1e-9, True), (worst - 1.0 - 1e-9, False)):
        found = pressure_schedule(examples.wind_tunnel(), grid.condition, REQUEST, tolerance)
        assert found.sufficient is enough
        assert ("is enough" in found.reason) is enough


def test_one_altitude_needs_no_more_than_pressure():
    grid = flight_grid(np.array([4000.0]), "airspeed", np.array([20.0, 60.0]))
    found = pressure_schedule(examples.wind_tunnel(), grid.condition, REQUEST, 1e-9)
    assert found.sufficient
    assert found.worst_factor == pytest.approx(1.0, abs=1e-12)


def test_any_axes_of_the_grid_are_compared_at_the_same_pressure():
    # The same points given by airspeed, where no two altitudes share a dynamic pressure.
    grid = flight_grid(np.array([0.0, 7000.0]), "airspeed", np.array([25.0, 40.0]))
    found = pressure_schedule(examples.wind_tunnel(), grid.condition, REQUEST)
    ratio = np.sqrt(grid.condition.air.density[0, 0] / grid.condition.air.density)
    np.testing.assert_allclose(found.damping_factor, ratio, rtol=1e-12)


def test_the_reference_air_is_a_choice():
    grid = flight_grid(np.array([0.0, 11000.0]), "dynamic_pressure", PRESSURES)
    middle = replace(grid.condition.air.take((0, 0)), density=np.sqrt(1.225 * 0.3639176))
    found = pressure_schedule(examples.wind_tunnel(), grid.condition, REQUEST, reference=middle)
    assert found.worst_factor == pytest.approx(np.sqrt(1.8347), rel=1e-4)
    assert found.worst_factor == pytest.approx(found.best_factor, rel=1e-6)


@pytest.mark.parametrize("damping", ["thesis", "quasi_steady"])
def test_the_coupled_models_damping_matrix_is_off_by_the_same_factor(variant, damping):
    system = variant(examples.wind_tunnel_23012(), damping=damping)
    condition = flight_condition(np.array([0.0, 11000.0]), "dynamic_pressure", 900.0)
    model = model_of(system, condition)
    factor = pressure_schedule(system, condition, REQUEST).damping_factor[1]
    np.testing.assert_allclose(model.stiffness[0], model.stiffness[1], rtol=1e-12)
    np.testing.assert_allclose(model.damping[0], factor * model.damping[1], rtol=1e-12)


def test_compressibility_makes_the_frequency_differ_too():
    grid = flight_grid(np.array([0.0, 9000.0]), "dynamic_pressure", np.array([3000.0, 6000.0]))
    found = pressure_schedule(examples.airliner_aileron(), grid.condition, REQUEST)
    phi = 1.0 / np.sqrt(1.0 - grid.condition.mach**2)
    np.testing.assert_allclose(found.frequency_factor, np.sqrt(phi[0] / phi), rtol=1e-12)
    assert found.frequency_factor[1, 1] < 0.99


class Softening:
    """The air drives the surfaces away instead of back."""

    domain = "every angle"

    def at(self, alpha, dt, da):
        moments = ThinAerofoil(0.7, 0.88).at(alpha, dt, da)
        return HingeMoments(-moments.value, -moments.gradient)

    def covers(self, alpha, dt, da):
        return every_angle(alpha, dt, da)


def test_an_aileron_without_restoring_air_gets_no_verdict():
    tunnel = examples.wind_tunnel_23012()
    system = replace(tunnel, aerodynamics=replace(tunnel.aerodynamics, source=Softening()))
    condition = flight_condition(np.array([0.0, 9000.0]), "dynamic_pressure", 900.0)
    found = pressure_schedule(system, condition, TrimRequest(0.0))
    assert not found.sufficient
    assert found.worst_factor == np.inf
    assert found.reason.startswith("no verdict")


def test_impossible_questions_are_refused():
    grid = flight_grid(np.array([0.0, 11000.0]), "dynamic_pressure", np.array([20000.0]))
    with pytest.raises(ValueError, match="tolerance"):
        pressure_schedule(examples.wind_tunnel(), grid.condition, REQUEST, 0.0)
    with pytest.raises(ValueError, match="Mach one"):
        pressure_schedule(
            examples.wind_tunnel(), grid.condition.take(np.array([0])), REQUEST,
            reference=grid.condition.air.take((1, 0)),
        )  # fmt: skip


def test_batched_equals_single(example, grid):
    exponents = servo_exponents(example, grid.condition, REQUEST)
    whole = pressure_schedule(example, grid.condition, REQUEST)
    densest = grid.condition.air.take((0, 0))
    for index in ((0, 0), (3, 2)):
        point = grid.condition.take(index)
        single = servo_exponents(example, point, REQUEST)
        for name in EXPONENTS:
            np.testing.assert_allclose(getattr(exponents, name)[index], getattr(single, name), atol=1e-9)
        alone = pressure_schedule(example, point, REQUEST, reference=densest)
        np.testing.assert_allclose(whole.damping_factor[index], alone.damping_factor, rtol=1e-12)
