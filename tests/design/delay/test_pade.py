"""The chain of a delay against the textbook's Pade approximant and the delay itself."""

from fractions import Fraction
from math import factorial

import numpy as np
import pytest

from design.delay.pade import delay_chain


def _pade(order):
    """Numerator of degree order - 1 and denominator of degree `order` of exp(-s), highest power first."""
    m, n = order - 1, order

    def term(a, b, k):
        return Fraction(factorial(m + n - k) * factorial(a), factorial(m + n) * factorial(k) * factorial(a - k))

    numerator = [(-1) ** k * term(m, n, k) for k in range(m + 1)]
    denominator = [term(n, m, k) for k in range(n + 1)]
    return [np.array([float(c) for c in p[::-1]]) for p in (numerator, denominator)]


def _transfer(order, s):
    chain = delay_chain(order)
    return np.array([chain.c @ np.linalg.solve(x * np.eye(order) - chain.A, chain.b) for x in s])


@pytest.mark.parametrize("order", [1, 2, 5, 8, 12])
def test_chain_is_the_pade_approximant(order):
    s = 1j * np.array([0.0, 0.3, 2.0, 7.0]) + 0.2
    numerator, denominator = _pade(order)
    exact = np.polyval(numerator, s) / np.polyval(denominator, s)
    np.testing.assert_allclose(_transfer(order, s), exact, rtol=0.0, atol=1e-13)


def test_order_of_accuracy():
    """As good as rounding up to two radians with 8 states, up to five with 12."""
    for order, turn, error in ((8, 2.0, 1e-12), (12, 5.0, 1e-13), (12, 10.0, 1e-6)):
        s = 1j * np.linspace(0.0, turn, 21)
        np.testing.assert_allclose(_transfer(order, s), np.exp(-s), rtol=0.0, atol=error)


def test_chain_is_well_scaled_and_stable():
    for order in range(1, 25):
        chain = delay_chain(order)
        assert np.abs(chain.A).max() < 2 * order
        assert chain.order == order
        poles = np.linalg.eigvals(chain.A)
        assert poles.real.max() < -0.9
        assert np.linalg.cond(chain.A) < 20.0 * order**2


def test_states_are_what_the_delay_holds():
    """``u = t^2`` for ever: the chain's derivative vanishes but for what t moves, for polynomials exactly."""
    order, t = 6, 3.0
    chain = delay_chain(order)
    nodes, weights = np.polynomial.legendre.leggauss(12)
    x = 0.5 * (1.0 + nodes)
    phi = np.polynomial.legendre.legvander(nodes, order - 1) * np.sqrt(2.0 * np.arange(order) + 1.0)
    held, moved = (0.5 * (weights * u) @ phi for u in ((t - x) ** 2, 2.0 * (t - x)))
    np.testing.assert_allclose(chain.A @ held + chain.b * t**2, moved, atol=1e-12)
    assert chain.c @ held == pytest.approx((t - 1.0) ** 2, rel=1e-13)


def test_no_order():
    with pytest.raises(ValueError, match="order"):
        delay_chain(0)


def test_read_only():
    with pytest.raises(ValueError, match="read-only"):
        delay_chain(3).A[0, 0] = 1.0
