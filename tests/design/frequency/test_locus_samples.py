from dataclasses import replace

import numpy as np
import pytest

from design.frequency.loci import root_locus
from design.frequency.poles import pole_order
from model.branches import continuous_branches
from tests.design.siso_loops import of_transfer, stabilised


def loops():
    conditional = np.polymul(np.poly([0.0, -4.0, -6.0]), [1.0, 1.4, 1.0])
    yield "one breakaway", of_transfer([1.0], np.poly([0.0, -1.0, -2.0]), gain=1.0)
    yield "a circle", of_transfer([1.0, 2.0], [1.0, 2.0, 3.0], gain=1.34)
    yield "conditionally stable", of_transfer([1.0, 2.0, 4.0], conditional, gain=100.0)
    yield "fourth order", of_transfer([1.0], [1.0, 12.0, 64.0, 128.0, 0.0], gain=100.0)
    yield "two on the axis", of_transfer([1.0, 1.0], [1.0, 12.0, 0.0, 0.0], gain=27.0)
    yield "almost three at once", of_transfer([1.0, 1.0], [1.0, 8.9, 0.0, 0.0], gain=27.0)
    product = np.polymul([1.0, 4.1, 8.0], [1.0, 4.0, 8.0])
    yield "all but a complex breakaway", of_transfer([1.0], np.polysub(product, [9.0]), gain=3.0)
    for i in range(3):
        yield f"random {i}", stabilised(3, 5, seed=3).take(i)


CASES = dict(loops())


def even_ratios(loop, locus):
    """As many gains in even ratios over the same range, the special ones among them."""
    chosen = float(loop.gain)
    special = np.concatenate([locus.crossing_gain, locus.breakaway_gain, [chosen]])
    special = np.unique(special[(special > chosen / 100.0) & (special < chosen * 100.0)].round(12))
    ratios = np.geomspace(chosen / 100.0, chosen * 100.0, locus.gains.size - 1 - special.size)
    return np.union1d(np.append(0.0, ratios), special)


def worst(loop, gains, window):
    """Largest step between samples, and largest distance of the curve from its chord, in parts of the window."""
    parts = np.linspace(0.0, 1.0, 9)[:-1]
    fine = np.append((gains[:-1, None] + np.diff(gains)[:, None] * parts).ravel(), gains[-1])
    closed = loop.A - loop.sign * fine[:, None, None] * np.outer(loop.b, loop.c)
    branches = continuous_branches(pole_order(np.linalg.eigvals(closed).astype(complex))[None])[0]
    at = branches[:, ::8]
    inside = (np.abs(at[:, 1:]) < window) & (np.abs(at[:, :-1]) < window)
    chord = np.diff(at)
    length = np.abs(chord)
    off = np.zeros(length.shape)
    for i in range(1, 8):
        way = branches[:, i::8] - at[:, :-1]
        along = np.clip((way * chord.conj()).real / np.maximum(length, 1e-100) ** 2, 0.0, 1.0)
        off = np.maximum(off, np.abs(way - along * chord))
    return (length * inside).max() / window, (off * inside).max() / window


@pytest.mark.parametrize("name", CASES)
def test_samples_draw_the_locus_more_smoothly_than_even_ratios(name):
    loop = CASES[name]
    locus = root_locus(loop)
    meeting = locus.breakaway_point[~np.isnan(locus.breakaway_gain)]
    chosen = locus.branches[:, np.argmin(np.abs(locus.gains - loop.gain))]
    window = 1.5 * np.abs(np.concatenate([locus.branches[:, 0], meeting, chosen])).max()
    step, off = worst(loop, locus.gains, window)
    even_step, even_off = worst(loop, even_ratios(loop, locus), window)
    assert step < 0.035
    assert step < 0.9 * even_step
    assert off < 2e-3
    assert off < 0.15 * even_off


def test_steps_next_to_a_breakaway_are_like_the_others():
    """Poles move like a square root there: even steps in the gain would make the first ones many times longer."""
    locus = root_locus(CASES["one breakaway"])
    k = np.argmin(np.abs(locus.gains - locus.breakaway_gain[0]))
    step = np.abs(np.diff(locus.branches, axis=-1)).max(axis=0)
    beside = step[k - 4 : k + 4]
    assert beside.max() < 2.0 * beside.min()
    gap = np.diff(locus.gains)[k : k + 4]
    np.testing.assert_allclose(gap / gap[0], [1.0, 3.0, 5.0, 7.0], rtol=0.25)


def test_few_samples_go_where_nothing_moves():
    """A pole pair at 1 rad/s that a zero pair all but cancels: it moves over half a decade of gain, then stays."""
    denominator = np.polymul([1.0, 0.02, 1.0], [1.0, 50.0])
    locus = root_locus(of_transfer([1.0, 0.03, 1.01], denominator, gain=10.0))
    slow = np.abs(locus.gains) < 1.0
    even = np.geomspace(0.1, 1e3, 299)
    assert slow.sum() < 0.5 * (even < 1.0).sum()


def test_every_part_of_the_range_has_some():
    locus = root_locus(stabilised(10, 5, seed=8))
    decades = np.log10(locus.gains[:, 1:])
    assert np.diff(decades, axis=-1).max() < 0.7


def test_deterministic_and_the_same_for_any_scale_of_time_and_gain():
    loop = stabilised(6, 4, seed=9)
    a, b = root_locus(loop), root_locus(loop)
    np.testing.assert_array_equal(a.gains, b.gains)
    np.testing.assert_array_equal(a.branches, b.branches)
    faster = replace(loop, A=4.0 * loop.A, b=4.0 * loop.b / 8.0, gain=8.0 * loop.gain)
    c = root_locus(faster)
    # Where poles meet they are known to half the digits, and so is how much they turn.
    np.testing.assert_allclose(c.gains, 8.0 * a.gains, rtol=1e-3)
    np.testing.assert_allclose(np.abs(c.branches).sum(axis=1), 4.0 * np.abs(a.branches).sum(axis=1), rtol=1e-3)


@pytest.mark.parametrize("order", [1, 2, 4, 7])
@pytest.mark.parametrize("sign", [1, -1])
def test_all_samples_are_closed_loop_poles(order, sign):
    loop = stabilised(8, order, seed=order + 40, sign=sign)
    locus = root_locus(loop, count=120)
    outer = sign * loop.b[:, :, None] * loop.c[:, None, :]
    closed = loop.A[:, None] - locus.gains[..., None, None] * outer[:, None]
    for power in (1, 2, 3):
        sums = np.trace(np.linalg.matrix_power(closed, power), axis1=-2, axis2=-1)
        size = (np.linalg.norm(closed, axis=(-2, -1)) + np.linalg.norm(loop.A, axis=(-2, -1))[:, None]) ** power
        assert np.all(np.abs((locus.branches**power).sum(axis=1) - sums) < 1e-11 * size)


def test_loops_without_anything_to_see():
    """No input, no output, all poles at the origin, an integral alone: gains rise all the same."""
    zero, one = np.zeros(2), np.ones(2)
    for A, b, c in (
        (np.zeros((2, 2)), zero, zero),
        (np.diag([-1.0, -2.0]), zero, one),
        (np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0])),
        (np.zeros((1, 1)), np.ones(1), np.ones(1)),
    ):
        locus = root_locus(replace(CASES["a circle"], A=A, b=b, c=c, gain=np.array(2.0)))
        assert np.all(np.diff(locus.gains) > 0.0)
        assert np.all(np.isfinite(locus.branches))
        assert locus.gains.size == 300
