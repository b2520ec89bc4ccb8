"""Root loci worked out in textbooks.

- Ogata, Modern Control Engineering, 5th ed., 2010, chapter 6 (root-locus plots).
- Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, 6th ed., 2010, chapter 5.
- Skogestad and Postlethwaite, Multivariable Feedback Control, 2nd ed., 2005, section 2.2.
- Nise, Control Systems Engineering, 6th ed., 2011, chapter 8 (root locus techniques).
- Dorf and Bishop, Modern Control Systems, 12th ed., 2011, chapter 7 (the root locus method).

Printed numbers have the digits of the book. Beside each stands what it is exactly, worked out here by hand.
"""

from dataclasses import replace

import numpy as np
import pytest

from design.frequency.loci import root_locus
from design.frequency.locus_damping import gain_at_damping
from tests.design.siso_loops import of_transfer


def listed(values):
    return values[~np.isnan(values)]


def departures_of(locus, pole):
    """Departure angle [rad] of the open loop's pole next to this one."""
    return locus.departure_angles[np.argmin(np.abs(locus.branches[:, 0] - pole))]


def at(locus, gain):
    """Poles at one of the gains of the locus."""
    return locus.branches[:, np.argmin(np.abs(locus.gains - gain))]


def test_ogata_example_6_1():
    """``K / (s (s + 1) (s + 2))``: breakaway -0.4226 at K = 0.3849; axis at K = 6, omega = sqrt 2; damping 0.5."""
    locus = root_locus(of_transfer([1.0], np.poly([0.0, -1.0, -2.0]), gain=1.0383))
    np.testing.assert_allclose(np.rad2deg(listed(locus.asymptote_angles)), [-60.0, 60.0, 180.0])
    np.testing.assert_allclose(locus.asymptote_centroid, -1.0)
    np.testing.assert_allclose(listed(locus.breakaway_point), [-0.4226], atol=5e-5)
    np.testing.assert_allclose(listed(locus.breakaway_gain), [0.3849], atol=5e-5)
    np.testing.assert_allclose(listed(locus.crossing_gain), [6.0])
    np.testing.assert_allclose(listed(locus.crossing_omega), [np.sqrt(2.0)])
    poles = np.sort_complex(at(locus, 1.0383))
    # Read off a plot: the printed point is 6e-4 beside the locus.
    np.testing.assert_allclose(poles, [-2.3326, -0.3337 - 0.5780j, -0.3337 + 0.5780j], atol=1.5e-3)


def test_ogata_example_6_2():
    """``K (s + 2) / (s^2 + 2 s + 3)``: break-in at -3.7320, K = 5.4641; damping 0.7 at K = 1.34."""
    locus = root_locus(of_transfer([1.0, 2.0], [1.0, 2.0, 3.0], gain=1.34))
    np.testing.assert_allclose(listed(locus.breakaway_point), [-3.7320], atol=1e-4)
    np.testing.assert_allclose(listed(locus.breakaway_gain), [5.4641], atol=5e-5)
    np.testing.assert_allclose(np.sort_complex(at(locus, 1.34)), [-1.67 - 1.70j, -1.67 + 1.70j], atol=5e-3)
    assert listed(locus.crossing_gain).size == 0
    # Departure 144.7 deg: 180 - 90 + atan sqrt 2. Break-in: s^2 + 4 s + 1 = 0. A circle of sqrt 3 about the zero.
    np.testing.assert_allclose(np.rad2deg(departures_of(locus, -1.0 + np.sqrt(2.0) * 1j)), 144.7, atol=0.05)
    np.testing.assert_allclose(departures_of(locus, -1.0 + np.sqrt(2.0) * 1j), np.pi / 2 + np.arctan(np.sqrt(2.0)))
    np.testing.assert_allclose(listed(locus.breakaway_point), -2.0 - np.sqrt(3.0))
    complex_ = locus.branches[locus.branches.imag != 0.0]
    np.testing.assert_allclose(np.abs(complex_ + 2.0), np.sqrt(3.0), rtol=1e-6)
    np.testing.assert_allclose(listed(locus.zeros), [-2.0])
    assert locus.arrival_angles[0] == np.pi


