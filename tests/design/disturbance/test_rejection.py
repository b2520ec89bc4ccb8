"""Rejected steps against closed forms, dense exact samples, and a delayed loop integrated step by step."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.special import lambertw

from design.disturbance.closed_system import ClosedSystem, closed_system
from design.disturbance.rejection import rejection
from tests.design.disturbance.outside_loops import (
    full_loop,
    of_transfer,
    oscillators,
    plain_loop,
    random_systems,
    same_at_every_point,
)

FIELDS = ("peak", "peak_time", "rejection_time", "residual")


def _figures(found, index=(0, 0, 0)):
    return [float(getattr(found, field)[index]) for field in FIELDS]


@pytest.mark.parametrize("a", [1e-3, 1.0, 377.0, 1e5])
def test_a_double_lag_behind_an_integral_action(a):
    """``s / (s + a)^2``: ``t exp(-a t)``, largest at 1/a; it comes back to 5 % where Lambert's W says."""
    found = rejection(of_transfer([0.0, 1.0, 0.0], [1.0, 2.0 * a, a * a]))
    gone = -lambertw(-0.05 / np.e, -1).real / a
    np.testing.assert_allclose(_figures(found), [np.exp(-1.0) / a, 1.0 / a, gone, 0.0], rtol=1e-8)
    np.testing.assert_allclose(
        _figures(rejection(of_transfer([0.0, -1.0, 0.0], [1.0, 2.0 * a, a * a]), 0.5))[:3],
        [-np.exp(-1.0) / a, 1.0 / a, -lambertw(-0.5 / np.e, -1).real / a],
        rtol=1e-8,
    )


def test_a_jump_and_a_value_that_is_only_approached():
    """``s / (s + a)`` jumps to 1 and decays; ``1 / (s + a)`` rises to 1/a and stays."""
    found = rejection(of_transfer([[1.0, 0.0], [0.0, -1.0]], [[1.0, 8.0]] * 2))
    np.testing.assert_allclose(_figures(found), [1.0, 0.0, np.log(20.0) / 8.0, 0.0], rtol=1e-8, atol=1e-15)
    np.testing.assert_allclose(_figures(found, (1, 0, 0)), [-0.125, np.nan, np.nan, -0.125], rtol=1e-12)


def test_a_small_rest_within_the_band():
    """``(s + c) / (s + a)`` jumps to 1 and settles to ``c / a``, inside the band or outside."""
    found = rejection(of_transfer([[1.0, 0.04], [1.0, 0.06], [1.0, -0.04]], [[1.0, 1.0]] * 3))
    for i, rest in enumerate((0.04, 0.06, -0.04)):
        gone = np.log((1.0 - rest) / (0.05 - rest)) if abs(rest) < 0.05 else np.nan
        np.testing.assert_allclose(_figures(found, (i, 0, 0)), [1.0, 0.0, gone, rest], rtol=1e-8, atol=1e-15)


def test_oscillators_closed_form():
    """The overshoot of a second-order step is ``exp(-pi z / sqrt(1 - z^2))``, at ``pi / (w sqrt(1 - z^2))``."""
    omega = np.array([1e-2, 1.0, 4000.0])[:, None]
    zeta = np.array([0.005, 0.05, 0.3, 0.6])
    found = rejection(oscillators(omega, zeta))
    root = np.sqrt(1.0 - zeta**2)
    shape = (3, 4)
    peak = np.broadcast_to(1.0 + np.exp(-np.pi * zeta / root), shape)
    np.testing.assert_allclose(found.peak[..., 0, 0], peak, rtol=1e-8)
    np.testing.assert_allclose(found.peak_time[..., 0, 0], np.broadcast_to(np.pi / (omega * root), shape), rtol=1e-5)
    np.testing.assert_allclose(found.residual, 1.0, rtol=1e-12)
    assert np.isnan(found.rejection_time).all()


