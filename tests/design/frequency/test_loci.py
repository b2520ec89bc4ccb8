from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.frequency import landmarks
from design.frequency.loci import root_locus
from design.frequency.poles import pole_order
from design.loop import SisoLoop
from tests.design.siso_loops import abscissa, in_other_states, of_transfer, same, stabilised

ORDERS = [1, 2, 3, 5, 7]


def random_loops(count, order, seed, sign=1):
    gains = np.random.default_rng(seed).lognormal(0.0, 1.0, count)
    return replace(stabilised(count, order, seed, sign), gain=gains)


def listed(values):
    return values[~np.isnan(values)]


def closed_at(loop, locus, gains):
    """Points and closed-loop matrices (L, n, n) of the gains in a nan padded list (*G, M)."""
    there = ~np.isnan(gains)
    rows = np.nonzero(there)[0]
    return rows, there, loop.take(rows).closed(gains[there])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", ORDERS)
def test_branch_points_are_the_closed_loop_eigenvalues(order, sign):
    loop = random_loops(12, order, seed=order, sign=sign)
    locus = root_locus(loop)
    closed = loop.A[:, None] - sign * locus.gains[..., None, None] * (loop.b[:, :, None] * loop.c[:, None, :])[:, None]
    # The least singular value of sI - A is the distance to a matrix that has s exactly.
    s = np.moveaxis(locus.branches, 1, 2)[..., None, None] * np.eye(order)
    residual = np.linalg.svd(s - closed[:, :, None], compute_uv=False)[..., -1]
    size = np.linalg.norm(loop.A, axis=(-2, -1))[:, None] + np.abs(closed - loop.A[:, None]).max(axis=(-2, -1))
    size = size[..., None]
    assert np.all(residual < 1e-12 * size)
    # Counted with multiplicity: they sum to the trace and their squares to that of the square.
    np.testing.assert_allclose(locus.branches.sum(axis=1), np.trace(closed, axis1=-2, axis2=-1), atol=1e-9 * size.max())
    squares = np.trace(closed @ closed, axis1=-2, axis2=-1)
    assert np.all(np.abs((locus.branches**2).sum(axis=1) - squares) < 1e-10 * size[..., 0] ** 2)


@pytest.mark.parametrize("order", ORDERS)
def test_jumps_shrink_as_the_gains_are_refined(order):
    """A swap of two branches would stay as large as the distance between them."""
    loop = random_loops(15, order, seed=20 + order)
    largest = []
    for count in (300, 1200, 4800):
        locus = root_locus(loop, count=count)
        reach = np.abs(locus.branches).max(axis=(1, 2))
        largest.append(np.abs(np.diff(locus.branches, axis=-1)).max(axis=(1, 2)) / reach)
    assert np.all(largest[0] < 0.3)
    # Even ratios move the fast branches by as much as the ratio; about a breakaway by its square root.
    assert np.all(largest[2] < 0.6 * largest[0] + 1e-12)
    assert np.median(largest[2] / largest[0]) < 0.3


def test_branches_are_smooth_away_from_breakaways():
    """Not only continuous: no kink where two branches cross in the plane at different gains."""
    loop = random_loops(30, 4, seed=33)
    gains = np.geomspace(1e-2, 1e2, 4000)
    locus = root_locus(loop, gains)
    step = np.diff(locus.branches, axis=-1)
    turn = np.abs(np.diff(step, axis=-1))
    near = np.zeros((30, 3998), dtype=bool)
    for i in range(30):
        for k in listed(locus.breakaway_gain[i]):
            near[i] |= np.abs(np.log(gains[1:-1] / k)) < 0.05
    scale = np.abs(locus.branches).max(axis=(1, 2))[:, None]
    assert np.all(turn.max(axis=1)[~near] < 0.01 * np.broadcast_to(scale, near.shape)[~near])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", ORDERS)
