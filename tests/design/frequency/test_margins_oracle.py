"""Margins against python-control's, at 25 and at 2000 points; where that is wrong, against closed forms."""

import numpy as np
import pytest

from design.frequency.margins import margins
from tests.design.siso_loops import in_other_states, of_transfer, stabilised

pytestmark = pytest.mark.filterwarnings("ignore")


def compare(loop, found, points):
    """Every gain to 1e-8 of itself, every phase to 1e-6 deg."""
    import control

    for i in points:
        system = control.ss(loop.A[i], (loop.sign * loop.gain[i] * loop.b[i])[:, None], loop.c[i][None, :], 0)
        gain, phase, sensitivity, _, crossover, _ = control.stability_margins(system, returnall=True)
        ours = found.gain_ratio[i][~np.isnan(found.gain_ratio[i])]
        np.testing.assert_allclose(np.sort(ours), np.sort(gain[(gain > 1e-6) & (gain < 1e6)]), rtol=1e-8)
        there = ~np.isnan(found.phase[i])
        np.testing.assert_allclose(found.phase_omega[i][there], np.sort(crossover), rtol=1e-7)
        theirs = np.abs(phase[np.argsort(crossover)])
        np.testing.assert_allclose(np.abs(np.rad2deg(found.phase[i][there])), theirs, rtol=0.0, atol=1e-6)
        # It looks at stationary points only: none means that the peak is at zero or infinite frequency.
        if len(sensitivity):
            assert found.sensitivity_peak[i] >= (1.0 - 1e-6) / np.min(sensitivity)


@pytest.mark.parametrize("order", [2, 3, 4, 5, 6, 7])
@pytest.mark.parametrize("sign", [1, -1])
def test_25_points(order, sign):
    loop = stabilised(25, order, seed=80 + order, sign=sign, gain=1.7)
    compare(loop, margins(loop), range(25))
    assert np.any(np.linalg.eigvals(loop.A).real > 0.0)


@pytest.mark.parametrize("order", [2, 3, 4, 5, 6, 7])
def test_2000_points(order):
    """Every 40th against python-control, all of them against eigenvalues."""
    loop = stabilised(2000, order, seed=800 + order)
    found = margins(loop)
    compare(loop, found, range(0, 2000, 40))
    outer = loop.b[:, :, None] * loop.c[:, None, :]
    for values, omega, turn in (
        (found.gain_ratio, found.gain_omega, lambda ratio: ratio + 0j),
        (found.phase, found.phase_omega, lambda phase: np.exp(-1j * phase)),
    ):
        rows, column = np.nonzero(~np.isnan(values))
        factor = turn(values[rows, column])
        pole = np.linalg.eigvals(loop.A[rows] - factor[:, None, None] * outer[rows])
        distance = np.abs(pole - 1j * omega[rows, column][:, None]).min(axis=-1)
        assert np.all(distance < 1e-8 * np.maximum(1.0, np.abs(pole).max(axis=-1)))


def test_poles_at_the_origin_are_no_margins():
    """``5 k (3 s + 1) / (s^2 (s + 9))`` is stable for every k > 0 (Routh): python-control gives 1e-15."""
    import control

    loop = in_other_states(of_transfer([3.0, 1.0], np.poly([0.0, 0.0, -9.0]), gain=5.0), seed=1)
    gain, *_ = control.margin(control.ss(loop.A, 5.0 * loop.b[:, None], loop.c[None, :], 0))
    assert 0.0 < gain < 1e-6
    found = margins(loop)
    assert (found.gain_margin_up_db, found.gain_margin_down_db) == (np.inf, -np.inf)
    for factor in (1e-3, 1e3):
        assert np.linalg.eigvals(loop.closed(5.0 * factor)).real.max() < 0.0
