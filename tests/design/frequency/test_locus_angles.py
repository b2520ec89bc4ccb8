from dataclasses import replace

import numpy as np
import pytest

from design.frequency.loci import root_locus
from design.loop import SisoLoop
from tests.design.siso_loops import in_other_states, of_transfer, stabilised

SMALL = np.array([0.0, 1e-7])


def turned(a, b):
    """Angle between two directions [rad]."""
    return np.abs(np.angle(np.exp(1j * (a - b))))


def degrees(angles):
    return np.rad2deg(angles[~np.isnan(angles)])


def return_difference(loop, s):
    """``-sign L(s)``: its argument is 0 on the locus."""
    n = loop.A.shape[-1]
    return -loop.sign * loop.c @ np.linalg.solve(s * np.eye(n) - loop.A, loop.b)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [1, 2, 3, 5, 7])
def test_branches_leave_in_the_departure_angles(order, sign):
    loop = stabilised(60, order, seed=order, sign=sign)
    locus = root_locus(loop, SMALL)
    way = locus.branches[..., 1] - locus.branches[..., 0]
    assert np.all(turned(np.angle(way), locus.departure_angles) < 1e-5)
    assert np.all((locus.departure_angles > -np.pi) & (locus.departure_angles <= np.pi))


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("order", [2, 3, 5, 7])
def test_points_beside_poles_and_zeros_are_on_the_locus(order, sign):
    """The angle condition itself: next to a pole or a zero, in the direction given, ``1 + k L = 0`` for a real k."""
    loop = stabilised(30, order, seed=order + 10, sign=sign)
    locus = root_locus(loop, SMALL)
    for i in range(30):
        zeros = locus.zeros[i][~np.isnan(locus.zeros[i])]
        assert zeros.size == order - 1  # c b is not zero
        points = np.concatenate([locus.branches[i, :, 0], zeros])
        angles = np.concatenate([locus.departure_angles[i], locus.arrival_angles[i][: zeros.size]])
        for p, angle in zip(points, angles, strict=True):
            nearest = np.sort(np.abs(points - p))[1]
            s = p + 1e-5 * nearest * np.exp(1j * angle)
            assert abs(np.angle(return_difference(loop.take(i), s))) < 1e-3


def test_zeros_are_where_poles_go():
    loop = stabilised(10, 5, seed=3)
    locus = root_locus(loop)
    for i in range(10):
        far = np.linalg.eigvals(loop.take(i).closed(1e9))
        for z in locus.zeros[i, :4]:
            assert np.abs(far - z).min() < 1e-3 * abs(z)
            b, c, inverse = loop.b[i], loop.c[i], np.linalg.inv(z * np.eye(5) - loop.A[i])
            assert abs(c @ inverse @ b) < 1e-11 * np.abs(c) @ np.abs(inverse) @ np.abs(b)
    assert np.all(np.isnan(locus.zeros[:, 4]))
    assert np.all(np.isnan(locus.arrival_angles[:, 4]))


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
@pytest.mark.parametrize(
    ("pole", "sign", "expected"),
    [
        ([0.0, 0.0], 1, [-90.0, 90.0]),
        ([0.0, 0.0], -1, [0.0, 180.0]),
        ([-1.0, -1.0, -1.0], 1, [-60.0, 60.0, 180.0]),
        ([-1.0, -1.0, -1.0], -1, [-120.0, 0.0, 120.0]),
        ([-2.0, -2.0, -2.0, -2.0], 1, [-135.0, -45.0, 45.0, 135.0]),
    ],
)
def test_multiple_poles_send_their_branches_in_all_directions(pole, sign, expected, seed):
    loop = replace(of_transfer([1.0], np.poly(pole)), sign=sign)
    if seed is not None:
        loop = in_other_states(loop, seed)
    locus = root_locus(loop, np.linspace(0.0, 1.0, 50))
    np.testing.assert_allclose(np.sort(degrees(locus.departure_angles)), expected, atol=1e-6)
    # Each branch has the angle in which it goes.
    way = locus.branches[:, 1] - np.mean(pole)
    assert np.all(turned(np.angle(way), locus.departure_angles) < 1e-2)


