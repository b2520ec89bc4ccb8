"""Structured singular value of complex 2x2 matrices for diagonal complex perturbations, in closed form.

``mu(M) = 1 / min { max |delta_i| : det(I - diag(delta) M) = 0 }`` (Doyle 1982). With ``M = [a b; c e]``,

    mu^2 = (F + sqrt(F^2 - 4 |det M|^2)) / 2,    F = |a|^2 + |e|^2 + 2 |b c|,

the larger root of ``h^2 - F h + |det M|^2``. Two proofs in one:

- Above. The largest singular value of ``diag(d, 1) M diag(1/d, 1)`` bounds mu for every d. It is this formula with
  ``|d b|^2 + |c/d|^2`` for ``2 |b c|``, rises with it, and ``d^2 = |c/b|`` makes it least.
- Below. For ``|delta_i| = r`` the equation ``1 - delta_1 a - delta_2 e + delta_1 delta_2 det M = 0`` asks for
  ``|1 - delta_1 a| = r |e - delta_1 det M|``, that is for a real part of ``delta_1 (a - r^2 conj(e) det M)``. Some
  phase of delta_1 meets it if and only if ``(1 - r^2 F + r^4 |det M|^2) (1 - r^2 F' + r^4 |det M|^2) <= 0`` with
  ``F' = |a|^2 + |e|^2 - 2 |b c|``, and the least such r is 1 / mu.

The largest singular value itself is the same with ``|b|^2 + |c|^2`` for ``2 |b c|``. Both are computed as half the
sum of ``sqrt(F + 2 |det M|)`` and ``sqrt(F - 2 |det M|)``, the latter without its cancellation: with
``v = det M / |det M|``

    F + 2 |det M| = |a + conj(e) v|^2 + |b - conj(c) v|^2,    F - 2 |det M| = |a - conj(e) v|^2 + |b + conj(c) v|^2,

where for mu the last terms are ``|b c| |v - b c / |b c||^2`` and ``|b c| |v + b c / |b c||^2``.
"""

from __future__ import annotations

import numpy as np

from model.arrays import BoolArray, ComplexArray, FloatArray


def structured_singular_value(matrix: ComplexArray) -> FloatArray:
    """The value mu of (*G, 2, 2) for diagonal complex perturbations, (*G,)."""
    total, gap = sum_and_gap(matrix, np.asarray(True))
    return np.asarray(0.5 * (total + gap))


def largest_singular_value(matrix: ComplexArray) -> FloatArray:
    """Largest singular value of (*G, 2, 2), (*G,)."""
    total, gap = sum_and_gap(matrix, np.asarray(False))
    return np.asarray(0.5 * (total + gap))


def sum_and_gap(matrix: ComplexArray, structured: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Sum and difference (*G,) of the two singular values of (*G, 2, 2).

    Where `structured`, a mask that broadcasts against (*G,), those of ``diag(d, 1) M diag(1/d, 1)`` at the best d.
    """
    a, b, c, e = (matrix[..., i, j] for i in (0, 1) for j in (0, 1))
    product = b * c
    v = _direction(a * e - product)
    mirrored = np.conj(e) * v
    if structured.all():
        plus, minus = _scaled_part(product, v)
    elif structured.any():
        pairs = zip(_scaled_part(product, v), _plain_part(b, np.conj(c) * v), strict=True)
        plus, minus = (np.where(structured, *pair) for pair in pairs)
    else:
        plus, minus = _plain_part(b, np.conj(c) * v)
    return np.sqrt(square(a + mirrored) + plus), np.sqrt(square(a - mirrored) + minus)


def _scaled_part(product: ComplexArray, v: ComplexArray) -> tuple[FloatArray, FloatArray]:
    size, heading = np.abs(product), _direction(product)
    return size * square(v - heading), size * square(v + heading)


def _plain_part(b: ComplexArray, mirrored: ComplexArray) -> tuple[FloatArray, FloatArray]:
    return square(b - mirrored), square(b + mirrored)


def smallest_perturbation(matrix: ComplexArray) -> ComplexArray:
    """Diagonal delta (*G, 2), none larger than 1 / mu, with ``det(I - diag(delta) M) = 0`` for M (*G, 2, 2).

    nan where mu is 0: then there is none. Real for a real matrix.
    """
    a, b, c, e = (matrix[..., i, j] for i in (0, 1) for j in (0, 1))
    determinant = a * e - b * c
    mu = structured_singular_value(matrix)
    r = 1.0 / np.where(mu > 0.0, mu, np.nan)
    directions = a - r * r * np.conj(e) * determinant, e - r * r * np.conj(a) * determinant
    # The phase of the channel that has the clearer one; the other follows.
    second = np.abs(directions[1]) > np.abs(directions[0])
    own, other = np.where(second, e, a), np.where(second, a, e)
    leader = r * np.conj(_direction(np.where(second, directions[1], directions[0])))
    bottom = other - leader * determinant
    with np.errstate(over="ignore", invalid="ignore"):
        follower = np.where(bottom == 0.0, 0.0, (1.0 - leader * own) / np.where(bottom == 0.0, 1.0, bottom))
    # Where the channels hardly know of each other its size is rounding, and any size will do.
    follower = follower * np.minimum(1.0, r / np.maximum(np.abs(follower), r))
    return np.stack([np.where(second, follower, leader), np.where(second, leader, follower)], axis=-1)


def square(z: ComplexArray) -> FloatArray:
    """``|z|^2``."""
    return np.asarray(z.real**2 + z.imag**2)


def _direction(z: ComplexArray) -> ComplexArray:
    """``z / |z|``, 1 for 0."""
    size = np.abs(z)
    return np.asarray(np.where(size > 0.0, z / np.where(size > 0.0, size, 1.0), 1.0))