def test_lightly_damped_ringing_ends_where_its_envelope_does():
    """``w s / (s^2 + 2 z w s + w^2)``: ``exp(-z w t) sin(w_d t) / root``, to the last swing above the band."""
    omega = 50.0
    for zeta in (0.4, 0.05, 0.006):
        found = rejection(of_transfer([0.0, omega, 0.0], [1.0, 2.0 * zeta * omega, omega**2]))
        damped = omega * np.sqrt(1.0 - zeta**2)
        time = np.linspace(0.0, 8.0 / (zeta * omega), 1_000_001)
        course = np.exp(-zeta * omega * time) * np.sin(damped * time) / np.sqrt(1.0 - zeta**2)
        top = np.argmax(course)
        last = np.flatnonzero(np.abs(course) > 0.05 * course[top])[-1]
        expected = [course[top], time[top], time[last], 0.0]
        np.testing.assert_allclose(_figures(found), expected, rtol=1e-5, atol=2.0 * time[1])


def test_random_systems_against_dense_exact_samples():
    systems = random_systems(4, seed=11, n=5, o=3, p=2)
    found = rejection(systems, 0.1)
    for i in range(4):
        A, B, C = systems.A[i], systems.B[i], systems.C[i]
        slow = -systems.poles[i].real.max()
        step = 12.0 / slow / 30000
        M = np.block([[A, B], [np.zeros((2, 7))]])
        jump = expm(M * step)[:5]
        x, course = np.zeros((5, 2)), np.zeros((30001, 3, 2))
        for k in range(30000):
            x = jump[:, :5] @ x + jump[:, 5:]
            course[k + 1] = C @ x
        for index in np.ndindex(3, 2):
            y = course[:, index[0], index[1]]
            top = np.argmax(np.abs(y))
            np.testing.assert_allclose(found.residual[i][index], -(C @ np.linalg.solve(A, B))[index], rtol=1e-9)
            np.testing.assert_allclose(found.peak[i][index], y[top], rtol=3e-5)
            outside = np.flatnonzero(np.abs(y) > 0.1 * np.abs(y[top]))[-1]
            if outside == 30000:
                assert np.isnan(found.rejection_time[i][index])
            else:
                assert abs(found.rejection_time[i][index] - outside * step) < 2.0 * step


def test_modes_over_six_decades():
    """A fast jump, and a slow tail of twice the band that keeps it for long."""
    slow, fast = 1e-2, 1e4
    A, B = np.diag([-slow, -fast]), np.array([[0.1 * slow], [-1.0 * fast]])
    system = ClosedSystem.of(A, B, np.array([[1.0, 1.0]]), np.array([[0.9]]))
    # y = 0.9 + 0.1 (1 - exp(-slow t)) - (1 - exp(-fast t)) = exp(-fast t) - 0.1 exp(-slow t)
    found = rejection(ClosedSystem.of(system.A, system.B, system.C, system.D))
    np.testing.assert_allclose(found.peak.item(), 0.9, rtol=1e-12)
    np.testing.assert_allclose(found.rejection_time.item(), np.log(0.1 / 0.045) / slow, rtol=1e-8)
    assert found.residual.item() == 0.0


def test_the_larger_swing_counts_on_either_side():
    """Both signs of a step, of a response whose second swing is the larger one."""
    numerator, denominator = [0.0, 1.0, -1.0, 0.0], np.polymul([1.0, 1.0, 1.0], [1.0, 3.0])
    found = rejection(of_transfer([numerator, [-x for x in numerator]], [denominator] * 2))
    np.testing.assert_allclose(found.peak[0], -found.peak[1], rtol=1e-12)
    np.testing.assert_allclose(found.peak_time[0], found.peak_time[1], rtol=1e-12)
    assert found.peak[0].item() < 0.0


