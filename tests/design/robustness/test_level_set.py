import numpy as np
import pytest

from design.robustness.gains import every_gain
from design.robustness.input_loop import InputLoop, complementary, value, with_derivatives
from design.robustness.level_set import crossings, nodes
from tests.design.robustness.two_input_loops import dense, random_loops, regulators, resonant_loops

CASES = {
    "random 1": random_loops(8, 1, seed=1),
    "random 2": random_loops(8, 2, seed=2),
    "random 5": random_loops(8, 5, seed=3),
    "random 10": random_loops(5, 10, seed=4),
    "regulator 4": regulators(8, 4, seed=5),
    "resonant 6": resonant_loops(8, 6, seed=6, spread=4, damping=1e-3, scale=1),
    "stiff 8": resonant_loops(6, 8, seed=7, spread=8, damping=1e-2, scale=0),
}


def input_loop(A, B, K, delay=(0.0, 0.0)):
    closed = A - B @ K
    N = len(A)
    poles = np.linalg.eigvals(closed).astype(complex)
    return InputLoop(closed, B, K, np.zeros((N, 2, 2)), poles, np.tile(np.asarray(delay), (N, 1)))


def chain(count, seed):
    """All poles in one Jordan block: no eigenvectors to speak of."""
    rng = np.random.default_rng(seed)
    closed = np.tile(-np.eye(5) + np.eye(5, k=1), (count, 1, 1))
    B, K = rng.standard_normal((count, 5, 2)), rng.standard_normal((count, 2, 5))
    return closed + B @ K, B, K


def decoupled(count, seed):
    """Two loops that do not know of each other: every crossing of mu is a double root of the polynomial."""
    A, B, K = random_loops(2 * count, 3, seed)
    block = np.kron(np.eye(2), np.ones((3, 3)))
    A = np.tile(A.reshape(count, 6, 3), (1, 1, 2)) * block
    inputs, outputs = np.zeros((count, 6, 2)), np.zeros((count, 2, 6))
    for i in range(2):
        inputs[:, 3 * i : 3 * i + 3, i], outputs[:, i, 3 * i : 3 * i + 3] = B[i::2, :, i], K[i::2, i]
    closed = A - inputs @ outputs
    growth = np.maximum(np.linalg.eigvals(closed).real.max(axis=-1) + 0.1, 0.0)
    return A - growth[:, None, None] * np.eye(6), inputs, outputs


CASES["chain"] = chain(8, seed=8)
CASES["decoupled"] = decoupled(8, seed=9)


@pytest.mark.parametrize("name", CASES)
def test_every_sign_change_is_among_the_crossings(name):
    loop = input_loop(*CASES[name])
    points = len(loop.A)
    gains, rows = every_gain(points)
    rng = np.random.default_rng(0)
    known = nodes(loop, 2)
    seen = 0
    for point in range(points):
        omega = dense(loop.poles[point], points=2000)
        T = complementary(loop.take([point]), omega[None])
        own = np.flatnonzero(rows == point)
        heights = gains.take(own).of(np.repeat(T, 5, axis=0))
        for structured in (True, False):
            at = own[gains.structured[own] == structured]
            curve = heights[gains.structured[own] == structured]
            for part in rng.uniform(0.02, 0.98, 4):
                level = curve.min(axis=-1) + part * np.ptp(curve, axis=-1)
                found = crossings(known, rows[at], gains.take(at), level)
                for line, height, w in zip(curve, level, found, strict=True):
                    if np.ptp(line) < 1e-9:
                        continue  # a curve that is flat crosses nothing but rounding
                    change = np.flatnonzero(np.diff(np.sign(line - height)) != 0)
                    seen += change.size
                    low, high = omega[change] * (1.0 - 1e-7), omega[change + 1] * (1.0 + 1e-7)
                    assert np.all(((w >= low[:, None]) & (w <= high[:, None])).any(axis=-1))
    assert seen > 20


def test_the_gains_have_the_level_at_crossings_of_the_largest_singular_value():
    """Here every root on the axis is a crossing, of the larger value or of the smaller."""
    loop = input_loop(*random_loops(30, 4, seed=10))
    gains, rows = every_gain(30)
    plain = np.flatnonzero(~gains.structured)
    level = np.random.default_rng(1).uniform(0.2, 2.0, plain.size)
    w = crossings(nodes(loop, 2), rows[plain], gains.take(plain), level)
    row, column = np.nonzero(~np.isnan(w))
    at = gains.take(plain[row])
    values = np.linalg.svd(at.matrix(value(loop, rows[plain[row]], w[row, column])), compute_uv=False)
    off = np.abs(values**2 / level[row][:, None] - 1.0).min(axis=-1)
    # Roots that are only near the axis are kept on purpose.
    assert np.mean(off < 1e-10) > 0.7
    assert row.size > 40


@pytest.mark.parametrize("delay", [(0.0, 0.0), (0.3, 0.1)])
def test_derivatives_of_T(delay):
    loop = input_loop(*random_loops(20, 4, seed=11), delay)
    rows, w, h = np.arange(20), np.random.default_rng(2).uniform(0.2, 3.0, 20), 1e-4
    T, slope, curvature = with_derivatives(loop, rows, w)
    before, after = (value(loop, rows, w + side * h) for side in (-1.0, 1.0))
    np.testing.assert_allclose(T, value(loop, rows, w), rtol=1e-12)
    scale = np.abs(curvature).max() + np.abs(T).max()
    np.testing.assert_allclose(slope, (after - before) / (2.0 * h), atol=1e-6 * scale)
    np.testing.assert_allclose(curvature, (after - 2.0 * T + before) / h**2, atol=1e-5 * scale)


def test_step_to_the_peak_is_newtons():
    """On 1/h, by differences."""
    loop = input_loop(*random_loops(30, 4, seed=12))
    gains, rows = every_gain(30)
    w = np.random.default_rng(3).uniform(0.3, 3.0, len(rows))
    h, slope, step = gains.step_to_peak(*with_derivatives(loop, rows, w))
    np.testing.assert_allclose(h, gains.of(value(loop, rows, w)), rtol=1e-9)
    near = [1.0 / gains.of(value(loop, rows, w + side * 1e-4)) for side in (-1.0, 0.0, 1.0)]
    first, second = (near[2] - near[0]) / 2e-4, (near[2] - 2.0 * near[1] + near[0]) / 1e-8
    np.testing.assert_allclose(slope, -first * h**2, rtol=1e-4, atol=1e-5 * h.max())
    plain = np.abs(second) > 1e-2 * np.abs(near[1])
    np.testing.assert_allclose(step[plain], (-first / second)[plain], rtol=1e-3, atol=1e-4)
    assert plain.mean() > 0.8


def test_covers_are_nowhere_below():
    loop = input_loop(*random_loops(20, 4, seed=13))
    gains, rows = every_gain(20)
    w = np.random.default_rng(4).uniform(0.1, 3.0, len(rows))
    here = value(loop, rows, w)
    cover = gains.covered(here)
    np.testing.assert_allclose(cover.of(here), gains.of(here), rtol=1e-12)
    for other in np.geomspace(0.01, 100.0, 40):
        T = value(loop, rows, np.full(len(rows), other))
        assert np.all(cover.of(T) >= gains.of(T) * (1.0 - 1e-12))
