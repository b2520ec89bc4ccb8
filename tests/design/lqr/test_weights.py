from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from design.lqr.weights import BrysonWeights, ExplicitWeights, WeightsRefused, check_weights, weight_matrices
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS


def test_brysons_rule_over_the_named_states_and_inputs():
    weights = weight_matrices(
        BrysonWeights(
            aileron=0.5,
            aileron_rate=0.25,
            tab=0.1,
            tab_rate=2.0,
            aileron_integral=0.01,
            tab_torque=0.5,
            aileron_torque=4.0,
        )
    )
    # dt, dt_rate, da, da_rate, int_a and T_t, T_a.
    np.testing.assert_allclose(weights.Q, np.diag([100.0, 0.25, 4.0, 16.0, 1e4]), rtol=1e-15)
    np.testing.assert_allclose(weights.R, np.diag([4.0, 0.0625]), rtol=1e-15)
    assert weights.N is None


def test_brysons_rule_over_other_states():
    both = replace(WIND_TUNNEL_WEIGHTS, tab_integral=0.004)
    states = ("dt", "dt_rate", "da", "da_rate", "int_a", "int_t", "tab_torque", "lag_1")
    weights = weight_matrices(both, states)
    np.testing.assert_array_equal(weights.Q[:5, :5], weight_matrices(WIND_TUNNEL_WEIGHTS).Q)
    assert weights.Q[5, 5] == pytest.approx(1.0 / 0.004**2)
    np.testing.assert_array_equal(weights.Q[6:], 0.0)
    # A regulator has no integral to weigh, and needs no value for one.
    alone = replace(WIND_TUNNEL_WEIGHTS, aileron_integral=None)
    np.testing.assert_array_equal(weight_matrices(alone, states[:4]).Q, weights.Q[:4, :4])


@pytest.mark.parametrize(("name", "state"), [("aileron_integral", "int_a"), ("tab_integral", "int_t")])
def test_brysons_rule_without_a_value_for_an_integral_that_there_is(name, state):
    weights = replace(WIND_TUNNEL_WEIGHTS, **{"tab_integral": 0.004, name: None})
    with pytest.raises(WeightsRefused, match=f"{name} is missing.* 0 1/s .*{state}") as refused:
        weight_matrices(weights, ("dt", "dt_rate", "da", "da_rate", "int_a", "int_t"))
    assert (refused.value.matrix, refused.value.eigenvalue) == ("Q", 0.0)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_bryson_needs_positive_values(value):
    values = [1.0] * 7
    values[4] = value
    with pytest.raises(ValueError, match="aileron_integral"):
        BrysonWeights(*values)
    with pytest.raises(ValueError, match="tab_integral"):
        replace(WIND_TUNNEL_WEIGHTS, tab_integral=value)
    with pytest.raises(ValueError, match="aileron_rate"):
        replace(WIND_TUNNEL_WEIGHTS, aileron_rate=None)


def test_bryson_values_too_small_to_square_are_refused_later():
    weights = weight_matrices(BrysonWeights(1e-200, *[1.0] * 6))
    with pytest.raises(WeightsRefused, match="not finite") as refused:
        check_weights(weights.Q, weights.R)
    assert refused.value.matrix == "Q"


def test_explicit_weights_come_as_lists_and_stay_as_they_are():
    weights = ExplicitWeights(Q=[[2.0, 0.0], [0.0, 1.0]], R=[[1]], N=[[0.5], [0.0]])
    assert weight_matrices(weights) is weights
    assert weights.R.dtype == float
    with pytest.raises(ValueError, match="read-only"):
        weights.Q[0, 0] = 3.0


def test_good_weights_pass():
    weights = weight_matrices(WIND_TUNNEL_WEIGHTS)
    assert check_weights(weights.Q, weights.R) is None
    # Singular Q, singular Q - N R^-1 N', and units 24 decades apart are all good weights.
    assert check_weights(np.diag([1.0, 0.0, 1e-12, 1e12, 0.0]), np.diag([1e-12, 1e12])) is None
    N = np.zeros((5, 2))
    N[:2] = [[1.0, 0.5], [0.2, 2.0]]
    R = np.array([[2.0, 0.3], [0.3, 1.0]])
    assert check_weights(N @ np.linalg.inv(R) @ N.T, R, N) is None