def test_what_has_no_figures():
    A = np.diag([-1.0, -2.0])
    nothing = rejection(ClosedSystem.of(A, np.array([[1.0], [0.0]]), np.array([[0.0, 1.0]]), np.zeros((1, 1))))
    np.testing.assert_array_equal(_figures(nothing, (0, 0)), [0.0, np.nan, np.nan, 0.0])
    unstable = rejection(ClosedSystem.of(-A, np.eye(2), np.eye(2), np.zeros((2, 2))))
    undamped = rejection(oscillators(1.0, 1e-3))
    for found in (unstable, undamped):
        assert all(np.isnan(getattr(found, field)).all() for field in FIELDS)
    rate = rejection(closed_system(full_loop(), ("n_noise",), ("x",)))
    np.testing.assert_array_equal(rate.peak, np.inf)
    assert np.isnan(rate.rejection_time).all()
    for band in (0.0, 1.0, np.nan):
        with pytest.raises(ValueError, match="band"):
            rejection(oscillators(1.0, 0.5), band)


def test_only_some_inputs_are_stepped():
    systems = random_systems(4, seed=2)
    whole, some = rejection(systems), rejection(systems, inputs=("w1",))
    for field in FIELDS:
        assert np.isnan(getattr(some, field)[..., 0]).all()
        np.testing.assert_allclose(getattr(some, field)[..., 1], getattr(whole, field)[..., 1], rtol=1e-12)
    with pytest.raises(ValueError, match="no such input as 'w7'"):
        rejection(systems, inputs=("w7",))


def test_grid_equals_points():
    """Points whose modes are decades apart do not share a mesh, and do not see each other."""
    rng = np.random.default_rng(3)
    systems = random_systems(8, seed=7)
    rate = 10.0 ** rng.uniform(-3, 3, (8, 1, 1))
    systems = ClosedSystem.of(systems.A * rate, systems.B * rate, systems.C, systems.D)
    same_at_every_point(rejection, systems, ("peak", "residual"), 1e-11)
    same_at_every_point(rejection, systems, ("peak_time", "rejection_time"), 1e-9)


def test_a_delayed_loop_against_its_differential_equation():
    """Integrated from delay to delay, each with the one before as its input, by a high-order Runge-Kutta method."""
    A = np.array([[0.0, 1.0, 0.0], [-100.0, -6.0, 120.0], [0.0, 0.0, -30.0]])
    B, K, G = np.array([[0.0], [0.0], [30.0]]), np.array([[0.4, 0.02, 0.0]]), np.array([[0.0], [1.0], [0.0]])
    delay, count = 0.03, 160
    system = closed_system(plain_loop(A, B, K, G, [[0.0]], np.eye(3)[:2], delay=delay), ("w0",), ("y0", "y1", "u0"))
    found = rejection(system, 0.2)
    pieces, x, before = [], np.zeros(3), None
    for k in range(count):

        def slope(t, x, before=before):
            late = K @ before(t - delay) if before is not None else np.zeros(1)
            return A @ x - B @ late + G[:, 0]

        piece = solve_ivp(
            slope,
            (k * delay, (k + 1) * delay),
            x,
            "DOP853",
            rtol=1e-11,
            atol=1e-14,
            max_step=delay / 8,
            dense_output=True,
        )
        before, x = piece.sol, piece.y[:, -1]
        pieces.append(piece.sol(np.linspace(k * delay, (k + 1) * delay, 2001)[:-1]))
    states = np.concatenate(pieces, axis=-1)
    course = np.concatenate([states[:2], -K @ states])
    time = np.arange(course.shape[-1]) * delay / 2000
    for i, y in enumerate(course):
        top = np.argmax(np.abs(y))
        np.testing.assert_allclose(found.peak[i, 0], y[top], rtol=1e-7)
        np.testing.assert_allclose(found.peak_time[i, 0], time[top], atol=5e-5)
        outside = np.flatnonzero(np.abs(y) > 0.2 * np.abs(y[top]))[-1]
        expected = time[outside] if outside < time.size - 1 else np.nan
        np.testing.assert_allclose(found.rejection_time[i, 0], expected, atol=5e-5)
        np.testing.assert_allclose(found.residual[i, 0], y[-1], atol=1e-4 * abs(y[top]))
