import warnings
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from design.frequency.margins import margins
from design.loop import SisoLoop
from tests.design.siso_loops import abscissa, in_other_states, of_transfer, same, stabilised

ORDERS = [1, 2, 3, 5, 7]
BEYOND = 1e-6


def ratio_of(decibels):
    return 10.0 ** (decibels / 20.0)


def right_half_plane_poles(loop, delay):
    """Poles of a single loop with its delay in the right half-plane, by the argument principle."""
    n = len(loop.b)
    w = np.concatenate([[0.0], np.geomspace(1e-4, 1e5, 200001)])
    b = loop.sign * loop.gain * loop.b
    pole, closed = np.linalg.eigvals(loop.A), np.linalg.eigvals(loop.A - np.outer(b, loop.c))
    s = 1j * w[:, None]
    denominator, both = (np.prod((s - p) / (s + 1.0), axis=-1) for p in (pole, closed))
    F = denominator + (both - denominator) * np.exp(-1j * w * delay)
    angle = np.unwrap(np.angle(F))
    assert np.abs(np.diff(angle)).max() < 1.0, "the contour is too coarse"
    assert n == len(pole)
    return round(-(angle[-1] - angle[0]) / np.pi)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", ORDERS)
def test_gain_margins_are_the_edges_of_stability(order, sign):
    """Eigenvalues just inside and just outside, most of the open loops being unstable."""
    loop = stabilised(200, order, seed=order, sign=sign, gain=2.5)
    found = margins(loop)
    up, down = ratio_of(found.gain_margin_up_db), ratio_of(found.gain_margin_down_db)
    has_up, has_down = np.isfinite(up), down > 0.0
    assert np.all(up > 1.0)
    assert np.all(down < 1.0)
    for ratio, has, inward in ((up, has_up, -1.0), (down, has_down, 1.0)):
        edge = np.where(has, ratio, 1.0)
        inside = abscissa(loop, loop.gain * np.where(has, edge * (1.0 + inward * BEYOND), 1.0))
        outside = abscissa(loop, loop.gain * edge * (1.0 - inward * BEYOND))
        assert np.all(inside < 0.0)
        assert np.all(outside[has] > 0.0)
    unstable = abscissa(loop, 0.0 * loop.gain) > 0.0
    np.testing.assert_array_equal(has_down, has_down | unstable)
    assert unstable.any()
    assert np.all(np.isfinite(found.gain_margin_down_db[unstable]))


@pytest.mark.parametrize("order", ORDERS)
def test_nothing_is_unstable_between_the_gain_margins(order):
    loop = stabilised(150, order, seed=10 + order)
    found = margins(loop)
    up = np.minimum(ratio_of(found.gain_margin_up_db), 1e5)
    down = np.maximum(ratio_of(found.gain_margin_down_db), 1e-5)
    for part in np.linspace(0.0, 0.999, 40):
        assert np.all(abscissa(loop, up**part) < 0.0)
        assert np.all(abscissa(loop, down**part) < 0.0)


@pytest.mark.parametrize("order", ORDERS)
def test_every_listed_gain_puts_a_pole_on_the_axis(order):
    loop = stabilised(100, order, seed=20 + order)
    found = margins(loop)
    there = ~np.isnan(found.gain_ratio)
    rows = np.nonzero(there)[0]
    values = np.linalg.eigvals(loop.take(rows).closed(found.gain_ratio[there]))
    distance = np.abs(values - 1j * found.gain_omega[there][:, None]).min(axis=-1)
    assert rows.size > 20
    assert np.all(distance < 1e-8 * np.maximum(1.0, np.abs(values).max(axis=-1)))


@pytest.mark.parametrize("order", ORDERS)
def test_phase_margin_is_the_edge_of_stability(order):
    """Eigenvalues of ``A - exp(-j phase) b c``: lag for a positive margin, lead for a negative one."""
    loop = stabilised(200, order, seed=30 + order)
    found = margins(loop)
    has = np.isfinite(found.phase_margin)
    nearest = np.argmin(np.where(np.isnan(found.phase), np.inf, np.abs(found.phase)), axis=-1)
    signed = np.take_along_axis(found.phase, nearest[:, None], axis=-1)[:, 0]
    np.testing.assert_array_equal(np.abs(signed)[has], found.phase_margin[has])
    outer = loop.b[:, :, None] * loop.c[:, None, :]

    def growth(phase):
        turned = np.exp(-1j * phase)[:, None, None] * outer
        return np.linalg.eigvals(loop.A - turned).real.max(axis=-1)

    margin = np.where(has, found.phase_margin, np.pi)
    for part in np.linspace(0.0, 1.0 - BEYOND, 15):
        assert np.all(growth(part * margin) < 0.0)
        assert np.all(growth(-part * margin) < 0.0)
    assert np.all(growth(np.where(has, signed * (1.0 + BEYOND), 0.0))[has] > 0.0)
    crossed = np.linalg.eigvals(loop.A - np.exp(-1j * np.where(has, signed, 0.0))[:, None, None] * outer)
    omega = np.where(has, found.crossover, 0.0)
    distance = np.abs(crossed - 1j * omega[:, None]).min(axis=-1)
    assert np.all(distance[has] < 1e-8 * np.maximum(1.0, omega[has]))


