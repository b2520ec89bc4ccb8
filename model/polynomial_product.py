"""The product of polynomials, batched."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray


def times(p: FloatArray, q: FloatArray) -> FloatArray:
    """Product of polynomials (*G, m), (*G, n) over leading axes, coefficients along the last: (*G, m + n - 1)."""
    out = np.zeros((*np.broadcast_shapes(p.shape[:-1], q.shape[:-1]), p.shape[-1] + q.shape[-1] - 1))
    for k in range(q.shape[-1]):
        out[..., k : k + p.shape[-1]] += p * q[..., k : k + 1]
    return out