def test_ogata_positive_feedback_system():
    """``K (s + 2) / ((s + 3) (s^2 + 2 s + 2))``, positive feedback: asymptotes along the axis both ways, departure -72
    deg from -1 + j, break-in at -0.8, and a pole at the origin for K = 3.
    """
    loop = of_transfer([1.0, 2.0], np.polymul([1.0, 3.0], [1.0, 2.0, 2.0]))
    locus = root_locus(replace(loop, sign=-1))
    np.testing.assert_allclose(np.rad2deg(listed(locus.asymptote_angles)), [0.0, 180.0])
    np.testing.assert_allclose(np.rad2deg(departures_of(locus, -1.0 + 1.0j)), -72.0, atol=0.5)
    np.testing.assert_allclose(listed(locus.breakaway_point), [-0.8], atol=5e-3)
    np.testing.assert_allclose(listed(locus.crossing_gain), [3.0])
    np.testing.assert_allclose(listed(locus.crossing_omega), [0.0])
    # Angle condition at -1 + j: zero 45 deg, poles atan 1/2 and 90 deg. dK/ds = 0: 2 s^3 + 11 s^2 + 20 s + 10 = 0.
    exact = np.deg2rad(45.0 - 90.0) - np.arctan(0.5)
    np.testing.assert_allclose(departures_of(locus, -1.0 + 1.0j), exact)
    cubic = np.roots([2.0, 11.0, 20.0, 10.0])
    np.testing.assert_allclose(listed(locus.breakaway_point), cubic[cubic.imag == 0.0])
    # The same with negative feedback, which the book draws beside it: asymptotes upright, no break point.
    usual = root_locus(loop)
    np.testing.assert_allclose(np.rad2deg(listed(usual.asymptote_angles)), [-90.0, 90.0])
    np.testing.assert_allclose(usual.asymptote_centroid, -1.5)
    assert listed(usual.breakaway_gain).size == 0


def test_ogata_conditionally_stable_system():
    """``K (s^2 + 2 s + 4) / (s (s + 4) (s + 6) (s^2 + 1.4 s + 1))``: stable to 15.6 and from 67.5 to 163.6."""
    denominator = np.polymul(np.poly([0.0, -4.0, -6.0]), [1.0, 1.4, 1.0])
    locus = root_locus(of_transfer([1.0, 2.0, 4.0], denominator, gain=100.0))
    np.testing.assert_allclose(listed(locus.crossing_gain), [15.6, 67.5, 163.6], atol=0.05)


def test_franklin_example_with_complex_poles():
    """``K / (s ((s + 4)^2 + 16))``: centroid -2.67, axis at K = 256, omega = 5.66."""
    locus = root_locus(of_transfer([1.0], np.polymul([1.0, 0.0], [1.0, 8.0, 32.0])))
    np.testing.assert_allclose(locus.asymptote_centroid, -2.67, atol=5e-3)
    np.testing.assert_allclose(listed(locus.crossing_gain), [256.0])
    np.testing.assert_allclose(listed(locus.crossing_omega), [5.66], atol=5e-3)
    assert listed(locus.breakaway_gain).size == 0
    # Departure from -4 + 4 j: 180 - 90 - 135 deg.
    np.testing.assert_allclose(np.rad2deg(departures_of(locus, -4.0 + 4.0j)), -45.0)


def test_franklin_gain_for_a_damping_ratio_of_a_half():
    """The same locus: K = 65 for a damping ratio of 0.5, read off at ``-2 + 3.4 j``; it is 64, 4 from the origin."""
    found = gain_at_damping(of_transfer([1.0], np.polymul([1.0, 0.0], [1.0, 8.0, 32.0]), gain=10.0), 0.5)
    np.testing.assert_allclose(listed(found.gains), [64.0])
    np.testing.assert_allclose(listed(found.natural_frequency), [4.0])
    np.testing.assert_allclose([found.lowest_gain, found.largest_gain], [0.0, 64.0])


