"""Unsteady damping: the six-state model against Theodorsen's theory, its own motion, and the quasi-steady limit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import hankel2

from model.hinge_moments.unsteady import jones
from model.lag_states import (
    LAG_STATES,
    circulatory_incidence,
    lag_coefficients,
    lag_rates,
    with_settled_lags,
)
from model.linear_model import STATES
from model.linearise import linearise
from model.motion import acceleration, aerodynamic_torque, required_torque
from model.servo_tab import servo_tab
from model.trim import TrimRequest, trim

REQUEST = TrimRequest(0.08, aileron=0.1, tab=-0.05)
OPTIONS = [
    {"damping": "unsteady"},
    {"damping": "unsteady", "virtual_inertia": True},
    {"damping": "unsteady", "virtual_inertia": True, "compressibility": "prandtl_glauert"},
]


def random_states(shape, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (*shape, 6)) * np.array([0.4, 20.0, 0.4, 10.0, 0.3, 0.3])


def moving_trim(system, grid, seed):
    rest = trim(system, grid.condition, REQUEST)
    rng = np.random.default_rng(seed)
    return replace(rest, state=random_states(grid.shape, seed)[..., :4], alpha=rng.uniform(-0.1, 0.15, grid.shape))


def transfer_of_the_air(model, s):
    """Torque by the angles [dt, da] at a complex frequency s (*G,), from the state-space model (*G, 2, 2)."""
    Azz, Azx = model.A[..., 4:, 4:], model.A[..., 4:, :4]
    s = s[..., None, None]
    lag = np.linalg.solve(s * np.eye(2) - Azz, Azx[..., 0::2] + s * Azx[..., 1::2])
    return model.stiffness + s * model.damping + model.lag_torque @ lag


def transfer_by_theodorsen(system, condition, gradient, s, C):
    """The same from the theory with circulation function C (*G,), written with hinge-moment derivatives."""
    grid = np.shape(C)
    C, s = np.reshape(C, (*grid, 1, 1)), s[..., None, None]
    time = (system.geometry.chord / condition.airspeed)[..., None, None]
    I0 = system.incidence_derivatives[:, None]
    W, W_rate = system.circulatory_angles, system.circulatory_rates
    steady = gradient[..., 1:] - I0 * W + C * I0 * W
    rate = system.rate_derivatives - I0 * W_rate + C * I0 * W_rate
    load = system.hinge_load(condition) * system.aerodynamics.amplification(condition.mach)
    return -load[..., None, None] * (steady + s * time * rate)


@pytest.fixture(params=OPTIONS, ids=["unsteady", "virtual_inertia", "compressible"])
def system(request, example, variant):
    return variant(example, **request.param)


def test_states_are_named_and_shaped(system, grid):
    base = trim(system, grid.condition, REQUEST)
    model = linearise(system, grid.condition, base)
    assert model.states == (*STATES, *LAG_STATES) == ("dt", "dt_rate", "da", "da_rate", "lag_1", "lag_2")
    assert model.A.shape == (*grid.shape, 6, 6)
    assert model.B.shape == (*grid.shape, 6, 2)
    np.testing.assert_array_equal(model.B[..., 4:, :], 0.0)
    np.testing.assert_array_equal(model.C[0, 0], [[1, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0]])
    np.testing.assert_array_equal(model.state_offset[..., :4], base.state)
    # At rest nothing is behind: both lags are at the incidence that the trim's deflections are worth.
    np.testing.assert_array_equal(lag_rates(system, grid.condition, model.state_offset), 0.0)
    assert np.all(model.state_offset[..., 4] > 0.02)
    np.testing.assert_allclose(model.inertia @ model.A[..., 1:4:2, :], model.air_torque, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_model_is_the_derivative_of_the_nonlinear_motion(system, grid, seed):
    check_twin(system, grid.condition, moving_trim(system, grid, seed))


def test_model_is_the_derivative_for_a_nonlinear_source_too(polynomial_system, grid, variant):
    """Steady part from the source, its lag from thin-aerofoil theory."""
    system = variant(polynomial_system, damping="unsteady", virtual_inertia=True)
    for seed in range(3):
        check_twin(system, grid.condition, moving_trim(system, grid, seed))


def check_twin(system, condition, base):
    model = linearise(system, condition, base)
    where = model.state_offset

    def motion(state):
        accelerations = acceleration(system, condition, base.alpha, state, base.torque)
        return np.concatenate([accelerations, lag_rates(system, condition, state)], axis=-1)

    for k, size in enumerate((1e-5, 1e-3, 1e-5, 1e-3, 1e-5, 1e-5)):
        step = np.zeros(6)
        step[k] = size
        column = (motion(where + step) - motion(where - step)) / (2 * size)
        exact = model.A[..., [1, 3, 4, 5], k]
        for rows in (slice(0, 2), slice(2, 4)):
            scale = np.abs(exact[..., rows]).max(axis=-1, keepdims=True)
            assert np.max(np.abs(column[..., rows] - exact[..., rows]) / np.where(scale > 0, scale, 1.0)) < 1e-6


def test_frequency_response_is_jones_exactly_and_theodorsen_nearly(system, grid):
    model = linearise(system, grid.condition, trim(system, grid.condition, REQUEST))
    gradient = system.aerodynamics.source.gradient
    half_chord = system.geometry.chord / (2 * grid.condition.airspeed)
    for k in (0.003, 0.05, 0.3, 2.0):
        s = 1j * k / half_chord
        found = transfer_of_the_air(model, s)
        exact = hankel2(1, k) / (hankel2(1, k) + 1j * hankel2(0, k))
        by_jones = transfer_by_theodorsen(system, grid.condition, gradient, s, np.full(s.shape, jones(1j * k)))
        by_hankel = transfer_by_theodorsen(system, grid.condition, gradient, s, np.full(s.shape, exact))
        settled = transfer_by_theodorsen(system, grid.condition, gradient, s, np.ones(s.shape))
        np.testing.assert_allclose(found, by_jones, rtol=1e-10)
        assert np.max(np.abs(found - by_hankel) / np.abs(by_hankel)) < 0.024
        if k >= 0.05:
            # Taking the circulation as settled is several times worse.
            assert np.max(np.abs(settled - by_hankel) / np.abs(by_hankel)) > 0.06


def test_slow_motion_is_quasi_steady_with_virtual_inertia(system, grid, variant):
    steady = variant(system, damping="quasi_steady")
    base = trim(system, grid.condition, REQUEST)
    model, limit = linearise(system, grid.condition, base), linearise(steady, grid.condition, base)
    np.testing.assert_allclose(model.static_stiffness, limit.stiffness, rtol=1e-12)
    np.testing.assert_allclose(limit.static_stiffness, limit.stiffness, rtol=0)
    np.testing.assert_array_equal(model.inertia, limit.inertia)
    half_chord = system.geometry.chord / (2 * grid.condition.airspeed)
    gaps = []
    for k in (1e-2, 1e-4, 1e-6):
        s = 1j * k / half_chord
        quasi = limit.stiffness + s[..., None, None] * limit.damping
        gaps.append(np.max(np.abs(transfer_of_the_air(model, s) - quasi) / np.abs(quasi)))
    assert gaps[0] < 0.1
    assert gaps[2] < 1e-5
    assert gaps[1] / gaps[2] == pytest.approx(100.0, rel=0.01)  # it goes with k


def test_settled_circulation_is_quasi_steady_whatever_the_motion(system, grid, variant):
    """C = 1 exactly: lags at what they tend to, or none given."""
    steady = variant(system, damping="quasi_steady")
    state = random_states(grid.shape, 3)[..., :4]
    torque = np.array([0.4, -1.1])
    expected = acceleration(steady, grid.condition, 0.07, state, torque)
    with_lags = with_settled_lags(system, grid.condition, state)
    np.testing.assert_array_equal(lag_coefficients(system, grid.condition, with_lags), 0.0)
    np.testing.assert_array_equal(acceleration(system, grid.condition, 0.07, with_lags, torque), expected)
    np.testing.assert_array_equal(acceleration(system, grid.condition, 0.07, state, torque), expected)


def test_a_step_of_the_aileron_lifts_half_at_once(example, grid, variant):
    """Wagner: the circulatory moment of a sudden deflection begins at one half of its steady value."""
    system = variant(example, damping="unsteady", compressibility="none")
    before = np.zeros((*grid.shape, 6))
    after = before.copy()
    after[..., 2] = 0.1
    jump = aerodynamic_torque(system, grid.condition, 0.0, after) - aerodynamic_torque(
        system, grid.condition, 0.0, before
    )
    end = aerodynamic_torque(system, grid.condition, 0.0, with_settled_lags(system, grid.condition, after[..., :4]))
    rest = aerodynamic_torque(system, grid.condition, 0.0, before)
    circulatory = -system.hinge_load(grid.condition)[..., None] * system.incidence_derivatives
    circulatory = circulatory * circulatory_incidence(system, grid.condition, after)[..., None]
    np.testing.assert_allclose(end - rest - jump, 0.5 * circulatory, rtol=1e-9)


def test_required_torque_is_the_inverse_of_acceleration(system, grid):
    states, torque = random_states(grid.shape), np.random.default_rng(1).uniform(-2.0, 2.0, (*grid.shape, 2))
    found = acceleration(system, grid.condition, 0.08, states, torque)
    back = required_torque(system, grid.condition, 0.08, states, found)
    scale = np.abs(aerodynamic_torque(system, grid.condition, 0.08, states)).max(axis=-1, keepdims=True) + 2.0
    assert np.max(np.abs(back - torque) / scale) < 1e-12


def test_lag_states_belong_to_unsteady_damping(example, grid, variant):
    system = variant(example, damping="quasi_steady")
    with pytest.raises(ValueError, match="only with unsteady damping"):
        aerodynamic_torque(system, grid.condition, 0.0, np.zeros((*grid.shape, 6)))
    with pytest.raises(ValueError, match="5 numbers"):
        aerodynamic_torque(variant(example, damping="unsteady"), grid.condition, 0.0, np.zeros((*grid.shape, 5)))


def test_eigenvalues_are_proportional_to_airspeed(example, variant):
    from model.flight import flight_condition

    system = variant(example, damping="unsteady", virtual_inertia=True, compressibility="none")
    condition = flight_condition(2000.0, "airspeed", np.array([20.0, 140.0]))
    model = linearise(system, condition, trim(system, condition, REQUEST))
    slow, fast = np.sort_complex(np.linalg.eigvals(model.A))
    np.testing.assert_allclose(slow / 20.0, fast / 140.0, rtol=1e-9)


def test_batched_equals_single(system, grid):
    base = moving_trim(system, grid, 7)
    model = linearise(system, grid.condition, base)
    servo = servo_tab(model)
    for index in np.ndindex(grid.shape):
        condition = grid.condition.take(index)
        point, single = model.take(index), linearise(system, condition, base.take(index))
        for name in ("A", "B", "C", "stiffness", "damping", "lag_torque", "state_offset", "air_torque"):
            np.testing.assert_allclose(getattr(point, name), getattr(single, name), rtol=1e-12)
        one = servo_tab(point)
        for name in ("F", "G", "numerator", "denominator", "dc_gain", "zero", "natural_frequency", "damping_ratio"):
            np.testing.assert_allclose(getattr(servo.take(index), name), getattr(one, name), rtol=1e-12)
        state = random_states((), 4)
        alone = acceleration(system, condition, 0.05, state, np.zeros(2))
        among = acceleration(system, grid.condition, 0.05, state, np.zeros(2))[index]
        np.testing.assert_allclose(among, alone, rtol=1e-12)
        np.testing.assert_allclose(
            lag_rates(system, grid.condition, state)[index], lag_rates(system, condition, state), rtol=1e-12
        )


def test_servo_tab_transfer_function_is_that_of_the_state_space(system, grid):
    servo = servo_tab(linearise(system, grid.condition, trim(system, grid.condition, REQUEST)))
    assert servo.states == ("da", "da_rate", "lag_1", "lag_2")
    assert servo.numerator.shape == (*grid.shape, 4)
    assert servo.denominator.shape == (*grid.shape, 5)
    for s in (0.3j, 40j, -3 + 7j, 900j):
        column = servo.G[..., 0] + s * servo.G[..., 1]
        expected = np.linalg.solve(s * np.eye(4) - servo.F, column[..., None])[..., 0, 0]
        top = servo.numerator @ s ** np.arange(3, -1, -1)
        bottom = servo.denominator @ s ** np.arange(4, -1, -1)
        np.testing.assert_allclose(top / bottom, expected, rtol=1e-9)


def test_servo_tab_is_the_coupled_model_with_the_tab_imposed(system, grid):
    """At a frequency s, the aileron's equation with dt = 1 and without the tab's acceleration."""
    model = linearise(system, grid.condition, trim(system, grid.condition, REQUEST))
    servo = servo_tab(model)
    s = np.full(grid.shape, 5.0 + 30.0j)
    air = transfer_of_the_air(model, s)
    expected = air[..., 1, 0] / (model.inertia[..., 1, 1] * s**2 - air[..., 1, 1])
    top = servo.numerator @ s[0, 0] ** np.arange(3, -1, -1)
    bottom = servo.denominator @ s[0, 0] ** np.arange(4, -1, -1)
    np.testing.assert_allclose(top / bottom, expected, rtol=1e-9)


def test_servo_tab_figures(system, grid, variant):
    model = linearise(system, grid.condition, trim(system, grid.condition, REQUEST))
    servo = servo_tab(model)
    quasi = variant(system, damping="quasi_steady")
    limit = servo_tab(linearise(quasi, grid.condition, trim(quasi, grid.condition, REQUEST)))
    np.testing.assert_allclose(servo.dc_gain, limit.dc_gain, rtol=1e-10)
    np.testing.assert_allclose(servo.static_stiffness, limit.denominator[..., 2], rtol=1e-10)
    np.testing.assert_allclose(servo.static_tab_effect, limit.numerator[..., 1], rtol=1e-10)
    for index in np.ndindex(grid.shape):
        pair = [s for s in np.roots(servo.denominator[index]) if s.imag > 0]
        least = min(pair, key=lambda s: -s.real / abs(s))
        assert servo.natural_frequency[index] == pytest.approx(abs(least), rel=1e-9)
        assert servo.damping_ratio[index] == pytest.approx(-least.real / abs(least), rel=1e-8)
        zeros = np.roots(servo.numerator[index])
        assert servo.zero[index] == pytest.approx(zeros[np.argmax(abs(zeros))].real, rel=1e-9)


def test_servo_tab_of_a_model_that_is_not_finite_is_nan(system, grid):
    base = trim(system, grid.condition, REQUEST)
    model = linearise(system, grid.condition, base)
    mask = np.ones(grid.shape, dtype=bool)
    mask[1, 2] = False
    servo = servo_tab(model.take(mask).spread(mask))
    for name in ("zero", "natural_frequency", "damping_ratio", "dc_gain"):
        found = getattr(servo, name)
        assert np.isnan(found[1, 2])
        assert np.isfinite(found[mask]).all()


def test_servo_tab_without_a_pair_has_no_frequency(system, grid):
    """An aileron whose damping is a hundred times too large does not oscillate."""
    model = linearise(system, grid.condition, trim(system, grid.condition, REQUEST)).take((0, 0))
    heavy = replace(model, damping=model.damping * 100.0)
    servo = servo_tab(heavy)
    assert np.all(np.linalg.eigvals(servo.F).imag == 0)
    assert np.isnan(servo.natural_frequency)
    assert np.isnan(servo.damping_ratio)
    assert np.isfinite(servo.dc_gain)


def test_geometry_may_vary_instead_of_the_condition(tunnel_condition):
    from model.aerodynamics import Aerodynamics
    from model.examples import wind_tunnel
    from model.hinge_moments.thin_aerofoil import ThinAerofoil
    from model.section import Geometry
    from model.system import TabAileron

    tab_hinge, bodies = np.array([0.8, 0.9, 0.97]), wind_tunnel().inertia

    def system(hinge):
        aerodynamics = Aerodynamics(ThinAerofoil(0.7, hinge), damping="unsteady")
        return TabAileron(Geometry(0.6, 0.8, 0.7, hinge), bodies, aerodynamics)

    sweep = system(tab_hinge)
    model = linearise(sweep, tunnel_condition, trim(sweep, tunnel_condition, REQUEST))
    assert model.A.shape == (3, 6, 6)
    for i, hinge in enumerate(tab_hinge):
        single = linearise(system(hinge), tunnel_condition, trim(system(hinge), tunnel_condition, REQUEST))
        np.testing.assert_allclose(model.A[i], single.A, rtol=1e-11)
        np.testing.assert_allclose(servo_tab(model).denominator[i], servo_tab(single).denominator, rtol=1e-11)