@pytest.mark.parametrize("order", [2, 4])
def test_delay_margin_is_the_edge_of_stability(order):
    loop = stabilised(12, order, seed=40 + order)
    found = margins(loop)
    for i in np.flatnonzero(np.isfinite(found.delay_margin)):
        point, margin = loop.take(i), float(found.delay_margin[i])
        assert right_half_plane_poles(point, 0.999 * margin) == 0
        assert right_half_plane_poles(point, 1.001 * margin) == 2
        for part in (0.3, 0.7):
            assert right_half_plane_poles(point, part * margin) == 0


def test_sensitivity_and_disk_margin_equal_a_search_over_frequency():
    loop = stabilised(60, 5, seed=50)
    found = margins(loop)
    w = np.geomspace(1e-4, 1e4, 4001)
    for i in range(60):
        A, b, c = loop.closed()[i], loop.b[i], loop.c[i]
        T = np.linalg.solve(1j * w[:, None, None] * np.eye(5) - A, b[:, None])[..., 0] @ c

        def peak(factor, A=A, b=b, c=c, T=T):
            def height(x):
                return -abs(1.0 - factor * (c @ np.linalg.solve(1j * np.exp(x) * np.eye(5) - A, b)))

            k = int(np.clip(np.argmax(np.abs(1.0 - factor * T)), 1, w.size - 2))
            bounds = tuple(np.log(w[[k - 1, k + 1]]))
            best = minimize_scalar(height, bounds=bounds, method="bounded", options={"xatol": 1e-11})
            return max(-best.fun, 1.0, abs(height(-np.inf)))

        np.testing.assert_allclose(found.sensitivity_peak[i], peak(1.0), rtol=2e-8)
        np.testing.assert_allclose(2.0 / found.disk_margin[i], peak(2.0), rtol=2e-8)


def test_no_factor_of_the_disk_destabilises():
    loop = stabilised(60, 4, seed=60)
    found = margins(loop)
    rng = np.random.default_rng(0)
    assert np.all((found.disk_margin > 0.0) & (found.disk_margin <= 2.0))
    for _ in range(60):
        d = found.disk_margin * 0.9999 * np.exp(2j * np.pi * rng.random(60))
        factor = (1.0 + d / 2.0) / (1.0 - d / 2.0)
        turned = factor[:, None, None] * loop.b[:, :, None] * loop.c[:, None, :]
        assert np.all(np.linalg.eigvals(loop.A - turned).real.max(axis=-1) < 0.0)


def test_some_factor_on_the_rim_of_the_disk_destabilises():
    loop = stabilised(60, 4, seed=60)
    loop = loop.take(margins(loop).disk_margin < 1.5)
    found = margins(loop)
    d = 1.001 * found.disk_margin[:, None] * np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 721))
    factor = (1.0 + d / 2.0) / (1.0 - d / 2.0)
    turned = factor[..., None, None] * (loop.b[:, :, None] * loop.c[:, None, :])[:, None]
    growth = np.linalg.eigvals(loop.A[:, None] - turned).real.max(axis=-1)
    assert len(growth) > 20
    assert np.all(growth.max(axis=-1) > 0.0)


def test_margins_bound_each_other():
    """A disk margin promises a gain and a phase margin; the peak of S promises both as well."""
    found = margins(stabilised(200, 5, seed=70))
    a, peak = found.disk_margin, found.sensitivity_peak
    assert np.all(ratio_of(found.gain_margin_up_db) >= (2 + a) / np.maximum(2 - a, 1e-300) * (1 - 1e-9))
    assert np.all(ratio_of(found.gain_margin_down_db) <= (2 - a) / (2 + a) * (1 + 1e-9))
    assert np.all(found.phase_margin >= 2 * np.arctan(a / 2) * (1 - 1e-9))
    assert np.all(found.phase_margin >= 2 * np.arcsin(0.5 / peak) * (1 - 1e-9))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("order", [2, 4, 6])
