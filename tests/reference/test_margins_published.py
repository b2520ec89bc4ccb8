"""Margins printed in books, papers and manuals.

- Seiler, Packard and Gahinet, An introduction to disk margins, IEEE Control Systems 40 (2020) 5, 78-95.
- The MathWorks, reference pages of `allmargin` and `diskmargin` (the loop of that paper, more digits).
- Skogestad and Postlethwaite, Multivariable Feedback Control, 2nd ed., 2005, sections 2.2 and 2.4.
- Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems, 6th ed., 2010, chapter 6.
- Doyle, Robustness of multiloop linear feedback systems, IEEE CDC 1978 (the spinning satellite).
- Safonov and Athans, IEEE Transactions on Automatic Control 22 (1977) 173-179 (margins of LQ regulators).
- Doyle, Guaranteed margins for LQG regulators, IEEE Transactions on Automatic Control 23 (1978) 756-757.
- GNU Octave, control package, the test at the end of `margin.m` (fifteen digits, continuous and sampled).
- The MathWorks, reference page of `margin` (a sampled loop).
"""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from design.frequency.margins import margins
from design.frequency.sampled import DiscreteLoop, sampled_margins
from design.frequency.sampled_plant import sampled_plant
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


def test_skogestad_unstable_process():
    """``4 / ((s - 1) (0.02 s + 1)^2)`` with ``1.25 (1 + 1 / (1.5 s))``: 18.7 up, 0.21 down, 59.5 deg, peak 1.19.

    Section 2.4 of the 2nd edition, from memory; the critical gains are those of Routh's scheme as well.
    """
    integral, lag = 1.5, 0.02
    denominator = np.polymul(np.polymul([1.0, -1.0], np.polymul([lag, 1.0], [lag, 1.0])), [1.0, 0.0])
    found = margins(of_transfer(5.0 / integral * np.array([integral, 1.0]), denominator))
    up, down = ratio_of(found.gain_margin_up_db), ratio_of(found.gain_margin_down_db)
    np.testing.assert_allclose([up, down], [18.7, 0.21], atol=0.05)
    np.testing.assert_allclose(np.rad2deg(found.phase_margin), 59.5, atol=0.05)
    np.testing.assert_allclose(found.sensitivity_peak, 1.19, atol=0.005)
    for ratio in (up, down):
        # a s^4 + b s^3 + c s^2 + d s + e has a pair on the axis for b c d = a d^2 + b^2 e.
        a, b, c, d = lag**2, 2 * lag - lag**2, 1.0 - 2 * lag, 5.0 * ratio - 1.0
        e = 5.0 * ratio / integral
        np.testing.assert_allclose(b * c * d, a * d**2 + b**2 * e, rtol=1e-10)


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
        A, identity, nothing, nothing, C, nothing, nothing, C, nothing, nothing, nothing, np.zeros(2),
        ("x1", "x2"), ("u1", "u2"), ("r1", "r2"), ("y1", "y2"), ("w1", "w2"), (), (0.0, 0.0),
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


@pytest.mark.parametrize("weight", [60.0, 1000.0])
def test_regulators_with_an_observer_have_none(weight):
    """Doyle's plant: the gain can rise by ``1 / (d f)`` only, and fall by no more than ``(d + f - 4) / (2 d f)``."""
    f = d = 2.0 + np.sqrt(4.0 + weight)
    A, B, C = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
    K, observer = np.array([[f, f]]), np.array([[d], [d]])
    for plant, inputs, gain in ((A, B, K), (A.T, C.T, observer.T)):
        X = solve_continuous_are(plant, inputs, weight * np.ones((2, 2)), np.eye(1))
        np.testing.assert_allclose(inputs.T @ X, gain, rtol=1e-9)
    whole = np.block([[A, np.zeros((2, 2))], [observer @ C, A - B @ K - observer @ C]])
    b, c = np.concatenate([B[:, 0], np.zeros(2)]), np.concatenate([np.zeros(2), K[0]])
    found = margins(SisoLoop("u", whole, b, c, np.array(1.0), 1))
    np.testing.assert_allclose(ratio_of(found.gain_margin_up_db), 1.0 + 1.0 / (d * f), rtol=1e-9)
    assert 1.0 > ratio_of(found.gain_margin_down_db) > 1.0 - (d + f - 4.0) / (2.0 * d * f)
    assert found.disk_margin < 2.0 / (d * f)


def test_loop_of_the_octave_control_package():
    """``24 / ((s + 1) (s + 2) (s + 3))``: continuous, and held for 0.3 s."""
    loop = of_transfer([24.0], [1.0, 6.0, 11.0, 6.0])
    plant = sampled_plant(loop.A, loop.b[:, None], 0.3, (0.0,))
    held = DiscreteLoop("test", plant.A, plant.B[:, 0], loop.c, np.array(1.0), 1, 0.3)
    for found, printed in (
        (margins(loop), [2.50000000000000, 35.4254199887541, 3.31662479035540, 2.06385145800825]),
        (sampled_margins(held), [1.41205400689315, 18.6021379182828, 2.47750745165538, 2.04369751003386]),
    ):
        ratio, omega = ratio_of(found.gain_margin_up_db), found.gain_omega[np.nanargmin(found.gain_ratio)]
        values = [ratio, np.rad2deg(found.phase_margin), omega, found.crossover]
        np.testing.assert_allclose(values, printed, rtol=2e-13)


def test_sampled_loop_of_the_mathworks():
    """``(0.04798 z + 0.0464) / (z^2 - 1.81 z + 0.9048)``, 0.1 s: 2.05 at 5.44 rad/s, 13.6 deg at 4.35 rad/s.

    From memory; the product of the poles, ``0.9048 + 0.0464 k``, is 1 at the critical gain, half their sum the cosine.
    """
    A, b, c = np.array([[1.81, -0.9048], [1.0, 0.0]]), np.array([1.0, 0.0]), np.array([0.04798, 0.0464])
    found = sampled_margins(DiscreteLoop("test", A, b, c, np.array(1.0), 1, 0.1))
    np.testing.assert_allclose(ratio_of(found.gain_margin_up_db), 2.0517, atol=1e-4)
    np.testing.assert_allclose(found.gain_omega[0], 5.4374, atol=1e-4)
    np.testing.assert_allclose(np.rad2deg(found.phase_margin), 13.571, atol=1e-3)
    np.testing.assert_allclose(found.crossover, 4.3544, atol=1e-4)
    k = (1.0 - 0.9048) / 0.0464
    np.testing.assert_allclose(found.gain_ratio[0], k, rtol=1e-12)
    np.testing.assert_allclose(found.gain_omega[0], np.arccos((1.81 - 0.04798 * k) / 2.0) / 0.1, rtol=1e-12)
