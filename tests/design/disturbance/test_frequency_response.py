"""Frequency responses against python-control, their phase and singular values, and the frequencies chosen for them."""

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.disturbance.closed_system import closed_system
from design.disturbance.frequency_response import (
    FrequencyResponse,
    frequency_response,
    response_frequencies,
    singular_values,
)
from tests.design.disturbance.outside_loops import full_loop, of_transfer, oscillators, random_systems


def test_values_of_python_control():
    systems = random_systems(4, seed=1, n=6)
    omega = np.concatenate([[0.0], np.geomspace(1e-3, 1e5, 80)])
    found = frequency_response(systems, omega)
    assert found.value.shape == (4, 81, 3, 2)
    assert found.omega.shape == (4, 81)
    for i in range(4):
        peer = ct.ss(systems.A[i], systems.B[i], systems.C[i], systems.D[i])(1j * omega)
        np.testing.assert_allclose(found.value[i], np.moveaxis(peer, -1, 0), rtol=1e-9)
        np.testing.assert_allclose(found.magnitude[i], np.moveaxis(np.abs(peer), -1, 0), rtol=1e-9)
        np.testing.assert_allclose(
            found.singular_values[i], np.linalg.svd(np.moveaxis(peer, -1, 0), compute_uv=False), rtol=1e-9
        )


def test_roll_off_keeps_its_digits():
    """Eight lags in a row, six decades above them: ``prod 1 / (jw / a + 1)``."""
    a = np.arange(1.0, 9.0)
    system = of_transfer([0.0] * 8 + [np.prod(a)], np.poly(-a))
    omega = np.array([1e3, 1e6])
    expected = np.prod(1.0 / (1j * omega[:, None] / a + 1.0), axis=-1)
    np.testing.assert_allclose(frequency_response(system, omega).value[0, :, 0, 0], expected, rtol=1e-12)


def test_phase_goes_on_through_all_turns():
    """Eight lags end at -4 pi, with a delay of the loop's own beyond."""
    a = np.arange(1.0, 9.0)
    system = of_transfer([0.0] * 8 + [np.prod(a)], np.poly(-a))
    omega = np.geomspace(1e-3, 1e5, 200)
    expected = -np.sum(np.arctan(omega[:, None] / a), axis=-1)
    np.testing.assert_allclose(frequency_response(system, omega).phase[0, :, 0, 0], expected, rtol=1e-9)


def test_a_gap_is_left_out_of_the_phase():
    value = np.exp(-1j * np.array([0.5, 2.0, 3.5, 5.0, 6.5]))
    value[[0, 2]] = np.nan
    found = FrequencyResponse(np.arange(5.0), value[:, None, None], ("w",), ("y",))
    phase = found.phase[:, 0, 0]
    assert np.isnan(phase[[0, 2]]).all()
    np.testing.assert_allclose(phase[[1, 3, 4]], [-2.0, -5.0, -6.5])


def test_a_pole_on_the_axis_is_nan_and_alone():
    systems = of_transfer([[0.0, 0.0, 9.0]] * 2, [[1.0, 0.0, 9.0], [1.0, 1.0, 9.0]])
    found = frequency_response(systems, np.array([0.0, 3.0, 4.0]))
    assert np.isnan(found.value[0, 1]).all()
    np.testing.assert_allclose(found.value[0, [0, 2], 0, 0], [1.0, 9.0 / (9.0 - 16.0)], rtol=1e-13)
    np.testing.assert_allclose(found.value[1, 1, 0, 0], 9.0 / 3.0j, rtol=1e-13)


def test_each_point_may_have_frequencies_of_its_own():
    system = closed_system(full_loop(delay=(0.1, 0.3)), ("r_a", "n_noise"), ("x", "tab"))
    omega = response_frequencies(system.poles, 0.1, 100.0, 30)
    found = frequency_response(system, omega)
    for index in np.ndindex(2, 3):
        alone = frequency_response(system.take(index), omega[index])
        np.testing.assert_allclose(found.value[index], alone.value, rtol=1e-12)
        np.testing.assert_array_equal(found.omega[index], omega[index])
    np.testing.assert_allclose(found.take((1, 2)).phase, found.phase[1, 2], rtol=1e-12)


