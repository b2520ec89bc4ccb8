import numpy as np
import pytest

from model.hinge_moments.compressibility import is_subsonic, prandtl_glauert


def test_factor_of_well_known_mach_numbers():
    np.testing.assert_allclose(prandtl_glauert(np.array([0.0, 0.6, 0.8])), [1.0, 1.25, 1 / 0.6], rtol=1e-15)


@pytest.mark.parametrize("mach", [1.0, 1.5, -0.1, np.nan, np.inf])
def test_outside_the_subsonic_range_is_refused(mach):
    with pytest.raises(ValueError, match="Mach"):
        prandtl_glauert(np.array([0.3, mach]))


def test_mask_tells_the_points_that_may_be_asked():
    np.testing.assert_array_equal(is_subsonic(np.array([0.2, 0.99, 1.0, np.nan])), [True, True, False, False])


def test_batched_equals_single():
    mach = np.linspace(0, 0.95, 11)
    np.testing.assert_array_equal(prandtl_glauert(mach), [prandtl_glauert(m) for m in mach])
