"""Peaks over frequency against closed forms, dense sweeps and searches of other kinds."""

import control as ct
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from design.disturbance import level_set
from design.disturbance.closed_system import ClosedSystem, closed_system
from design.disturbance.h2 import h2_norm
from design.disturbance.h_infinity import h_infinity_norm, pair_peaks
from design.disturbance.rejection import rejection
from tests.design.disturbance.outside_loops import (
    full_loop,
    of_transfer,
    oscillators,
    plain_loop,
    random_systems,
    same_at_every_point,
)

BOTH = pytest.mark.parametrize("peaks", [pair_peaks, h_infinity_norm])


def _sweep(system, index, count=4000):
    """Largest magnitude of each pair and largest singular value on a dense grid, poles and all."""
    poles = system.poles[index]
    size = np.abs(poles)
    ladder = np.geomspace(size.min() / 100.0, size.max() * 100.0, count)
    near = np.abs(poles.imag)[:, None] + np.abs(poles.real)[:, None] * np.linspace(-10.0, 10.0, 401)
    omega = np.concatenate([[0.0], ladder, np.abs(near).ravel()])
    value = system.take(index).response(omega)
    return np.abs(value).max(axis=0), np.linalg.norm(value, 2, axis=(-2, -1)).max()


@BOTH
def test_second_order_closed_form(peaks):
    """``1 / (2 z sqrt(1 - z^2))`` at ``w sqrt(1 - 2 z^2)``; 1 at 0 where the damping is larger than sqrt(1/2)."""
    omega = np.array([1e-2, 1.0, 377.0, 1e4])[:, None]
    zeta = np.array([1e-8, 1e-5, 1e-3, 0.1, 0.5, 0.7, 0.7072, 1.0, 5.0])
    found = peaks(oscillators(omega, zeta))
    resonant = zeta < np.sqrt(0.5)
    gain = np.where(resonant, 0.5 / (zeta * np.sqrt(np.abs(1.0 - zeta**2) + (zeta == 1.0))), 1.0)
    place = omega * np.sqrt(np.maximum(1.0 - 2.0 * zeta**2, 0.0))
    shape = (4, 9)
    np.testing.assert_allclose(found.gain.reshape(shape), np.broadcast_to(gain, shape), rtol=1e-12)
    np.testing.assert_allclose(found.omega.reshape(shape), np.broadcast_to(place, shape), rtol=1e-6)


@BOTH
def test_peaks_at_the_ends_of_the_axis(peaks):
    high_pass, all_pass, low_pass = [2.0, 0.0], [2.0, -2.0], [0.0, 2.0]
    found = peaks(of_transfer([high_pass, all_pass, low_pass, [1.0, 1.001]], [[1.0, 1.0]] * 4))
    np.testing.assert_allclose(found.gain.ravel(), [2.0, 2.0, 2.0, 1.001], rtol=1e-9)
    assert found.omega.ravel()[0] == np.inf
    np.testing.assert_array_equal(found.omega.ravel()[2:], 0.0)


@BOTH
def test_a_gain_that_only_just_exceeds_that_at_infinity(peaks):
    """``(s^2 + 2 z (1 + e) w s + w^2) / (s^2 + 2 z w s + w^2)`` is 1 at both ends and ``1 + e`` at w."""
    for excess in (1e-3, 1e-6):
        for zeta in (0.5, 1e-3):
            found = peaks(of_transfer([1.0, 2.0 * zeta * (1.0 + excess) * 7.0, 49.0], [1.0, 2.0 * zeta * 7.0, 49.0]))
            np.testing.assert_allclose(found.gain.item(), 1.0 + excess, rtol=1e-9)
            np.testing.assert_allclose(found.omega.item(), 7.0, rtol=1e-4)


def _zoomed(system, low, high):
    """Largest gain between two frequencies, and where, by looking ever closer."""
    for _ in range(30):
        omega = np.linspace(low, high, 41)
        gain = np.abs(system.response(omega)[:, 0, 0])
        best = np.clip(np.argmax(gain), 1, 39)
        low, high = omega[best - 1], omega[best + 1]
    return gain[best], omega[best]


