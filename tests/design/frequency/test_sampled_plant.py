from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete

from design.frequency.sampled_plant import sampled_plant

RNG = np.random.default_rng(11)


def random_plant(order, inputs, count=3):
    return RNG.standard_normal((count, order, order)), RNG.standard_normal((count, order, inputs))


@pytest.mark.parametrize("sample_time", [1e-3, 0.1, 2.0])
def test_without_delay_it_is_the_zero_order_hold(sample_time):
    A, B = random_plant(4, 2)
    found = sampled_plant(A, B, sample_time, (0.0, 0.0))
    assert found.A.shape == (3, 4, 4)
    for i in range(3):
        wanted = cont2discrete((A[i], B[i], np.eye(4), np.zeros((4, 2))), sample_time, "zoh")
        np.testing.assert_allclose(found.A[i], wanted[0], rtol=1e-11, atol=1e-12)
        np.testing.assert_allclose(found.B[i], wanted[1], rtol=1e-11, atol=1e-12)


def test_first_order_lag_in_closed_form():
    a, T, whole, part = 3.0, 0.2, 2, 0.35
    found = sampled_plant(np.array([[-a]]), np.array([[1.0]]), T, ((whole + part) * T,))
    held = np.exp(-a * (1 - part) * T)
    A = np.zeros((4, 4))
    A[0] = [np.exp(-a * T), 0.0, (1.0 - held) / a, held * (1.0 - np.exp(-a * part * T)) / a]
    A[2, 1] = A[3, 2] = 1.0
    np.testing.assert_allclose(found.A, A, rtol=1e-13, atol=1e-15)
    np.testing.assert_array_equal(found.B, [[0.0], [1.0], [0.0], [0.0]])
    assert (found.plant_states, found.sample_time) == (1, T)


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    first=st.floats(0.0, 3.3),
    second=st.sampled_from([0.0, 0.25, 1.0, 1.6, 2.0]),
)
def test_samples_are_those_of_the_differential_equation(seed, first, second):
    """Commands drawn at random, each input with its own delay, followed by an ODE solver from switch to switch."""
    rng, T = np.random.default_rng(seed), 0.3
    A, B = rng.standard_normal((3, 3)), rng.standard_normal((3, 2))
    delay = np.array([first, second]) * T
    commands = rng.standard_normal((9, 2))
    found = sampled_plant(A, B, T, tuple(delay))
    x, samples = np.zeros(found.A.shape[0]), []
    x[:3] = start = rng.standard_normal(3)
    for v in commands:
        samples.append(x[:3])
        x = found.A @ x + found.B @ v
    switches = np.unique(np.concatenate([T * np.arange(9)] + [T * np.arange(9) + d for d in delay]))
    switches = switches[switches <= 8 * T + 1e-12]
    state, at = start, {0: start}
    for begin, end in pairwise(switches):
        k = np.floor((0.5 * (begin + end) - delay) / T).astype(int)
        u = np.where(k >= 0, commands[np.maximum(k, 0), [0, 1]], 0.0)
        state = solve_ivp(lambda t, x, u=u: A @ x + B @ u, (begin, end), state, rtol=1e-10, atol=1e-12).y[:, -1]
        at[round(end / T * 1e6)] = state
    for k, sample in enumerate(samples):
        np.testing.assert_allclose(sample, at[round(k * 1e6)], rtol=1e-6, atol=1e-7)


def test_delay_is_continuous_through_whole_samples():
    """Just short of two samples, two, and just beyond: the same response at every frequency."""
    A, B = random_plant(3, 1, 1)
    z = np.exp(1j * np.linspace(0.01, 3.1, 7))

    def response(delay):
        plant = sampled_plant(A[0], B[0], 0.1, (delay,))
        n = len(plant.A)
        return np.array([np.linalg.solve(x * np.eye(n) - plant.A, plant.B)[:3, 0] for x in z])

    for near in (0.2 - 1e-9, 0.2 + 1e-9, 0.2 * (1 + 1e-15)):
        np.testing.assert_allclose(response(near), response(0.2), rtol=1e-6, atol=1e-8)


def test_rounding_does_not_make_a_part_of_a_sample():
    """0.3 / 0.1 is a little less than 3, 0.007 / 0.001 exactly 7, 0.0021 / 0.0007 a little more than 3."""
    for T, delay, whole in ((0.1, 0.3, 3), (0.001, 0.007, 7), (0.0007, 0.0021, 3)):
        assert sampled_plant(np.zeros((1, 1)), np.ones((1, 1)), T, (delay,)).A.shape == (1 + whole, 1 + whole)


def test_integrators_are_exact():
    """``1 / s^2``: (T^2 / 2, T), and what half a sample of delay makes of it."""
    A, B, T = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), 0.5
    found = sampled_plant(A, B, T, (0.25,))
    np.testing.assert_allclose(found.A, [[1.0, T, 3 * T**2 / 8], [0.0, 1.0, T / 2], [0.0, 0.0, 0.0]], rtol=1e-14)
    np.testing.assert_allclose(found.B[:, 0], [T**2 / 8, T / 2, 1.0], rtol=1e-14)


@pytest.mark.parametrize(
    ("sample_time", "delay", "message"),
    [
        (0.0, (0.0,), "sample time"),
        (np.nan, (0.0,), "sample time"),
        (0.1, (-1e-3,), "negative"),
        (0.1, (0.0, 0.0), "2"),
    ],
)
def test_what_makes_no_sense_is_refused(sample_time, delay, message):
    with pytest.raises(ValueError, match=message):
        sampled_plant(np.zeros((1, 1)), np.ones((1, 1)), sample_time, delay)


def test_grid_equals_points():
    A, B = RNG.standard_normal((2, 3, 4, 4)), RNG.standard_normal((2, 3, 4, 2))
    found = sampled_plant(A, B, 0.1, (0.13, 0.3))
    assert found.A.shape == (2, 3, 9, 9)
    for i in np.ndindex(2, 3):
        one = sampled_plant(A[i], B[i], 0.1, (0.13, 0.3))
        np.testing.assert_allclose(found.A[i], one.A, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(found.B[i], one.B, rtol=1e-12, atol=1e-14)
