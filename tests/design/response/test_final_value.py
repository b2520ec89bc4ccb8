"""Final values: DC gain where the loop is stable, mode by mode where it is not."""

import numpy as np
from scipy.linalg import expm

from design.response.final_value import final_values
from tests.design.step_loops import random_stable


def generator_of(A, b):
    n = len(A)
    M = np.zeros((n + 1, n + 1))
    M[:n, :n], M[:n, n] = A, b
    return M


def test_stable_loops_settle_at_their_dc_gain():
    loops = random_stable(5, 3)
    M = np.zeros((3, 6, 6))
    M[:, :5, :5], M[:, :5, 5] = loops.closed, loops.reference_input[..., 0]
    rows = np.concatenate([loops.closed_outputs, loops.reference_feedthrough + loops.offset[..., None]], axis=-1)
    values = final_values(M, rows, np.linalg.eigvals(loops.closed))
    for i in range(3):
        rest = np.linalg.solve(loops.closed[i], -loops.reference_input[i])
        expected = (loops.closed_outputs[i] @ rest + loops.reference_feedthrough[i])[:, 0] + loops.offset[i]
        np.testing.assert_allclose(values[i], expected, rtol=1e-10)
        np.testing.assert_allclose(
            final_values(M[i], rows[i], np.linalg.eigvals(loops.closed[i])), values[i], rtol=1e-12
        )


def test_an_integral_that_nobody_uses_does_not_hide_the_others():
    A = np.array([[-2.0, 1.0, 0.0], [0.0, -3.0, 0.0], [-1.0, 0.0, 0.0]])
    rows = np.array([[1.0, 0.0, 0.0, 0.5], [0.0, 0.0, 1.0, 0.0]])
    drifting = generator_of(A, np.array([0.0, 6.0, 4.0]))
    np.testing.assert_allclose(final_values(drifting, rows, np.linalg.eigvals(A)), [1.5, np.nan], rtol=1e-12)
    # With its target met the integral comes to rest where its history leaves it.
    resting = generator_of(A, np.array([0.0, 6.0, 1.0]))
    late = rows @ expm(40.0 * resting)[:, -1]
    np.testing.assert_allclose(final_values(resting, rows, np.linalg.eigvals(A)), late, rtol=1e-12)


def test_an_integral_that_is_not_driven_stays_where_it_is():
    A = np.array([[-2.0, 0.0], [0.0, 0.0]])
    values = final_values(generator_of(A, np.array([1.0, 0.0])), np.array([[1.0, 1.0, 0.25]]), np.array([-2.0, 0.0]))
    np.testing.assert_allclose(values, [0.75], rtol=1e-12)


def test_growing_and_repeated_integrating_modes_have_no_limit():
    growing = np.array([[1.0, 0.0], [0.0, -1.0]])
    double = np.array([[0.0, 1.0], [0.0, 0.0]])
    M = np.stack([generator_of(growing, np.ones(2)), generator_of(double, np.array([0.0, 1.0]))])
    rows = np.broadcast_to([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], (2, 2, 3))
    values = final_values(M, rows, np.linalg.eigvals(M[:, :2, :2]))
    np.testing.assert_allclose(values, [[np.nan, 1.0], [np.nan, np.nan]])