def test_crossings_are_all_of_them_and_exact(order, sign):
    loop = random_loops(60, order, seed=40 + order, sign=sign)
    locus = root_locus(loop)
    rows, there, closed = closed_at(loop, locus, locus.crossing_gain)
    values = np.linalg.eigvals(closed)
    distance = np.abs(values - 1j * locus.crossing_omega[there][:, None]).min(axis=-1)
    assert np.all(distance < 1e-8 * np.maximum(1.0, np.abs(values).max(axis=-1)))
    assert np.all(locus.crossing_gain[there] > 0.0)
    right = (locus.branches.real > 0.0).sum(axis=1)
    for i, k in np.argwhere(np.diff(right, axis=-1) != 0):
        low, high = locus.gains[i, k] * (1 - 1e-9), locus.gains[i, k + 1] * (1 + 1e-9)
        assert np.any((locus.crossing_gain[i] >= low) & (locus.crossing_gain[i] <= high))
    if order > 1:
        assert rows.size > 10


def test_crossings_of_a_wide_spread_keep_their_digits():
    """Poles from a slow integral to a fast filter: each crossing is one of a matrix next to the closed loop's."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        pole = np.append(0.0, -np.geomspace(1e-2, 1e4, 7) * rng.uniform(0.5, 2.0, 7))
        zero = np.array([-200.0, -300.0])
        loop = of_transfer(np.poly(zero), np.poly(pole), gain=1e3)
        locus = root_locus(loop)
        assert listed(locus.crossing_gain).size > 0
        for k, w in zip(listed(locus.crossing_gain), listed(locus.crossing_omega), strict=True):
            L = np.prod(1j * w - zero) / np.prod(1j * w - pole)
            np.testing.assert_allclose(k * L, -1.0, atol=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [2, 3, 5, 8])
def test_breakaways_are_all_of_them_and_double(order, sign):
    loop = random_loops(60, order, seed=60 + order, sign=sign)
    locus = root_locus(loop)
    rows, there, closed = closed_at(loop, locus, locus.breakaway_gain)
    values = np.linalg.eigvals(closed)
    distance = np.sort(np.abs(values - locus.breakaway_point[there][:, None]), axis=-1)
    assert np.all(distance[:, 1] < 1e-6 * np.linalg.norm(closed, axis=(-2, -1)))
    assert rows.size > 20
    real = (locus.branches.imag == 0.0).sum(axis=1)
    for i, k in np.argwhere(np.diff(real, axis=-1) != 0):
        low, high = locus.gains[i, k] * (1 - 1e-9), locus.gains[i, k + 1] * (1 + 1e-9)
        assert np.any((locus.breakaway_gain[i] >= low) & (locus.breakaway_gain[i] <= high))


@pytest.mark.parametrize("order", ORDERS)
def test_branches_end_on_the_asymptotes_and_the_zeros(order):
    loop = random_loops(20, order, seed=80 + order)
    loop = replace(loop, gain=np.full(20, 1e9))
    locus = root_locus(loop)
    last = locus.branches[..., -1]
    for i in range(20):
        angles = listed(locus.asymptote_angles[i])
        assert angles.size == 1  # c b is not zero
        far = last[i][np.argmax(np.abs(last[i]))]
        np.testing.assert_allclose(np.angle(far * np.exp(-1j * angles[0])), 0.0, atol=1e-6)


def test_asymptotes_of_several_branches():
    loop = of_transfer([2.0, 6.0], np.poly([0.0, -1.0, -4.0, -6.0]), gain=1e9)
    locus = root_locus(loop)
    np.testing.assert_allclose(np.rad2deg(listed(locus.asymptote_angles)), [-60.0, 60.0, 180.0])
    np.testing.assert_allclose(locus.asymptote_centroid, (-11.0 + 3.0) / 3.0)
    far = locus.branches[:, -1]
    far = far[np.abs(far) > 100.0]
    np.testing.assert_allclose(far.mean(), -8.0 / 3.0, atol=1e-3)
    np.testing.assert_allclose(np.sort(np.rad2deg(np.angle(far + 8.0 / 3.0))), [-60.0, 60.0, 180.0], atol=1e-3)
    flipped = root_locus(replace(loop, sign=-1))
    np.testing.assert_allclose(np.rad2deg(listed(flipped.asymptote_angles)), [-120.0, 0.0, 120.0])


def test_no_asymptote_when_the_input_does_not_reach_the_output():
    loop = SisoLoop("test", np.diag([-1.0, -2.0]), np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array(1.0), 1)
    locus = root_locus(loop)
    assert np.isnan(locus.asymptote_centroid)
    assert listed(locus.asymptote_angles).size == 0
    np.testing.assert_allclose(locus.branches, np.array([[-2.0], [-1.0]]) * np.ones(300), atol=1e-15)


def test_the_sign_is_that_of_the_gain():
    """A locus of ``1 - k L`` is that of ``1 + k L`` with the loop's sign turned over."""
    loop = random_loops(8, 4, seed=5)
    turned = replace(loop, c=-loop.c, sign=-1)
    a, b = root_locus(loop), root_locus(turned)
    for field in fields(a):
        if field.name not in ("branches", "sign", "departure_angles", "breakaway_point"):
            same(getattr(a, field.name), getattr(b, field.name))
    for name in ("departure_angles", "asymptote_angles", "arrival_angles"):
        listed_a, listed_b = listed(getattr(a, name)), listed(getattr(b, name))
        np.testing.assert_allclose(np.exp(1j * listed_a), np.exp(1j * listed_b), atol=1e-9)
    np.testing.assert_allclose(a.branches, b.branches, atol=1e-9)
    assert (a.sign, b.sign) == (1, -1)


