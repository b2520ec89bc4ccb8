"""The closed system against the definition of the loop, worked out equation by equation."""

from dataclasses import replace

import numpy as np
import pytest

from design.disturbance.closed_system import closed_system
from tests.design.disturbance.outside_loops import full_loop, plain_loop

INPUTS, OUTPUTS = ("n_noise", "r_a", "d_disturbance"), ("z", "aileron", "x", "tab")


def _oscillation(loop, index, s):
    """Amplitudes of outputs and commands for unit amplitudes of r and w at s, all equations in one linear system."""
    n, m = loop.B[index].shape
    A, B, K = loop.A[index], loop.B[index], loop.K[index]
    W = np.concatenate([loop.E[index], loop.G[index]], axis=-1)
    M = np.concatenate([loop.N[index], loop.M[index]], axis=-1)
    turn = np.diag(np.exp(-s * np.array(loop.delay)))
    unknowns = np.block([
        [s * np.eye(n) - A, -B, np.zeros((n, m))],
        [np.zeros((m, n)), np.eye(m), -turn],
        [K, np.zeros((m, m)), np.eye(m)],
    ])  # fmt: skip
    found = np.linalg.solve(unknowns, np.concatenate([W, np.zeros_like(M), M]).astype(complex))
    x, v, u = found[:n], found[n : n + m], found[n + m :]
    y = loop.C[index] @ x + loop.F[index] @ (s * x) + loop.D[index] @ v + loop.H[index] @ (s * v)
    return np.concatenate([y, u])


@pytest.mark.parametrize("delay", [(0.0, 0.0), (0.3, 0.0), (0.2, 0.7)])
def test_response_obeys_every_equation_of_the_loop(delay):
    loop = full_loop(delay=delay)
    system = closed_system(loop, INPUTS, OUTPUTS)
    assert (system.inputs, system.outputs) == (INPUTS, OUTPUTS)
    omega = np.broadcast_to([0.0, 0.3, 2.0, 40.0], (2, 3, 4))
    value = system.response(omega)
    columns = [("r_a", "d_disturbance", "n_noise").index(name) for name in INPUTS]
    rows = [("x", "y", "z", "tab", "aileron").index(name) for name in OUTPUTS]
    for index in np.ndindex(2, 3):
        for k, w in enumerate(omega[index]):
            expected = _oscillation(loop, index, 1j * w)[rows][:, columns]
            np.testing.assert_allclose(value[index][k], expected, rtol=1e-10, atol=1e-10)


def test_grid_equals_points():
    for delay in ((0.0, 0.0), (0.2, 0.7)):
        loop = full_loop(delay=delay)
        system = closed_system(loop, INPUTS, OUTPUTS)
        for index in np.ndindex(2, 3):
            alone = closed_system(loop.take(index), INPUTS, OUTPUTS)
            for field in ("A", "B", "C", "D", "R", "poles", "stable"):
                np.testing.assert_allclose(getattr(system, field)[index], getattr(alone, field), rtol=1e-12)


def test_a_state_that_nobody_reads_is_put_to_rest():
    """An integral of gain zero stands at the origin, and must not make the others look unstable."""
    A = [[0.0, 1.0, 0.0], [-4.0, -1.0, 0.0], [-1.0, 0.0, 0.0]]
    loop = plain_loop(A, [[0.0], [1.0], [0.0]], [[1.0, 0.5, 0.0]], [[0.0], [1.0], [0.0]], [[0.0]], [[1.0, 0.0, 0.0]])
    system = closed_system(loop, ("w0",), ("y0", "u0"))
    assert system.stable
    np.testing.assert_allclose(sorted(system.poles.imag)[::2], [-np.sqrt(5.0 - 0.75**2), np.sqrt(5.0 - 0.75**2)])
    s = 1j * np.array([0.0, 1.0, 3.0])
    np.testing.assert_allclose(system.response(s.imag)[:, 0, 0], 1.0 / (s**2 + 1.5 * s + 5.0), rtol=1e-13)
    assert not closed_system(replace(loop, K=np.array([[1.0, 0.5, 0.1]])), ("w0",), ("y0",)).stable
    # An unstable mode that is driven, but seen by nobody, and one that is seen but not driven.
    for where in ((2, 0), (0, 2)):
        A = np.diag([-1.0, -2.0, 3.0])
        A[where] = 1.0
        loop = plain_loop(
            A, [[1.0], [0.0], [0.0]], [[0.5, 0.0, 0.0]], [[1.0], [1.0], [0.0]], [[0.0]], [[1.0, 1.0, 0.0]]
        )
        assert closed_system(loop, ("w0",), ("y0",)).stable


