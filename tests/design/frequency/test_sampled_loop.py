import numpy as np
import pytest
from scipy.signal import cont2discrete

from design.frequency.margins import margins
from design.frequency.sampled import sampled_margins, sampled_poles
from design.frequency.sampled_loop import Realisation, sampled_loop, tustin
from design.loop import SisoLoop
from tests.design.siso_loops import same

RNG = np.random.default_rng(17)
INPUTS = ("tab", "aileron")


def random_system(states, inputs, outputs, grid=()):
    shape = ((states, states), (states, inputs), (outputs, states), (outputs, inputs))
    A, B, C, D = (RNG.standard_normal((*grid, *each)) for each in shape)
    return Realisation(A - 3.0 * np.eye(states), B, C, D)


def response(system, z):
    """(W, m, p) at the points `z`."""
    n = system.A.shape[-1]
    return system.C @ np.linalg.solve(z[:, None, None] * np.eye(n) - system.A, system.B + 0j) + system.D


def plant_response(A, B, C, sample_time, z):
    found = cont2discrete((A, B, C, np.zeros((len(C), B.shape[1]))), sample_time, "zoh")
    return response(Realisation(*found[:4]), z)


@pytest.mark.parametrize("states", [1, 4])
def test_tustin_is_the_bilinear_transform(states):
    system, T = random_system(states, 2, 3), 0.05
    found = tustin(system, T)
    wanted = cont2discrete((system.A, system.B, system.C, system.D), T, "bilinear")
    for a, b in zip((found.A, found.B, found.C, found.D), wanted, strict=False):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14)
    z = np.exp(1j * np.linspace(0.1, 3.0, 5))
    s = 2.0 / T * (z - 1.0) / (z + 1.0)
    np.testing.assert_allclose(response(found, z), response(system, s), rtol=1e-11)


def test_tustin_of_integrator_and_derivative_filter():
    """``T/2 (z + 1) / (z - 1)``, and ``w s / (s + w)``, flat above its cut-off."""
    T, w = 0.01, 120.0
    one = np.ones((1, 1))
    integral = tustin(Realisation(0.0 * one, one, one, 0.0 * one), T)
    rate = tustin(Realisation(-w * one, w * one, -w * one, w * one), T)
    z = np.exp(1j * np.array([0.02, 0.5, 3.0]))
    np.testing.assert_allclose(response(integral, z)[:, 0, 0], T / 2 * (z + 1) / (z - 1), rtol=1e-12)
    np.testing.assert_allclose(
        response(rate, z)[:, 0, 0], w * (z - 1) / ((1 + w * T / 2) * z - (1 - w * T / 2)), rtol=1e-12
    )
    np.testing.assert_allclose(integral.A, [[1.0]], rtol=0.0)


def test_tustin_refuses_what_it_cannot_do():
    with pytest.raises(ValueError, match="sample time"):
        tustin(random_system(2, 1, 1), -1.0)
    with pytest.raises(np.linalg.LinAlgError):
        tustin(Realisation(20.0 * np.ones((1, 1)), *(np.ones((1, 1)),) * 3), 0.1)


