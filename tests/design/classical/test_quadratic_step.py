"""Against scipy's optimisers, which solve the same programmes by another road."""

import numpy as np
import pytest
from scipy.optimize import minimize

from design.classical.quadratic_step import BOX_SOFTNESS, SOFTNESS, quadratic_step

K, M = 40, 7


def _programmes(n, room):
    rng = np.random.default_rng(n)
    half = rng.standard_normal((K, n, n))
    bend = half @ half.swapaxes(-1, -2) + 0.1 * np.eye(n)
    value = rng.uniform(-1.0, 0.0 if room else 0.5, (K, M))
    low, high = -rng.uniform(0.1, 1.0, (K, n)), rng.uniform(0.1, 1.0, (K, n))
    return rng.standard_normal((K, n)), bend, value, rng.standard_normal((K, M, n)), low, high


def _solved(programmes, guess=None):
    n = programmes[0].shape[1]
    return quadratic_step(*programmes, np.zeros((K, M + 2 * n), bool) if guess is None else guess)


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_where_there_is_room_it_is_the_optimum_inside_the_walls(n):
    programmes = _programmes(n, room=True)
    step = _solved(programmes)
    for i in range(K):
        slope, bend, value, gradient, low, high = (p[i] for p in programmes)
        walls = {"type": "ineq", "fun": lambda v, c=value, g=gradient: -(c + g @ v), "jac": lambda v, g=gradient: -g}
        best = minimize(
            lambda v, a=slope, H=bend: 0.5 * v @ H @ v - a @ v, np.zeros(n), jac=lambda v, a=slope, H=bend: H @ v - a,
            bounds=list(zip(low, high, strict=True)), method="SLSQP", constraints=walls,
        )  # fmt: skip
        v = step.v[i]
        given_way = SOFTNESS * (step.push[i] @ step.push[i])
        assert 0.5 * v @ bend @ v - slope @ v == pytest.approx(best.fun, abs=1e-5 + given_way)
        assert np.all(value + gradient @ v <= SOFTNESS * step.push[i] + 1e-6)
        assert np.all((v >= low) & (v <= high))
        # What the walls push back with balances the pull of the aim where the box does not.
        inside = (v > low) & (v < high)
        balance = slope - bend @ v - gradient.T @ step.push[i]
        assert np.all(np.abs(balance[inside]) < 1e-4 * (1.0 + np.abs(step.push[i]).sum()))


@pytest.mark.parametrize("n", [2, 4])
def test_where_there_is_no_room_the_violations_are_the_least(n):
    slope, bend, value, gradient, low, high = programmes = _programmes(n, room=False)
    step = _solved(programmes)

    def energy(v, i):
        walls = np.maximum(value[i] + gradient[i] @ v, 0.0)
        box = np.maximum(low[i] - v, 0.0) ** 2 + np.maximum(v - high[i], 0.0) ** 2
        return 0.5 * v @ bend[i] @ v - slope[i] @ v + 0.5 * walls @ walls / SOFTNESS + 0.5 * box.sum() / BOX_SOFTNESS

    rng = np.random.default_rng(0)
    for i in range(K):
        ours = energy(step.v[i], i)
        for other in step.v[i] + rng.standard_normal((200, n)) * np.geomspace(1e-6, 0.3, 200)[:, None]:
            assert ours <= energy(np.clip(other, low[i], high[i]), i) + 5e-3 * (1.0 + abs(ours))


def test_the_guess_only_saves_work_and_neighbours_do_not_matter():
    programmes = _programmes(3, room=False)
    step = _solved(programmes)
    wrong = np.random.default_rng(1).random(step.pushing.shape) < 0.3
    np.testing.assert_allclose(_solved(programmes, wrong).v, step.v, atol=1e-7)
    np.testing.assert_allclose(_solved(programmes, step.pushing).v, step.v, atol=1e-9)
    one = quadratic_step(*(p[7:8] for p in programmes), np.zeros((1, M + 6), bool))
    np.testing.assert_allclose(one.v[0], step.v[7], atol=1e-10)
