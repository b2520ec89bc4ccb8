"""Equations of the seed (Rupert 2011, chapter 2) as printed, against what its own definitions give.

Each test shows by numbers that the printed form cannot be meant, or how much the choice matters. Data set B unless
said otherwise: chord 0.6 m, span 0.8 m, hinges 0.70 and 0.88, 50 m/s at sea level.
"""

from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.flight import flight_condition
from model.hinge_moments.closed_forms import between_surfaces, flap_moment, rate_moment
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.induced_angles import induced_angles
from model.linearise import linearise
from model.modes import modes
from model.motion import acceleration, required_torque
from model.servo_tab import servo_tab
from model.trim import TrimRequest, trim

CONDITION = flight_condition(0.0, "airspeed", 50.0)
CA, CT, LEVER = 0.18, 0.072, 0.108  # aileron and tab chord, hinge to hinge [m]


@pytest.fixture
def system():
    return examples.wind_tunnel_23012()


def model_of(system, condition=CONDITION, request=TrimRequest(0.08, 0.1, -0.05)):  # noqa: B008
    return linearise(system, condition, trim(system, condition, request))


def derivatives(system):
    """``C_H`` by [dt, da], rows [tab, aileron]."""
    return system.aerodynamics.source.gradient[:, 1:]


def test_2_1_1_the_lever_runs_to_the_tabs_centre_of_mass(system):
    # mt (e_at a' + et t')^2 / 2 is the tab's energy if e_at = l + et. As the distance l between the hinges it leaves
    # out what the aileron's rate does to the offset: six per cent of the coupling for a tab 20 mm out of balance.
    bodies = replace(system.inertia, tab=replace(system.inertia.tab, cg_offset=0.020))
    tab, J = bodies.tab, replace(system, inertia=bodies).inertia_matrix
    tab_rate, aileron_rate = 7.0, -3.0
    speed = LEVER * aileron_rate + 0.020 * (aileron_rate + tab_rate)
    energy = 0.5 * tab.mass * speed**2 + 0.5 * tab.inertia * (aileron_rate + tab_rate) ** 2
    aileron = bodies.aileron
    energy += 0.5 * (aileron.inertia + aileron.mass * aileron.cg_offset**2) * aileron_rate**2
    rates = np.array([tab_rate, aileron_rate])
    assert 0.5 * rates @ J @ rates == pytest.approx(energy, rel=1e-12)
    assert (tab.inertia + tab.mass * 0.020 * LEVER) / J[0, 1] == pytest.approx(0.942, abs=1e-3)


def test_2_1_8_small_angle_of_the_tab_in_the_inertia(system):
    # Exact: the tab's centre of mass moves with l a' along the aileron's normal and et (a' + t') turned by dt.
    tab, dt = system.inertia.tab, np.deg2rad(25.0)
    exact = tab.inertia + tab.mass * (tab.cg_offset**2 + LEVER * tab.cg_offset * np.cos(dt))
    assert exact / system.inertia_matrix[0, 1] == pytest.approx(1.0, abs=1.5e-3)


def test_2_2_8_the_mass_is_the_tabs(system):
    # 2.1.8 has mt where 2.2.8 and its followers print m2. Read as the other body's, the coupling is 12 per cent more.
    tab, aileron = system.inertia.tab, system.inertia.aileron
    wrong = tab.inertia + aileron.mass * tab.cg_offset * (LEVER + tab.cg_offset)
    assert wrong / system.inertia_matrix[0, 1] == pytest.approx(1.125, abs=2e-3)


def test_2_2_4_coefficients_are_per_unit_span(system):
    # Torques of the whole section carry the span; left out, forces would be 1/0.8 too large beside these inertias.
    result = trim(system, CONDITION, TrimRequest(0.08, 0.1, -0.05))
    value = system.aerodynamics.source.at(0.08, -0.05, 0.1).value
    printed = 0.5 * 1.225 * 50.0**2 * 0.6**2 * value
    np.testing.assert_allclose(result.torque, 0.8 * printed, rtol=1e-6)
    omega = servo_tab(model_of(system)).natural_frequency
    printed = 50.0 * 0.6 * np.sqrt(1.225 * derivatives(system)[1, 1] / (2 * system.inertia_matrix[1, 1]))
    assert float(omega) / printed == pytest.approx(np.sqrt(0.8), rel=1e-6)


def test_2_2_12_a_tangent_for_an_arctangent(system):
    # The induced angle is the arctangent of a ratio of velocities. At 400 deg/s of the aileron and 30 m/s tangent and
    # arctangent both differ from the ratio, which the seed uses in the end, by less than a ten-thousandth.
    ratio = 0.25 * CA * np.deg2rad(400.0) / 30.0
    assert np.arctan(ratio) / ratio == pytest.approx(1.0, abs=1e-4)
    assert np.tan(ratio) / ratio == pytest.approx(1.0, abs=1e-4)
    state = np.array([0.0, 0.0, 0.0, np.deg2rad(400.0)])
    assert induced_angles(system.geometry, np.array(30.0), state)[1] == pytest.approx(ratio, rel=1e-12)


