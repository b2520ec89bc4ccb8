from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.frequency.loci import root_locus
from design.frequency.locus_damping import gain_at_damping
from design.frequency.poles import damping_ratio
from design.loop import SisoLoop
from tests.design.siso_loops import of_transfer, stabilised

RATIOS = [-0.3, 0.0, 0.2, 0.5, 0.9]


def random_loops(count, order, seed, sign=1):
    return replace(stabilised(count, order, seed, sign), gain=np.random.default_rng(seed).lognormal(0.0, 1.0, count))


def listed(values):
    return values[~np.isnan(values)]


def poles_at(loop, gains):
    return np.linalg.eigvals(loop.A - loop.sign * gains[:, None, None] * np.outer(loop.b, loop.c))


def with_hidden(loop, pole):
    """The loop beside a mode driven by its states that it does not feed back."""
    N, n = loop.b.shape
    A = np.zeros((N, n + 1, n + 1))
    A[:, :n, :n], A[:, n, n] = loop.A, pole
    A[:, n, :n] = np.random.default_rng(0).standard_normal((N, n))
    b, c = (np.concatenate([v, np.zeros((N, 1))], axis=-1) for v in (loop.b, loop.c))
    return replace(loop, A=A, b=b, c=c)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [1, 2, 3, 5, 7])
def test_every_pole_that_passes_the_ray_is_found(order, sign):
    """Brute force: where the number of poles beyond the ray changes, there is a gain, but for poles at the origin."""
    loop = random_loops(10, order, seed=order, sign=sign)
    k = np.geomspace(1e-3, 1e3, 1001)
    for ratio in RATIOS:
        found = gain_at_damping(loop, ratio)
        assert found.gains.shape == (10, 2 * order - 2)
        for i in range(10):
            poles = poles_at(loop.take(i), k)
            beyond = (damping_ratio(poles) < ratio).sum(axis=-1)
            gains = listed(found.gains[i])
            for j in np.flatnonzero(np.diff(beyond)):
                real = np.prod(poles[j : j + 2], axis=-1).real
                inside = (gains >= k[j] * (1.0 - 1e-9)) & (gains <= k[j + 1] * (1.0 + 1e-9))
                assert inside.any() or real[0] * real[1] < 0.0


@pytest.mark.parametrize("sign", [1, -1])
def test_gains_put_a_pole_on_the_ray(sign):
    loop = random_loops(40, 5, seed=50, sign=sign)
    for ratio in RATIOS:
        found = gain_at_damping(loop, ratio)
        assert listed(found.gains).size > 10
        for i, j in np.argwhere(~np.isnan(found.gains)):
            poles = poles_at(loop.take(i), found.gains[i, j : j + 1])[0]
            wanted = found.natural_frequency[i, j] * (-ratio + 1j * np.sqrt(1.0 - ratio**2))
            nearest = poles[np.argmin(np.abs(poles - wanted))]
            assert abs(nearest - wanted) < 1e-6 * abs(wanted)
            np.testing.assert_allclose(damping_ratio(nearest), ratio, atol=1e-7)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("order", [1, 3, 5])
def test_the_interval_is_that_of_brute_force(order, ratio):
    loop = random_loops(30, order, seed=60 + order)
    found = gain_at_damping(loop, ratio)
    k = np.geomspace(1e-3, 1e3, 2001)
    for i in range(30):
        point = loop.take(i)
        least = damping_ratio(poles_at(point, k)).min(axis=-1)
        chosen = damping_ratio(np.linalg.eigvals(point.closed())).min()
        np.testing.assert_allclose(found.least_damping_ratio[i], chosen, atol=1e-9)
        low, high = found.lowest_gain[i], found.largest_gain[i]
        assert np.isnan(low) == np.isnan(high) == (chosen < ratio)
        if chosen < ratio:
            continue
        assert low <= point.gain <= high
        assert np.all(least[(k > low) & (k < high)] >= ratio - 1e-9)
        for end, outside in ((low, low * (1.0 - 1e-6)), (high, high * (1.0 + 1e-6))):
            if 0.0 < end < np.inf:
                assert damping_ratio(poles_at(point, np.array([outside]))).min() < ratio
                poles = poles_at(point, np.array([end]))
                # A pole at the origin has no damping ratio to speak of.
                assert np.abs(poles).min() < 1e-9 or damping_ratio(poles).min() > ratio - 1e-6


@pytest.mark.parametrize("pole", [0.0, -1.0, 0.5, -1e-3])
def test_a_hidden_mode_changes_nothing(pole):
    """An integral that the loop does not feed back made placement return any gain at all."""
    loop = random_loops(20, 4, seed=70)
    for ratio in RATIOS:
        plain, beside = gain_at_damping(loop, ratio), gain_at_damping(with_hidden(loop, pole), ratio)
        for name in ("gains", "natural_frequency"):
            np.testing.assert_allclose(getattr(beside, name)[:, :6], getattr(plain, name), rtol=1e-7)
            assert np.all(np.isnan(getattr(beside, name)[:, 6:]))
        for name in ("least_damping_ratio", "lowest_gain", "largest_gain"):
            np.testing.assert_allclose(getattr(beside, name), getattr(plain, name), rtol=1e-7, atol=1e-9)


def test_an_integrator_of_the_loop_itself():
    """``k / (s (s + 1) (s + 2))`` at a damping ratio of 0.5: on ``s = w e^(j 120 deg)``, ``k = 28/27, w = 2/3``."""
    found = gain_at_damping(of_transfer([1.0], np.poly([0.0, -1.0, -2.0]), gain=0.2), 0.5)
    np.testing.assert_allclose(listed(found.gains), [28.0 / 27.0])
    np.testing.assert_allclose(listed(found.natural_frequency), [2.0 / 3.0])
    assert found.lowest_gain == 0.0
    np.testing.assert_allclose(found.largest_gain, 28.0 / 27.0)


