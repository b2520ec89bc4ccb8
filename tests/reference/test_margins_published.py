"""Margins printed in books, papers and manuals.

- Seiler, Packard and Gahinet, An introduction to disk margins, IEEE Control Systems 40 (2020) 5, 78-95.
- The MathWorks, reference pages of `allmargin` and `diskmargin` (the loop of that paper, more digits).
- Skogestad and Postlethwaite, Multivariable Feedback Control, 2nd ed., 2005, sections 2.2 and 2.4.
- Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, 6th ed., 2010, chapter 6.
- Doyle, Robustness of multiloop linear feedback systems, IEEE CDC 1978 (the spinning satellite).
- Safonov and Athans, IEEE Transactions on Automatic Control 22 (1977) 173-179 (margins of LQ regulators).
"""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from design.frequency.margins import margins
from design.loop import Loop, SisoLoop
from tests.design.siso_loops import of_transfer


def listed(values):
    return values[~np.isnan(values)]


def ratio_of(decibels):
    return 10.0 ** (decibels / 20.0)


def test_loop_of_the_disk_margin_paper():
    """``25 / (s^3 + 10 s^2 + 10 s + 10)``."""
    found = margins(of_transfer([25.0], [1.0, 10.0, 10.0, 10.0]))
    np.testing.assert_allclose(listed(found.gain_ratio), [3.6000], atol=5e-5)
    np.testing.assert_allclose(listed(found.gain_omega), [3.1623], atol=5e-5)
    np.testing.assert_allclose(np.rad2deg(found.phase_margin), 29.1104, atol=5e-5)
    np.testing.assert_allclose(found.crossover, 1.7844, atol=5e-5)
    np.testing.assert_allclose(found.delay_margin, 0.2847, atol=5e-5)
    np.testing.assert_allclose(found.disk_margin, 0.4581, atol=5e-5)
    # The gain and phase that this disk margin promises, as printed there.
    a = float(found.disk_margin)
    np.testing.assert_allclose([(2 - a) / (2 + a), (2 + a) / (2 - a)], [0.6273, 1.5942], atol=1e-4)
    np.testing.assert_allclose(np.rad2deg(2 * np.arctan(a / 2)), 25.8017, atol=5e-4)


def test_skogestad_inverse_response_process():
    """Ziegler and Nichols's PI controller: margins 1.63 and 19.4 deg, peak of S 3.92, delay margin 1.44 s."""
    gain, period = 2.5, 2.0 * np.pi / np.sqrt(0.17)
    integral_time = period / 1.2
    numerator = gain / 2.2 * np.polymul([-6.0, 3.0], [integral_time, 1.0])
    denominator = np.polymul([50.0, 15.0, 1.0], [integral_time, 0.0])
    found = margins(of_transfer(numerator, denominator))
    np.testing.assert_allclose(ratio_of(found.gain_margin_up_db), 1.63, atol=0.01)
    np.testing.assert_allclose(np.rad2deg(found.phase_margin), 19.4, atol=0.05)
    np.testing.assert_allclose(found.crossover, 0.236, atol=5e-4)
    np.testing.assert_allclose(found.sensitivity_peak, 3.92, atol=0.01)
    np.testing.assert_allclose(found.delay_margin, 1.44, atol=0.01)


def test_franklin_stable_plant():
    """``1 / (s (s + 1)^2)``: gain margin 2 at 1 rad/s, phase margin about 22 deg."""
    found = margins(of_transfer([1.0], np.poly([0.0, -1.0, -1.0])))
    np.testing.assert_allclose(ratio_of(found.gain_margin_up_db), 2.0)
    np.testing.assert_allclose(listed(found.gain_omega), [1.0])
    np.testing.assert_allclose(np.rad2deg(found.phase_margin), 22.0, atol=1.0)
    assert found.gain_margin_down_db == -np.inf


@pytest.mark.parametrize("gain", [1.5, 2.0, 10.0])
def test_franklin_unstable_plant(gain):
    """``K (s + 1) / (s (s / 10 - 1))`` is stable for K > 1: the lower margin is 1 / K, there is no upper one."""
    found = margins(of_transfer([1.0, 1.0], [0.1, -1.0, 0.0], gain=gain))
    np.testing.assert_allclose(ratio_of(found.gain_margin_down_db), 1.0 / gain)
    np.testing.assert_allclose(listed(found.gain_omega), [np.sqrt(10.0)])
    assert found.gain_margin_up_db == np.inf
    assert np.isnan(margins(of_transfer([1.0, 1.0], [0.1, -1.0, 0.0], gain=0.9)).gain_margin_down_db)


def test_spinning_satellite():
    """One axis at a time the loop is 1 / s: 90 deg, any gain, and a disk margin of 2, which says little."""
    a = 10.0
    A, identity, C = np.array([[0.0, a], [-a, 0.0]]), np.eye(2), np.array([[1.0, a], [-a, 1.0]])
    nothing = np.zeros((2, 2))
    loop = Loop(
        A, identity, nothing, C, nothing, C, nothing, nothing, np.zeros(2),
        ("x1", "x2"), ("u1", "u2"), ("r1", "r2"), ("y1", "y2"), (), (0.0, 0.0),
    )  # fmt: skip
    for name in loop.inputs:
        found = margins(loop.cut(name))
        np.testing.assert_allclose(np.rad2deg(found.phase_margin), 90.0)
        np.testing.assert_allclose(found.crossover, 1.0)
        assert (found.gain_margin_up_db, found.gain_margin_down_db) == (np.inf, -np.inf)
        np.testing.assert_allclose(found.disk_margin, 2.0)
        np.testing.assert_allclose(found.sensitivity_peak, 1.0)


def test_regulators_have_the_margins_of_safonov_and_athans():
    """Every LQ regulator: at least 60 deg, half the gain and any more of it, and ``|1 + L| >= 1``."""
    rng = np.random.default_rng(0)
    A, B = rng.standard_normal((40, 4, 4)), rng.standard_normal((40, 4, 1))
    Q, R = np.eye(4), np.eye(1)
    K = np.array([(b.T @ solve_continuous_are(a, b, Q, R))[0] for a, b in zip(A, B, strict=True)])
    found = margins(SisoLoop("u", A, B[..., 0], K, np.ones(40), 1))
    assert np.all(np.rad2deg(found.phase_margin) >= 60.0)
    assert np.all(found.gain_margin_up_db == np.inf)
    assert np.all(found.gain_margin_down_db <= 20.0 * np.log10(0.5))
    np.testing.assert_allclose(found.sensitivity_peak, 1.0, rtol=1e-9)
    # S in the unit disk puts S - T in the disk about -1/2 .. : |S - T| <= 3, so the disk margin is 2/3 or more.
    assert np.all(found.disk_margin >= 2.0 / 3.0)
    assert np.any(np.isfinite(found.gain_margin_down_db))