def test_rounding_opens_no_direct_way():
    """``F G + D M`` that cancels must be exactly zero: the variance would be infinite otherwise."""
    loop = plain_loop(-np.eye(2), [[1.0], [0.3]], [[1.0, 0.0]], [[0.1], [0.7]], [[0.1]], [[1.0, 1.0]])
    loop = replace(loop, F=np.array([[0.1, 0.3]]), D=np.array([[-(0.01 + 0.21 + 0.01 + 0.009) / 0.1]]))
    direct = (loop.F @ (loop.G + loop.B @ loop.M) + loop.D @ loop.M).item()
    assert 0.0 < abs(direct) < 1e-15
    assert closed_system(loop, ("w0",), ("y0",)).D.item() == 0.0


def test_a_failed_point_stays_alone():
    loop = full_loop()
    K = loop.K.copy()
    K[0, 1] = np.nan
    for delay in ((0.0, 0.0), (0.2, 0.7)):
        broken, whole = (closed_system(replace(loop, K=gains, delay=delay), INPUTS, OUTPUTS) for gains in (K, loop.K))
        others = np.ones((2, 3), dtype=bool)
        others[0, 1] = False
        omega = np.broadcast_to([0.5, 3.0], (2, 3, 2))
        assert not broken.stable[0, 1]
        np.testing.assert_array_equal(broken.stable[others], whole.stable[others])
        np.testing.assert_allclose(broken.response(omega)[others], whole.response(omega)[others], rtol=1e-12)
        assert np.isnan(broken.response(omega)[0, 1]).all()


def test_names_and_delays_are_checked():
    loop = full_loop()
    with pytest.raises(ValueError, match="no reference or disturbance 'wind'"):
        closed_system(loop, ("wind",), ("x",))
    with pytest.raises(ValueError, match="no output or command 'da'"):
        closed_system(loop, ("r_a",), ("da",))
    with pytest.raises(ValueError, match="negative"):
        closed_system(replace(loop, delay=(0.1, -0.1)), ("r_a",), ("x",))


def test_a_loop_with_a_delay_is_judged_with_it():
    """``x' = -k x(t - delay)`` is stable below ``k delay = pi / 2``."""
    for product, stable in ((1.5, True), (1.6, False)):
        loop = plain_loop([[0.0]], [[1.0]], [[product / 0.4]], [[1.0]], [[0.0]], [[1.0]], delay=0.4)
        assert closed_system(loop, ("w0",), ("y0",)).stable == stable


def test_links_are_told_from_zeros():
    """A chain 0 -> 1 -> 2 -> 0 with state 3 apart; the second input has a direct way only."""
    A = -np.eye(4)
    A[[1, 2, 0], [0, 1, 2]] = 0.5
    loop = plain_loop(
        A, np.zeros((4, 1)), np.zeros((1, 4)), [[0, 0], [1, 0], [0, 0], [0, 0]], [[0, 2]], np.eye(4)[[0, 3]]
    )
    for delay in (0.0, 0.1):
        points = closed_system(replace(loop, delay=(delay,)), ("w0", "w1"), ("y0", "y1", "u0")).stable_points
        np.testing.assert_array_equal(points.linked[0], [[True, False], [False, False], [False, False]])
        np.testing.assert_array_equal(points.direct[0], [[False, False], [False, False], [False, True]])