def test_an_interval_that_does_not_begin_at_zero():
    """``s^2 + (k - 1) s + 4``: damping ratio (k - 1) / 4, so 0.5 at k = 3, and real from k = 5 on."""
    loop = of_transfer([1.0, 0.0], [1.0, -1.0, 4.0], gain=4.0)
    found = gain_at_damping(loop, 0.5)
    np.testing.assert_allclose(listed(found.gains), [3.0])
    np.testing.assert_allclose(found.lowest_gain, 3.0)
    assert found.largest_gain == np.inf
    below = gain_at_damping(replace(loop, gain=np.array(2.0)), 0.5)
    np.testing.assert_allclose(below.least_damping_ratio, 0.25)
    assert np.isnan(below.lowest_gain)
    assert np.isnan(below.largest_gain)
    on_the_edge = gain_at_damping(replace(loop, gain=np.array(3.0)), 0.5)
    np.testing.assert_allclose([on_the_edge.lowest_gain, on_the_edge.largest_gain], [3.0, np.inf])


def test_a_pole_that_passes_the_origin_ends_the_interval():
    """Positive feedback of ``1 / (s^2 + s + 4)``: static divergence at k = 4, the damping being over 0.25 till then."""
    loop = of_transfer([1.0], [1.0, 1.0, 4.0], gain=1.0, sign=-1)
    found = gain_at_damping(loop, 0.25)
    assert found.lowest_gain == 0.0
    np.testing.assert_allclose(found.largest_gain, 4.0)


def test_the_axis_is_the_ray_of_no_damping():
    loop = random_loops(40, 5, seed=80)
    found, locus = gain_at_damping(loop, 0.0), root_locus(loop)
    for i in range(40):
        expected = locus.crossing_gain[i][locus.crossing_omega[i] > 0.0]
        np.testing.assert_allclose(listed(found.gains[i]), listed(expected), rtol=1e-8)


def test_signs_and_negative_gains():
    loop = random_loops(10, 4, seed=90)
    other = gain_at_damping(replace(loop, sign=-1), 0.3)
    back = gain_at_damping(replace(loop, gain=-loop.gain), 0.3)
    for name in ("gains", "lowest_gain", "largest_gain"):
        np.testing.assert_array_equal(getattr(back, name), -getattr(other, name))
    np.testing.assert_array_equal(back.natural_frequency, other.natural_frequency)


def test_a_gain_of_zero_looks_from_the_open_loop():
    loop = of_transfer([6.0], np.poly([-1.0, -2.0, -3.0]), gain=0.0)
    found = gain_at_damping(loop, 0.0)
    np.testing.assert_allclose(found.largest_gain, 10.0)
    assert found.lowest_gain == 0.0
    assert found.least_damping_ratio == 1.0


def test_nothing_moves():
    loop = SisoLoop("test", np.diag([-1.0, -2.0]), np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array(1.0), 1)
    found = gain_at_damping(loop, 0.5)
    assert np.all(np.isnan(found.gains))
    assert np.isnan(found.least_damping_ratio)
    assert (found.lowest_gain, found.largest_gain) == (0.0, np.inf)


@pytest.mark.parametrize("ratio", [1.0, -1.0, 2.0, np.nan])
def test_ratios_that_are_no_ray_are_refused(ratio):
    with pytest.raises(ValueError, match="between -1 and 1"):
        gain_at_damping(of_transfer([1.0], [1.0, 1.0]), ratio)


def test_a_ratio_for_each_point_and_grid_equals_points():
    flat = random_loops(6, 5, seed=12)
    loop = replace(
        flat, A=flat.A.reshape(2, 3, 5, 5), b=flat.b.reshape(2, 3, 5), c=flat.c.reshape(2, 3, 5),
        gain=flat.gain.reshape(2, 3),
    )  # fmt: skip
    ratios = np.linspace(0.1, 0.8, 6).reshape(2, 3)
    found = gain_at_damping(loop, ratios)
    for i in np.ndindex(2, 3):
        one = gain_at_damping(loop.take(i), ratios[i])
        for field in fields(found):
            np.testing.assert_allclose(getattr(found.take(i), field.name), getattr(one, field.name), rtol=1e-12)


def test_a_point_without_entries_is_nan_and_harms_no_neighbour():
    loop = random_loops(3, 4, seed=13)
    b = loop.b.copy()
    b[1, 2] = np.nan
    whole, broken = gain_at_damping(loop, 0.4), gain_at_damping(replace(loop, b=b), 0.4)
    for field in fields(whole):
        np.testing.assert_array_equal(getattr(whole, field.name)[[0, 2]], getattr(broken, field.name)[[0, 2]])
        assert np.all(np.isnan(getattr(broken, field.name)[1]))


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), order=st.integers(1, 6), ratio=st.floats(-0.6, 0.95))
def test_law_of_time(seed, order, ratio):
    """In another unit of time the gains are the same and the frequencies scale."""
    loop = random_loops(3, order, seed)
    found = gain_at_damping(loop, ratio)
    scaled = gain_at_damping(replace(loop, A=3.0 * loop.A, b=3.0 * loop.b), ratio)
    np.testing.assert_allclose(scaled.gains, found.gains, rtol=1e-5)
    np.testing.assert_allclose(scaled.natural_frequency, 3.0 * found.natural_frequency, rtol=1e-5)
