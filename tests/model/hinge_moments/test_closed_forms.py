import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from model.hinge_moments.closed_forms import (
    acceleration_moment,
    apparent_mass_rate_moment,
    between_surfaces,
    flap_moment,
    incidence_moment,
    parabola_moment,
    ramp_moment,
    rate_moment,
)

PAIRS = [(0.7, 0.88), (0.88, 0.7), (0.75, 0.75), (0.4, 0.95), (0.97, 0.6), (0.1, 0.99)]
HINGES = st.floats(0.02, 0.98)


def angle(x):
    return np.arccos(1 - 2 * x)


def flap_vorticity(theta, f):
    """``gamma / (2 V) sin(theta)`` of a unit flap (Glauert)."""
    kernel = np.log(abs(np.sin(0.5 * (theta + f)) / np.sin(0.5 * (theta - f))))
    return (np.pi - f) / np.pi * (1 + np.cos(theta)) + kernel * np.sin(theta) / np.pi


def moment_of(vorticity_times_sine, hinge, breaks):
    """Integral of ``4 (gamma/2V) (x - hinge) dx`` with ``dx = sin(theta)/2 d theta``."""
    h = angle(hinge)

    def load(t):
        return 2.0 * vorticity_times_sine(t) * (0.5 * (1 - np.cos(t)) - hinge)

    points = [b for b in breaks if h < b < np.pi]
    return quad(load, h, np.pi, points=points or None, epsabs=1e-14, limit=400)[0]


def test_incidence_moment_is_the_moment_of_the_flat_plate_load():
    for hinge in (0.05, 0.3, 0.7, 0.97):
        expected = moment_of(lambda t: 1 + np.cos(t), hinge, [])
        assert float(incidence_moment(hinge)) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(("hinge", "flap"), PAIRS)
def test_flap_moment_is_the_moment_of_glauerts_load(hinge, flap):
    f = angle(flap)
    expected = moment_of(lambda t: flap_vorticity(t, f), hinge, [f])
    assert float(flap_moment(hinge, flap)) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(("hinge", "start"), [*PAIRS, (0.7, 0.0)])
def test_ramp_and_parabola_are_superpositions_of_flaps(hinge, start):
    points = [hinge] if start < hinge else None
    ramp = quad(lambda z: float(flap_moment(hinge, z)), start, 1, points=points, epsabs=1e-14, limit=200)[0]
    parabola = quad(lambda z: float(ramp_moment(hinge, z)), start, 1, points=points, epsabs=1e-14, limit=200)
    assert float(ramp_moment(hinge, start)) == pytest.approx(ramp, rel=1e-9)
    assert float(parabola_moment(hinge, start)) == pytest.approx(parabola[0], rel=1e-9)


@pytest.mark.parametrize(("hinge", "flap"), PAIRS)
def test_apparent_mass_part_is_the_accelerated_potential(hinge, flap):
    # Without circulation the bound vorticity is gamma - 2 Gamma / (pi c sin): its potential jump phi starts
    # and ends at zero. N = 2 int_h^1 (x - h) phi dx = - int (x - h)^2 dphi, after one integration by parts.
    f, h = angle(flap), angle(hinge)
    circulation = (np.pi - f + np.sin(f)) / np.pi  # A_0 + A_1 / 2

    def integrand(t):
        return (0.5 * (1 - np.cos(t)) - hinge) ** 2 * (flap_vorticity(t, f) - circulation)

    expected = -quad(integrand, h, np.pi, points=[f] if h < f else None, epsabs=1e-15, limit=400)[0]
    assert float(apparent_mass_rate_moment(hinge, flap)) == pytest.approx(expected, rel=1e-7, abs=1e-13)


@pytest.mark.parametrize(("hinge", "flap"), PAIRS)
def test_acceleration_moment_is_the_apparent_mass_of_the_ramp(hinge, flap):
    # beta'' moves the points behind the hinge with (x - flap) c beta'': a ramp of flaps.
    points = [hinge] if flap < hinge else None
    expected = quad(
        lambda z: float(apparent_mass_rate_moment(hinge, z)), flap, 1, points=points, epsabs=1e-15, limit=200
    )[0]
    assert float(acceleration_moment(hinge, flap)) == pytest.approx(expected, rel=1e-8)


@given(HINGES, HINGES)
@settings(max_examples=100, deadline=None)
def test_virtual_inertia_is_symmetric(hinge, flap):
    there, back = float(acceleration_moment(hinge, flap)), float(acceleration_moment(flap, hinge))
    assert there == pytest.approx(back, rel=1e-9, abs=1e-16)


@given(HINGES)
@settings(max_examples=50, deadline=None)
def test_forms_are_continuous_where_the_hinges_meet(hinge):
    for form in (flap_moment, ramp_moment, rate_moment, acceleration_moment, parabola_moment):
        beside = float(form(hinge, hinge + 1e-9))
        assert float(form(hinge, hinge)) == pytest.approx(beside, rel=1e-5)


def test_virtual_inertia_is_positive_definite_and_rate_derivatives_positive():
    rng = np.random.default_rng(1)
    aileron = rng.uniform(0.3, 0.9, 200)
    tab = aileron + (0.99 - aileron) * rng.uniform(0.05, 0.95, 200)
    A = between_surfaces(acceleration_moment, aileron, tab)
    assert A.shape == (200, 2, 2)
    assert np.all(np.linalg.eigvalsh(0.5 * (A + np.swapaxes(A, -1, -2))) > 0)
    assert np.all(between_surfaces(rate_moment, aileron, tab) > 0)
    assert np.all(between_surfaces(flap_moment, aileron, tab) > 0)


@pytest.mark.parametrize(
    "form",
    [
        flap_moment,
        ramp_moment,
        parabola_moment,
        apparent_mass_rate_moment,
        rate_moment,
        acceleration_moment,
    ],
)
def test_batched_equals_single(form):
    hinge, flap = np.linspace(0.3, 0.97, 6)[:, None], np.linspace(0.35, 0.97, 5)
    table = form(hinge, flap)
    assert table.shape == (6, 5)
    for i in range(6):
        for j in range(5):
            np.testing.assert_allclose(table[i, j], form(hinge[i, 0], flap[j]), rtol=1e-13)


def test_between_surfaces_has_rows_of_hinges_in_order_tab_aileron():
    matrix = between_surfaces(flap_moment, 0.7, 0.88)
    expected = [
        [flap_moment(0.88, 0.88), flap_moment(0.88, 0.7)],
        [flap_moment(0.7, 0.88), flap_moment(0.7, 0.7)],
    ]
    np.testing.assert_array_equal(matrix, expected)
