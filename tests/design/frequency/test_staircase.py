from fractions import Fraction

import numpy as np
import pytest

from design.frequency.staircase import balanced, integrations, polynomials, staircase
from tests.design.siso_loops import stabilised

RNG = np.random.default_rng(5)


def exact(A, b, c):
    """Faddeev and Leverrier in rational numbers: numerator and characteristic polynomial."""
    n = len(A)
    A = [[Fraction(float(x)) for x in row] for row in A]
    b, c = [Fraction(float(x)) for x in b], [Fraction(float(x)) for x in c]
    M = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    characteristic, numerator = [Fraction(1)], [Fraction(0)]
    for k in range(1, n + 1):
        numerator.append(sum(c[i] * M[i][j] * b[j] for i in range(n) for j in range(n)))
        M = [[sum(A[i][m] * M[m][j] for m in range(n)) for j in range(n)] for i in range(n)]
        characteristic.append(-sum(M[i][i] for i in range(n)) / k)
        for i in range(n):
            M[i][i] += characteristic[-1]
    return numerator, characteristic


def on_axis(p, w):
    """Exact value at ``j w`` as a pair of rational numbers."""
    real, imaginary = Fraction(0), Fraction(0)
    for a in p:
        real, imaginary = Fraction(a) - imaginary * w, real * w
    return real, imaginary


def error_on_axis(found, wanted, w):
    """Largest relative error of the value at the frequencies `w`."""
    errors = []
    for each in w:
        a, b = on_axis([float(x) for x in found], Fraction(float(each))), on_axis(wanted, Fraction(float(each)))
        size = b[0] ** 2 + b[1] ** 2
        errors.append(float(((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) / size) ** 0.5)
    return max(errors)


def batch(*arrays):
    """Batch axis from first to last."""
    return tuple(np.ascontiguousarray(np.moveaxis(a, 0, -1)) for a in arrays)


@pytest.mark.parametrize("order", [1, 2, 5, 8, 12])
@pytest.mark.parametrize("spread", [0.0, 20.0])
def test_polynomials_equal_exact_ones(order, spread):
    """To nearly all digits on the whole axis, in states of wildly different units as well."""
    loop = stabilised(4, order, seed=order)
    A, b, c = loop.closed(), loop.b, loop.c
    unit = 2.0 ** np.round(RNG.uniform(-spread, spread, order))
    A, b, c = A / unit[:, None] * unit, b / unit, c * unit
    numerator, characteristic = polynomials(staircase(*balanced(*batch(A, b, c))))
    w = np.geomspace(0.03, 30.0, 7)
    for i in range(4):
        top, bottom = exact(A[i], b[i], c[i])
        assert error_on_axis(numerator[:, i], top, w) < 1e-11
        assert error_on_axis(characteristic[:, i], bottom, w) < 1e-12


def test_form_is_orthogonally_similar():
    A, b, c = batch(RNG.standard_normal((6, 5, 5)), RNG.standard_normal((6, 5)), RNG.standard_normal((6, 5)))
    form = staircase(A, b, c)
    H = np.triu(np.moveaxis(form.A, -1, 0), 0)
    H[:, np.arange(1, 5), np.arange(4)] = form.drive[1:].T
    np.testing.assert_allclose(np.abs(form.drive[0]), np.linalg.norm(b, axis=0), rtol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(form.c, axis=0), np.linalg.norm(c, axis=0), rtol=1e-13)
    for i in range(6):
        expected = np.sort_complex(np.linalg.eigvals(A[..., i]))
        np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(H[i])), expected, rtol=1e-11)
        drive = np.zeros(5)
        drive[0] = form.drive[0, i]
        for k in range(5):
            original = c[:, i] @ np.linalg.matrix_power(A[..., i], k) @ b[:, i]
            np.testing.assert_allclose(form.c[:, i] @ np.linalg.matrix_power(H[i], k) @ drive, original, rtol=1e-9)


def test_states_that_are_not_reached_and_no_input_at_all():
    A = np.stack([np.diag([-1.0, -2.0, -3.0])] * 3)
    b, c = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 1.0]]), np.ones((3, 3))
    numerator, characteristic = polynomials(staircase(*batch(A, b, c)))
    for i in range(3):
        np.testing.assert_allclose(characteristic[:, i], np.poly([-1.0, -2.0, -3.0]), rtol=1e-13)
    np.testing.assert_allclose(numerator[:, 0], [0.0, *np.poly([-2.0, -3.0])], atol=1e-14)
    np.testing.assert_array_equal(numerator[:, 1], np.zeros(4))
    np.testing.assert_allclose(numerator[:, 2], [0.0, 2.0, 7.0, 5.0], atol=1e-13)


def test_balancing_changes_units_only():
    A, b, c = batch(RNG.standard_normal((6, 5, 5)), RNG.standard_normal((6, 5)), RNG.standard_normal((6, 5)))
    unit = 2.0 ** np.round(RNG.uniform(-20, 20, 5))[:, None]
    changed = balanced(A * unit[:, None] / unit, b * unit, c / unit)
    size = np.abs(changed[0])
    size[np.arange(5), np.arange(5)] = 0.0
    ratio = size.sum(axis=0) / size.sum(axis=1)
    assert np.all((ratio > 0.2) & (ratio < 5.0))
    found = np.linalg.matrix_power(np.moveaxis(changed[0], -1, 0), 3)
    wanted = np.einsum("in,nij,jn->n", c, np.linalg.matrix_power(np.moveaxis(A, -1, 0), 3), b)
    np.testing.assert_allclose(np.einsum("in,nij,jn->n", changed[2], found, changed[1]), wanted, rtol=1e-12)


def test_states_without_neighbours_are_left_alone():
    A = np.stack([np.diag([-1.0, -2.0]), np.array([[-1.0, 8.0], [0.0, -2.0]])])
    changed = balanced(*batch(A, np.ones((2, 2)), np.ones((2, 2))))
    assert np.all(np.isfinite(changed[0]))
    np.testing.assert_array_equal(changed[0][..., 0], A[0])


def test_integrations():
    chain = np.diag(np.ones(3), 1)
    rotation = np.linalg.qr(RNG.standard_normal((4, 4)))[0]
    A = np.stack([chain, rotation.T @ chain @ rotation, RNG.standard_normal((4, 4)), chain])
    b, c = np.eye(4)[[3, 3, 0, 0]], np.eye(4)[[0, 0, 0, 3]]
    b[1], c[1] = rotation.T @ b[1], c[1] @ rotation
    assert integrations(*batch(A, b, c)).tolist() == [3, 3, 0, 4]


def test_grid_equals_points():
    A, b, c = batch(RNG.standard_normal((6, 5, 5)), RNG.standard_normal((6, 5)), RNG.standard_normal((6, 5)))
    top, bottom = polynomials(staircase(*balanced(A, b, c)))
    for i in range(6):
        one = polynomials(staircase(*balanced(A[..., i : i + 1], b[:, i : i + 1], c[:, i : i + 1])))
        np.testing.assert_allclose(top[:, i], one[0][:, 0], rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(bottom[:, i], one[1][:, 0], rtol=1e-12)