def test_agrees_with_python_control(order):
    import control

    loop = stabilised(40, order, seed=80 + order)
    found = margins(loop)
    for i in range(40):
        system = control.ss(loop.A[i], loop.b[i][:, None], loop.c[i][None, :], 0)
        gain, phase, sensitivity, _, crossover, _ = control.stability_margins(system, returnall=True)
        ours = found.gain_ratio[i][~np.isnan(found.gain_ratio[i])]
        np.testing.assert_allclose(np.sort(ours), np.sort(gain[(gain > 1e-6) & (gain < 1e6)]), rtol=1e-6)
        there = ~np.isnan(found.phase[i])
        np.testing.assert_allclose(found.phase_omega[i][there], np.sort(crossover), rtol=1e-6)
        theirs = phase[np.argsort(crossover)]
        np.testing.assert_allclose(np.rad2deg(np.abs(found.phase[i][there])), np.abs(theirs), atol=1e-5)
        # It looks at stationary points only: none means that the peak is at zero or infinite frequency.
        if len(sensitivity):
            assert found.sensitivity_peak[i] >= (1.0 - 1e-6) / np.min(sensitivity)


def test_unstable_closed_loops_have_no_margins_and_leave_the_others_alone():
    good = stabilised(3, 4, seed=90)
    bad = replace(good, gain=np.array([1.0, -40.0, 1.0]))
    assert abscissa(bad, bad.gain)[1] > 0.0
    found, expected = margins(bad), margins(good)
    for field in fields(found):
        assert np.all(np.isnan(getattr(found, field.name)[1]))
        for i in (0, 2):
            same(getattr(found, field.name)[i], getattr(expected, field.name)[i])


def test_a_closed_loop_pole_on_the_axis_is_not_stable():
    integrator = of_transfer([1.0], [1.0, 2.0, 0.0], gain=0.0)
    oscillator = SisoLoop(
        "test", np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0]), np.array(3.0), 1
    )
    for plain in (integrator, oscillator):
        for loop in (plain, *(in_other_states(plain, seed) for seed in range(6))):
            assert np.isnan(margins(loop).disk_margin)
            assert np.isnan(margins(loop).gain_margin_up_db)


def test_an_open_circuit_has_every_margin():
    found = margins(of_transfer([1.0], [1.0, 2.0, 5.0], gain=0.0))
    assert (found.gain_margin_up_db, found.gain_margin_down_db) == (np.inf, -np.inf)
    assert (found.phase_margin, found.delay_margin) == (np.inf, np.inf)
    assert np.isnan(found.crossover)
    assert (found.disk_margin, found.sensitivity_peak) == (2.0, 1.0)


def test_lower_gain_margin_at_zero_frequency():
    """``2 / (s - 1)``: half the gain puts the pole at the origin."""
    found = margins(of_transfer([1.0], [1.0, -1.0], gain=2.0))
    np.testing.assert_allclose(found.gain_ratio, [0.5])
    np.testing.assert_allclose(found.gain_omega, [0.0])
    np.testing.assert_allclose(found.gain_margin_down_db, 20.0 * np.log10(0.5))
    assert found.gain_margin_up_db == np.inf
    np.testing.assert_allclose(found.phase_margin, np.pi / 3)
    np.testing.assert_allclose(found.crossover, np.sqrt(3.0))


def test_poles_at_the_origin_are_no_lower_gain_margin():
    single = of_transfer([30.0, 100.0], np.poly([0.0, -7.0, -9.0]), gain=5.0)
    double = of_transfer([3.0, 1.0], np.poly([0.0, 0.0, -9.0]), gain=5.0)
    for plain in (single, double):
        for loop in (plain, *(in_other_states(plain, seed) for seed in range(10))):
            found = margins(loop)
            assert found.gain_margin_down_db == -np.inf
            assert np.all(np.isnan(found.gain_ratio))


def test_conditionally_stable_loop_has_a_lower_gain_margin():
    """``k (s + 2)^2 / (s^3 (s + 40))`` is stable for k > 400 / 9, by Routh's scheme."""
    found = margins(of_transfer(np.poly([-2.0, -2.0]), np.poly([0.0, 0.0, 0.0, -40.0]), gain=100.0))
    np.testing.assert_allclose(100.0 * ratio_of(found.gain_margin_down_db), 400.0 / 9.0, rtol=1e-9)
    assert found.gain_margin_up_db == np.inf