def test_2_2_13_levers(system):
    # Velocity of the tab's quarter chord by the aileron's rate: hinge distance plus a quarter of the tab, not the
    # aileron's chord, and with it the quarter of the tab that the relative angle leaves out.
    printed = induced_angles(system.geometry, np.array(50.0), np.array([0.0, 0.0, 0.0, 1.0]))[0] * 50.0
    assert printed == pytest.approx(CA, rel=1e-12)
    assert printed / (LEVER + CT / 4) == pytest.approx(1.43, abs=5e-3)


def test_2_2_13_counts_the_ailerons_own_motion_twice():
    # The tab's angle is relative to the aileron, so the aileron's induced angle already tilts it: the consistent tab
    # angle is that of its quarter chord less the aileron's. Thesis over quasi-steady damping with it, per c/V.
    tt, ta, at, aa = between_surfaces(flap_moment, 0.70, 0.88).ravel()
    rates = between_surfaces(rate_moment, 0.70, 0.88)
    lever = (LEVER + CT / 4 - CA / 4) / 0.6
    by_aileron_rate = np.array([lever * tt + 0.25 * 0.30 * ta, lever * at + 0.25 * 0.30 * aa])
    np.testing.assert_allclose(by_aileron_rate / rates[:, 1], [0.33, 0.39], atol=5e-3)


def test_2_3_3_no_derivative_by_the_chord(system):
    # Coefficients depend on ratios of chords: twice the section has the same coefficients and eight times the load.
    g = system.geometry
    double = replace(system, geometry=replace(g, chord=2 * g.chord, span=2 * g.span))
    assert double.aerodynamics.source is system.aerodynamics.source
    np.testing.assert_allclose(double.hinge_load(CONDITION) / system.hinge_load(CONDITION), 8.0, rtol=1e-12)


def test_2_3_4_offsets_of_the_expansion(system):
    # As printed the expansion holds about zero only: its constant is the coefficient at the trim, not none.
    request = TrimRequest(0.08, 0.1, -0.05)
    result = trim(system, CONDITION, request)
    still = acceleration(system, CONDITION, result.alpha, result.state, result.torque)
    np.testing.assert_allclose(still, 0.0, atol=1e-9)
    assert np.all(np.abs(result.torque) > 0.05)


def test_2_3_5_interchanged_derivatives(system):
    # The aileron's row as printed multiplies the tab's deviation by C_Ha,da: 0.67 of what the equations of motion give.
    model = model_of(system)
    step = 1e-5
    base = trim(system, CONDITION, TrimRequest(0.08, 0.1, -0.05))
    moved = base.state + np.array([step, 0.0, 0.0, 0.0])
    slope = -(required_torque(system, CONDITION, 0.08, moved, np.zeros(2)) - base.torque) / step
    assert model.stiffness[1, 0] == pytest.approx(slope[1], rel=1e-6)
    assert model.stiffness[1, 1] / slope[1] == pytest.approx(0.673, abs=1e-3)


def test_2_3_6_both_gradients_are_taken_at_the_trim(system):
    # Even in linear theory they differ from those at zero: by the cosine of the trim's tab angle in 2.2.13.
    tab = np.deg2rad(25.0)
    at_trim = model_of(system, request=TrimRequest(0.0, 0.0, tab))
    at_zero = model_of(system, request=TrimRequest(0.0))
    lever = CA / 50.0 * derivatives(system)[:, 0] * float(system.hinge_load(CONDITION))
    change = at_trim.damping[:, 1] - at_zero.damping[:, 1]
    np.testing.assert_allclose(change, (1.0 - np.cos(tab)) * lever, rtol=1e-9)
    assert np.all(np.abs(change / at_zero.damping[:, 1]) > 0.07)


def test_2_3_17_inputs_are_deviations_from_the_trim_torques(system):
    model = model_of(system)
    base = trim(system, CONDITION, TrimRequest(0.08, 0.1, -0.05))
    extra = np.array([0.02, -0.3])
    nonlinear = acceleration(system, CONDITION, 0.08, base.state, base.torque + extra)
    np.testing.assert_allclose((model.B @ extra)[1::2], nonlinear, rtol=1e-9)
    assert np.max(np.abs((model.B @ (base.torque + extra))[1::2] / nonlinear - 1)) > 0.3


