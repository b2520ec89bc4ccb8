"""Roots counted by the argument principle, against the Lambert function and against dense contours."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import lambertw

from design.delay.characteristic import characteristic
from design.delay.winding import APEX, inside, roots_inside
from tests.design.delay.delayed_loops import loop, random_loops, scalar, winding

BRANCHES = range(-150, 151)


def _lambert(a):
    """All roots of ``s + a exp(-s) = 0`` up to |Im s| of 900."""
    return np.array([lambertw(-a, k) for k in BRANCHES])


@pytest.mark.parametrize(("decay", "damping"), [
    (0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (3.0, 1.0), (3.0, 0.5), (3.0, 0.2), (4.0, 0.1), (4.0, 0.9), (2.0, 0.0),
    (2.0, -0.3), (2.0, -0.9),
])  # fmt: skip
def test_counts_of_the_scalar_loop(decay, damping):
    a = np.array([1e-6, 0.1, 0.3, 0.36, 0.4, 1.0, 1.5, 1.57, 1.5709, 3.0, 10.0])
    f = characteristic(scalar(a, 1.0), np.ones(a.shape, dtype=bool))
    ours = roots_inside(f, decay / f.scale, np.full(a.shape, damping))
    roots = np.array([_lambert(x) for x in a]) / f.scale[:, None]
    np.testing.assert_array_equal(ours, inside(roots, decay / f.scale, np.full(a.shape, damping)).sum(axis=-1))


@pytest.mark.parametrize("delay", [(0.3,), (1.5,), (0.4, 0.4), (0.3, 1.1)])
@pytest.mark.parametrize("stable", [True, False])
def test_counts_of_random_loops_are_those_of_dense_contours(delay, stable):
    loops = random_loops(4, 4, delay, seed=7, stable=stable)
    f = characteristic(loops, np.ones(4, dtype=bool))
    for decay, damping in ((0.5, 1.0), (1.0, 0.4), (0.0, 1.0)):
        ours = roots_inside(f, decay / f.scale, np.full(4, damping))
        height = 1j * decay * np.tan(np.arccos(damping)) if damping < 1.0 else 0.0
        for i in range(4):
            far = 20.0 * f.scale[i]
            notch = [-decay + height, 0.0, -decay - height] if height else [-decay]
            corners = [-decay - 1j * far, far - 1j * far, far + 1j * far, -decay + 1j * far, *notch]
            assert ours[i] == winding(loops.take(i), np.array(corners) - APEX * f.scale[i])


def test_a_root_on_the_contour_is_not_settled():
    """``x' = -x(t - 1)`` has roots at W(-1): the line goes through one, then past it on either side."""
    root = lambertw(-1.0, 1)
    f = characteristic(scalar(np.ones(3), 1.0), np.ones(3, dtype=bool))
    decay = -root.real * (1.0 + np.array([0.0, 1e-6, -1e-6])) / f.scale
    decay[0] -= 1e-9  # the region begins that much farther to the left
    count = roots_inside(f, decay, np.ones(3))
    assert np.isnan(count[0])
    assert count[1] - count[2] == 2.0


def test_a_root_at_the_origin_or_on_the_axis_is_inside():
    A, B = np.diag([0.0, -1.0]), np.array([[0.0], [1.0]])
    integral = characteristic(loop(A, B, [[0.0, 0.5]], (0.3,)), np.array(True))
    assert roots_inside(integral, np.zeros(1), np.ones(1)) == 1.0
    edge = characteristic(scalar(np.pi / 2.0, 1.0), np.array(True))
    assert roots_inside(edge, np.zeros(1), np.ones(1)) == 2.0


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10_000), n=st.integers(1, 6), delay=st.sampled_from([(0.05,), (0.6,), (2.0,), (0.2, 0.7)]),
    factor=st.floats(1e-3, 1e3),
)  # fmt: skip
def test_counts_do_not_depend_on_the_unit_of_time(seed, n, delay, factor):
    loops = random_loops(3, n, delay, seed, stable=bool(seed % 2))
    other = loop(loops.A * factor, loops.B * factor, loops.K, tuple(d / factor for d in delay))
    points = np.ones(3, dtype=bool)
    f, g = characteristic(loops, points), characteristic(other, points)
    for decay, damping in ((0.0, 1.0), (1.0, 0.37)):
        ours = roots_inside(f, decay / f.scale, np.full(3, damping))
        np.testing.assert_array_equal(ours, roots_inside(g, decay * factor / g.scale, np.full(3, damping)))


def test_grid_equals_points():
    loops = random_loops(5, 5, (0.8,), seed=2)
    f = characteristic(loops, np.ones(5, dtype=bool))
    decay, damping = np.linspace(0.0, 1.0, 5), np.linspace(0.2, 1.0, 5)
    whole = roots_inside(f, decay, damping)
    for i in range(5):
        assert whole[i] == roots_inside(f.take(slice(i, i + 1)), decay[i : i + 1], damping[i : i + 1])[0]