@pytest.mark.parametrize(
    ("pole", "breakaways"), [(4.0, []), (9.0, [-3.0]), (12.0, [-2.31, -5.18])], ids=["4", "9", "12"]
)
def test_franklin_satellite_attitude(pole, breakaways):
    """``K (s + 1) / (s^2 (s + p))``: no breakaway for p = 4, a triple one at -3 for 9, two for 12."""
    locus = root_locus(of_transfer([1.0, 1.0], [1.0, pole, 0.0, 0.0], gain=27.0))
    np.testing.assert_allclose(listed(locus.breakaway_point), breakaways, atol=1e-2)
    np.testing.assert_allclose(locus.asymptote_centroid, -(pole - 1.0) / 2.0)
    np.testing.assert_allclose(np.rad2deg(listed(locus.asymptote_angles)), [-90.0, 90.0])
    assert listed(locus.crossing_gain).size == 0


def test_skogestad_inverse_response_process():
    """``3 (-2 s + 1) / ((5 s + 1) (10 s + 1))``: ultimate gain 2.5 at a period of 15.2 s."""
    locus = root_locus(of_transfer([-6.0, 3.0], [50.0, 15.0, 1.0], gain=1.5))
    np.testing.assert_allclose(listed(locus.crossing_gain), [2.5])
    np.testing.assert_allclose(2.0 * np.pi / listed(locus.crossing_omega), [15.2], atol=0.05)


def test_dorf_fourth_order_system():
    """``K / (s^4 + 12 s^3 + 64 s^2 + 128 s)``: asymptotes at 45 deg from -3, breakaway -1.577, axis at 3.266 rad/s for
    K = 568.89, departure 225 deg from -4 + 4 j, and K = 126 for a damping ratio of 0.707.
    """
    loop = of_transfer([1.0], [1.0, 12.0, 64.0, 128.0, 0.0], gain=100.0)
    locus = root_locus(loop)
    np.testing.assert_allclose(locus.asymptote_centroid, -3.0)
    np.testing.assert_allclose(np.rad2deg(listed(locus.asymptote_angles)), [-135.0, -45.0, 45.0, 135.0])
    np.testing.assert_allclose(listed(locus.breakaway_point), [-1.577], atol=5e-4)
    np.testing.assert_allclose(listed(locus.crossing_gain), [568.89], atol=5e-3)
    np.testing.assert_allclose(listed(locus.crossing_omega), [3.266], atol=5e-4)
    np.testing.assert_allclose(np.rad2deg(departures_of(locus, -4.0 + 4.0j)), 225.0 - 360.0)
    np.testing.assert_allclose(listed(gain_at_damping(loop, 0.707).gains), [126.0], atol=0.5)
    # Routh: 12 w^2 = 128, K = 64 w^2 - w^4.
    np.testing.assert_allclose(listed(locus.crossing_gain), [64.0 * 32.0 / 3.0 - (32.0 / 3.0) ** 2])
    stationary = np.roots([4.0, 36.0, 128.0, 128.0])
    np.testing.assert_allclose(listed(locus.breakaway_point), stationary[stationary.imag == 0.0])


