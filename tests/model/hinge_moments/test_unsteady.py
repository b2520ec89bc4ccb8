"""What a flap is worth to the circulation, and how much of the circulation lags."""

from math import acos, sqrt

import numpy as np
import pytest

from model.hinge_moments.unsteady import (
    JONES_RATES,
    JONES_WEIGHTS,
    circulatory_angle,
    circulatory_rate,
    jones,
)


@pytest.mark.parametrize("hinge", [0.05, 0.5, 0.72, 0.96])
def test_worth_of_a_flap_is_theodorsens(hinge):
    # NACA report 496: T10 = sqrt(1 - c^2) + acos(c), T11 = acos(c) (1 - 2c) + sqrt(1 - c^2) (2 - c).
    c = 2 * hinge - 1
    r, p = sqrt(1 - c * c), acos(c)
    assert float(circulatory_angle(hinge)) == pytest.approx((r + p) / np.pi, rel=1e-12)
    assert float(circulatory_rate(hinge)) == pytest.approx((p * (1 - 2 * c) + r * (2 - c)) / (4 * np.pi), rel=1e-12)


def test_a_flap_at_the_leading_edge_is_the_whole_aerofoil():
    # A radian of it is a radian of incidence; pitching about the nose, the rear neutral point sees 3/4 c of it.
    assert float(circulatory_angle(0.0)) == pytest.approx(1.0, rel=1e-12)
    assert float(circulatory_rate(0.0)) == pytest.approx(0.75, rel=1e-12)


def test_parts_of_the_lag_add_up_to_a_half():
    assert sum(JONES_WEIGHTS) == pytest.approx(0.5, rel=1e-14)
    assert complex(jones(np.array(0.0))) == 1.0
    assert complex(jones(np.array(1e9j))) == pytest.approx(0.5, rel=1e-8)
    for rate in JONES_RATES:
        # The poles of Jones's denominator p^2 + 0.3455 p + 0.01365.
        assert rate**2 - 0.3455 * rate + 0.01365 == pytest.approx(0.0, abs=1e-15)
