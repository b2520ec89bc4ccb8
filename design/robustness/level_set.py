"""All frequencies at which a gain has a given value: the eigenvalues of one small real matrix.

A squared gain h is the larger root of ``h^2 - F h + P``. In ``x = w^2``, and with the characteristic polynomial p, so
that ``|p|^2 = prod |jw - pole|^2`` is of degree n,

- largest singular value: F and P have the denominator ``|p|^2`` (P too, because the determinant of ``i I + k T`` has
  the denominator p, not its square), and ``|p|^2 (h^2 - F h + P)`` is a polynomial of degree n;
- structured singular value: ``F = E + 2 |b c|``, where ``|b c|`` is only the root of something rational. It is gone
  from the product with the same for ``F' = E - 2 |b c|``: ``|p|^4 (h^2 - F h + P)(h^2 - F' h + P)`` is a polynomial of
  degree 2 n. Its further roots are no crossings of mu, and harmless.

Such a polynomial of degree m is never written in powers of x. Known at m + 1 nodes it is
``prod (x - x_j) sum g_j / (x - x_j)``, and its roots are the eigenvalues of a diagonal matrix and one of rank one,
after a Moebius map that takes the node of largest ``|g_j|`` to infinity: no leading coefficient that may nearly vanish
is divided by. (For the largest singular value Boyd and Balakrishnan 1990 and Bruinsma and Steinbuch 1990 have a
Hamiltonian matrix.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.robustness.diagonal import square
from design.robustness.gains import Gains
from design.robustness.input_loop import InputLoop, complementary
from model.arrays import ComplexArray, FloatArray, GridArrays, IntArray

#: Distance of the nodes from the moduli of their poles (natural logarithm over damping ratio): those of a pair to the
#: sides, and all of them spread, so that poles in the same place have nodes in different ones.
SIDES, SPREAD = np.array([-1.5, 0.5]), 1.0
#: Least distance of two nodes, likewise.
CLOSEST = 1e-2
#: Roots further from the positive axis than this part of their size are no crossings. It is wide on purpose: a
#: frequency too many costs a look at it, one too few a peak.
NEARLY_REAL = 0.1


@dataclass(frozen=True, eq=False)
class Nodes(GridArrays):
    """Where T is known; with n + 1 of them it is known everywhere.

    Attributes
    ----------
    omega : (N, W) [rad/s], rising
    T : (N, W, 2, 2) complementary sensitivity there, without delay
    log_denominator : (N, W) logarithm of the characteristic polynomial there
    """

    omega: FloatArray
    T: ComplexArray
    log_denominator: ComplexArray


def nodes(loop: InputLoop, each: int) -> Nodes:
    """So many, 1 or 2, about `each` pole, and one more; nearer to a pole that is nearer to the axis."""
    poles = np.take_along_axis(loop.poles, np.argsort(np.abs(loop.poles), axis=-1, kind="stable"), axis=-1)
    about = np.concatenate([np.repeat(poles, each, axis=-1), -np.abs(poles[:, -1:])], axis=-1)
    side = np.sign(about.imag) * np.append(np.tile(SIDES[:each], poles.shape[-1]), 0.0)
    size = np.abs(about)
    damping = np.abs(about.real) / size
    place = np.log(size) + damping * (side + np.linspace(-SPREAD, SPREAD, about.shape[-1]))
    # Rising, and no two of them in the same place.
    steps = CLOSEST * damping.min(axis=-1)[:, None] * np.arange(place.shape[-1])
    omega = np.exp(np.maximum.accumulate(np.sort(place, axis=-1) - steps, axis=-1) + steps)
    distance = np.log(1j * omega[:, :, None] - loop.poles[:, None, :])
    return Nodes(omega, complementary(loop, omega), distance.sum(axis=-1))


def crossings(known: Nodes, points: IntArray, gains: Gains, level: FloatArray) -> FloatArray:
    """Frequencies (R, m) [rad/s], rising, nan padded, among which are all where the rows' gains have their `level`.

    Parameters
    ----------
    known : 2n + 1 nodes of each of N points
    points : (R,) point of each row
    gains : of the rows, all structured or none
    level : (R,) squared gain, > 0
    """
    structured = bool(gains.structured[0])
    # The largest singular value needs every other node only.
    known = known.take((slice(None), slice(None, None, 1 if structured else 2)))
    largest = known.omega[points, -1:]
    x = (known.omega[points] / largest) ** 2
    height = _height(gains.matrix(known.T[points]), level[:, None], structured)
    log_factor = (4.0 if structured else 2.0) * known.log_denominator.real[points]
    return largest * _frequencies(x, height * barycentric_weights(x, log_factor.astype(complex)).real)


def barycentric_weights(x: FloatArray, log_factor: ComplexArray) -> ComplexArray:
    """``factor_j / prod (x_j - x_l)`` (R, m) over l other than j, up to a common factor; x (R, m) rising."""
    m = x.shape[-1]
    apart = x[:, :, None] - x[:, None, :]
    apart[:, np.arange(m), np.arange(m)] = 1.0
    log_weight = log_factor - np.log(np.abs(apart)).sum(axis=-1)
    largest = log_weight.real.max(axis=-1, keepdims=True)
    return np.asarray(np.exp(log_weight - largest) * (1.0 - 2.0 * (np.arange(m) % 2)))


def _height(M: ComplexArray, h: FloatArray, structured: bool) -> FloatArray:
    """``1 - F / h + P / h^2`` (R, m) of M (R, m, 2, 2), and if `structured` times the same with F'."""
    a, b, c, e = (M[..., i, j] for i in (0, 1) for j in (0, 1))
    product = b * c
    P = square(a * e - product) / h**2
    if not structured:
        return np.asarray(1.0 - (square(a) + square(e) + square(b) + square(c)) / h + P)
    middle, twice = 1.0 - (square(a) + square(e)) / h + P, 2.0 * np.abs(product) / h
    return np.asarray((middle - twice) * (middle + twice))


def _frequencies(x: FloatArray, g: FloatArray) -> FloatArray:
    """Square roots (R, m) of the roots near the positive axis of ``sum g_j / (x - x_j)``, x and g (R, m+1).

    With the pivot i and ``y = x / (x - x_i)``: the eigenvalues of ``diag(y_j) + 1 v'``, ``v_j = (y_j - 1) g_j / g_i``.
    Low frequencies are small y, so that they keep their digits however far apart the poles are.
    """
    rows, m = np.arange(len(x)), x.shape[-1] - 1
    pivot = np.argmax(np.abs(g), axis=-1)
    others = np.arange(m) + (np.arange(m) >= pivot[:, None])
    top, g_top = x[rows, pivot][:, None], g[rows, pivot][:, None]
    x, g = np.take_along_axis(x, others, axis=-1), np.take_along_axis(g, others, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        v = top / (x - top) * (g / g_top)
        # Scaled to have the same size on both sides of the diagonal, large entries first.
        root = np.sqrt(np.abs(v))[:, ::-1]
        matrix = root[:, :, None] * (np.sign(v[:, ::-1]) * root)[:, None, :]
        matrix[:, np.arange(m), np.arange(m)] += (x / (x - top))[:, ::-1]
        y = np.linalg.eigvals(np.where(np.isfinite(matrix), matrix, 0.0)).astype(complex)
        found = top * (y / (y - 1.0))
        near = np.isfinite(found) & (found.real > 0.0) & (np.abs(found.imag) <= NEARLY_REAL * found.real)
    return np.sort(np.sqrt(np.where(near, found.real, np.nan)), axis=-1)
