"""Bandwidth against closed forms and a dense frequency grid."""

import numpy as np

from design.frequency.bandwidth import bandwidth
from tests.design.step_loops import random_stable, second_order


def gains(A, b, c, d, omega):
    return np.array([abs(c @ np.linalg.solve(1j * w * np.eye(len(A)) - A, b) + d) for w in omega])


def test_second_order_in_closed_form():
    omega, zeta = np.meshgrid([0.5, 40.0, 3000.0], [0.05, 0.4, 0.7071, 2.0], indexing="ij")
    loops = second_order(omega, zeta)
    found = bandwidth(
        loops.closed, loops.reference_input[..., 0], loops.closed_outputs[..., 0, :], np.zeros((3, 4)), np.ones((3, 4))
    )
    s = 1.0 - 2.0 * zeta**2
    np.testing.assert_allclose(found, omega * np.sqrt(s + np.sqrt(s**2 + 1.0)), rtol=1e-9)


def test_lowest_crossing_of_random_loops():
    loops = random_stable(11, 12)
    A, b = loops.closed, loops.reference_input[..., 0]
    compared = 0
    for output in (0, 4):
        c, d = loops.closed_outputs[:, output, :], loops.reference_feedthrough[:, output, 0]
        dc = d - np.einsum("gn,gn->g", c, np.linalg.solve(A, b[..., None])[..., 0])
        found = bandwidth(A, b, c, d, dc)
        omega = np.geomspace(1e-2, 1e4, 4001)
        for i in range(12):
            below = gains(A[i], b[i], c[i], d[i], omega) < np.sqrt(0.5) * abs(dc[i])
            if not np.any(below):
                assert np.isnan(found[i]) or found[i] > omega[-1]
                continue
            k = int(np.argmax(below))
            assert omega[k - 1] <= found[i] <= omega[k]
            np.testing.assert_allclose(
                gains(A[i], b[i], c[i], d[i], found[i : i + 1]), np.sqrt(0.5) * abs(dc[i]), rtol=1e-9
            )
            np.testing.assert_allclose(bandwidth(A[i], b[i], c[i], d[i], dc[i]), found[i], rtol=1e-9)
            compared += 1
    assert compared >= 15


def test_no_bandwidth_without_a_dc_gain_or_a_fall():
    A, b, c = -np.eye(1)[None], np.ones((1, 1)), np.ones((1, 1))
    assert np.isnan(bandwidth(A, b, c, np.zeros(1), np.array([np.nan]))[0])
    assert np.isnan(bandwidth(A, b, c, np.zeros(1), np.zeros(1))[0])
    # 1 / (s + 1) + 9 falls from 10 to 9 only.
    assert np.isnan(bandwidth(A, b, c, np.full(1, 9.0), np.full(1, 10.0))[0])
