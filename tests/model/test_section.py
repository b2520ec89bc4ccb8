import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from model.section import Body, Geometry, Inertia, inertia_matrix

POSITIVE = st.floats(1e-3, 1e3)


@given(
    chord=st.floats(0.05, 10.0),
    hinges=st.tuples(st.floats(0.3, 0.95), st.floats(0.02, 0.98)),
    masses=st.tuples(POSITIVE, POSITIVE),
    inertias=st.tuples(st.floats(1e-6, 1e2), st.floats(1e-6, 1e2)),
    offsets=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
)
@settings(max_examples=200, deadline=None)
def test_inertia_matrix_is_symmetric_positive_definite(chord, hinges, masses, inertias, offsets):
    aileron_hinge, behind = hinges
    geometry = Geometry(chord, 1.0, aileron_hinge, aileron_hinge + (1 - aileron_hinge) * behind)
    bodies = Inertia(Body(masses[0], offsets[0], inertias[0]), Body(masses[1], offsets[1], inertias[1]))
    J = inertia_matrix(geometry, bodies)
    np.testing.assert_array_equal(J, J.T)
    # det J = It (Ia + ma ea^2 + mt l^2) + mt et^2 (Ia + ma ea^2): positive for any body with inertia.
    arm = inertias[0] + masses[0] * offsets[0] ** 2
    determinant = inertias[1] * (arm + masses[1] * geometry.hinge_distance**2)
    determinant += masses[1] * offsets[1] ** 2 * arm
    # J's entries may be far larger than its determinant's factors: allow their rounding.
    rounding = 1e-13 * J[0, 0] * J[1, 1]
    assert J[0, 0] > 0
    assert J[1, 1] > 0
    assert J[0, 0] * J[1, 1] - J[0, 1] ** 2 == pytest.approx(determinant, rel=1e-9, abs=rounding)


@given(st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
@settings(max_examples=50, deadline=None)
def test_quadratic_form_is_the_kinetic_energy_of_the_two_bodies(rates):
    tab_rate, aileron_rate = rates
    geometry = Geometry(0.6, 0.8, 0.7, 0.88)
    bodies = Inertia(Body(0.9, 0.01, 7e-3), Body(0.08, 0.0005, 3.5e-4))
    J = inertia_matrix(geometry, bodies)
    # Each body turns at its absolute rate about a centre of mass that moves across the chord line.
    aileron_speed = 0.01 * aileron_rate
    tab_speed = geometry.hinge_distance * aileron_rate + 0.0005 * (aileron_rate + tab_rate)
    energy = 0.5 * (0.9 * aileron_speed**2 + 7e-3 * aileron_rate**2)
    energy += 0.5 * (0.08 * tab_speed**2 + 3.5e-4 * (aileron_rate + tab_rate) ** 2)
    assert 0.5 * np.array(rates) @ J @ np.array(rates) == pytest.approx(energy, rel=1e-12, abs=1e-15)


def test_levers_run_from_hinge_to_hinge_and_to_the_trailing_edge():
    geometry = Geometry(0.6, 0.8, 0.7, 0.88)
    assert geometry.aileron_chord == pytest.approx(0.18)
    assert geometry.tab_chord == pytest.approx(0.072)
    assert geometry.hinge_distance == pytest.approx(0.108)


def test_arrays_of_geometries_give_stacks_of_matrices():
    tab_hinge = np.array([0.8, 0.88, 0.95])
    bodies = Inertia(Body(0.9, 0.01, 7e-3), Body(0.08, 0.0005, 3.5e-4))
    stack = inertia_matrix(Geometry(0.6, 0.8, 0.7, tab_hinge), bodies)
    assert stack.shape == (3, 2, 2)
    for i, x in enumerate(tab_hinge):
        np.testing.assert_array_equal(stack[i], inertia_matrix(Geometry(0.6, 0.8, 0.7, x), bodies))


@pytest.mark.parametrize(
    "values",
    [
        (0.0, 0.8, 0.7, 0.9),
        (0.6, -1.0, 0.7, 0.9),
        (np.inf, 0.8, 0.7, 0.9),
        (np.nan, 0.8, 0.7, 0.9),
        (0.6, 0.8, 0.0, 0.9),
        (0.6, 0.8, 0.7, 1.0),
        (0.6, 0.8, 0.9, 0.9),
        (0.6, 0.8, 0.9, 0.7),
        (0.6, 0.8, np.nan, 0.7),
    ],
)
def test_impossible_geometry_is_refused(values):
    with pytest.raises(ValueError, match=r"chord|hinge"):
        Geometry(*values)


@pytest.mark.parametrize("values", [(0.0, 0.0, 1.0), (1.0, 0.0, -1.0), (1.0, np.nan, 1.0), (np.inf, 0.0, 1.0)])
def test_impossible_body_is_refused(values):
    with pytest.raises(ValueError, match=r"mass|cg_offset"):
        Body(*values)