@BOTH
@pytest.mark.parametrize("lead", [1e-7, -1e-7])
def test_two_resonances_of_nearly_the_same_height(peaks, lead):
    """One of them is two thousand times narrower than the other that it stands beside."""
    modes, weight = oscillators(np.array([10.0, 11.0]), np.array([0.02, 1e-5])), 5e-4
    A = np.zeros((4, 4))
    A[:2, :2], A[2:, 2:] = modes.A
    C = np.array([[1.0, 0.0, 1.0, 0.0]])

    def system_of(weight):
        return ClosedSystem.of(A, np.concatenate([modes.B[0], weight * modes.B[1]]), C, np.zeros((1, 1)))

    for _ in range(20):  # the weight at which they are alike, but for the lead
        tops = [_zoomed(system_of(weight), *ends) for ends in ((9.5, 10.5), (11.0 * (1 - 3e-5), 11.0 * (1 + 3e-5)))]
        weight *= (1.0 + lead) * tops[0][0] / tops[1][0]
    tops = [_zoomed(system_of(weight), *ends) for ends in ((9.5, 10.5), (11.0 * (1 - 3e-5), 11.0 * (1 + 3e-5)))]
    assert abs(tops[1][0] / tops[0][0] - 1.0 - lead) < 1e-9
    found = peaks(system_of(weight))
    gain, omega = max(tops)
    np.testing.assert_allclose(found.gain.item(), gain, rtol=1e-9)
    np.testing.assert_allclose(found.omega.item(), omega, rtol=1e-6)


@pytest.mark.parametrize(
    ("n", "o", "p", "damping"), [(2, 1, 1, None), (5, 3, 2, None), (6, 2, 3, 1e-4), (9, 3, 3, 0.01)]
)
def test_random_systems_against_a_sweep(n, o, p, damping):
    systems = random_systems(12, seed=n, n=n, o=o, p=p, damping=damping)
    pairs, whole = pair_peaks(systems), h_infinity_norm(systems)
    for i in range(12):
        magnitude, sigma = _sweep(systems, i)
        assert np.all(magnitude <= pairs.gain[i] * (1.0 + 1e-9))
        assert np.all(magnitude >= pairs.gain[i] * (1.0 - 2e-3))
        assert sigma * (1.0 - 1e-9) <= whole.gain[i] <= sigma * (1.0 + 2e-3)
        assert whole.gain[i] >= pairs.gain[i].max() * (1.0 - 1e-9)
        # The gain is there where it is said to be, by python-control.
        peer = ct.ss(systems.A[i], systems.B[i], systems.C[i], systems.D[i])
        value = np.squeeze(peer(1j * whole.omega[i], squeeze=False))
        np.testing.assert_allclose(np.linalg.norm(value.reshape(o, p), 2), whole.gain[i], rtol=1e-9)
        for index in np.ndindex(o, p):
            value = peer(1j * pairs.omega[i][index], squeeze=False).reshape(o, p)[index]
            np.testing.assert_allclose(np.abs(value), pairs.gain[i][index], rtol=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 7))
def test_modes_over_six_decades(seed, n):
    """Poles from 1e-2 to 1e4 rad/s, some hardly damped, in a chain: nothing on a sweep is above the peak."""
    rng = np.random.default_rng(seed)
    A, B, C = np.zeros((n, n)), rng.standard_normal((n, 2)), rng.standard_normal((2, n))
    k = 0
    while k < n:
        w = 10.0 ** rng.uniform(-2, 4)
        if k + 1 < n and rng.random() < 0.6:
            A[k : k + 2, k : k + 2] = [[0.0, w], [-w, -2.0 * 10.0 ** rng.uniform(-5, 0) * w]]
            k += 2
        else:
            A[k, k] = -w
            k += 1
        if k < n:
            A[k, k - 1] = rng.standard_normal() * w
    system = ClosedSystem.of(A[None], B[None], C[None], np.zeros((1, 2, 2)))
    assume(system.stable.all())  # next to the fastest pole the slowest may not be told from zero
    magnitude, sigma = _sweep(system, 0, 2000)
    pairs, whole = pair_peaks(system), h_infinity_norm(system)
    assert np.all(magnitude <= pairs.gain[0] * (1.0 + 1e-9))
    assert np.all(magnitude >= pairs.gain[0] * (1.0 - 2e-3))
    assert sigma <= whole.gain[0] * (1.0 + 1e-9)


