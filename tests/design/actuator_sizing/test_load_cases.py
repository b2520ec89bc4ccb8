"""Load cases of 14 CFR 25.395(a) and 25.415."""

import numpy as np
import pytest

from design.actuator_sizing.load_cases import AILERON_FULL_THROW, ground_gust_torque, system_torque


def test_the_system_holds_five_quarters_of_the_hinge_moment():
    np.testing.assert_allclose(system_torque(np.array([[8.0, -4.0]])), [[10.0, 5.0]])
    np.testing.assert_allclose(system_torque(-2.0, 1.5), 3.0)


def test_the_ground_gust_of_65_knots():
    """65 kt are 33.44 m/s, 684.9 Pa at sea level; aileron of 0.3 m by 2 m, that is c = 0.3 m and S = 0.6 m^2."""
    np.testing.assert_allclose(ground_gust_torque(0.3, 0.6), 0.75 * 684.872 * 0.3 * 0.6, rtol=1e-5)
    np.testing.assert_allclose(
        ground_gust_torque(np.array([0.3, 0.6]), 0.6, AILERON_FULL_THROW),
        0.5 * 684.872 * np.array([0.18, 0.36]),
        rtol=1e-5,
    )


def test_numbers_that_make_no_sense_are_refused():
    for factor in (0.9, np.nan, np.inf):
        with pytest.raises(ValueError, match="at least 1"):
            system_torque(1.0, factor)
    for chord, area in ((0.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (1.0, np.array([1.0, np.inf]))):
        with pytest.raises(ValueError, match="positive and finite"):
            ground_gust_torque(chord, area)
