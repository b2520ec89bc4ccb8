"""Theodorsen's function and the six-state models of both data sets against numbers found elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import hankel2

from model import examples
from model.flight import flight_condition
from model.hinge_moments.unsteady import jones
from model.linearise import linearise
from model.trim import trim

# Worked out independently of this code from the formulae of NACA reports 496 and 681: 50 m/s, 1.225 kg/m^3.
SIX_STATES = {
    "wind_tunnel": ((-42.13854599 + 33.80885431j, 26.48621558 + 44.04597851j), (-61.888, -8.0999)),
    "wind_tunnel_23012": ((-36.46912264 + 101.7404649j, 0.9925081357 + 26.14435192j), (-54.252, -7.8723)),
}
#: Theodorsen's function as tabulated (NACA report 496, table of F and G).
THEODORSEN = {0.1: 0.8319 - 0.1723j, 0.2: 0.7276 - 0.1886j, 0.36: 0.6390 - 0.1709j, 0.5: 0.5979 - 0.1507j}


def theodorsen(k):
    """The exact function ``H1(k) / (H1(k) + i H0(k))`` with Hankel functions of the second kind."""
    return hankel2(1, k) / (hankel2(1, k) + 1j * hankel2(0, k))


@pytest.mark.parametrize("name", SIX_STATES)
def test_eigenvalues_with_virtual_inertia(name):
    condition = flight_condition(0.0, "airspeed", 50.0)
    air = replace(condition.air, density=np.array(1.225))
    condition = replace(condition, air=air, dynamic_pressure=np.array(0.5 * 1.225 * 2500.0))
    system = getattr(examples, name)()
    aerodynamics = replace(system.aerodynamics, damping="unsteady", virtual_inertia=True)
    system = replace(system, aerodynamics=aerodynamics)
    found = np.linalg.eigvals(linearise(system, condition, trim(system, condition, examples.WIND_TUNNEL_TRIM)).A)
    pairs, lags = SIX_STATES[name]
    upper = np.sort_complex(found[found.imag > 0])
    np.testing.assert_allclose(upper, np.sort_complex(pairs), rtol=1e-9)
    np.testing.assert_allclose(np.sort(found[found.imag == 0].real), np.sort(lags), rtol=1e-5)


def test_the_exact_function_is_the_tabulated_one():
    for k, value in THEODORSEN.items():
        assert theodorsen(k) == pytest.approx(value, abs=6e-5)


def test_jones_is_within_two_and_a_half_per_cent_of_theodorsen():
    k = np.logspace(-4, 2, 400)
    exact, found = theodorsen(k), jones(1j * k)
    assert np.max(np.abs(found - exact) / np.abs(exact)) < 0.0235
    assert np.max(np.abs(found - exact)) < 0.0147


def test_jones_is_the_printed_quotient():
    p = np.array([0.0, 0.02 + 0.1j, 3j, -0.01 + 0.5j, 400.0])
    quotient = (0.5 * p**2 + 0.2808 * p + 0.01365) / (p**2 + 0.3455 * p + 0.01365)
    np.testing.assert_allclose(jones(p), quotient, rtol=1e-13)