def test_integrator_with_delay_in_closed_form():
    """``k exp(-s h) / s``: phase pi/2 - k h, gain pi / (2 k h), delay pi / (2 k) - h."""
    k, h = 4.0, 0.15
    found = margins(of_transfer([1.0], [1.0, 0.0], gain=k, delay=h))
    np.testing.assert_allclose(found.phase_margin, np.pi / 2 - k * h, rtol=1e-12)
    np.testing.assert_allclose(found.crossover, k, rtol=1e-12)
    np.testing.assert_allclose(ratio_of(found.gain_margin_up_db), np.pi / (2 * k * h), rtol=1e-9)
    np.testing.assert_allclose(found.delay_margin, np.pi / (2 * k) - h, rtol=1e-12)
    assert found.gain_margin_down_db == -np.inf
    # All later turns: ratio (2 i + 1/2) pi / (k h) at (2 i + 1/2) pi / h.
    i = np.arange(DELAYED)
    np.testing.assert_allclose(found.gain_omega, (2 * i + 0.5) * np.pi / h, rtol=1e-9)
    np.testing.assert_allclose(found.gain_ratio, (2 * i + 0.5) * np.pi / (k * h), rtol=1e-9)


DELAYED = 16


@pytest.mark.parametrize("delay", [0.02, 0.3, 1.5])
def test_delayed_loops_equal_a_search_over_frequency(delay):
    loop = stabilised(25, 4, seed=100, delay=delay)
    found = margins(loop)
    plain = margins(replace(loop, delay=0.0))
    w = np.geomspace(1e-4, 1e4, 100001)
    for i in range(25):
        point = loop.take(i)
        stable = right_half_plane_poles(point, delay) == 0
        assert stable == (not np.isnan(found.disk_margin[i]))
        if not stable:
            continue
        pole, V = np.linalg.eig(point.closed())
        T = ((point.c @ V) * np.linalg.solve(V, point.b.astype(complex)) / (1j * w[:, None] - pole)).sum(-1)
        L = T / (1.0 - T) * np.exp(-1j * w * delay)
        k = np.flatnonzero((L.imag[1:] * L.imag[:-1] < 0.0) & (L.real[1:] < 0.0))
        part = L.imag[k] / (L.imag[k] - L.imag[k + 1])
        ratio = -1.0 / (L.real[k] + part * (L.real[k + 1] - L.real[k]))
        ratio = np.append(ratio, 1.0 - (1.0 / T[0]).real)
        for ours, edge in (
            (ratio_of(found.gain_margin_up_db[i]), np.min(ratio[ratio > 1.0], initial=np.inf)),
            (ratio_of(found.gain_margin_down_db[i]), np.max(ratio[(ratio > 0.0) & (ratio < 1.0)], initial=0.0)),
        ):
            if 2e-3 < edge < 500.0 or 2e-3 < ours < 500.0:
                np.testing.assert_allclose(ours, edge, rtol=1e-3)
        np.testing.assert_allclose(found.sensitivity_peak[i], np.abs(1.0 / (1.0 + L)).max(), rtol=2e-3)
        assert found.sensitivity_peak[i] >= np.abs(1.0 / (1.0 + L)).max() * (1.0 - 1e-9)
        np.testing.assert_allclose(2.0 / found.disk_margin[i], np.abs((1.0 - L) / (1.0 + L)).max(), rtol=2e-3)
        if np.isfinite(plain.delay_margin[i]) and plain.delay_margin[i] > delay:
            np.testing.assert_allclose(found.delay_margin[i], plain.delay_margin[i] - delay, rtol=1e-9)


def test_long_delays_are_searched_finely():
    """Many turns of the delay, narrow peaks: nothing on a fine grid is higher, or nearer, than what was found."""
    loop = stabilised(60, 5, seed=13, delay=5.0)
    found = margins(loop)
    stable = np.flatnonzero(~np.isnan(found.disk_margin))
    assert stable.size > 20
    w = np.unique(np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 20001), np.linspace(0.0, 60.0, 20001)]))
    for i in stable:
        pole, V = np.linalg.eig(loop.closed()[i])
        T = ((loop.c[i] @ V) * np.linalg.solve(V, loop.b[i].astype(complex)) / (1j * w[:, None] - pole)).sum(-1)
        turn = np.exp(-5.0j * w)
        T = turn * T / (1.0 + (turn - 1.0) * T)
        assert found.sensitivity_peak[i] > np.abs(1.0 - T).max() * (1.0 - 1e-8)
        assert 2.0 / found.disk_margin[i] > np.abs(1.0 - 2.0 * T).max() * (1.0 - 1e-8)
        k = np.flatnonzero((T.imag[1:] * T.imag[:-1] < 0.0) & (np.abs(np.diff(w)) < 0.01))
        low, high = ((1.0 - 1.0 / T[k + j]).real for j in (0, 1))
        nearest = np.minimum(np.abs(np.log(np.abs(low))), np.abs(np.log(np.abs(high))))
        nearest = np.min(nearest[(low > 0.0) & (high > 0.0)], initial=np.log(900.0))
        ours = np.log(10.0) / 20.0 * min(found.gain_margin_up_db[i], -found.gain_margin_down_db[i])
        assert ours < nearest + 0.02


