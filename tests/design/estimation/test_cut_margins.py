"""Margins of one actuator's loop with every delay, against brute force on the exact matrix of transfers."""

from dataclasses import replace

import numpy as np
import pytest

from design.estimation.cut_margins import margins_of_cuts
from design.estimation.kalman_filter import kalman_filter
from design.estimation.observer import with_kalman_filter
from design.frequency.margins import margins
from tests.design.estimation.estimation_cases import NOISE, full_state, open_response

OMEGA = np.geomspace(0.1, 5e3, 6001)


def cut_transfers(point):
    """``L_ii - L_ij L_ji / (1 + L_jj)`` of each input of one point, the delays exact, over `OMEGA`."""
    L = open_response(point, 1j * OMEGA) * np.exp(-1j * OMEGA[:, None, None] * np.array(point.delay))
    return [L[:, i, i] - L[:, i, j] * L[:, j, i] / (1.0 + L[:, j, j]) for i, j in ((0, 1), (1, 0))]


@pytest.mark.parametrize("observer", [False, True])
@pytest.mark.parametrize("name", ["late", "modelled_delay"])
def test_brute_force(name, observer):
    loop = full_state(name)
    if observer:
        loop = with_kalman_filter(loop, kalman_filter(loop, NOISE))
    found = margins_of_cuts(loop)
    for index in [(0, 0), (1, 2)]:
        for cut, L in zip(found, cut_transfers(loop.take(index)), strict=True):
            assert cut.sensitivity_peak[index] == pytest.approx(1.0 / np.abs(1.0 + L).min(), rel=1e-5)
            assert cut.disk_margin[index] == pytest.approx(2.0 / np.abs((1.0 - L) / (1.0 + L)).max(), rel=1e-5)
            crossing = np.flatnonzero(np.diff(np.sign(np.abs(L) - 1.0)))
            phases = np.abs(np.angle(-L[crossing]))
            assert cut.phase_margin[index] == pytest.approx(phases.min(), abs=5e-3)
            real = np.flatnonzero((np.diff(np.sign(L.imag)) != 0) & (L.real[:-1] < 0.0))
            ratios = -1.0 / L.real[real]
            assert cut.gain_margin_up_db[index] == pytest.approx(20.0 * np.log10(ratios[ratios > 1.0].min()), abs=0.05)


def test_without_delays_they_are_those_of_the_cuts():
    loop = full_state("lagged")
    for i, found in enumerate(margins_of_cuts(loop)):
        alone = margins(loop.cut(loop.inputs[i]))
        for field in ("gain_margin_down_db", "phase_margin", "disk_margin", "sensitivity_peak"):
            np.testing.assert_allclose(getattr(found, field), getattr(alone, field), rtol=1e-9)


def test_the_delay_of_the_other_input_matters():
    """What `Loop.cut` leaves out: with the other input at once, the tab's loop would look better than it is."""
    loop = full_state("late")
    found, alone = margins_of_cuts(loop)[0], margins(loop.cut("tab"))
    assert np.all(found.disk_margin < 0.95 * alone.disk_margin)
    only = replace(loop, delay=(loop.delay[0], 0.0))
    np.testing.assert_allclose(margins_of_cuts(only)[0].disk_margin, alone.disk_margin, rtol=1e-9)
