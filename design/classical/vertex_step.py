"""Linear programmes of a few unknowns, solved in batches by looking at every vertex.

The optimum of a linear programme lies where as many constraints meet as there are unknowns. With two or three
unknowns and a dozen constraints there are few such vertices, and a batch of them is one stacked solve.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from model.arrays import BoolArray, FloatArray


def best_vertex(
    slope: FloatArray, value: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Step that raises a linear aim most while all linear constraints hold, or comes nearest to holding them.

    Maximise ``slope . d`` subject to ``value + gradient d <= 0`` and ``low <= d <= high``.

    Parameters
    ----------
    slope : (K, J) gradient of the aim, J = 2 or 3
    value : (K, M) constraints at d = 0, at most 0 when met
    gradient : (K, M, J) their gradients
    low, high : (K, J) box, ``low <= 0 <= high``

    Returns
    -------
    (K, J) the best vertex: among those that meet all constraints the one with the largest aim; when none does,
    the one whose largest violation is least; never a violation larger than at d = 0.
    """
    k, j = slope.shape
    eye = np.broadcast_to(np.eye(j), (k, j, j))
    normals = np.concatenate([gradient, eye, -eye], axis=1)
    bounds = np.concatenate([-value, high, -low], axis=1)  # normals . d <= bounds
    triples = np.array([c for c in combinations(range(normals.shape[1]), j) if not _opposite(c, value.shape[1], j)])
    N, b = normals[:, triples, :], bounds[:, triples]
    d, independent = _meeting_points(N, b)
    d = np.concatenate([d, np.zeros((k, 1, j))], axis=1)  # standing still is a choice too
    independent = np.concatenate([independent, np.ones((k, 1), dtype=bool)], axis=1)
    inside = np.all((d >= low[:, None] - 1e-9) & (d <= high[:, None] + 1e-9), axis=-1) & independent
    violation = np.max(value[:, None, :] + np.einsum("kmj,kvj->kvm", gradient, d), axis=-1, initial=-np.inf)
    violation = np.where(inside, np.maximum(violation, 0.0), np.inf)
    met = violation <= 1e-9
    aim = np.einsum("kj,kvj->kv", slope, d)
    rank = np.where(met, 1.0 + _unit(aim), np.where(inside, -violation, -np.inf))
    best = np.argmax(rank, axis=-1)
    return np.asarray(np.clip(d[np.arange(k), best], low, high))


def _meeting_points(N: FloatArray, b: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Where planes ``N d = b`` meet (..., J), and whether they do, by Cramer's rule for two or three unknowns.

    Orders of magnitude faster than a stack of LAPACK calls, and exact enough: each step is judged again anyway.
    """
    if N.shape[-1] == 2:
        p, q = N[..., 0, :], N[..., 1, :]
        det = p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
        x = b[..., 0] * q[..., 1] - b[..., 1] * p[..., 1]
        y = b[..., 1] * p[..., 0] - b[..., 0] * q[..., 0]
        top = np.stack([x, y], axis=-1)
    else:
        n = [N[..., i, :] for i in range(3)]
        normals = [_cross(n[1], n[2]), _cross(n[2], n[0]), _cross(n[0], n[1])]
        det = np.sum(n[0] * normals[0], axis=-1)
        top = b[..., 0, None] * normals[0] + b[..., 1, None] * normals[1] + b[..., 2, None] * normals[2]
    size = np.sqrt(np.prod(np.sum(N * N, axis=-1), axis=-1))
    independent = np.abs(det) > 1e-9 * size
    return top / np.where(independent, det, 1.0)[..., None], independent


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Vector product along the last axis, of length 3."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )


def _unit(aim: FloatArray) -> FloatArray:
    """Aims in order, squeezed between 0 and 1 row by row."""
    top = np.max(np.abs(aim), axis=-1, keepdims=True)
    return 0.5 + 0.5 * aim / np.where(top > 0, top, 1.0)


def _opposite(chosen: tuple[int, ...], constraints: int, j: int) -> bool:
    """Whether both faces of the box in one direction are chosen: they never meet."""
    return any(c >= constraints and c < constraints + j and c + j in chosen for c in chosen)
