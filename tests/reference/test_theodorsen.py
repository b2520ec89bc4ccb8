"""The closed forms against Theodorsen's T-functions (NACA report 496, 1935; hinge at c semichords).

Same-hinge stiffness, damping and inertia of a flap, and, with the hinge of the moment at the leading
edge, the pitching-moment terms of a flap.
"""

from math import acos, sqrt

import numpy as np
import pytest

from model.hinge_moments.closed_forms import (
    acceleration_moment,
    flap_moment,
    incidence_moment,
    rate_moment,
)
from model.hinge_moments.lift import flap_lift

HINGES = [0.05, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97]


class T:
    """Theodorsen's functions of c."""

    def __init__(self, c):
        r, p = sqrt(1 - c * c), acos(c)
        self.c = c
        self.t1 = -r * (2 + c * c) / 3 + c * p
        self.t3 = -(1 / 8 + c * c) * p * p + c * r * p * (7 + 2 * c * c) / 4 - (1 - c * c) * (5 * c * c + 4) / 8
        self.t4 = -p + c * r
        self.t5 = -(1 - c * c) - p * p + 2 * c * r * p
        self.t7 = -(1 / 8 + c * c) * p + c * r * (7 + 2 * c * c) / 8
        self.t8 = -r * (2 * c * c + 1) / 3 + c * p
        self.t10 = r + p
        self.t11 = p * (1 - 2 * c) + r * (2 - c)
        self.t12 = r * (2 + c) - p * (2 * c + 1)


def test_functions_are_those_of_the_printed_table():
    # NACA report 496, table of T-functions, c = 0 and c = 0.5.
    names = ("t1", "t4", "t5", "t10", "t11", "t12")
    zero = (-0.66667, -1.5708, -3.4674, 2.5708, 3.5708, 0.42920)
    half = (-0.12592, -0.61418, -0.93972, 1.91322, 1.29904, 0.07067)
    for c, printed in ((0.0, zero), (0.5, half)):
        for name, value in zip(names, printed, strict=True):
            assert getattr(T(c), name) == pytest.approx(value, abs=6e-5)
    assert T(0.0).t3 == pytest.approx(-0.80843, abs=6e-5)


@pytest.mark.parametrize("hinge", HINGES)
def test_flap_on_its_own_hinge(hinge):
    t = T(2 * hinge - 1)
    stiffness = (t.t5 - t.t4 * t.t10 + t.t12 * t.t10) / (2 * np.pi)
    assert float(incidence_moment(hinge)) == pytest.approx(t.t12 / 2, rel=1e-9)
    assert float(flap_moment(hinge, hinge)) == pytest.approx(stiffness, rel=1e-9)
    assert float(rate_moment(hinge, hinge)) == pytest.approx(t.t11 * (t.t12 - t.t4) / (8 * np.pi), rel=1e-9)
    assert float(acceleration_moment(hinge, hinge)) == pytest.approx(-t.t3 / (8 * np.pi), rel=1e-7)
    assert float(flap_lift(hinge)) == pytest.approx(2 * t.t10, rel=1e-12)


@pytest.mark.parametrize("flap", HINGES)
def test_flap_seen_from_the_leading_edge(flap):
    t = T(2 * flap - 1)
    stiffness = 0.5 * (t.t4 + 2 * t.t10)
    damping = 0.25 * (t.t1 - t.t8 - (t.c + 1) * t.t4 + t.t11)
    inertia = -(t.t7 + (t.c + 1) * t.t1) / 8
    assert float(flap_moment(0.0, flap)) == pytest.approx(stiffness, rel=1e-9)
    assert float(rate_moment(0.0, flap)) == pytest.approx(damping, rel=1e-9)
    assert float(acceleration_moment(0.0, flap)) == pytest.approx(inertia, rel=1e-9)


@pytest.mark.parametrize(
    ("flap_chord", "b1", "b2"),
    [
        (0.20, -0.4993815050, -0.9228767358),
        (0.25, -0.5653472565, -0.9436078642),
        (0.30, -0.6274070459, -0.9654026601),
        (0.12, -0.3795134048, -0.8916814624),
    ],
)
def test_classical_coefficients_of_a_plain_flap(flap_chord, b1, b2):
    # Houghton and Carpenter, Aerodynamics for Engineering Students: b1, b2 per radian and flap chord squared.
    hinge = 1 - flap_chord
    assert float(-incidence_moment(hinge) / flap_chord**2) == pytest.approx(b1, rel=1e-9)
    assert float(-flap_moment(hinge, hinge) / flap_chord**2) == pytest.approx(b2, rel=1e-9)
