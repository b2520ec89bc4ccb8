"""What the seed (Rupert 2011, chapter 2) claims of the model, as far as it can be checked here."""

from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.flight import flight_condition
from model.hinge_moments.closed_forms import between_surfaces, flap_moment, rate_moment
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.linearise import linearise
from model.section import Geometry
from model.servo_tab import servo_tab
from model.trim import TrimRequest, trim

TUNNEL = ["wind_tunnel", "wind_tunnel_23012"]


def model_of(system, condition, request=examples.WIND_TUNNEL_TRIM):
    return linearise(system, condition, trim(system, condition, request))


@pytest.mark.parametrize("name", TUNNEL)
def test_coupled_system_is_unstable_at_every_airspeed(name):
    # Seed 2.4 and Fig 2.10; the growth rate is proportional to airspeed, so there is no flutter speed.
    condition = flight_condition(0.0, "airspeed", np.array([1.0, 10.0, 30.0, 50.0, 100.0]))
    growth = np.linalg.eigvals(model_of(getattr(examples, name)(), condition).A).real.max(axis=-1)
    assert np.all(growth > 0)
    np.testing.assert_allclose(growth / condition.airspeed, growth[0] / condition.airspeed[0], rtol=1e-9)


def test_eigenvalues_lie_where_figures_2_8_to_2_11_show_them():
    # Axes of the figures at 50 m/s: real parts from -60 to 40, imaginary parts to about 45.
    values = np.linalg.eigvals(model_of(examples.wind_tunnel(), flight_condition(0.0, "airspeed", 50.0)).A)
    assert -60 < values.real.min() < -40
    assert 20 < values.real.max() < 40
    np.testing.assert_allclose(np.abs(values.imag), 44.0, atol=2.0)


@pytest.mark.parametrize("name", TUNNEL)
def test_no_tab_chord_stabilises_the_fixed_bodies(name):
    # Seed Fig 2.12: tab chord from 3 to 47 per cent of the aileron's.
    system = getattr(examples, name)()
    geometry = system.geometry
    tab_hinge = 1.0 - np.linspace(0.03, 0.47, 23) * (1.0 - geometry.aileron_hinge)
    sweep = replace(
        system,
        geometry=Geometry(geometry.chord, geometry.span, geometry.aileron_hinge, tab_hinge),
        aerodynamics=replace(system.aerodynamics, source=replace(system.aerodynamics.source, tab_hinge=tab_hinge)),
    )
    values = np.linalg.eigvals(model_of(sweep, flight_condition(0.0, "airspeed", 50.0)).A)
    assert values.shape == (23, 4)
    assert np.all(values.real.max(axis=-1) > 0.04)


@pytest.mark.parametrize("name", TUNNEL)
def test_servo_tab_poles_lie_around_minus_fifteen(name):
    # Seed 2.3: "the system poles, around -15 on the real axis", at 50 m/s; lightly damped, not real.
    servo = servo_tab(model_of(getattr(examples, name)(), flight_condition(0.0, "airspeed", 50.0)))
    assert -0.5 * float(servo.denominator[1]) == pytest.approx(-15.0, abs=1.0)
    assert 0.18 < float(servo.damping_ratio) < 0.22


@pytest.mark.parametrize(
    ("hinges", "gain"),
    [
        ((0.70, 0.88), -1.4856),
        ((0.75, 0.90), -1.5057),
        ((0.80, 0.95), -1.4431),
        ((0.60, 0.80), -1.4263),
        ((0.70, 0.97), -1.0404),
    ],
)
def test_tab_up_drives_the_aileron_down(hinges, gain):
    # Seed 2.3.30 prints the gain without its minus sign; its text says it is negative.
    _, by_tab, by_aileron = ThinAerofoil(*hinges).gradient[1]
    assert -by_tab / by_aileron == pytest.approx(gain, abs=5e-5)


def test_free_aileron_floats_up_with_incidence():
    system = examples.wind_tunnel_23012()
    source = system.aerodynamics.source
    moments = source.at(np.deg2rad(5.0), 0.0, 0.0)
    float_angle = -moments.value[1] / moments.gradient[1, 2]
    assert np.rad2deg(float_angle) == pytest.approx(4.142, abs=5e-4)


@pytest.mark.parametrize(
    ("hinges", "ratios"),
    [
        ((0.70, 0.88), (0.739, 0.162, 0.634, 0.0985)),
        ((0.80, 0.95), (0.690, 0.172, 0.736, 0.0957)),
        ((0.70, 0.97), (0.550, 0.186, 1.090, 0.0949)),
    ],
)
def test_thesis_damping_is_too_small_by_these_factors(hinges, ratios):
    # Seed 2.2.12 and 2.2.13 over quasi-steady thin-aerofoil theory, per unit of c/V.
    (tt, ta), (at, aa) = between_surfaces(flap_moment, *hinges)
    ca, ct = 1 - hinges[0], 1 - hinges[1]
    thesis = np.array([ca * at + ca / 4 * aa, ct / 4 * at, ca * tt + ca / 4 * ta, ct / 4 * tt])
    rates = between_surfaces(rate_moment, *hinges)
    correct = np.array([rates[1, 1], rates[1, 0], rates[0, 1], rates[0, 0]])
    # Printed to three digits.
    np.testing.assert_allclose(thesis / correct, ratios, rtol=6e-3)


def test_virtual_inertia_of_the_air_is_a_few_per_cent_of_the_ailerons():
    system = examples.wind_tunnel()
    aerodynamics = replace(system.aerodynamics, virtual_inertia=True)
    moving = replace(system, aerodynamics=aerodynamics).moving_inertia(flight_condition(0.0, "airspeed", 50.0))
    share = (moving - system.inertia_matrix)[1, 1] / system.inertia_matrix[1, 1]
    assert 0.025 < share < 0.045


def test_angle_of_attack_and_deflection_leave_the_linear_theorys_eigenvalues():
    # Seed 2.4: no significant variation; exactly none in linear theory but for cos(dt) in 2.2.13.
    system, condition = examples.wind_tunnel(), flight_condition(0.0, "airspeed", 50.0)
    base = model_of(system, condition, TrimRequest(0.0)).A
    np.testing.assert_array_equal(model_of(system, condition, TrimRequest(0.15, aileron=0.3)).A, base)
    deflected = model_of(system, condition, TrimRequest(0.0, tab=np.deg2rad(25.0))).A
    change = np.sort_complex(np.linalg.eigvals(deflected)) - np.sort_complex(np.linalg.eigvals(base))
    assert 0 < np.max(np.abs(change)) / np.max(np.abs(np.linalg.eigvals(base))) < 0.03
