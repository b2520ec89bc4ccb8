"""Step responses with one delay by the method of steps: each delay by Chebyshev collocation, to rounding."""

import numpy as np


def _chebyshev(order):
    """Nodes in [-1, 1] from the left, and the matrix that differentiates there (Trefethen 2000, ch. 6)."""
    k = np.arange(order + 1)
    x = -np.cos(np.pi * k / order)
    c = np.where((k == 0) | (k == order), 2.0, 1.0) * (-1.0) ** k
    D = np.outer(c, 1.0 / c) / (x[:, None] - x + np.eye(order + 1))
    return x, D - np.diag(D.sum(axis=1))


def outputs(loop, step, time, order=40):
    """Outputs (T, o) of one point at times (T,) that are no corners; every input has the same delay."""
    delay, n, m = loop.delay[0], *loop.B.shape
    x, D = _chebyshev(order)
    D = D * 2.0 / delay
    collocated = np.kron(D, np.eye(n)) - np.kron(np.eye(order + 1), loop.A)
    collocated[:n], collocated[:n, :n] = 0.0, np.eye(n)
    inverse = np.linalg.inv(collocated)
    count = int(np.ceil(np.max(time) / delay)) + 1
    states = np.zeros((count, order + 1, n))
    arriving = np.zeros((count, order + 1, m))
    now = np.zeros(n)
    for k in range(count):
        right = arriving[k] @ loop.B.T + loop.E @ step
        right[0] = now
        states[k] = (inverse @ right.ravel()).reshape(order + 1, n)
        if k + 1 < count:
            arriving[k + 1] = -states[k] @ loop.K.T + loop.N @ step
        now = states[k, -1]
    k = np.floor(time / delay).astype(int)
    w = np.where(np.isin(np.arange(order + 1), (0, order)), 0.5, 1.0) * (-1.0) ** np.arange(order + 1)
    distance = (time / delay - k)[:, None] * 2.0 - 1.0 - x
    weight = w / np.where(distance == 0.0, 1e-300, distance)
    weight /= weight.sum(axis=1, keepdims=True)
    xs, vs, rates = (
        np.einsum("tk,tkn->tn", weight, values[k])
        for values in (states, arriving, np.einsum("kl,dln->dkn", D, arriving))
    )
    slopes = xs @ loop.A.T + vs @ loop.B.T + loop.E @ step
    return xs @ loop.C.T + slopes @ loop.F.T + vs @ loop.D.T + rates @ loop.H.T + loop.offset
