"""What the seed (Rupert 2011, chapter 2) claims of the model, as far as it can be checked here."""

from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.eigenvalue_sweep import eigenvalue_sweep, sweep_plant
from model.flight import flight_condition, flight_grid
from model.flutter import Mechanism, flutter_criterion, flutter_range
from model.hinge_moments.closed_forms import between_surfaces, flap_moment, rate_moment
from model.hinge_moments.interpolant import fit_interpolant
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
from model.linearise import linearise
from model.section import Geometry
from model.servo_tab import servo_tab
from model.similarity import pressure_schedule, servo_exponents
from model.steady_state import float_line
from model.swept_plant import swept_plant
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


def tunnel(name="wind_tunnel", **options):
    system = getattr(examples, name)()
    return replace(system, aerodynamics=replace(system.aerodynamics, **options))


def growth_without(model, **changed):
    """Largest real part with some of the matrices of ``J d'' = Bk d' + Kk d`` replaced."""
    parts = {"inertia": model.inertia, "damping": model.damping, "stiffness": model.stiffness} | changed
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1.0
    A[1::2, 0::2] = np.linalg.solve(parts["inertia"], parts["stiffness"])
    A[1::2, 1::2] = np.linalg.solve(parts["inertia"], parts["damping"])
    return np.linalg.eigvals(A).real.max()


AT_50 = flight_condition(0.0, "airspeed", 50.0)


def test_instability_comes_from_a_stiffness_that_is_not_symmetric():
    ratios = {(0.70, 0.88): 17.0, (0.70, 0.97): 400.0}
    for hinges, ratio in ratios.items():
        (_, ta), (at, _) = ThinAerofoil(*hinges).gradient[:, 1:]
        assert at / ta == pytest.approx(ratio, rel=0.01)
    model = model_of(tunnel(), AT_50)
    assert growth_without(model, damping=np.zeros((2, 2))) == pytest.approx(35.34, abs=0.01)
    criterion = flutter_criterion(model.inertia, model.stiffness)
    assert criterion.undamped.item() is Mechanism.UNDAMPED_FLUTTER
    assert float(criterion.discriminant) < 0


@pytest.mark.parametrize(
    ("hinges", "lower", "upper"),
    [
        ((0.70, 0.88), 2.03, 9.03),
        ((0.75, 0.90), 2.07, 9.13),
        ((0.80, 0.95), 2.33, 37.8),
        ((0.60, 0.80), 1.89, 3.71),
        ((0.70, 0.97), 1.05, 321.0),
        ((0.72, 0.96), 1.69, 147.0),
    ],
)
def test_inertia_ratios_of_undamped_flutter_with_a_balanced_tab(hinges, lower, upper):
    found = flutter_range(ThinAerofoil(*hinges).gradient[:, 1:], 1.0)
    # Printed to three digits.
    assert float(found.lower) == pytest.approx(lower, rel=5e-3)
    assert float(found.upper) == pytest.approx(upper, rel=5e-3)


def test_the_air_makes_the_pair_diverge_only_with_a_tab_of_more_than_half_the_aileron():
    aileron = np.linspace(0.5, 0.97, 17)[:, None]
    ratio = np.array([0.03, 0.2, 0.35, 0.47, 0.54, 0.56, 0.7, 0.97])
    gradient = ThinAerofoil(np.broadcast_to(aileron, (17, 8)), 1 - ratio * (1 - aileron)).gradient[..., 1:]
    diverges = np.linalg.det(gradient) < 0
    np.testing.assert_array_equal(diverges, np.broadcast_to(ratio > 0.55, (17, 8)))
    # With the bodies of set A the eigenvalues say the same: a real one grows.
    found = eigenvalue_sweep(tunnel(), AT_50, examples.WIND_TUNNEL_TRIM, "tab_chord_ratio", np.array([0.47, 0.6]))
    assert [kind is Mechanism.DIVERGENCE for kind in found.coupled.mechanism] == [False, True]


def test_set_b_is_made_unstable_by_the_tab_rates_damping_of_the_aileron():
    model = model_of(tunnel("wind_tunnel_23012"), AT_50)
    assert growth_without(model) == pytest.approx(0.3746, abs=1e-4)
    without = model.damping.copy()
    without[1, 0] = 0.0
    assert growth_without(model, damping=without) == pytest.approx(-0.519, abs=1e-3)
    # Better damping does not cure it.
    better = model_of(tunnel("wind_tunnel_23012", damping="quasi_steady"), AT_50)
    assert np.linalg.eigvals(better.A).real.max() == pytest.approx(0.657, abs=1e-3)
    found = eigenvalue_sweep(
        tunnel("wind_tunnel_23012"), AT_50, examples.WIND_TUNNEL_TRIM, "airspeed", np.array([50.0])
    )
    assert found.coupled.mechanism[0] is Mechanism.DAMPING_DRIVEN


