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


def test_negative_delay_is_refused():
    with pytest.raises(ValueError, match="delay"):
        margins(of_transfer([1.0], [1.0, 1.0], delay=-0.1))


def test_what_is_not_finite_and_what_is_too_large_is_refused():
    loop = stabilised(3, 4, seed=1)
    for bad in (np.nan, np.inf):
        A = loop.A.copy()
        A[1, 2, 0] = bad
        with pytest.raises(np.linalg.LinAlgError):
            margins(replace(loop, A=A))
    with pytest.raises(ValueError, match="61"):
        margins(SisoLoop("test", -np.eye(61), np.ones(61), np.ones(61), np.array(1.0), 1))


@pytest.mark.parametrize("order", [21, 30])
def test_loops_of_very_many_states(order):
    """Lags in a row: margins by a search on a grid, in closed form ``k / (s + 1)^n``."""
    A = -np.eye(order) + np.diag(np.ones(order - 1), -1)
    b, c = np.eye(order)[0], np.eye(order)[-1]
    gain = 1.1
    found = margins(SisoLoop("test", A, b, c, np.array(gain), 1))
    angle = np.pi / order
    np.testing.assert_allclose(ratio_of(found.gain_margin_up_db), np.cos(angle) ** -order / gain, rtol=1e-9)
    crossover = np.sqrt(gain ** (2 / order) - 1.0)
    np.testing.assert_allclose(found.crossover, crossover, rtol=1e-9)
    np.testing.assert_allclose(found.phase_margin, np.pi - order * np.arctan(crossover), rtol=1e-9)
    w = np.linspace(0.0, 2.0, 200001)
    L = gain / (1.0 + 1j * w) ** order
    np.testing.assert_allclose(found.sensitivity_peak, np.abs(1.0 / (1.0 + L)).max(), rtol=1e-6)
    np.testing.assert_allclose(2.0 / found.disk_margin, np.abs((1.0 - L) / (1.0 + L)).max(), rtol=1e-6)


def test_search_and_polynomials_agree(monkeypatch):
    loop = stabilised(40, 6, seed=140)
    by_polynomials = margins(loop)
    monkeypatch.setattr("design.frequency.feedback.MOST_STATES", 5)
    monkeypatch.setattr("design.frequency.crossovers.MOST_STATES", 5)
    by_search = margins(loop)
    for name in ("gain_margin_up_db", "gain_margin_down_db", "phase", "phase_omega", "delay_margin"):
        a, b = getattr(by_polynomials, name), getattr(by_search, name)
        far = np.abs(a) > 59.0 if name.endswith("db") else np.zeros(a.shape, dtype=bool)
        same(b[~far], a[~far], 1e-9)
    same(by_search.disk_margin, by_polynomials.disk_margin, 1e-8)
    same(by_search.sensitivity_peak, by_polynomials.sensitivity_peak, 1e-8)


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


@pytest.mark.parametrize("delay", [0.0, 0.2])
def test_a_grid_without_points(delay):
    found = margins(replace(stabilised(3, 4, seed=160).take(np.zeros(3, dtype=bool)), delay=delay))
    assert found.disk_margin.shape == (0,)
    assert found.phase.shape == (0, 4)
