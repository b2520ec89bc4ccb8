"""Margins against simultaneous changes, printed in books, papers and manuals.

- Doyle, Robustness of multiloop linear feedback systems, IEEE CDC 1978 (the spinning satellite), with the numbers of
  Skogestad and Postlethwaite, Multivariable Feedback Control, 2nd ed., 2005, section 3.7.1, and of Zhou and Doyle,
  Essentials of Robust Control, 1998: a = 10, peaks of T and S 10.05, unstable for gains off by 0.1 and -0.1.
- The MathWorks, reference page of `diskmargin` (a satellite with a static controller): multiloop disk margin between
  0.3754 and 0.3762 at zero frequency, gain margins [0.6839 1.4621], phase margins 21.2607 deg; of an older edition with
  another plant, between 0.4890 and 0.4899, gain margins [0.6071 1.6472], phase margins 27.4762 deg, 0.2250 rad/s.
- Safonov and Athans, IEEE Transactions on Automatic Control 22 (1977) 173-179; Lehtomaki, Sandell and Athans, the same
  26 (1981) 75-93: an LQ regulator with diagonal R stands gains from a half, or 60 deg, in all channels at once.
"""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from design.robustness.simultaneous import simultaneous_margins

SATELLITE = np.array([[0.0, 10.0], [-10.0, 0.0]])


def gain(decibels):
    return 10.0 ** (decibels / 20.0)


@pytest.mark.parametrize("a", [0.5, 1.0, 10.0, 300.0])
def test_spinning_satellite(a):
    """One axis at a time it has every margin there is; both at once next to none.

    ``S - T = [s - 1, -2a; 2a, s - 1] / (s + 1)`` is balanced, its singular values are ``|jw - 1 +- 2 j a| / |jw + 1|``
    with the maximum ``a + sqrt(1 + a^2)``; sigma(S) and sigma(T) reach ``sqrt(1 + a^2)``.
    """
    A, K = np.array([[0.0, a], [-a, 0.0]]), np.array([[1.0, a], [-a, 1.0]])
    found = simultaneous_margins(A, np.eye(2), K)
    largest = np.sqrt(1.0 + a * a)
    np.testing.assert_allclose(found.disk_margin, 2.0 * (largest - a) if a < 100 else 2.0 / (largest + a), rtol=1e-9)
    np.testing.assert_allclose(found.complementary_peak, largest, rtol=1e-12)
    np.testing.assert_allclose(found.sensitivity_peak, largest, rtol=1e-9)
    np.testing.assert_allclose(found.complementary_margin, 1.0 / largest, rtol=1e-9)
    assert found.proved
    values = np.linalg.eigvals(A - found.worst_factors[:, None] * K)
    np.testing.assert_allclose(np.abs(values - 1j * found.disk_omega).min(), 0.0, atol=1e-9 * a)


def test_spinning_satellite_as_printed():
    K = np.array([[1.0, 10.0], [-10.0, 1.0]])
    found = simultaneous_margins(SATELLITE, np.eye(2), K)
    np.testing.assert_allclose([found.complementary_peak, found.sensitivity_peak], 10.05, atol=5e-3)
    np.testing.assert_allclose(found.complementary_margin, 0.1, atol=1e-3)

    def stable(*errors):
        return np.linalg.eigvals(SATELLITE - np.diag(1.0 + np.array(errors)) @ K).real.max() < 0.0

    # The printed limit is 1 / sqrt(1 + a^2): gains off by opposite amounts, and any one of them alone.
    assert not stable(0.1, -0.1)
    assert stable(0.099, -0.099)
    assert stable(100.0, 0.0)
    assert stable(-0.99, 0.0)


@pytest.mark.parametrize("at_output", [False, True])
def test_satellite_with_a_static_controller(at_output):
    """Printed are bounds; the exact value lies between them. The loop opened at the output is the transposed one."""
    C, K = np.array([[1.0, 10.0], [-10.0, 1.0]]), np.array([[1.0, -2.0], [0.0, 1.0]])
    loop = (SATELLITE.T, C.T, K.T) if at_output else (SATELLITE, np.eye(2), K @ C)
    found = simultaneous_margins(*loop)
    assert 0.3754 <= found.disk_margin <= 0.3762
    assert found.disk_omega == 0.0
    np.testing.assert_allclose(gain(np.array([-1, 1]) * found.gain_margin_up_db), [0.6839, 1.4621], rtol=2e-3)
    np.testing.assert_allclose(np.rad2deg(found.phase_margin), 21.2607, rtol=3e-3)
    # In closed form: at zero frequency S - T is real.
    np.testing.assert_allclose(found.worst_factors.imag, 0.0, atol=1e-12)


def test_satellite_with_another_output():
    C, K = np.array([[1.0, 8.0], [-10.0, 1.0]]), np.array([[1.0, -2.0], [0.0, 1.0]])
    found = simultaneous_margins(SATELLITE.T, C.T, K.T)
    assert 0.4890 <= found.disk_margin <= 0.48995
    np.testing.assert_allclose(found.disk_omega, 0.2250, atol=0.01)
    np.testing.assert_allclose(gain(np.array([-1, 1]) * found.gain_margin_up_db), [0.6071, 1.6472], rtol=2e-3)
    np.testing.assert_allclose(np.rad2deg(found.phase_margin), 27.4762, rtol=3e-3)


def test_regulators_stand_half_the_gain_or_60_degrees_in_all_channels():
    rng = np.random.default_rng(0)
    A, B = rng.standard_normal((30, 4, 4)), rng.standard_normal((30, 4, 2))
    R = np.diag([4.0, 0.25])
    X = np.array([solve_continuous_are(a, b, np.eye(4), R) for a, b in zip(A, B, strict=True)])
    K = np.linalg.inv(R) @ B.mT @ X
    found = simultaneous_margins(A, B, K)
    np.testing.assert_allclose(found.sensitivity_margin, 1.0, rtol=1e-8)
    # |delta| < 1 in 1 / (1 - delta) is every gain above a half, and every phase within 60 deg.
    for _ in range(100):
        gains = 0.5 * 10.0 ** rng.uniform(0.0, 3.0, (30, 2, 1))
        assert np.all(np.linalg.eigvals(A - B @ (gains * K)).real.max(axis=-1) < 0.0)
        phases = np.exp(1j * np.pi / 3.0 * rng.uniform(-1.0, 1.0, (30, 2, 1)))
        assert np.all(np.linalg.eigvals(A - B @ (phases * K)).real.max(axis=-1) < 0.0)
