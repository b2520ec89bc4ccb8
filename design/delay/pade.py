"""The Pade approximant of a delay as a chain of states: what the last delay's worth of a signal looks like.

The states are the coefficients of the signal's recent past in orthonormal Legendre polynomials,

        u(t - x delay) ~ sum_i z_i phi_i(x) ,   phi_i(x) = sqrt(2 i + 1) P_i(2 x - 1) ,   0 <= x <= 1 ,

        delay z' = A z + b u ,   v = c z = sum_i z_i phi_i(1) ~ u(t - delay) ,

and v is exactly the Pade approximant of numerator degree n - 1 and denominator degree n (Voelker, Kajic and
Eliasmith 2019, Legendre Memory Units, eq. 1 and 2, there not normalised). No entry exceeds 2 n, whatever the delay,
where a companion form would hold factorials.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from model.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class DelayChain:
    """``delay z' = A z + b u, v = c z`` with A (n, n), b (n,), c (n,); read-only."""

    A: FloatArray
    b: FloatArray
    c: FloatArray

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self.b.size)


@cache
def delay_chain(order: int) -> DelayChain:
    """Chain of `order` states.

    Raises
    ------
    ValueError : the order is less than 1
    """
    if order < 1:
        raise ValueError(f"the order of a delay's approximant must be at least 1, is {order}")
    i = np.arange(order)
    size, sign = np.sqrt(2.0 * i + 1.0), (-1.0) ** i
    A = -np.where(i[:, None] < i, 1.0, sign[:, None] * sign) * size[:, None] * size
    chain = DelayChain(A, size * sign, size)
    for array in (chain.A, chain.b, chain.c):
        array.flags.writeable = False
    return chain