@pytest.mark.parametrize("order", [2, 3, 5, 7])
def test_the_breakaways_of_both_signs_are_all_real_stationary_gains(order):
    """``d' num - d num' = 0`` with a real gain: each belongs to one of the two loci, and to no other."""
    loop = random_loops(20, order, seed=30 + order)
    both = root_locus(loop), root_locus(replace(loop, sign=-1))
    for i in range(20):
        A, b, c = loop.A[i], loop.b[i], loop.c[i]
        d = np.poly(A)
        numerator = np.poly(A - np.outer(b, c)) - d
        s = np.roots(np.polysub(np.polymul(np.polyder(d), numerator), np.polymul(d, np.polyder(numerator))))
        k = -np.polyval(d, s) / np.polyval(numerator, s)
        real = k[(np.abs(k.imag) < 1e-5 * np.abs(k)) & (np.abs(k) < 1e6) & (np.abs(k) > 1e-6)].real
        found = np.concatenate([listed(both[0].breakaway_gain[i]), -listed(both[1].breakaway_gain[i])])
        found = found[(np.abs(found) < 1e6) & (np.abs(found) > 1e-6)]
        np.testing.assert_allclose(np.sort(found), np.sort(real), rtol=1e-4)


def test_both_signs_share_the_real_axis_between_them():
    """Each point of the axis that is no pole or zero is on exactly one of the two loci: the parity rule."""
    pole, zero = np.array([-1.0, -2.5, -4.0, 1.0]), np.array([-3.0, -6.0])
    loop = of_transfer(np.poly(zero), np.poly(pole), gain=1.0)
    for s in (-7.0, -5.0, -3.5, -2.8, -1.7, 0.0, 2.0):
        k = -np.prod(s - pole) / np.prod(s - zero)
        right = np.sum(np.concatenate([pole, zero]) > s)
        assert (k > 0.0) == (right % 2 == 1)
        locus = root_locus(replace(loop, sign=1 if k > 0.0 else -1), np.array([0.0, abs(k), 2.0 * abs(k)]))
        assert np.abs(locus.branches[:, 1] - s).min() < 1e-9