def test_nise_example_8_5():
    """``K (s + 3) / (s (s + 1) (s + 2) (s + 4))``: asymptotes from -4/3 at 60, 180 and 300 deg; axis at 1.59 rad/s for
    K = 9.65.
    """
    loop = of_transfer([1.0, 3.0], np.poly([0.0, -1.0, -2.0, -4.0]), gain=5.0)
    locus = root_locus(loop)
    np.testing.assert_allclose(locus.asymptote_centroid, -4.0 / 3.0)
    np.testing.assert_allclose(np.rad2deg(listed(locus.asymptote_angles)), [-60.0, 60.0, 180.0])
    np.testing.assert_allclose(listed(locus.crossing_gain), [9.65], atol=5e-3)
    np.testing.assert_allclose(listed(locus.crossing_omega), [1.59], atol=5e-3)
    # Routh: K^2 + 65 K - 720 = 0, w^2 = (8 + K) / 7.
    K = (-65.0 + np.sqrt(65.0**2 + 4.0 * 720.0)) / 2.0
    np.testing.assert_allclose(listed(locus.crossing_gain), [K])
    np.testing.assert_allclose(listed(locus.crossing_omega), [np.sqrt((8.0 + K) / 7.0)])
    # The positive-feedback locus of the same transfer function: 0, 120 and 240 deg.
    positive = root_locus(replace(loop, sign=-1))
    np.testing.assert_allclose(np.rad2deg(listed(positive.asymptote_angles)), [-120.0, 0.0, 120.0])
    np.testing.assert_allclose(positive.asymptote_centroid, -4.0 / 3.0)


def test_nise_example_8_6():
    """``K (s + 2) / ((s + 3) (s^2 + 2 s + 2))``: departure 108.4 deg from -1 + j."""
    locus = root_locus(of_transfer([1.0, 2.0], np.polymul([1.0, 3.0], [1.0, 2.0, 2.0])))
    np.testing.assert_allclose(np.rad2deg(departures_of(locus, -1.0 + 1.0j)), 108.4, atol=0.05)
    np.testing.assert_allclose(departures_of(locus, -1.0 + 1.0j), np.pi - np.arctan(0.5) - np.pi / 4)


def proper_part(numerator, denominator, gain):
    """The loop of ``1 + K (1 + L) = (1 + K) (1 + K / (1 + K) L)``: of a transfer function that is 1 at infinity."""
    rest = np.trim_zeros(np.polysub(numerator, denominator), "f")
    return of_transfer(rest, denominator, gain=gain / (1.0 + gain))


def test_nise_break_points_of_two_zeros_in_the_right_half_plane():
    """``K (s - 3) (s - 5) / ((s + 1) (s + 2))``: breakaway at -1.45, break-in at 3.82."""
    locus = root_locus(proper_part(np.poly([3.0, 5.0]), np.poly([-1.0, -2.0]), gain=1.0))
    np.testing.assert_allclose(listed(locus.breakaway_point), [-1.45, 3.82], atol=5e-3)
    np.testing.assert_allclose(listed(locus.breakaway_point), np.sort(np.roots([11.0, -26.0, -61.0])))


def test_nise_example_8_7():
    """``K (s^2 - 4 s + 20) / ((s + 2) (s + 4))``: axis at 3.9 rad/s for K = 1.5, breakaway -2.88, and a damping ratio
    of 0.45 for K = 0.417, 3.4 rad/s from the origin.
    """
    loop = proper_part([1.0, -4.0, 20.0], np.poly([-2.0, -4.0]), gain=0.1)
    locus = root_locus(loop)
    np.testing.assert_allclose(listed(locus.breakaway_point)[0], -2.88, atol=5e-3)
    k = listed(locus.crossing_gain)
    np.testing.assert_allclose(k / (1.0 - k), [1.5])
    np.testing.assert_allclose(listed(locus.crossing_omega), [3.9], atol=5e-3)
    np.testing.assert_allclose(listed(locus.crossing_omega), [np.sqrt(38.0 / 2.5)])
    found = gain_at_damping(loop, 0.45)
    k = listed(found.gains)
    np.testing.assert_allclose(k / (1.0 - k), [0.417], atol=5e-4)
    np.testing.assert_allclose(listed(found.natural_frequency), [3.4], atol=5e-3)
    # (1 + K) s^2 + (6 - 4 K) s + 8 + 20 K: the damping ratio is (3 - 2 K) / sqrt((1 + K) (8 + 20 K)).
    K = k / (1.0 - k)
    np.testing.assert_allclose((3.0 - 2.0 * K) / np.sqrt((1.0 + K) * (8.0 + 20.0 * K)), 0.45)
