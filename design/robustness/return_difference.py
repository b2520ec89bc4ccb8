"""Smallest singular value of ``I + L`` over frequency: the curve of which `simultaneous_margins` has the minimum.

It is one over the largest singular value of ``S = I - T``, finite also where the plant has a pole. T is a ratio of
polynomials of degree n, so that n + 1 nodes on the axis, where it is computed from the matrices, give it everywhere:
``T(jw) = sum q_j T_j / (w - w_j) / sum q_j / (w - w_j)`` with ``q_j = p(j w_j) / prod (w_j - w_l)``, p being the
characteristic polynomial (the barycentric form: Berrut and Trefethen 2004). Unlike a sum over modes it does not mind
eigenvectors that nearly coincide; digits are lost where p is small against its terms, next to poles near the axis.
"""

from __future__ import annotations

import numpy as np

from design.robustness.diagonal import largest_singular_value
from design.robustness.input_loop import InputLoop, delayed, turn
from design.robustness.level_set import Nodes, barycentric_weights, nodes
from design.robustness.simultaneous import as_loop, off_axis
from model.arrays import ComplexArray, FloatArray, Floats

#: Difference of a frequency and a node that stands for 0 [rad/s]; the node's value is what comes out.
NOTHING = 1e-150
#: Points that are worked on together: what they need stays in the cache.
BLOCK = 8


def smallest_return_difference(
    A: FloatArray, B: FloatArray, K: FloatArray, omega: FloatArray, delays: Floats | None = None
) -> FloatArray:
    """Smallest singular value of ``I + L(jw)``, ``L = K (jwI - A)^-1 B`` with the delays of the inputs, (*G, W).

    Parameters
    ----------
    A (*G, n, n), B (*G, n, 2), K (*G, 2, n), delays : as of `simultaneous_margins`; the loop need not be stable, but
        the curve is nan at points whose loop without delay has a pole on the axis, or an entry that is not finite
    omega : (W,), or (*G, W), finite frequencies [rad/s]

    Raises
    ------
    ValueError : the shapes do not fit, or a delay is negative or not finite
    """
    loop, grid = as_loop(A, B, K, delays)
    width = np.shape(omega)[-1]
    frequencies = np.broadcast_to(omega, (*grid, width)).reshape(-1, width)
    result = np.full(frequencies.shape, np.nan)
    members = np.flatnonzero(off_axis(loop))
    if members.size:
        regular = loop.take(members)
        known = nodes(regular, 1)
        weight = barycentric_weights(known.omega, known.log_denominator)
        for start in range(0, len(members), BLOCK):
            at = slice(start, start + BLOCK)
            own = frequencies[members[at]]
            result[members[at]] = _curve(regular.take(at), known.take(at), weight[at], own)
    return result.reshape(*grid, width)


def _curve(loop: InputLoop, known: Nodes, weight: ComplexArray, omega: FloatArray) -> FloatArray:
    top, bottom = _sensitivity(known, weight, omega)
    if loop.is_delayed:
        T = np.eye(2) - top / bottom[..., None, None]
        top = np.eye(2) - delayed(T, turn(loop, np.arange(len(T)), omega))
        bottom = np.ones_like(bottom)
    with np.errstate(divide="ignore"):
        return np.asarray(np.abs(bottom) / largest_singular_value(top))


def _sensitivity(known: Nodes, weight: ComplexArray, omega: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """S without delay as a numerator (N, W, 2, 2) over a denominator (N, W)."""
    values = (np.eye(2) - known.T).reshape(*known.omega.shape, 4)
    terms = np.concatenate([weight[:, :, None] * values, weight[:, :, None]], axis=-1)
    apart = omega[:, None, :] - known.omega[:, :, None]
    apart[apart == 0.0] = NOTHING
    np.reciprocal(apart, out=apart)
    # In real arithmetic: half the work.
    sums = np.empty((len(omega), 5, omega.shape[-1]), dtype=complex)
    sums.real, sums.imag = np.ascontiguousarray(terms.real.mT) @ apart, np.ascontiguousarray(terms.imag.mT) @ apart
    return np.moveaxis(sums[:, :4].reshape(len(omega), 2, 2, -1), -1, 1), sums[:, 4]
