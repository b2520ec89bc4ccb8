import numpy as np
import pytest
from scipy.integrate import quad

from model.hinge_moments.camber import SYMMETRIC, mean_line
from model.hinge_moments.lift import (
    camber_coefficients,
    flap_lift,
    flap_pitching_moment,
    ideal_incidence,
    ideal_lift,
    quarter_chord_moment,
    zero_lift_angle,
)

LINES = ["NACA 2412", "NACA 6309", "NACA 23012", "NACA 21018", "NACA 65012"]


@pytest.mark.parametrize("name", LINES)
def test_coefficients_are_glauerts_integrals(name):
    line = mean_line(name)
    bends = sorted({np.arccos(1 - 2 * b.start) for b in (*line.ramps, *line.parabolas)} - {0.0})

    def cosine_mean(n):
        def integrand(t):
            return -float(line.slope(0.5 * (1 - np.cos(t)))) * np.cos(n * t)

        return quad(integrand, 0, np.pi, points=bends, epsabs=1e-14)[0] / np.pi

    expected = [cosine_mean(0), -2 * cosine_mean(1), -2 * cosine_mean(2)]
    np.testing.assert_allclose(camber_coefficients(line), expected, atol=1e-12)


@pytest.mark.parametrize("flap", [0.3, 0.7, 0.95])
def test_flap_lift_and_moment_are_glauerts_integrals(flap):
    f = np.arccos(1 - 2 * flap)
    a0 = (np.pi - f) / np.pi
    a1, a2 = (-2 / np.pi * quad(lambda t, n=n: np.cos(n * t), f, np.pi)[0] for n in (1, 2))
    assert float(flap_lift(flap)) == pytest.approx(np.pi * (2 * a0 + a1), rel=1e-12)
    assert float(flap_pitching_moment(flap)) == pytest.approx(-np.pi / 4 * (a1 - a2), rel=1e-12)


def test_lift_vanishes_at_the_zero_lift_angle_and_the_ideal_point_lies_on_the_lift_line():
    for name in LINES:
        line = mean_line(name)
        expected = 2 * np.pi * (ideal_incidence(line) - zero_lift_angle(line))
        assert ideal_lift(line) == pytest.approx(expected, rel=1e-12)
        assert quarter_chord_moment(line) < 0


def test_no_camber_no_lift():
    assert zero_lift_angle(SYMMETRIC) == quarter_chord_moment(SYMMETRIC) == ideal_lift(SYMMETRIC) == 0.0


def test_batched_equals_single():
    x = np.linspace(0.05, 0.95, 7)
    for function in (flap_lift, flap_pitching_moment):
        np.testing.assert_allclose(function(x), [function(v) for v in x], rtol=1e-14)