def test_a_delay_may_stabilise():
    """``s^2 - 0.02 s + 1 - 0.2 exp(-s)`` is stable, without its delay it is not."""
    loop = of_transfer([-0.2], [1.0, -0.02, 1.0], delay=1.0)
    assert np.isnan(margins(replace(loop, delay=0.0)).phase_margin)
    assert right_half_plane_poles(loop, 1.0) == 0
    found = margins(loop)
    assert np.isfinite(found.phase_margin)
    margin = float(found.delay_margin)
    assert right_half_plane_poles(loop, 1.0 + 0.999 * margin) == 0
    assert right_half_plane_poles(loop, 1.0 + 1.001 * margin) == 2


def test_a_vanishing_delay_changes_nothing():
    loop = stabilised(20, 5, seed=110)
    plain, delayed = margins(loop), margins(replace(loop, delay=1e-9))
    near = np.abs(plain.gain_margin_up_db) < 59.0
    same(delayed.gain_margin_up_db[near], plain.gain_margin_up_db[near], 1e-5)
    near = np.abs(plain.gain_margin_down_db) < 119.0
    same(delayed.gain_margin_down_db[near], plain.gain_margin_down_db[near], 1e-5)
    for name in ("phase_margin", "crossover", "delay_margin", "disk_margin", "sensitivity_peak"):
        same(getattr(delayed, name), getattr(plain, name), 1e-6)


def test_negative_delay_is_refused():
    with pytest.raises(ValueError, match="delay"):
        margins(of_transfer([1.0], [1.0, 1.0], delay=-0.1))


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    order=st.integers(1, 6),
    time=st.floats(1e-3, 1e3),
    spread=st.floats(0.0, 6.0),
)
def test_units_of_time_and_state_do_not_matter(seed, order, time, spread):
    loop = stabilised(4, order, seed)
    unit = 2.0 ** np.round(np.random.default_rng(seed).uniform(-spread, spread, order))
    changed = replace(loop, A=loop.A / unit[:, None] * unit / time, b=loop.b / unit / time, c=loop.c * unit)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found, expected = margins(changed), margins(loop)
    for name in ("gain_ratio", "gain_margin_up_db", "gain_margin_down_db", "phase_margin", "disk_margin"):
        same(getattr(found, name), getattr(expected, name), 1e-5)
    same(found.crossover * time, expected.crossover, 1e-6)
    same(found.delay_margin / time, expected.delay_margin, 1e-6)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), order=st.integers(1, 6), ratio=st.floats(0.1, 10.0))
def test_another_gain_moves_all_gain_margins_alike(seed, order, ratio):
    """The critical gains themselves do not depend on the gain flown, as long as that is stable."""
    loop = stabilised(4, order, seed)
    found, moved = margins(loop), margins(replace(loop, gain=loop.gain * ratio))
    stable = ~np.isnan(moved.disk_margin)
    np.testing.assert_array_equal(stable, abscissa(loop, loop.gain * ratio) < 0.0)
    same(moved.gain_ratio[stable] * ratio, found.gain_ratio[stable], 1e-6)


@pytest.mark.parametrize("delay", [0.0, 0.2])
def test_grid_equals_points(delay):
    flat = stabilised(6, 4, seed=120, delay=delay)
    loop = replace(
        flat, A=flat.A.reshape(2, 3, 4, 4), b=flat.b.reshape(2, 3, 4), c=flat.c.reshape(2, 3, 4),
        gain=flat.gain.reshape(2, 3),
    )  # fmt: skip
    found = margins(loop)
    assert found.gain_margin_up_db.shape == (2, 3)
    assert found.gain_ratio.shape == (2, 3, 16 if delay else 4)
    assert found.phase.shape == (2, 3, 4)
    for i in np.ndindex(2, 3):
        one = margins(loop.take(i))
        for field in fields(found):
            same(getattr(found.take(i), field.name), getattr(one, field.name), 1e-10)
