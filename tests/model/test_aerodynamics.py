from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.aerodynamics import Aerodynamics
from model.hinge_moments.compressibility import prandtl_glauert
from model.hinge_moments.thin_aerofoil import ThinAerofoil

SOURCE = ThinAerofoil(0.7, 0.88)
MACH = np.array([0.0, 0.4, 0.7])


def test_without_correction_the_source_speaks():
    plain = Aerodynamics(SOURCE)
    moments = plain.hinge_moments(0.1, 0.05, -0.02, MACH)
    np.testing.assert_array_equal(plain.amplification(MACH), np.ones(3))
    np.testing.assert_array_equal(moments.value, np.broadcast_to(SOURCE.at(0.1, 0.05, -0.02).value, (3, 2)))


def test_prandtl_glauert_multiplies_values_and_derivatives():
    corrected = Aerodynamics(SOURCE, compressibility="prandtl_glauert")
    moments, factor = corrected.hinge_moments(0.1, 0.05, -0.02, MACH), prandtl_glauert(MACH)
    assert moments.gradient.shape == (3, 2, 3)
    np.testing.assert_allclose(moments.value, factor[:, None] * SOURCE.at(0.1, 0.05, -0.02).value)
    np.testing.assert_allclose(moments.gradient, factor[:, None, None] * SOURCE.gradient)
    for i, mach in enumerate(MACH):
        point = corrected.hinge_moments(0.1, 0.05, -0.02, mach)
        np.testing.assert_array_equal(moments.take(i).value, point.value)
        np.testing.assert_array_equal(moments.take(i).gradient, point.gradient)


@pytest.mark.parametrize("compressibility", ["none", "prandtl_glauert"])
def test_supersonic_points_are_outside_whatever_the_correction(compressibility):
    aerodynamics = Aerodynamics(SOURCE, compressibility=compressibility)
    np.testing.assert_array_equal(aerodynamics.covers(np.array([0.9, 1.0, 1.3])), [True, False, False])


def test_correction_refuses_supersonic_points():
    with pytest.raises(ValueError, match="Mach"):
        Aerodynamics(SOURCE, compressibility="prandtl_glauert").amplification(np.array([0.3, 1.0]))


@pytest.mark.parametrize("option", [{"damping": "none"}, {"compressibility": "karman_tsien"}])
def test_unknown_options_are_refused(option):
    with pytest.raises(ValueError, match="must be one of"):
        Aerodynamics(SOURCE, **option)


def test_a_source_of_another_geometry_is_refused():
    tunnel = examples.wind_tunnel()
    with pytest.raises(ValueError, match="hinges of the geometry"):
        replace(tunnel, aerodynamics=Aerodynamics(SOURCE))
