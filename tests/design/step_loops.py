"""Loops built by hand, with known answers, for the tests of responses, metrics and demands."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_continuous_are

from design.loop import Loop

OUTPUTS = ("dt", "dt_rate", "da", "da_rate", "T_t", "T_a")


def loop(A, B, E, K, N, C, F, D, offset, states=None, inputs=None, references=("r_a",), outputs=OUTPUTS) -> Loop:
    """A Loop from matrices over any grid, names filled in."""
    *grid, n, m = np.shape(B)
    o = np.shape(C)[-2]

    def none(rows, columns=0):
        return np.zeros((*grid, rows, columns))

    return Loop(
        *(np.asarray(M, dtype=float) for M in (A, B, E, none(n), K, N, none(m), C, F, D, none(o, m), offset)),
        states=states or tuple(f"x{i}" for i in range(n)),
        inputs=inputs or ("tab", "aileron")[-m:],
        references=tuple(references),
        outputs=tuple(outputs),
        disturbances=(),
        stages=(),
        delay=(0.0,) * m,
    )


def second_order(omega, zeta, trim_torque=0.0) -> Loop:
    """``da = w^2 / (s^2 + 2 z w s + w^2) r_a`` over the shape of omega and zeta, closed by gains.

    The plant is a unit inertia moved by the torque T_a: ``K = [w^2, 2 z w]``, ``N = w^2``.
    """
    omega, zeta = np.broadcast_arrays(np.asarray(omega, dtype=float), np.asarray(zeta, dtype=float))
    grid = omega.shape
    A = np.broadcast_to([[0.0, 1.0], [0.0, 0.0]], (*grid, 2, 2))
    B = np.broadcast_to([[0.0], [1.0]], (*grid, 2, 1))
    K = np.stack([omega**2, 2.0 * zeta * omega], axis=-1)[..., None, :]
    N = (omega**2)[..., None, None]
    C = np.broadcast_to([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], (*grid, 3, 2))
    D = np.broadcast_to([[0.0], [0.0], [1.0]], (*grid, 3, 1))
    offset = np.broadcast_to([0.0, 0.0, trim_torque], (*grid, 3))
    zeros = np.zeros((*grid, 2, 1))
    F = np.zeros((*grid, 3, 2))
    return loop(A, B, zeros, K, N, C, F, D, offset, inputs=("aileron",), outputs=("da", "da_rate", "T_a"))


def data_set_a(speeds) -> Loop:
    """LQR with an aileron integral on the coupled section of data set A (thesis damping, 50 m/s rows scaled)."""
    ratio = np.asarray(speeds, dtype=float) / 50.0
    grid = ratio.shape
    J = np.array([[2.100405e-4, 2.1652050e-4], [2.1652050e-4, 5.5098005e-3]])
    A = np.zeros((*grid, 5, 5))
    A[..., 0, 1] = A[..., 2, 3] = 1.0
    A[..., 4, 2] = -1.0
    angles = np.array([[4699.9693, 5400.2239], [-7370.4668, -6214.637]])
    rates = np.array([[0.56399632, 20.328085], [-0.88445601, -29.985063]])
    for i, row in enumerate((1, 3)):
        A[..., row, 0:4:2] = angles[i] * (ratio**2)[..., None]
        A[..., row, 1:4:2] = rates[i] * ratio[..., None]
    B = np.zeros((*grid, 5, 2))
    B[..., [1, 3], :] = np.linalg.inv(J)
    E = np.zeros((*grid, 5, 1))
    E[..., 4, 0] = 1.0
    Q = np.diag(1.0 / np.deg2rad([10.0, 400.0, 2.0, 200.0, 0.1]) ** 2)
    R = np.diag(1.0 / np.array([0.5, 2.0]) ** 2)
    K = np.zeros((*grid, 2, 5))
    for index in np.ndindex(grid):
        K[index] = np.linalg.solve(R, B[index].T @ solve_continuous_are(A[index], B[index], Q, R))
    N = np.zeros((*grid, 2, 1))
    N[..., :, 0] = 0.4 * K[..., :, 2]
    C = np.zeros((*grid, 6, 5))
    C[..., range(4), range(4)] = 1.0
    D = np.zeros((*grid, 6, 2))
    D[..., [4, 5], [0, 1]] = 1.0
    offset = np.zeros((*grid, 6))
    offset[..., 4], offset[..., 5] = 2e-3 * ratio**2, -0.15 * ratio**2
    return loop(A, B, E, K, N, C, np.zeros((*grid, 6, 5)), D, offset)


def random_stable(seed, count, n=5) -> Loop:
    """`count` loops of n states with random stable poles and random everything else."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((count, n, n)) * 20.0
    shift = np.max(np.linalg.eigvals(A).real, axis=-1) + rng.uniform(1.0, 10.0, count)
    A -= shift[:, None, None] * np.eye(n)
    B = rng.standard_normal((count, n, 2))
    K = rng.standard_normal((count, 2, n))
    C = rng.standard_normal((count, 6, n))
    F = 0.05 * rng.standard_normal((count, 6, n))
    D = 0.3 * rng.standard_normal((count, 6, 2))
    F[:, :4], D[:, :4] = 0.0, 0.0  # angles and rates do not jump
    N = rng.standard_normal((count, 2, 1))
    E = 10.0 * rng.standard_normal((count, n, 1))
    return loop(A + B @ K, B, E, K, N, C, F, D, 0.2 * rng.standard_normal((count, 6)))


def servo_and_aileron(servo_bandwidth, servo_damping, omega, zeta) -> Loop:
    """A first mode of the tab servo and a second of the aileron that it drives: two time scales in one loop.

    ``dt'' + 2 zs ws dt' + ws^2 dt = ws^2 r_a``, ``da'' + 2 z w da' + w^2 da = w^2 dt``; the torques are those
    of unit inertias, and the loop is flown with gains of zero.
    """
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1.0
    A[1, :2] = [-(servo_bandwidth**2), -2.0 * servo_damping * servo_bandwidth]
    A[3] = [omega**2, 0.0, -(omega**2), -2.0 * zeta * omega]
    E = np.array([[0.0], [servo_bandwidth**2], [0.0], [0.0]])
    C = np.zeros((6, 4))
    C[:4] = np.eye(4)
    F = np.zeros((6, 4))
    F[4, 1] = F[5, 3] = 1.0
    B, K, N, D = np.zeros((4, 2)), np.zeros((2, 4)), np.zeros((2, 1)), np.zeros((6, 2))
    return loop(A, B, E, K, N, C, F, D, np.zeros(6))