def test_frequencies_are_checked():
    system = oscillators(np.ones((2, 3)), 0.5)
    for omega in (np.array([-1.0]), np.array([np.inf]), np.array([np.nan])):
        with pytest.raises(ValueError, match="finite"):
            frequency_response(system, omega)
    with pytest.raises(ValueError, match="shape"):
        frequency_response(system, np.ones((3, 4)))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([(2, 2), (1, 3), (3, 1), (2, 3), (3, 3)]), st.floats(-12.0, 0.0))
def test_singular_values(seed, shape, decades):
    """Also of matrices that are nearly of rank one, or nearly unitary."""
    rng = np.random.default_rng(seed)
    left, right = (rng.standard_normal((7, k, k)) + 1j * rng.standard_normal((7, k, k)) for k in shape)
    left, right = np.linalg.qr(left)[0], np.linalg.qr(right)[0]
    size = min(shape)
    wanted = 10.0 ** (np.arange(size) * decades / 2) * (1.0 + 1e-9 * rng.random((7, 1)))
    value = (left[:, :, :size] * wanted[:, None, :]) @ right[:, :size]
    np.testing.assert_allclose(singular_values(value), wanted, rtol=1e-12, atol=1e-14)


def test_singular_values_of_what_is_missing_or_zero():
    value = np.zeros((3, 2, 2), dtype=complex)
    value[1, 0, 1] = np.nan
    value[2] = np.eye(2)
    np.testing.assert_array_equal(singular_values(value), [[0.0, 0.0], [np.nan, np.nan], [1.0, 1.0]])
    wide = np.zeros((2, 3, 3), dtype=complex)
    wide[1, 2, 2] = np.nan
    np.testing.assert_array_equal(singular_values(wide), [[0.0] * 3, [np.nan] * 3])


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 300))
def test_frequencies_hold_the_resonances(seed, count):
    rng = np.random.default_rng(seed)
    size, damping = 10.0 ** rng.uniform(-3, 5, (4, 3)), 10.0 ** rng.uniform(-6, 0.3, (4, 3))
    pole = size * (-damping + 1j * np.sqrt(np.maximum(1.0 - damping**2, 0.0)))
    poles = np.concatenate([pole, pole.conj()], axis=-1)
    omega = response_frequencies(poles, 0.01, 1e4, count)
    assert omega.shape == (4, count)
    assert np.all(omega[:, 0] == 0.01)
    assert np.all(omega[:, -1] == 1e4)
    assert np.all(np.diff(omega, axis=-1) >= 0.0)
    peak = size * np.sqrt(np.maximum(1.0 - 2.0 * damping**2, 0.0))
    shown = (damping < np.sqrt(0.5)) & (peak > 0.01) & (peak < 1e4)
    for i in range(4):
        if count >= 8:
            for w in peak[i][shown[i]]:
                assert np.min(np.abs(omega[i] / w - 1.0)) < 1e-12
        np.testing.assert_array_equal(response_frequencies(poles[i], 0.01, 1e4, count), omega[i])
        if count > 3:
            even = 1e6 ** (1.0 / (np.ceil(count / 2) - 1))
            assert np.max(omega[i][1:] / omega[i][:-1]) <= even * (1.0 + 1e-9)


def test_points_without_poles_have_even_frequencies():
    poles = np.array([[np.nan, np.nan], [-0.1 + 5.0j, -0.1 - 5.0j]], dtype=complex)
    omega = response_frequencies(poles, 1.0, 100.0, 21)
    np.testing.assert_allclose(omega[0], np.geomspace(1.0, 100.0, 21), rtol=1e-13)


def test_limits_of_frequencies_are_checked():
    for low, high in ((0.0, 1.0), (2.0, 1.0), (1.0, np.inf), (np.nan, 1.0)):
        with pytest.raises(ValueError, match="first frequency"):
            response_frequencies(np.array([-1.0 + 0.0j]), low, high, 5)
    with pytest.raises(ValueError, match="two"):
        response_frequencies(np.array([-1.0 + 0.0j]), 1.0, 2.0, 1)