def test_a_small_tab_is_violently_and_a_large_one_mildly_unstable():
    # Both with an inertia ratio of about twenty: data sets A (tab a seventh of the aileron) and B (two fifths).
    violent, mild = (model_of(tunnel(name), AT_50) for name in TUNNEL)
    for model in (violent, mild):
        assert 20 < model.inertia[1, 1] / model.inertia[0, 0] < 30
    assert np.linalg.eigvals(violent.A).real.max() == pytest.approx(29.11, abs=0.01)
    assert np.linalg.eigvals(mild.A).real.max() < 0.4


def test_eigenvalues_vary_by_one_per_cent_with_the_tab_angle_and_evenly():
    # Seed 2.4 and Fig 2.8: about 1.5 per cent. Here through cos(dt) of 2.2.13 alone.
    angles = np.deg2rad(np.linspace(-25.0, 25.0, 11))
    values = eigenvalue_sweep(tunnel(), AT_50, examples.WIND_TUNNEL_TRIM, "tab", angles).coupled.modes.eigenvalues
    change = np.abs(values - values[5]) / np.abs(values[5])
    assert change.max() == pytest.approx(0.0121, abs=1e-4)
    np.testing.assert_allclose(values, values[::-1], rtol=1e-9)


def test_eigenvalues_do_not_vary_with_the_aileron_angle_in_linear_theory():
    # Seed 2.4 and Fig 2.9: about 10 per cent.
    angles = np.deg2rad(np.linspace(-25.0, 25.0, 5))
    values = eigenvalue_sweep(tunnel(), AT_50, examples.WIND_TUNNEL_TRIM, "aileron", angles).coupled.modes.eigenvalues
    np.testing.assert_allclose(values, np.broadcast_to(values[0], values.shape), rtol=1e-12)


def test_with_viscous_hinge_moments_deflection_matters():
    # Xfoil's NACA 23012 in the place of thin-aerofoil theory: variations of tens of per cent, and a static instability.
    system = tunnel("wind_tunnel_23012", source=fit_interpolant(xfoil_naca23012(), "cubic"))
    angles = np.deg2rad([-18.0, -10.0, 0.0, 10.0, 18.0])
    for quantity, least in (("tab", 0.3), ("aileron", 0.13)):
        found = eigenvalue_sweep(system, AT_50, examples.WIND_TUNNEL_TRIM, quantity, angles)
        values = found.coupled.modes.eigenvalues
        change = np.max(np.abs(values - values[2]), axis=0) / np.abs(values[2])
        assert np.all(change > least)
        assert np.all(found.coupled.growth > 0)
    assert Mechanism.DIVERGENCE in list(found.coupled.mechanism)


def test_tab_and_aileron_take_part_alike_in_the_modes_of_set_a():
    # Seed 2.4.8: "almost equally coupled to all four eigenvalues"; of set B each mode has its own surface.
    sweeps = {
        name: eigenvalue_sweep(tunnel(name), AT_50, examples.WIND_TUNNEL_TRIM, "airspeed", np.array([50.0])).coupled
        for name in TUNNEL
    }
    seen = {name: sweep.modes.output[0, 0] / sweep.modes.output[0, 1] for name, sweep in sweeps.items()}
    np.testing.assert_allclose(np.sort(seen["wind_tunnel"]), [0.747, 0.747, 0.969, 0.969], atol=1e-3)
    np.testing.assert_allclose(np.sort(seen["wind_tunnel_23012"]), [0.585, 0.585, 1.416, 1.416], atol=1e-3)
    by_tab = {name: sweep.modes.participation[0, :2].sum(axis=0) for name, sweep in sweeps.items()}
    assert np.all(np.abs(by_tab["wind_tunnel"] - 0.5) < 0.05)
    np.testing.assert_allclose(np.sort(by_tab["wind_tunnel_23012"]), [0.292, 0.292, 0.687, 0.687], atol=1e-3)


def test_density_leaves_the_damping_ratios_of_set_a_but_not_of_set_b_or_the_servo_tab():
    # Seed 2.4 and Fig 2.11: an insignificant change. Flutter of set A is a matter of stiffness, not of damping.
    densities = np.array([0.3639, 1.225])
    for name, factor in (("wind_tunnel", 1.06), ("wind_tunnel_23012", 1.83)):
        found = eigenvalue_sweep(tunnel(name), AT_50, examples.WIND_TUNNEL_TRIM, "density", densities)
        ratios = found.coupled.modes.damping_ratio
        stable = ratios[1] > 0
        np.testing.assert_allclose((ratios[1] / ratios[0])[stable], factor, rtol=0.01)
        servo = found.decoupled.modes.damping_ratio
        np.testing.assert_allclose(servo[1] / servo[0], np.sqrt(1.225 / 0.3639), rtol=1e-9)