def test_the_screen_changes_nothing(monkeypatch):
    systems = random_systems(30, seed=8, n=6, damping=1e-3)
    with_screen = pair_peaks(systems)
    proved = level_set.proved_peak
    asked = []

    def unscreened(system, start, quiet, screen):
        asked.append(screen)
        return proved(system, start, quiet)

    monkeypatch.setattr("design.disturbance.h_infinity.proved_peak", unscreened)
    without = pair_peaks(systems)
    assert asked
    np.testing.assert_allclose(with_screen.gain, without.gain, rtol=1e-9)


@pytest.mark.parametrize("start", [0.0, 1e-6, 1e6])
def test_a_bad_start_only_takes_longer(start):
    systems = random_systems(20, seed=2, n=5, o=1, p=1, damping=1e-3)
    matrices = systems.stable_points.matrices
    good = h_infinity_norm(systems)
    found = level_set.proved_peak(matrices, np.full((20, 1), start), np.zeros(20))
    np.testing.assert_allclose(found.gain, good.gain, rtol=1e-9)


def test_what_cannot_be_proved_is_not_given(monkeypatch):
    monkeypatch.setattr(level_set, "LARGEST_NUMBER_OF_PASSES", 1)
    systems = random_systems(20, seed=2, n=5, o=1, p=1, damping=1e-3)
    found = level_set.proved_peak(systems.stable_points.matrices, np.full((20, 1), 1e-6), np.zeros(20))
    assert np.isnan(found.gain).any()
    assert np.all(np.isnan(found.gain) | (np.abs(found.gain / h_infinity_norm(systems).gain[:20] - 1.0) < 1e-9))


@BOTH
def test_what_is_zero_infinite_or_missing(peaks):
    A = np.diag([-1.0, -2.0])
    nothing = peaks(ClosedSystem.of(A, np.array([[1.0], [0.0]]), np.array([[0.0, 1.0]]), np.zeros((1, 1))))
    assert nothing.gain.item() == 0.0
    assert np.isnan(nothing.omega).all()
    for growing in (np.diag([-1.0, 0.0]), np.diag([-1.0, 1e-3]), np.diag([-1.0, np.nan])):
        found = peaks(ClosedSystem.of(growing, np.eye(2), np.eye(2), np.zeros((2, 2))))
        assert np.isnan(found.gain).all()
        assert np.isnan(found.omega).all()
    # An output that takes the rate of a noisy command at once.
    found = peaks(closed_system(full_loop(), ("n_noise",), ("x",)))
    np.testing.assert_array_equal(found.gain, np.inf)
    np.testing.assert_array_equal(found.omega, np.inf)


@pytest.mark.parametrize("delay", [0.0, 0.001])
def test_an_output_that_is_not_reached_has_no_figures(delay):
    """In states that pivoting mixes, where rounding leaves something of the transfer."""
    A = [[-1.0, 100.0, 0.0], [-100.0, -1.0, 0.0], [1e5, 1e5, -3.0]]
    loop = plain_loop(
        A, [[1.0], [1.0], [0.0]], [[0.3, 0.2, 0.0]], [[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0]],
        [[1.0, 2.0, 0.0], [0.0, 0.0, 1.0]], delay,
    )  # fmt: skip
    system = closed_system(loop, ("w0", "w1"), ("y0", "y1"))
    reached = np.array([[False, True], [True, True]])
    peak = pair_peaks(system)
    np.testing.assert_array_equal(peak.gain > 0.0, reached)
    np.testing.assert_array_equal(np.isfinite(peak.omega), reached)
    np.testing.assert_array_equal(h2_norm(system).pairs > 0.0, reached)
    found = rejection(system)
    np.testing.assert_array_equal(found.peak != 0.0, reached)
    np.testing.assert_array_equal(found.residual != 0.0, reached)