def test_a_negative_chosen_gain_goes_the_other_way():
    loop = random_loops(8, 4, seed=6)
    a, b = root_locus(replace(loop, gain=-loop.gain)), root_locus(replace(loop, sign=-1))
    same(a.gains, -b.gains)
    same(a.crossing_gain, -b.crossing_gain)
    same(a.breakaway_gain, -b.breakaway_gain)
    np.testing.assert_allclose(a.branches, b.branches, atol=1e-9)


@pytest.mark.parametrize("count", [48, 100, 300])
def test_default_gains(count):
    loop = random_loops(20, 5, seed=7)
    locus = root_locus(loop, count=count)
    assert locus.gains.shape == (20, count)
    assert np.all(locus.gains[:, 0] == 0.0)
    assert np.all(np.diff(locus.gains, axis=-1) > 0.0)
    low, high = loop.gain[:, None] / 100.0, loop.gain[:, None] * 100.0
    np.testing.assert_allclose(locus.gains[:, -1:], high)
    for expected in (low, loop.gain[:, None], locus.crossing_gain, locus.breakaway_gain):
        for i, j in np.argwhere((expected >= low) & (expected < high)):
            assert np.isclose(locus.gains[i], expected[i, j], rtol=1e-9, atol=0.0).any()
    assert np.all(np.any(locus.gains == loop.gain[:, None], axis=-1))
    np.testing.assert_array_equal(pole_order(locus.branches[..., 0]), locus.branches[..., 0])


def test_default_gains_have_the_poles_of_gains_given():
    loop = random_loops(10, 6, seed=17)
    locus = root_locus(loop)
    same_gains = root_locus(loop, locus.gains)
    far = np.abs(same_gains.branches - locus.branches) > 1e-10 * np.abs(locus.branches).max(axis=(1, 2))[:, None, None]
    # Where poles meet, either continuation of each is as continuous as the other.
    assert far.mean() < 0.1
    np.testing.assert_allclose(
        np.sort_complex(np.swapaxes(locus.branches, 1, 2)).sum(axis=-1),
        np.sort_complex(np.swapaxes(same_gains.branches, 1, 2)).sum(axis=-1),
        rtol=1e-9,
    )


def test_a_point_without_entries_is_nan_and_harms_no_neighbour():
    loop = random_loops(5, 4, seed=18)
    A, gain = loop.A.copy(), loop.gain.copy()
    A[1, 0, 0], gain[3] = np.nan, np.inf
    for gains in (None, np.linspace(0.0, 2.0, 30)):
        whole, broken = root_locus(loop, gains), root_locus(replace(loop, A=A, gain=gain), gains)
        assert broken.sign == loop.sign
        for field in fields(whole):
            a, b = getattr(whole, field.name), getattr(broken, field.name)
            if field.name != "sign":
                np.testing.assert_array_equal(a[[0, 2, 4]], b[[0, 2, 4]])
                assert np.all(np.isnan(b[[1, 3]]))
    alone = root_locus(replace(loop.take(1), A=A[1]))
    assert alone.branches.shape == (4, 300)
    assert np.all(np.isnan(alone.branches))


def test_a_chosen_gain_of_zero_still_has_a_locus():
    loop = of_transfer([6.0], np.poly([-1.0, -2.0, -3.0]), gain=0.0)
    locus = root_locus(loop)
    np.testing.assert_allclose(listed(locus.crossing_gain), [10.0])
    assert locus.gains[0] == 0.0
    assert locus.gains[1] < 1.0 < 10.0 < locus.gains[-1]
    unreachable = SisoLoop("test", -np.eye(2), np.zeros(2), np.ones(2), np.array(0.0), 1)
    assert np.all(np.isfinite(root_locus(unreachable).gains))


def test_a_crossing_at_the_gain_chosen_is_there_once():
    locus = root_locus(of_transfer([1.0], np.poly([0.0, -1.0, -2.0]), gain=6.0))
    assert np.all(np.diff(locus.gains) > 0.0)
    assert np.sum(np.isclose(locus.gains, 6.0, rtol=1e-6)) == 1