def test_2_3_21_reaction_of_the_tabs_acceleration(system):
    # Left out: (It + mt et e_at) dt'', four per cent of J_aa for each unit of dt''/da''.
    for name, share in (("wind_tunnel", 0.0393), ("wind_tunnel_23012", 0.0423)):
        J = getattr(examples, name)().inertia_matrix
        assert J[0, 1] / J[1, 1] == pytest.approx(share, abs=2e-4)


def test_2_3_29_the_zero_depends_on_speed_chord_and_trim_rate_only(system):
    # The text has it depend on C_Ha,dt and the chord ratio; both cancel.
    gains = []
    for factor in (1.0, 3.0):
        source = system.aerodynamics.source
        scaled = _Scaled(source, factor)
        other = replace(system, aerodynamics=replace(system.aerodynamics, source=scaled))
        base = trim(other, CONDITION, TrimRequest(0.08, 0.1, -0.05))
        moving = replace(base, state=base.state + np.array([0.0, 0.0, 0.0, 2.0]))
        servo = servo_tab(linearise(other, CONDITION, moving))
        rate_factor = 1.0 - 2.0 * np.sin(-0.05) * CA / 50.0
        assert float(servo.zero) == pytest.approx(-4 * 50.0 / CT * rate_factor, rel=1e-9)
        gains.append(float(servo.dc_gain))
    assert gains[1] == pytest.approx(3.0 * gains[0], rel=1e-9)


class _Scaled:
    """A thin aerofoil whose tab moves the aileron `factor` times as much."""

    domain = "every angle"

    def __init__(self, source, factor):
        self.source, self.factor = source, factor

    def at(self, alpha, dt, da):
        moments = self.source.at(alpha, dt, da)
        gradient = moments.gradient.copy()
        more = (self.factor - 1.0) * gradient[..., 1, 1]
        value = moments.value.copy()
        value[..., 1] += more * dt
        gradient[..., 1, 1] *= self.factor
        return type(moments)(value, gradient)

    def covers(self, alpha, dt, da):
        return self.source.covers(alpha, dt, da)


def test_2_3_30_and_2_4_16_the_gain_is_negative(system):
    K = derivatives(system)
    servo = servo_tab(model_of(system))
    assert float(servo.dc_gain) == pytest.approx(-K[1, 0] / K[1, 1], rel=1e-12)
    assert float(servo.dc_gain) < 0


def test_2_4_10_the_frequency_is_real(system):
    # Printed with a minus: omega^2 would be negative for the positive C_Ha,da that 2.3.31 needs.
    servo = servo_tab(model_of(system))
    load = float(system.hinge_load(CONDITION))
    omega_squared = load * derivatives(system)[1, 1] / system.inertia_matrix[1, 1]
    assert omega_squared > 0
    assert float(servo.natural_frequency) ** 2 == pytest.approx(omega_squared, rel=1e-12)


def test_2_3_33_the_cosine_is_the_trims_and_its_sum_does_not_scale_as_one(system):
    # 2.3.34 to 2.3.36 hold for each part of zeta; between c ca C_at and c ca C_aa/4 the balance moves with dt0.
    K, J = derivatives(system), system.inertia_matrix[1, 1]
    part = 0.6 * CA / 2 * np.sqrt(1.225 * 0.8 / (2 * J * K[1, 1]))
    for dt in (0.0, 0.4):
        zeta = servo_tab(model_of(system, request=TrimRequest(0.0, 0.0, dt))).damping_ratio
        assert float(zeta) == pytest.approx(part * (np.cos(dt) * K[1, 0] + K[1, 1] / 4), rel=1e-6)
    assert K[1, 0] / (K[1, 1] / 4) == pytest.approx(5.94, abs=0.01)


def test_2_4_3_the_new_states_are_the_inverse_of_the_eigenvectors(system):
    # X = V Xbar: Xbar' = V^-1 F V Xbar is diagonal. With 2.4.3 as printed, Xbar = V X, it is V F V^-1, which is not.
    A = model_of(system).A
    values, V = np.linalg.eig(A)
    np.testing.assert_allclose(np.linalg.solve(V, A @ V), np.diag(values), atol=1e-9 * np.abs(values).max())
    printed = V @ A @ np.linalg.inv(V)
    assert np.abs(printed - np.diag(np.diag(printed))).max() > np.abs(values).max()
    np.testing.assert_allclose(np.sort_complex(modes(A, np.eye(4)).eigenvalues), np.sort_complex(values), rtol=1e-12)


def test_2_4_linear_theory_does_not_vary_near_zero_deflection():
    # The text: derivatives "vary strongly near zero deflection". Thin-aerofoil theory's are constants.
    angles = np.deg2rad(np.linspace(-20.0, 20.0, 9))
    gradient = ThinAerofoil(0.70, 0.88).at(0.05, angles, -angles).gradient
    np.testing.assert_array_equal(gradient, np.broadcast_to(gradient[0], gradient.shape))
