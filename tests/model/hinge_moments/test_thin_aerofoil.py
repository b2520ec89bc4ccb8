from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from model.hinge_moments.camber import mean_line
from model.hinge_moments.closed_forms import flap_moment, incidence_moment
from model.hinge_moments.thin_aerofoil import ThinAerofoil, camber_moment, camber_pressure

SECTIONS = ["symmetric", "NACA 2412", "NACA 23012", "NACA 65018"]
ANGLES = np.deg2rad([5.0, -10.0, 10.0])


def load_moment(source, hinge, angles):
    """Moment of the pressure difference about a hinge, by quadrature in theta, split at its singular points."""
    breaks = [0.7, 0.88] + [b.start for b in (*source.mean_line.ramps, *source.mean_line.parabolas)]
    points = sorted({np.arccos(1 - 2 * b) for b in breaks if b > hinge})

    def integrand(t):
        x = 0.5 * (1 - np.cos(t))
        return source.pressure_difference(np.array([x]), *angles)[0] * (x - hinge) * 0.5 * np.sin(t)

    start = np.arccos(1 - 2 * hinge) + 1e-9  # not on the hinge itself, where the load is infinite
    edges = [start, *points, np.pi]
    return sum(quad(integrand, a, b, epsabs=1e-13, limit=200)[0] for a, b in pairwise(edges))


@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize(("positive", "sign"), [("te_up", -1.0), ("te_down", 1.0)])
def test_pressure_integrates_to_the_hinge_moments(section, positive, sign):
    source = ThinAerofoil(0.7, 0.88, mean_line(section), positive)
    value = source.at(*ANGLES).value
    assert sign * load_moment(source, 0.88, ANGLES) == pytest.approx(value[0], abs=1e-11)
    assert sign * load_moment(source, 0.70, ANGLES) == pytest.approx(value[1], abs=1e-11)


@pytest.mark.parametrize("section", SECTIONS)
def test_camber_load_is_a_superposition_of_flaps_along_the_mean_line(section):
    line = mean_line(section)
    incidence = -line.slope(0.0)
    for hinge in (0.6, 0.93):
        bends = sorted({b.start for b in (*line.ramps, *line.parabolas)} | {hinge})

        def integrand(z, hinge=hinge):
            step = 1e-6
            turn = -(line.slope(z + step) - line.slope(z - step)) / (2 * step)
            return float(turn * flap_moment(hinge, z))

        spread = quad(integrand, 0.0, 1.0, points=bends, epsabs=1e-13, limit=400)[0]
        expected = float(incidence * incidence_moment(hinge)) + spread
        assert float(camber_moment(line, hinge)) == pytest.approx(expected, abs=2e-9)


def test_value_is_offset_plus_gradient_times_angles():
    source = ThinAerofoil(0.7, 0.88, mean_line("NACA 23012"))
    moments = source.at(*ANGLES)
    np.testing.assert_allclose(moments.value, source.offset + moments.gradient @ ANGLES, rtol=1e-14)
    np.testing.assert_allclose(source.at(0.0, 0.0, 0.0).value, source.offset, rtol=0)


def test_the_sign_switch_turns_incidence_and_camber_and_leaves_deflections():
    up, down = (ThinAerofoil(0.7, 0.88, mean_line("NACA 2412"), p) for p in ("te_up", "te_down"))
    np.testing.assert_array_equal(up.offset, -down.offset)
    np.testing.assert_array_equal(up.gradient[:, 0], -down.gradient[:, 0])
    np.testing.assert_array_equal(up.gradient[:, 1:], down.gradient[:, 1:])
    assert np.all(up.gradient[:, 0] < 0)
    assert np.all(up.gradient[:, 1:] > 0)


def test_the_sign_switch_is_only_a_name_for_the_same_flow():
    up, down = (ThinAerofoil(0.7, 0.88, mean_line("NACA 2412"), p) for p in ("te_up", "te_down"))
    alpha, dt, da = ANGLES
    x = np.array([0.1, 0.5, 0.9])
    np.testing.assert_allclose(up.at(alpha, dt, da).value, -down.at(alpha, -dt, -da).value, rtol=1e-13)
    np.testing.assert_allclose(
        up.pressure_difference(x, alpha, dt, da), down.pressure_difference(x, alpha, -dt, -da), rtol=1e-13
    )


def test_load_vanishes_at_the_trailing_edge():
    source = ThinAerofoil(0.7, 0.88, mean_line("NACA 23012"))
    assert source.pressure_difference(np.array([1.0]), *ANGLES)[0] == pytest.approx(0.0, abs=1e-15)
    assert camber_pressure(mean_line("NACA 2412"), np.array([1.0]))[0] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("x", [0.0, -0.1, 1.1, np.nan, 0.7, 0.88, 0.88 + 1e-16])
def test_infinite_load_is_refused(x):
    source = ThinAerofoil(0.7, 0.88)
    with pytest.raises(ValueError, match=r"leading edge|hinge"):
        source.pressure_difference(np.array([0.5, x]), *ANGLES)


@pytest.mark.parametrize("hinges", [(0.88, 0.7), (0.7, 0.7), (0.0, 0.5), (0.5, 1.0), (np.nan, 0.9)])
def test_hinges_out_of_order_are_refused(hinges):
    with pytest.raises(ValueError, match="hinges"):
        ThinAerofoil(*hinges)


def test_unknown_sign_is_refused():
    with pytest.raises(ValueError, match="te_up"):
        ThinAerofoil(0.7, 0.88, positive="down")


def test_batched_equals_single():
    source = ThinAerofoil(0.7, 0.88, mean_line("NACA 23012"))
    alpha, dt, da = np.linspace(-0.1, 0.2, 4)[:, None], np.linspace(-0.3, 0.3, 5), 0.07
    x = np.array([0.02, 0.33, 0.95])
    table, load = source.at(alpha, dt, da), source.pressure_difference(x, alpha, dt, da)
    assert table.value.shape == (4, 5, 2)
    assert table.gradient.shape == (4, 5, 2, 3)
    assert load.shape == (4, 5, 3)
    for i in range(4):
        for j in range(5):
            point = source.at(alpha[i, 0], dt[j], da)
            np.testing.assert_array_equal(table.take((i, j)).value, point.value)
            np.testing.assert_array_equal(table.take((i, j)).gradient, point.gradient)
            single = source.pressure_difference(x, alpha[i, 0], dt[j], da)
            np.testing.assert_allclose(load[i, j], single, rtol=1e-14)


def test_hinges_may_be_arrays_too():
    tab_hinge = np.array([0.85, 0.9, 0.95])
    stack = ThinAerofoil(0.7, tab_hinge, mean_line("NACA 2412"))
    moments = stack.at(0.1, 0.05, -0.02)
    x = np.array([0.2, 0.8])
    load = stack.pressure_difference(x, 0.1, 0.05, -0.02)
    assert moments.value.shape == (3, 2)
    assert load.shape == (3, 2)
    for i, hinge in enumerate(tab_hinge):
        single = ThinAerofoil(0.7, hinge, mean_line("NACA 2412"))
        np.testing.assert_allclose(moments.value[i], single.at(0.1, 0.05, -0.02).value, rtol=1e-14)
        np.testing.assert_allclose(load[i], single.pressure_difference(x, 0.1, 0.05, -0.02), rtol=1e-14)