@BOTH
@pytest.mark.parametrize("size", [1e-150, 1e-20, 1e150])
def test_units_do_not_matter(peaks, size):
    systems = random_systems(5, seed=6, n=4, o=2, p=2, damping=1e-3)
    scaled = ClosedSystem.of(systems.A, systems.B, systems.C * size, systems.D)
    np.testing.assert_allclose(peaks(scaled).gain / size, peaks(systems).gain, rtol=1e-9)


@BOTH
def test_grid_equals_points(peaks):
    same_at_every_point(peaks, random_systems(6, seed=1), ("gain",), 1e-12)
    same_at_every_point(peaks, random_systems(6, seed=1), ("omega",), 1e-6)


@BOTH
@pytest.mark.parametrize("product", [0.01, 0.3, 1.0, 1.5, 1.57])
def test_delayed_integrator(peaks, product):
    """``x' = -k x(t - h) + w``: ``|H|^-2 = w^2 - 2 k w sin(w h) + k^2``, by a search of its own."""
    delay = 0.02
    k = product / delay
    system = closed_system(
        plain_loop([[0.0]], [[1.0]], [[k]], [[1.0]], [[0.0]], [[1.0]], delay=delay), ("w0",), ("y0",)
    )
    found = peaks(system)

    def height(w):
        return w**2 - 2.0 * k * w * np.sin(w * delay) + k**2

    omega = np.linspace(0.0, 5.0 / delay, 200001)
    near = omega[np.argmin(height(omega))]
    top = minimize_scalar(
        height, bounds=(max(near - 1e-3, 0.0), near + 1e-3), method="bounded", options={"xatol": 1e-12}
    )
    np.testing.assert_allclose(found.gain.item(), min(top.fun, k**2) ** -0.5, rtol=1e-9)
    assert abs(found.omega.item() - top.x) < 1e-3 * top.x + 1e-3


@BOTH
def test_noise_through_a_delay(peaks):
    """The command sees the noise at once: ``u = -k (x + w)``, ``|H| = k w / |jw + k exp(-jw h)|``."""
    k, delay = 40.0, 0.03
    loop = plain_loop([[0.0]], [[1.0]], [[k]], [[0.0]], [[-k]], [[1.0]], delay=delay)
    found = peaks(closed_system(loop, ("w0",), ("u0",)))
    omega = np.linspace(1.0, 400.0, 2000001)
    expected = np.max(k * omega / np.abs(1j * omega + k * np.exp(-1j * omega * delay)))
    np.testing.assert_allclose(found.gain.item(), expected, rtol=1e-9)
    # Far slower: nothing resonates, and the gain is largest at infinity.
    slow = plain_loop([[-1.0]], [[1.0]], [[0.1]], [[0.0]], [[-0.1]], [[1.0]], delay=0.001)
    found = peaks(closed_system(slow, ("w0",), ("u0",)))
    np.testing.assert_allclose(found.gain.item(), 0.1, rtol=1e-6)


@BOTH
def test_delayed_systems_against_a_sweep(peaks):
    loop = full_loop(delay=(0.02, 0.05), seed=4)
    system = closed_system(loop, ("d_disturbance", "n_noise"), ("tab", "aileron"))
    found = peaks(system)
    same_at_every_point(peaks, system, ("gain", "omega"), 1e-12)
    omega = np.concatenate([np.linspace(0.0, 100.0, 20001), np.geomspace(100.0, 1e4, 8001)])
    for index in np.ndindex(2, 3):
        value = system.take(index).response(omega)
        swept = np.abs(value).max(axis=0) if peaks is pair_peaks else np.linalg.norm(value, 2, axis=(-2, -1)).max()
        assert np.all(swept <= found.gain[index] * (1.0 + 1e-9))
        assert np.all(swept >= found.gain[index] * (1.0 - 1e-3))
