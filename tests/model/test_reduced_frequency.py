import numpy as np
import pytest

from model.flight import flight_condition
from model.reduced_frequency import QUASI_STEADY_LIMIT, reduced_frequency


def test_of_an_undamped_mode_is_theodorsens():
    # omega b / V with the half chord b.
    condition = flight_condition(0.0, "airspeed", 50.0)
    assert reduced_frequency(np.array([40.0j]), condition, 0.6)[0] == pytest.approx(40.0 * 0.3 / 50.0, rel=1e-14)
    assert reduced_frequency(np.array([-30.0 + 40.0j]), condition, 0.6)[0] == pytest.approx(0.3, rel=1e-14)


def test_limit_is_where_the_circulation_is_a_tenth_short():
    from scipy.special import hankel2

    k = QUASI_STEADY_LIMIT
    C = hankel2(1, k) / (hankel2(1, k) + 1j * hankel2(0, k))
    assert abs(C - (0.91 - 0.13j)) < 1.5e-3


def test_batched_equals_single(grid):
    poles = np.random.default_rng(0).standard_normal((*grid.shape, 4, 2)) @ np.array([30.0, 50.0j])
    whole = reduced_frequency(poles, grid.condition, 0.6)
    assert whole.shape == (*grid.shape, 4)
    for index in np.ndindex(grid.shape):
        np.testing.assert_allclose(whole[index], reduced_frequency(poles[index], grid.condition.take(index), 0.6))
