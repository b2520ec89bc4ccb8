"""Delay margins against the delay differential equation itself: simulated, and by its characteristic roots."""

import numpy as np
import pytest

from design.frequency.margins import margins
from design.response.transition import transition
from tests.design.siso_loops import of_transfer, stabilised


def abscissa(loop, delay, points=40):
    """Largest real part of the roots of ``det(sI - A + b c exp(-s delay))``.

    Eigenvalues of the generator on Chebyshev's points between ``t - delay`` and t (Breda, Maset and Vermiglio 2005).
    """
    n = loop.A.shape[-1]
    feedback = np.outer(loop.sign * loop.gain * loop.b, loop.c)
    if delay == 0.0:
        return np.linalg.eigvals(loop.A - feedback).real.max()
    k = np.arange(points + 1)
    x, weight = np.cos(np.pi * k / points), (-1.0) ** k * np.where((k == 0) | (k == points), 2.0, 1.0)
    gap = x[:, None] - x + np.eye(points + 1)
    D = np.outer(weight, 1.0 / weight) / gap
    D[k, k] = 0.0
    D[k, k] = -D.sum(axis=-1)
    generator = np.kron(D * 2.0 / delay, np.eye(n))
    generator[:n] = 0.0
    generator[:n, :n], generator[:n, -n:] = loop.A, -feedback
    return np.linalg.eigvals(generator).real.max()


def growth(loop, delay, period, periods=300, steps=60):
    """Ratio of the amplitudes late and early in the step-by-step solution of ``x' = A x - b c x(t - delay)``.

    The method of steps, exact but for the cubic through past values and slopes of the output.
    """
    n = loop.A.shape[-1]
    b = loop.sign * loop.gain * loop.b
    per_delay = int(np.ceil(steps * delay / period)) + 1
    h = delay / per_delay
    # int_0^h exp(A (h - t)) b p(t) dt for the four cubics of Hermite, by the exponential of a chain of integrators.
    chain = np.zeros((n + 4, n + 4))
    chain[:n, :n], chain[:n, n] = loop.A, b
    chain[np.arange(n, n + 3), np.arange(n + 1, n + 4)] = 1.0
    E = transition(chain, h)
    moment = E[:n, n:] * np.array([1.0, 1.0 / h, 2.0 / h**2, 6.0 / h**3])
    cubic = np.array([[1, 0, -3, 2], [0, 0, 3, -2], [0, 1, -2, 1], [0, 0, -1, 1]]) * np.array([[1, 1, h, h]]).T
    past, here = E[:n, :n], moment @ cubic.T
    count = int(periods * period / h)
    y, slope = np.zeros(count + per_delay + 1), np.zeros(count + per_delay + 1)
    x = np.ones(n)
    y[per_delay], slope[per_delay] = loop.c @ x, loop.c @ (loop.A @ x)
    for i in range(count):
        at = slice(i, i + 2)
        x = past @ x - here @ np.concatenate([y[at], slope[at]])
        now = i + per_delay + 1
        y[now], slope[now] = loop.c @ x, loop.c @ (loop.A @ x - b * y[i + 1])
    window = int(20 * period / h)
    late, early = np.abs(y[-window:]).max(), np.abs(y[count // 2 : count // 2 + window]).max()
    return late / early


@pytest.mark.parametrize("delay", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("order", [2, 3, 5])
def test_roots_cross_the_axis_at_the_delay_margin(order, delay):
    """Just short of it, and part of the way, all are left of the axis; just beyond it some are not."""
    loop = stabilised(20, order, seed=40 + order, delay=delay)
    found = margins(loop)
    looked = 0
    for i in range(20):
        point, margin = loop.take(i), float(found.delay_margin[i])
        assert np.isnan(margin) == (abscissa(point, delay) > 0.0)
        if not np.isfinite(margin) or (delay + margin) * np.abs(point.A).max() > 60.0:
            continue
        looked += 1
        for part in (0.3, 0.7, 0.999):
            assert abscissa(point, delay + part * margin) < 0.0
        assert abscissa(point, delay + 1.001 * margin) > 0.0
    assert looked >= 3


@pytest.mark.parametrize("delay", [0.0, 0.3])
@pytest.mark.parametrize(("order", "index"), [(2, 1), (3, 0), (4, 2)])
def test_simulation_decays_before_the_delay_margin_and_grows_after_it(order, index, delay):
    loop = stabilised(30, order, seed=60 + order, delay=delay)
    found = margins(loop)
    # Of loops where a thousandth of the margin shows in three hundred periods.
    shows = np.isfinite(found.delay_margin) & (found.delay_margin * found.crossover > 0.5)
    i = int(np.flatnonzero(shows)[index])
    point, margin = loop.take(i), float(found.delay_margin[i])
    crossing = found.phase_omega[i][np.nanargmin((found.phase[i] % (2 * np.pi)) / found.phase_omega[i])]
    period = 2 * np.pi / crossing
    assert growth(point, delay + 0.999 * margin, period) < 1.0 - 1e-4
    assert growth(point, delay + 1.001 * margin, period) > 1.0 + 1e-4


def test_integrator_by_simulation():
    """``x' = -k x(t - h)`` is stable for ``k h < pi / 2``."""
    point = of_transfer([1.0], [1.0, 0.0], gain=2.0)
    margin = float(margins(point).delay_margin)
    np.testing.assert_allclose(margin, np.pi / 4, rtol=1e-12)
    assert growth(point, 0.999 * margin, np.pi) < 0.95
    assert growth(point, 1.001 * margin, np.pi) > 1.05
    assert abs(growth(point, margin, np.pi) - 1.0) < 1e-3
