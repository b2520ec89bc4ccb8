"""Matrix exponentials of a whole stack at once: how a linear system gets from one sample to the next."""

from __future__ import annotations

from math import factorial

import numpy as np

from model.arrays import FloatArray

#: The Taylor polynomial of degree 12 is exact to rounding for a matrix no larger than this: 0.25^13 / 13! < 3e-18.
_SMALL = 0.25
_TERMS = [1.0 / factorial(k) for k in range(13)]
#: Largest size that is told from infinity.
_LARGEST = 1e300


def transition(generator: FloatArray, step: float) -> FloatArray:
    """``exp(generator step)`` by scaling and squaring of a Taylor polynomial.

    ``scipy.linalg.expm`` takes stacks too, but works on one matrix after the other, at twice the cost, and is
    accurate relative to the largest entry only; small entries here carry the slow modes.

    Parameters
    ----------
    generator : (*G, n, n) finite [1/s]
    step : [s]

    Returns
    -------
    (*G, n, n); inf or nan where the exponential leaves the range of doubles
    """
    M = generator * step
    halvings = _halvings(M)
    with np.errstate(over="ignore", invalid="ignore"):
        result = _taylor(M * 0.5**halvings)
        for _ in range(halvings):
            result = result @ result
    return result


def _halvings(M: FloatArray) -> int:
    """Halvings after which every matrix is small in the sense of ``|M^8|^(1/8)``.

    With angles next to rates, |M| itself says hundreds where the fastest mode is one; every needless halving
    costs a squaring and doubles the rounding (Al-Mohy and Higham 2009).
    """
    norm = np.sum(np.abs(M), axis=-1, keepdims=True).max(axis=-2, keepdims=True, initial=1e-300)
    power = M / norm
    for _ in range(3):
        power = power @ power
    eighth = np.sum(np.abs(power), axis=-1).max(axis=-1, initial=0.0)
    size = float(np.max(norm[..., 0, 0] * eighth**0.125, initial=_SMALL))
    return int(np.ceil(np.log2(min(size, _LARGEST) / _SMALL)))


def _taylor(M: FloatArray) -> FloatArray:
    """(*G, n, n) polynomial of degree 12 in five products: three cubics in M^3, Horner's way."""
    square = M @ M
    powers = (np.eye(M.shape[-1]), M, square)
    cube = square @ M
    result: FloatArray = _TERMS[12] * cube
    for k in (9, 6, 3, 0):
        for power, term in zip(powers, _TERMS[k : k + 3], strict=True):
            result = result + term * power
        if k:
            result = result @ cube
    return result