def test_nothing_but_gains_is_a_controller():
    """``u = -K x``: no state of its own."""
    A, B, K = RNG.standard_normal((3, 3)), RNG.standard_normal((3, 1)), RNG.standard_normal((1, 3))
    empty = Realisation(np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((1, 0)), K)
    loop = sampled_loop(A, B, np.eye(3), empty, 0.1, (0.0,), ("tab",), computation=0.0)
    wanted = cont2discrete((A, B, np.eye(3), np.zeros((3, 1))), 0.1, "zoh")
    np.testing.assert_allclose(loop.closed, wanted[0] - wanted[1] @ K, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(tustin(empty, 0.1).D, K)


@pytest.mark.parametrize("samples", [0, 1, 3])
def test_loop_transfer_of_one_input(samples):
    """``K(z) G(z) / z^d``, each by itself."""
    T = 0.08
    A, B, C = RNG.standard_normal((4, 4)), RNG.standard_normal((4, 1)), RNG.standard_normal((2, 4))
    controller = tustin(random_system(3, 2, 1), T)
    loop = sampled_loop(A, B, C, controller, T, (samples * T,), ("tab",), computation=0.0).cut("tab")
    z = np.exp(1j * np.linspace(0.05, 3.1, 9))
    wanted = (response(controller, z) @ plant_response(A, B, C, T, z))[:, 0, 0] / z**samples
    n = len(loop.A)
    found = np.array([loop.c @ np.linalg.solve(x * np.eye(n) - loop.A, loop.b) for x in z])
    np.testing.assert_allclose(found, wanted, rtol=1e-9)
    assert (loop.sign, float(loop.gain), loop.sample_time) == (1, 1.0, T)


def test_computation_counts_as_delay():
    T = 0.08
    A, B, C = RNG.standard_normal((4, 4)), RNG.standard_normal((4, 1)), RNG.standard_normal((2, 4))
    controller = tustin(random_system(3, 2, 1), T)
    for computation, delay in ((0.0, 1.7), (1.0, 0.7), (1.7, 0.0), (0.4, 1.3)):
        loop = sampled_loop(A, B, C, controller, T, (delay * T,), ("tab",), computation)
        wanted = sampled_loop(A, B, C, controller, T, (1.7 * T,), ("tab",), 0.0)
        np.testing.assert_allclose(loop.closed, wanted.closed, rtol=1e-9, atol=1e-12)
    default = sampled_loop(A, B, C, controller, T, (0.7 * T,), ("tab",))
    np.testing.assert_allclose(default.closed, wanted.closed, rtol=1e-9, atol=1e-12)


def test_cuts_of_two_inputs_leave_the_other_one_closed():
    """``1 + L_i = det(I + K G) / det(I + K G without row and column i)``."""
    T, delay = 0.05, np.array([1, 3])
    A, B, C = RNG.standard_normal((4, 4)), RNG.standard_normal((4, 2)), RNG.standard_normal((3, 4))
    controller = tustin(random_system(2, 3, 2), T)
    loop = sampled_loop(A, B, C, controller, T, tuple(delay * T), INPUTS, computation=0.0)
    z = np.exp(1j * np.linspace(0.05, 3.1, 9))
    KG = response(controller, z) @ plant_response(A, B, C, T, z) / z[:, None, None] ** delay
    stacked = loop.cuts()
    for i, name in enumerate(INPUTS):
        cut = loop.cut(name)
        n = len(cut.A)
        found = np.array([cut.c @ np.linalg.solve(x * np.eye(n) - cut.A, cut.b) for x in z])
        other = 1 - i
        wanted = np.linalg.det(np.eye(2) + KG) / (1.0 + KG[:, other, other])
        np.testing.assert_allclose(1.0 + found, wanted, rtol=1e-9)
        np.testing.assert_allclose(cut.closed(), loop.closed, rtol=1e-12, atol=1e-13)
        np.testing.assert_array_equal(stacked.A[i], cut.A)
        np.testing.assert_array_equal(stacked.b[i], cut.b)


def servo_loop(gains, cut_off=400.0):
    """A lightly damped aileron under ``u = -(K_p da + K_d da' + K_i int(da))``, the rate by a filtered derivative."""
    w, damping, servo = 20.0, 0.1, 250.0
    A = np.array([[0.0, 1.0, 0.0], [-(w**2), -2 * damping * w, w**2], [0.0, 0.0, -servo]])
    B, C = np.array([[0.0], [0.0], [servo]]), np.array([[1.0, 0.0, 0.0]])
    proportional, derivative, integral = gains
    own = np.diag([0.0, -cut_off])
    controller = Realisation(
        own, np.array([[1.0], [cut_off]]), np.array([[integral, -cut_off * derivative]]),
        np.array([[proportional + cut_off * derivative]]),
    )  # fmt: skip
    return A, B, C, controller


def test_sampled_controller_goes_over_into_the_continuous_one():
    """Half a sample for the hold and one for the computation, at first order in the sample time."""
    A, B, C, controller = servo_loop((0.6, 0.03, 4.0))
    whole = np.zeros((5, 5))
    whole[:3, :3], whole[3:, 3:], whole[3:, :3] = A, controller.A, controller.B @ C
    b = np.concatenate([B[:, 0], np.zeros(2)])
    c = np.concatenate([(controller.D @ C)[0], controller.C[0]])
    limit = margins(SisoLoop("tab", whole, b, c, np.array(1.0), 1))
    assert limit.phase_margin > 0.5
    lost = []
    for T in (4e-4, 2e-4, 1e-4):
        loop = sampled_loop(A, B, C, tustin(controller, T), T, (0.0,), ("tab",))
        found = sampled_margins(loop.cut("tab"))
        nearest = np.nanargmin(np.abs(limit.phase))
        expected = limit.phase[nearest] - 1.5 * T * limit.phase_omega[nearest]
        np.testing.assert_allclose(found.phase[nearest], expected, atol=3e3 * T**2)
        lost.append(float(limit.disk_margin - found.disk_margin))
        poles = sampled_poles(loop.closed, T)
        assert poles.stable
        slow = np.sort_complex(np.linalg.eigvals(whole - np.outer(b, c)))[-3:]
        for pole in slow:
            assert np.abs(poles.equivalent - pole).min() < 100.0 * T * np.abs(pole)
    np.testing.assert_allclose(np.array(lost[:-1]) / np.array(lost[1:]), 2.0, rtol=0.1)


def test_slow_sampling_is_unstable_and_says_so():
    A, B, C, controller = servo_loop((0.6, 0.03, 4.0))
    loop = sampled_loop(A, B, C, tustin(controller, 0.05), 0.05, (0.0,), ("tab",))
    assert not sampled_poles(loop.closed, 0.05).stable
    assert np.isnan(sampled_margins(loop.cut("tab")).disk_margin)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((0.0, 0.0), INPUTS, -0.1), "computation"),
        (((0.0, 0.0), ("tab",), 1.0), "names"),
        (((0.0,), INPUTS, 1.0), "delays"),
        (((0.0, -1.0), INPUTS, 0.0), "negative"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments, message):
    controller = random_system(1, 2, 2)
    with pytest.raises(ValueError, match=message):
        sampled_loop(np.eye(3), np.ones((3, 2)), np.ones((2, 3)), controller, 0.1, *arguments)


def test_grid_equals_points():
    A, B, C = RNG.standard_normal((2, 3, 4, 4)), RNG.standard_normal((2, 3, 4, 2)), RNG.standard_normal((2, 4))
    controller = tustin(random_system(2, 2, 2, (2, 3)), 0.02)
    loop = sampled_loop(A, B, C, controller, 0.02, (0.03, 0.0), INPUTS)
    found = sampled_margins(loop.cuts())
    assert found.disk_margin.shape == (2, 2, 3)
    for i in np.ndindex(2, 3):
        one = sampled_loop(A[i], B[i], C, controller.take(i), 0.02, (0.03, 0.0), INPUTS)
        np.testing.assert_allclose(loop.closed[i], one.closed, rtol=1e-12, atol=1e-14)
        same(found.disk_margin[(slice(None), *i)], sampled_margins(one.cuts()).disk_margin)