def refused(Q, R, N=None):
    with pytest.raises(WeightsRefused) as caught:
        check_weights(np.asarray(Q, float), np.asarray(R, float), None if N is None else np.asarray(N, float))
    error = caught.value
    assert str(error) == error.reason
    return error


@pytest.mark.parametrize(
    ("R", "eigenvalue"),
    [
        ([[1, 0], [0, 0]], 0.0),
        ([[1, 0], [0, -2]], -2.0),
        ([[1, 2], [2, 1]], -1.0),
        ([[1, 1], [1, 1]], 0.0),
        ([[0, 0], [0, 0]], 0.0),
        ([[1e12, 0], [0, -1e-12]], -1e-12),
    ],
)
def test_r_that_is_not_positive_definite(R, eigenvalue):
    error = refused(np.eye(5), R)
    assert error.matrix == "R"
    assert error.eigenvalue == pytest.approx(eigenvalue, abs=1e-15)
    assert "R is not positive definite" in error.reason
    assert f"{error.eigenvalue:.6g}" in error.reason


@pytest.mark.parametrize(
    ("Q", "eigenvalue"),
    [
        (np.diag([1, 1, -3, 1, 1]), -3.0),
        (np.diag([1e12, 1, -1e-6, 1, 1]), -1e-6),
        (np.diag([1.0, 1, 1, 1, 0]) + 0.5 * (np.eye(5, k=4) + np.eye(5, k=-4)), 0.5 * (1 - np.sqrt(2.0))),
    ],
)
def test_q_that_is_not_positive_semidefinite(Q, eigenvalue):
    error = refused(Q, np.eye(2))
    assert error.matrix == "Q"
    assert error.eigenvalue == pytest.approx(eigenvalue, rel=1e-12)
    assert "Q is not positive semidefinite" in error.reason


def test_cross_term_too_large_for_q():
    N = np.zeros((5, 2))
    N[1, 0] = 2.0
    error = refused(np.eye(5), np.diag([2.0, 1.0]), N)
    assert error.matrix == "N"
    assert error.eigenvalue == pytest.approx(1.0 - 2.0)
    assert "Q - N R^-1 N'" in error.reason
    # One that touches a state without any weight is too large however small.
    assert refused(np.diag([1.0, 0, 1, 1, 1]), np.eye(2), 1e-6 * N).matrix == "N"


@pytest.mark.parametrize(
    ("matrix", "Q", "R", "N"),
    [
        ("Q", np.ones((5, 4)), np.eye(2), None),
        ("Q", np.eye(5) + np.eye(5, k=1), np.eye(2), None),
        ("Q", np.diag([1, 1, np.nan, 1, 1]), np.eye(2), None),
        ("R", np.eye(5), [[1, 0.1], [0.2, 1]], None),
        ("R", np.eye(5), [[1, 0], [0, np.inf]], None),
        ("N", np.eye(5), np.eye(2), np.zeros((2, 5))),
        ("N", np.eye(5), np.eye(2), np.full((5, 2), np.nan)),
    ],
)
def test_shape_symmetry_and_numbers(matrix, Q, R, N):
    error = refused(Q, R, N)
    assert error.matrix == matrix
    assert error.eigenvalue is None
    assert error.reason.startswith(matrix)


@given(st.integers(0, 2**32 - 1), st.floats(1e-3, 1e3))
def test_definiteness_does_not_depend_on_units(seed, shift):
    """A congruence with any diagonal keeps the verdict (Sylvester's law of inertia)."""
    random = np.random.default_rng(seed)
    C = random.normal(size=(5, 5))
    unit = 10.0 ** random.uniform(-6, 6, 5)
    good = C @ C.T
    bad = good - (np.linalg.eigvalsh(good)[0] + shift) * np.eye(5)
    R = np.eye(2)
    assert check_weights(good * np.outer(unit, unit), R) is None
    assert refused(bad * np.outer(unit, unit), R).matrix == "Q"
