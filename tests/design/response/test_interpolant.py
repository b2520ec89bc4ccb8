"""Polynomials through ten samples: exact for polynomials, close for sampled sines."""

import numpy as np

from design.response.interpolant import crossings, interval_integrals, local_maxima, sign_changes, windows

S = np.arange(33.0)


def test_a_polynomial_of_degree_nine_is_reproduced():
    coefficients = np.random.default_rng(0).standard_normal(10)
    polynomial = np.polynomial.Polynomial(coefficients, domain=[0.0, 32.0])
    row = np.zeros(4, dtype=int)
    places = np.array([0.3, 7.7, 20.5, 31.9])
    curve = windows(polynomial(S)[None], row, places)
    np.testing.assert_allclose(curve.value(places), polynomial(places), rtol=1e-9)
    np.testing.assert_allclose(curve.derivative().value(places), polynomial.deriv()(places), rtol=1e-8)
    primitive = polynomial.integ()
    np.testing.assert_allclose(
        curve.integral(places - 0.2, places), primitive(places) - primitive(places - 0.2), rtol=1e-8
    )
    np.testing.assert_allclose(polynomial(S) @ interval_integrals(32), np.diff(primitive(S)), rtol=1e-9, atol=1e-12)


def test_maxima_of_sines_are_found_between_the_samples():
    phases = np.linspace(0.0, 2.0 * np.pi, 12)
    signals = np.sin(0.25 * S + phases[:, None])[:, None, :]
    found = local_maxima(signals, np.full(12, 0.9), np.full(12, 1e-12))
    angles = 0.25 * found.place + phases[found.row]
    inside = np.abs(np.cos(angles)) < 1e-4
    np.testing.assert_allclose(found.value[inside], 1.0, atol=1e-9)
    # 32 samples are 8 rad, more than one turn: at least one maximum each.
    assert set(found.row[inside]) == set(range(12))
    sampled = np.sin(0.25 * np.round(found.place) + phases[found.row])
    assert np.all(found.value >= sampled - 1e-12)


def test_maximum_of_a_magnitude_follows_the_signal_through_its_sign_change():
    signal = (0.2 - np.sin(0.4 * S))[None, None, :]
    found = local_maxima(np.abs(signal), np.array([1.0]), np.array([1e-12]), signed=signal)
    np.testing.assert_allclose(np.max(found.value), 1.2, rtol=1e-6)


def test_a_maximum_at_the_joint_of_two_blocks_is_not_lost():
    first, second = np.linspace(0.0, 1.0, 33), np.linspace(1.0, 3.0, 33)
    peak = 0.99
    signal = np.stack([1.0 - (first - peak) ** 2, 1.0 - (second - peak) ** 2])[None]
    found = local_maxima(signal, np.array([0.9]), np.array([1e-12]))
    # The joint is the largest sample of both blocks; the maximum is in the first, and the second finds no more.
    assert list(found.row) == [0, 1]
    np.testing.assert_allclose(found.value, [1.0, signal[0, 1, 0]], rtol=1e-13)


def test_crossings_rise_and_fall():
    signal = np.sin(0.25 * S)[None]
    row = np.zeros(2, dtype=int)
    places = crossings(signal, row, np.array([2, 9]), np.array([0.6, 0.6]))
    np.testing.assert_allclose(places, [np.arcsin(0.6) / 0.25, (np.pi - np.arcsin(0.6)) / 0.25], rtol=1e-8)


def test_sign_changes_leave_rounding_out():
    signal = np.array([[1.0, -1.0, 1e-15, -1e-15, 0.0, 1.0, 1e-15, -1.0]])
    changes = sign_changes(signal, np.array([1e-10]))
    np.testing.assert_array_equal(np.flatnonzero(changes), [0, 1, 6])


def test_weights_integrate_a_decay():
    x = 0.5
    whole = np.exp(-x * S) @ interval_integrals(32).sum(axis=-1)
    np.testing.assert_allclose(whole, (1.0 - np.exp(-32.0 * x)) / x, rtol=1e-6)
    finer = np.exp(-0.5 * x * np.arange(65.0)) @ interval_integrals(64).sum(axis=-1) * 0.5
    np.testing.assert_allclose(finer, (1.0 - np.exp(-32.0 * x)) / x, rtol=2e-9)