def test_bodies_that_shrink_with_the_tab_can_be_stable():
    # Seed: "no geometric configuration". With the tab's inertia as the cube of its chord, from set B, there are some.
    ratio = np.linspace(0.03, 0.47, 45)
    stable_below = {"thesis": 0.20, "quasi_steady": 0.35}
    for damping, limit in stable_below.items():
        system = tunnel("wind_tunnel_23012", damping=damping)
        plant = swept_plant(system, AT_50, examples.WIND_TUNNEL_TRIM, "tab_chord_ratio", ratio)
        body = system.inertia.tab
        tab = replace(body, inertia=body.inertia * (ratio / 0.4) ** 3)
        plant = replace(plant, system=replace(plant.system, inertia=replace(system.inertia, tab=tab)))
        growth = sweep_plant(plant, ratio, "tab chord ratio").coupled.growth
        inside = (ratio > 0.035) & (ratio < limit + 0.005)
        np.testing.assert_array_equal(growth[ratio > 0.035] < 0, inside[ratio > 0.035])


def test_the_tab_chord_ratio_decides_the_mechanism():
    # Bodies of set A: damping feeds the smallest and the largest tabs, the stiffness those between.
    ratio = np.array([0.03, 0.10, 0.20, 0.30, 0.40, 0.47])
    found = eigenvalue_sweep(tunnel(), AT_50, examples.WIND_TUNNEL_TRIM, "tab_chord_ratio", ratio)
    fed, flutter = Mechanism.DAMPING_DRIVEN, Mechanism.UNDAMPED_FLUTTER
    assert list(found.coupled.mechanism) == [fed, flutter, flutter, fed, fed, fed]
    assert all(word is Mechanism.STABLE for word in found.decoupled.mechanism)


def test_servo_tab_poles_are_proportional_to_airspeed():
    servo = servo_tab(model_of(tunnel(), flight_condition(0.0, "airspeed", np.array([20.0, 50.0]))))
    np.testing.assert_allclose(-0.5 * servo.denominator[:, 1], [-5.837, -14.593], atol=1e-3)


def test_the_quoted_zero_does_not_follow_from_its_formula():
    # Seed: -150 to -200. Its formula gives -4V/ct, which needs tab chords longer than the whole aileron.
    for name in TUNNEL:
        geometry = tunnel(name).geometry
        servo = servo_tab(model_of(tunnel(name), AT_50))
        assert float(servo.zero) == pytest.approx(-4 * 50.0 / geometry.tab_chord, rel=1e-12)
        assert float(servo.zero) < -2700
        chord_it_would_take = 4 * 20.0 / 200.0  # at 20 m/s [m]
        assert geometry.aileron_chord < chord_it_would_take
    # What comes out in that range: the aileron's chord in the place of a quarter of the tab's, at 30 m/s ...
    at_30 = [30.0 / tunnel(name).geometry.aileron_chord for name in TUNNEL]
    np.testing.assert_allclose(at_30, [178.6, 166.7], atol=0.1)
    # ... or, at 20 m/s, set B with the rate derivatives of thin-aerofoil theory.
    better = model_of(tunnel("wind_tunnel_23012", damping="quasi_steady"), flight_condition(0.0, "airspeed", 20.0))
    assert float(servo_tab(better).zero) == pytest.approx(-179.4, abs=0.1)


def test_hinge_moments_of_figure_2_5_do_not_fit_together():
    # Its contours: C_Ht of 1e-5 beside C_Ha of 2.5e-2, for a tab deflected by up to 25 degrees.
    reach = np.deg2rad(25.0)
    for hinge, moment in ((0.88, 5.6e-3), (0.97, 3.4e-4)):
        assert ThinAerofoil(0.70, hinge).gradient[0, 1] * reach == pytest.approx(moment, rel=0.01)


def test_dynamic_pressure_alone_does_not_schedule_the_servo_tab():
    # Seed 2.4: "can still be described in terms of dynamic pressure". Frequency yes, damping ratio no.
    exponents = servo_exponents(tunnel(), AT_50, examples.WIND_TUNNEL_TRIM)
    powers = [exponents.frequency_by_pressure, exponents.frequency_by_density,
              exponents.damping_by_pressure, exponents.damping_by_density]  # fmt: skip
    np.testing.assert_allclose(powers, [0.5, 0.0, 0.0, 0.5], atol=1e-9)
    grid = flight_grid(np.array([0.0, 11000.0]), "dynamic_pressure", np.array([980.0]))
    found = pressure_schedule(tunnel(), grid.condition, examples.WIND_TUNNEL_TRIM)
    assert found.worst_factor == pytest.approx(np.sqrt(1.225 / 0.3639), rel=1e-4)
    assert not found.sufficient


def test_float_line_of_set_b():
    line = float_line(tunnel("wind_tunnel_23012"), AT_50, np.deg2rad(5.0), np.deg2rad([0.0, 10.0]))
    aileron = np.rad2deg(line.trim.state[:, 2])
    np.testing.assert_allclose(aileron, [4.142, 4.142 - 14.856], atol=1e-3)
    np.testing.assert_allclose(line.gain, -1.4856, atol=5e-5)
