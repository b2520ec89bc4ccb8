"""Root loci worked out in textbooks.

- Ogata, Modern Control Engineering, 5th ed., 2010, chapter 6 (root-locus plots).
- Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, 6th ed., 2010, chapter 5.
- Skogestad and Postlethwaite, Multivariable Feedback Control, 2nd ed., 2005, section 2.2.
"""

import numpy as np
import pytest

from design.frequency.loci import root_locus
from tests.design.siso_loops import of_transfer


def listed(values):
    return values[~np.isnan(values)]


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