def test_a_hidden_integral_does_not_hide_the_crossing_at_the_origin():
    """Positive feedback of a servo-tab, an integral of its output not yet fed back: divergence at k = 1/f."""
    A = np.array([[0.0, 1.0, 0.0], [-4.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    loop = SisoLoop("test", A, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array(2.0), -1)
    locus = root_locus(loop)
    np.testing.assert_allclose(listed(locus.crossing_gain), [4.0])
    np.testing.assert_allclose(listed(locus.crossing_omega), [0.0])
    np.testing.assert_allclose(listed(locus.breakaway_gain), [3.75])
    assert np.all(np.abs(locus.branches).min(axis=0) < 1e-12)


@pytest.mark.parametrize("pole", [-1.0, -3.0, -0.5, 0.0, 2.0, -2.0])
def test_a_pole_that_does_not_move_changes_nothing(pole):
    """``1 / (s (s + 2))`` beside a hidden pole, also where that is exactly on the locus or its breakaway."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, -2.0, 0.0], [1.0, 0.0, pole]])
    locus = root_locus(SisoLoop("test", A, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array(1.0), 1))
    np.testing.assert_allclose(listed(locus.breakaway_gain), [1.0])
    np.testing.assert_allclose(listed(locus.breakaway_point), [-1.0])
    assert listed(locus.crossing_gain).size == 0
    np.testing.assert_allclose(locus.asymptote_centroid, -1.0)
    assert np.all(np.abs(locus.branches - pole).min(axis=0) < 1e-7)


def test_response_beside_a_pole():
    diagonal, ones = np.diag([0.0, -1.0])[None], np.ones((1, 2))
    at = landmarks.response_beside_poles(diagonal, ones, ones, np.array([[-1.0 + 0.0j]]))
    assert abs(at.value[0, 0]) > 1e9


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_open_loop_poles_on_the_axis_are_no_crossings(seed):
    def seen(loop):
        return loop if seed is None else in_other_states(loop, seed)

    oscillator = seen(of_transfer([1.0, 0.0], np.polymul([1.0, 0.0, 9.0], np.poly([-5.0, -7.0]))))
    # s^4 + 12 s^3 + 44 s^2 + (108 + k) s + 315: Routh gives k (312 - k) > 0.
    np.testing.assert_allclose(listed(root_locus(oscillator).crossing_gain), [312.0])
    assert listed(root_locus(replace(oscillator, sign=-1)).crossing_gain).size == 0
    double = root_locus(seen(of_transfer([1.0, 2.0], [1.0, 0.0, 0.0])))
    assert listed(double.crossing_gain).size == 0
    np.testing.assert_allclose(listed(double.breakaway_gain), [8.0])
    np.testing.assert_allclose(listed(double.breakaway_point), [-4.0])


def test_a_triple_point_is_one_point():
    locus = root_locus(of_transfer([1.0, 1.0], [1.0, 9.0, 0.0, 0.0], gain=20.0))
    np.testing.assert_allclose(listed(locus.breakaway_gain), [27.0], rtol=1e-9)
    np.testing.assert_allclose(listed(locus.breakaway_point), [-3.0], rtol=1e-6)
    assert listed(locus.breakaway_point).imag == 0.0


def test_complex_breakaways_come_in_pairs():
    """``1 + k / ((s^2 + 4 s + 8)^2 - 9)``: with x = s^2 + 4 s + 8, x^2 = 9 - k; pairs meet where x = 0, k = 9."""
    denominator = np.polysub(np.polymul([1.0, 4.0, 8.0], [1.0, 4.0, 8.0]), [9.0])
    locus = root_locus(of_transfer([1.0], denominator))
    np.testing.assert_allclose(listed(locus.breakaway_gain), [9.0, 9.0])
    np.testing.assert_allclose(listed(locus.breakaway_point), [-2.0 - 2.0j, -2.0 + 2.0j], atol=1e-9)
    gap = np.abs(np.diff(locus.branches, axis=-1)).max()
    assert gap < 0.35


def test_given_gains():
    loop = random_loops(3, 3, seed=8)
    gains = np.linspace(-2.0, 3.0, 40)
    locus = root_locus(loop, gains)
    np.testing.assert_array_equal(locus.gains, np.broadcast_to(gains, (3, 40)))
    own = gains * np.array([[1.0], [2.0], [3.0]])
    np.testing.assert_array_equal(root_locus(loop, own).gains, own)
    closed = loop.take(1).closed(gains[10])
    np.testing.assert_allclose(pole_order(locus.branches[1, :, 10]), pole_order(np.linalg.eigvals(closed) + 0j))


@pytest.mark.parametrize("gains", [[1.0], [0.0, 1.0, 1.0], [0.0, 2.0, 1.0], [0.0, np.nan, 1.0]])
def test_gains_that_make_no_locus_are_refused(gains):
    with pytest.raises(ValueError, match="monotonic"):
        root_locus(of_transfer([1.0], [1.0, 1.0]), np.array(gains))


def test_too_few_gains_are_refused():
    loop = stabilised(2, 5, seed=1)
    assert root_locus(loop, count=36).gains.shape == (2, 36)
    with pytest.raises(ValueError, match="at least"):
        root_locus(loop, count=20)


@pytest.mark.filterwarnings("ignore")
def test_agrees_with_python_control():
    import control

    loop = random_loops(4, 5, seed=11)
    locus = root_locus(loop)
    for i in range(4):
        system = control.ss(loop.A[i], loop.b[i][:, None], loop.c[i][None, :], 0)
        theirs = control.root_locus_map(system, gains=locus.gains[i]).loci
        ours = locus.branches[i].T
        np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(theirs), atol=2e-6)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), order=st.integers(1, 6), sign=st.sampled_from([1, -1]))
def test_crossings_separate_the_stable_gains_from_the_others(seed, order, sign):
    loop = random_loops(3, order, seed, sign)
    locus = root_locus(loop)
    for i in range(3):
        point = loop.take(i)
        edges = np.concatenate([[0.0], listed(locus.crossing_gain[i])])
        between = np.append(0.5 * (edges[1:] + edges[:-1]), 2.0 * edges[-1] + 1.0)
        counts = [(np.linalg.eigvals(point.closed(k)).real > 0.0).sum() for k in between]
        for k in np.random.default_rng(seed).uniform(0.0, between[-1], 20):
            place = np.searchsorted(edges, k) - 1
            assert (np.linalg.eigvals(point.closed(k)).real > 0.0).sum() == counts[place]


def test_grid_equals_points():
    flat = random_loops(6, 5, seed=12)
    loop = replace(
        flat, A=flat.A.reshape(2, 3, 5, 5), b=flat.b.reshape(2, 3, 5), c=flat.c.reshape(2, 3, 5),
        gain=flat.gain.reshape(2, 3),
    )  # fmt: skip
    locus = root_locus(loop)
    assert locus.branches.shape == (2, 3, 5, 300)
    assert locus.crossing_gain.shape == (2, 3, 5)
    assert locus.breakaway_point.shape == (2, 3, 8)
    assert locus.asymptote_angles.shape == (2, 3, 5)
    given = root_locus(loop, np.linspace(0.0, 5.0, 200))
    for i in np.ndindex(2, 3):
        for all_of_them, one in (
            (locus, root_locus(loop.take(i))),
            (given, root_locus(loop.take(i), np.linspace(0.0, 5.0, 200))),
        ):
            for field in fields(locus):
                mine, alone = getattr(all_of_them.take(i), field.name), getattr(one, field.name)
                np.testing.assert_allclose(mine, alone, rtol=1e-12, atol=1e-12)


def test_abscissa_at_the_crossing_is_zero():
    loop = of_transfer([1.0], np.poly([0.0, -1.0, -2.0]), gain=3.0)
    k = listed(root_locus(loop).crossing_gain)[0]
    np.testing.assert_allclose(abscissa(loop, k), 0.0, atol=1e-12)
