"""Lyapunov matrices that move with the flight point: the semidefinite programme of all cells of a grid at once.

P is given at the nodes of a grid and multilinear between them. With altitude and speed changing at rates h' and s',

    M = Acl' P + P Acl + h' dP/dh + s' dP/ds + 2 alpha P

is a polynomial in each cell, of one degree more than Acl, and linear in the rates: it is negative when its Bernstein
coefficients are, for all signs of the largest rates. Each coefficient is a sum over the corners of its cell of
``F' P_corner + P_corner F`` with constant matrices F.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import comb

import clarabel
import numpy as np
from scipy import sparse

from model.arrays import FloatArray, IntArray
from schedules.proof.flight_box import Box
from schedules.proof.semidefinite import solver_settings, symmetric_basis, upper_triangles


@dataclass(frozen=True, eq=False)
class MovingCell:
    """One cell of the grid that P is given on.

    Attributes
    ----------
    nodes : (a', b') numbers of its corners' nodes; of an axis of no width only one
    box : altitude and speed
    loops : (a + 1, b + 1, E, n, n) Bernstein coefficients of the closed loops (`control_loops.control_tensor`)
    """

    nodes: IntArray
    box: Box
    loops: FloatArray

    def coefficients(self, altitude_rate: float, speed_rate: float, alpha: float) -> FloatArray:
        """Matrices F (L, a', b', n, n) of all Bernstein coefficients of M and all signs of the rates."""
        rows, columns, ends, n, _ = self.loops.shape
        corners = self.nodes.shape
        degrees = rows + corners[0] - 2, columns + corners[1] - 2
        still = np.zeros((degrees[0] + 1, degrees[1] + 1, ends, *corners, n, n))
        for i, j, a, b in product(range(rows), range(columns), *(range(k) for k in corners)):
            weight = _product_weight(rows - 1, i, corners[0] - 1, a) * _product_weight(
                columns - 1, j, corners[1] - 1, b
            )
            still[i + a, j + b, :, a, b] += weight * self.loops[i, j]
        shares = [_shares(degree, k) for degree, k in zip(degrees, corners, strict=True)]  # (degree + 1, corners)
        slopes = [_slopes(ends, k) for ends, k in zip((self.box.altitude, self.box.speed), corners, strict=True)]
        mixed = np.einsum("ia,jb->ijab", *shares)
        by_altitude = np.einsum("a,jb->jab", slopes[0], shares[1])[None]
        by_speed = np.einsum("ia,b->iab", shares[0], slopes[1])[:, None]
        moved = []
        for up, fast in product((-1.0, 1.0), repeat=2):
            if (up > 0.0 and altitude_rate == 0.0) or (fast > 0.0 and speed_rate == 0.0):
                continue
            scalar = alpha * mixed + 0.5 * (up * altitude_rate * by_altitude + fast * speed_rate * by_speed)
            moved.append(still + scalar[:, :, None, :, :, None, None] * np.eye(n))
        return np.concatenate([part.reshape(-1, *corners, n, n) for part in moved])


def forms(F: FloatArray, P: FloatArray) -> FloatArray:
    """Coefficients of M (L, n, n) from F (L, a', b', n, n) and P (a', b', n, n) at the corners."""
    half = np.einsum("labkm,abkn->lmn", F, P)
    return np.asarray(half + np.swapaxes(half, -1, -2))


def best_moving(cells: list[tuple[IntArray, FloatArray]], scales: FloatArray) -> FloatArray | None:
    """P (N, n, n) at the nodes that make the worst coefficient most negative; None where the solver has no answer.

    Parameters
    ----------
    cells : nodes (a', b') and F (L, a', b', n, n) of each
    scales : (N, n, n) lower triangular S: unknown are X of ``P = S X S'``, with ``X <= I``
    """
    n = scales.shape[-1]
    basis, pick = symmetric_basis(n)
    m, unknowns = len(basis), len(basis) * len(scales)
    identity = upper_triangles(np.eye(n), pick)
    blocks, count = [], 0
    for nodes, F in cells:
        used = scales[nodes]
        T = np.linalg.inv(np.linalg.cholesky(np.mean(used @ np.swapaxes(used, -1, -2), axis=(0, 1)))).T
        left = np.swapaxes(used, -1, -2) @ F @ T  # S' F T
        right = np.swapaxes(used, -1, -2) @ T  # S' T
        size = float(np.max(np.abs(left))) or 1.0
        half = np.einsum("labkx,jkm,abmy->labjxy", left / size, basis, right, optimize=True)
        rows = upper_triangles(half + np.swapaxes(half, -1, -2), pick)  # (L, a', b', j, m)
        L = len(F)
        where = (count + np.arange(L * m)).reshape(L, 1, 1, 1, m)
        column = (nodes[..., None] * m + np.arange(m))[None, ..., None]
        blocks.append([x.ravel() for x in np.broadcast_arrays(rows, where, column)])
        slack = np.broadcast_to(identity, (L, m)).ravel()
        blocks.append([slack, count + np.arange(L * m), np.full(L * m, unknowns)])
        count += L * m
    blocks.append([np.ones(unknowns), count + np.arange(unknowns), np.arange(unknowns)])
    values, where, column = (np.concatenate([block[k] for block in blocks]) for k in range(3))
    total = count + unknowns
    matrix = sparse.csc_matrix((values, (where.astype(int), column.astype(int))), shape=(total, unknowns + 1))
    bound = np.concatenate([np.zeros(count), np.tile(identity, len(scales))])
    cost = np.zeros(unknowns + 1)
    cost[-1] = -1.0
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((unknowns + 1, unknowns + 1)), cost, matrix, bound,
        [clarabel.PSDTriangleConeT(n)] * (total // m), solver_settings(),
    )  # fmt: skip
    x = np.array(solver.solve().x)
    if x.size != unknowns + 1 or not np.all(np.isfinite(x)):
        return None
    X = np.einsum("pj,jab->pab", x[:-1].reshape(-1, m), basis)
    P = scales @ X @ np.swapaxes(scales, -1, -2)
    return np.asarray(0.5 * (P + np.swapaxes(P, -1, -2)))


def _product_weight(degree: int, i: int, other: int, a: int) -> float:
    """Part of a product of Bernstein polynomials of two degrees that its coefficient i + a gets."""
    return comb(degree, i) * comb(other, a) / comb(degree + other, i + a)


def _shares(degree: int, corners: int) -> FloatArray:
    """Bernstein coefficients (degree + 1, corners) of the weights of the corners along an axis."""
    if corners == 1:
        return np.ones((degree + 1, 1))
    part = np.arange(degree + 1) / degree
    return np.stack([1.0 - part, part], axis=-1)


def _slopes(ends: tuple[float, float], corners: int) -> FloatArray:
    """Derivative (corners,) of the weights of the corners along an axis."""
    return np.zeros(1) if corners == 1 else np.array([-1.0, 1.0]) / (ends[1] - ends[0])