def test_a_double_pair_and_a_double_zero():
    """``(s + 3)^2 / ((s^2 + 2 s + 5)^2 s)``: two branches leave each pole of the pair in opposite directions."""
    pair = np.polymul([1.0, 2.0, 5.0], [1.0, 2.0, 5.0])
    loop = of_transfer(np.poly([-3.0, -3.0]), np.polymul(pair, [1.0, 0.0]))
    for sign in (1, -1):
        turned_over = replace(loop, sign=sign)
        locus = root_locus(turned_over, np.linspace(0.0, 1e-3, 20))
        p = -1.0 + 2.0j
        at = np.abs(locus.branches[:, 0] - p) < 1e-5
        angles = locus.departure_angles[at]
        np.testing.assert_allclose(turned(*angles), np.pi)
        h = (p + 3.0) ** 2 / (p * (p - p.conjugate()) ** 2)
        np.testing.assert_allclose(np.exp(2j * angles), -sign * h / abs(h), atol=1e-6)
        assert np.all(turned(np.angle(locus.branches[at, 1] - p), angles) < 0.05)
        np.testing.assert_allclose(locus.zeros[:2], -3.0, atol=1e-6)
        g = 1.0 / ((9.0 - 6.0 + 5.0) ** 2 * -3.0)
        np.testing.assert_allclose(np.exp(2j * locus.arrival_angles[:2]), -sign * np.sign(g), atol=1e-9)
        np.testing.assert_allclose(turned(*locus.arrival_angles[:2]), np.pi)


@pytest.mark.parametrize("pole", [-1.0, -2.0, 0.0, 2.0])
def test_poles_that_do_not_move_have_no_angle_and_cancel_their_zero(pole):
    """``1 / (s (s + 2))`` beside a hidden pole, also at one of the others."""
    A = np.array([[0.0, 1.0, 0.0], [0.0, -2.0, 0.0], [1.0, 0.0, pole]])
    loop = SisoLoop("test", A, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array(1.0), 1)
    locus = root_locus(loop)
    assert np.isnan(locus.departure_angles).sum() == 1
    stays = np.isnan(locus.departure_angles)
    np.testing.assert_allclose(locus.branches[stays, :50], pole, atol=1e-7)
    np.testing.assert_allclose(np.sort(degrees(locus.departure_angles)), [0.0, 180.0])
    np.testing.assert_array_equal(degrees(locus.departure_angles[np.abs(locus.branches[:, 0] + 2.0) < 1e-6]), [0.0])
    assert np.all(np.isnan(locus.zeros))
    assert np.all(np.isnan(locus.arrival_angles))


def test_equal_poles_of_which_one_moves():
    loop = SisoLoop("test", np.diag([-1.0, -1.0]), np.array([1.0, 1.0]), np.array([1.0, 1.0]), np.array(1.0), 1)
    locus = root_locus(loop)
    np.testing.assert_allclose(degrees(locus.departure_angles), [180.0])
    moves = ~np.isnan(locus.departure_angles)
    assert np.all(locus.branches[moves, -1].real < -100.0)
    np.testing.assert_allclose(locus.branches[~moves], -1.0, atol=1e-12)


def test_an_input_that_does_not_reach_the_output_has_no_angles():
    loop = SisoLoop("test", np.diag([-1.0, -2.0]), np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array(1.0), 1)
    locus = root_locus(loop)
    for name in ("departure_angles", "zeros", "arrival_angles"):
        assert np.all(np.isnan(getattr(locus, name)))


def test_real_poles_and_zeros_have_exactly_the_axis():
    loop = of_transfer(np.poly([-3.0, -5.0]), np.poly([-1.0, -2.0, -4.0, -6.0]))
    for sign in (1, -1):
        locus = root_locus(replace(loop, sign=sign))
        for angles in (locus.departure_angles, locus.arrival_angles[:2]):
            assert np.all((angles == 0.0) | (angles == np.pi))


def test_the_sign_turns_simple_angles_over():
    loop = stabilised(20, 5, seed=9)
    a, b = root_locus(loop, SMALL), root_locus(replace(loop, sign=-1), SMALL)
    np.testing.assert_allclose(turned(a.departure_angles, b.departure_angles), np.pi, atol=1e-7)
    np.testing.assert_allclose(turned(a.arrival_angles[:, :4], b.arrival_angles[:, :4]), np.pi, atol=1e-7)
    c = root_locus(replace(loop, gain=-loop.gain))
    np.testing.assert_allclose(turned(c.departure_angles, b.departure_angles), 0.0, atol=1e-7)


def test_gains_that_do_not_start_at_zero_give_the_order_of_the_open_loop():
    loop = stabilised(5, 4, seed=2)
    a, b = root_locus(loop, np.linspace(0.5, 3.0, 20)), root_locus(loop, SMALL)
    np.testing.assert_array_equal(a.departure_angles, b.departure_angles)
