"""The nu-gap against closed forms, its own definition by plants and encirclements, and what it promises."""

from __future__ import annotations

import numpy as np
import pytest

from design.robustness.nu_gap import CutLoop, best_units, nu_gap, stability_margin


def first_order(gain: float, pole: float) -> CutLoop:
    """``gain / (s - pole)``."""
    return CutLoop(np.array([[pole]]), np.array([[1.0]]), np.array([[gain]]))


def random_loops(seed: int, points: int, n: int, m: int, spread: float = 1.0) -> CutLoop:
    rng = np.random.default_rng(seed)
    A, B, K = (spread * rng.normal(size=(points, *shape)) for shape in ((n, n), (n, m), (m, n)))
    return CutLoop(A, B, K)


def near(loop: CutLoop, size: float, seed: int) -> CutLoop:
    rng = np.random.default_rng(seed)
    A, B, K = (M * (1.0 + size * rng.normal(size=M.shape)) for M in (loop.A, loop.B, loop.K))
    return CutLoop(A, B, K)


@pytest.mark.parametrize("k", [1.05, 2.0, 10.0, 100.0])
def test_a_stable_and_an_unstable_plant_may_be_near(k: float) -> None:
    """k/(s + 1) and k/(s - 1): ``2 k / (1 + k^2)`` (Astrom and Murray, Feedback Systems, 2008, example 12.2)."""
    for one, other in ((-1.0, 1.0), (1.0, -1.0)):
        found = nu_gap(first_order(k, one), first_order(k, other))
        assert found.comparable
        assert found.gap == pytest.approx(2.0 * k / (1.0 + k**2), rel=1e-12)


@pytest.mark.parametrize("k", [0.3, 0.9])
def test_the_winding_number_tells_them_apart_all_the_same(k: float) -> None:
    """Below k = 1 no controller does for both, though the distance over frequency is less than 1."""
    for one, other in ((-1.0, 1.0), (1.0, -1.0)):
        found = nu_gap(first_order(k, one), first_order(k, other))
        assert not found.comparable
        assert found.gap == 1.0
        assert found.distance == pytest.approx(2.0 * k / (1.0 + k**2), rel=1e-12)


def test_poles_on_the_axis_are_no_exception() -> None:
    """1/s and 1/(s + a): at zero frequency ``a / sqrt(1 + a^2)``, a gain that is infinite against one of 1/a."""
    for a in (0.01, 0.1, 1.0):
        found = nu_gap(first_order(1.0, 0.0), first_order(1.0, -a))
        assert found.gap == pytest.approx(a / np.sqrt(1.0 + a * a), rel=1e-12)
        assert found.omega < 1e-3


def test_margins_of_first_order_loops() -> None:
    """b of k/(s + 1) under 1: the chordal distance of L from -1, at zero or at infinite frequency."""
    for k in (0.2, 1.0, 5.0):
        found = stability_margin(first_order(k, -1.0))
        at_rest = (1.0 + k) / np.sqrt(2.0 * (1.0 + k * k))
        assert found.margin == pytest.approx(min(at_rest, np.sqrt(0.5)), rel=1e-9)
    found = stability_margin(first_order(3.0, 1.0))
    assert found.margin == pytest.approx(2.0 / np.sqrt(2.0 * 10.0), rel=1e-9)
    assert stability_margin(first_order(0.5, 1.0)).margin == 0.0  # not stable


def test_the_same_loop_is_no_distance_away() -> None:
    loop = random_loops(0, 5, 4, 2)
    turned = np.linalg.qr(np.random.default_rng(1).normal(size=(4, 4)))[0]
    other = CutLoop(turned @ loop.A @ turned.T, turned @ loop.B, loop.K @ turned.T)
    assert np.all(nu_gap(loop, other).gap < 1e-9)


def inverse_root(M: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(M)
    return (vectors / np.sqrt(values)[..., None, :]) @ vectors.conj().mT


@pytest.mark.parametrize("m", [1, 2, 3])
def test_against_its_definition(m: int) -> None:
    """Plants instead of graphs, poles instead of closed loops: turns and unstable poles of the
    plants, ``turns of det(I + P2'P1) + eta_2 - eta_1 = 0`` along the axis (Vinnicombe counts them clockwise)."""
    one = random_loops(3, 12, 4, m)
    other = near(one, 0.4, 4)
    omega = np.concatenate([[0.0], np.geomspace(1e-4, 1e5, 20_000)])
    found, right = nu_gap(one, other), []
    for i in range(12):
        a, b = one.take(i), other.take(i)
        P1, P2 = (
            each.K @ np.linalg.solve(1j * omega[:, None, None] * np.eye(4) - each.A, each.B + 0j) for each in (a, b)
        )
        unit = np.eye(m)
        det = np.linalg.det(unit + P2.conj().mT @ P1)
        turns = 2.0 * np.angle(np.append(det[1:], 1.0) / det).sum() / (2.0 * np.pi)
        eta = [np.sum(np.linalg.eigvals(each.A).real > 0.0) for each in (a, b)]
        comparable = round(turns) + eta[1] - eta[0] == 0
        right.append(comparable)
        left, right_root = inverse_root(unit + P2 @ P2.conj().mT), inverse_root(unit + P1.conj().mT @ P1)
        psi = np.linalg.norm(left @ (P1 - P2) @ right_root, 2, axis=(-2, -1)).max()
        assert found.distance[i] == pytest.approx(psi, rel=1e-5)
        assert found.distance[i] >= psi * (1.0 - 1e-9)
        assert found.gap[i] == pytest.approx(found.distance[i] if comparable else 1.0)
    np.testing.assert_array_equal(found.comparable, right)
    assert 0 < sum(right) < 12


def test_it_is_a_metric() -> None:
    a = random_loops(7, 10, 3, 2)
    b, c = near(a, 0.05, 8), near(a, 0.1, 9)
    ab, bc, ac = nu_gap(a, b).gap, nu_gap(b, c).gap, nu_gap(a, c).gap
    np.testing.assert_allclose(nu_gap(b, a).gap, ab, rtol=1e-9)
    assert np.all(ac <= ab + bc + 1e-9)


def test_what_is_nearer_than_the_margin_is_stable() -> None:
    """The theorem, on hundreds of pairs: no loop within b of a stable one is unstable."""
    proved = unstable = 0
    for seed in range(12):
        loop = random_loops(20 + seed, 40, 3, 2)
        stable = np.linalg.eigvals(loop.closed).real.max(axis=-1) < 0.0
        loop = loop.take(stable)
        other = near(loop, (0.05, 0.5)[seed % 2], 50 + seed)
        units = best_units(loop)
        one, there = loop.in_units(units), other.in_units(units)
        held = nu_gap(one, there).gap < stability_margin(one).margin
        grows = np.linalg.eigvals(there.closed).real.max(axis=-1) >= 0.0
        assert not np.any(held & grows)
        proved, unstable = proved + int(held.sum()), unstable + int(grows.sum())
    assert proved > 10
    assert unstable > 5


def test_best_units_leave_the_loop_alone_and_prove_more() -> None:
    loop = random_loops(3, 20, 4, 2)
    loop = loop.take(np.linalg.eigvals(loop.closed).real.max(axis=-1) < 0.0)
    units = best_units(loop)
    assert np.all(units[:, 1] == 1.0)
    best, plain = loop.in_units(units), stability_margin(loop).margin
    np.testing.assert_allclose(best.closed, loop.closed, rtol=1e-12, atol=1e-12)
    found = stability_margin(best).margin
    assert np.all(found >= plain * (1.0 - 1e-3))
    for factor in (0.5, 0.9, 1.1, 2.0):
        trial = stability_margin(loop.in_units(units * [factor, 1.0])).margin
        assert np.all(trial <= found * (1.0 + 1e-3))
    np.testing.assert_array_equal(best_units(first_order(2.0, -1.0)), [1.0])
    with pytest.raises(ValueError, match="two commands"):
        best_units(random_loops(0, 1, 4, 3))


def test_a_narrow_peak_is_found() -> None:
    """Two lightly damped modes a thousandth apart: the distance is 1 nearly, in a band of a few thousandths."""

    def mode(omega: float, damping: float) -> CutLoop:
        A = np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]])
        return CutLoop(A, np.array([[0.0], [1.0]]), np.array([[0.0, 2.0 * damping * omega * 30.0]]))

    one, other = mode(100.0, 1e-5), mode(100.1, 1e-5)
    found = nu_gap(one, other)
    omega = np.linspace(99.5, 100.6, 200_001)
    P = [
        (each.K @ np.linalg.solve(1j * omega[:, None, None] * np.eye(2) - each.A, each.B + 0j))[:, 0, 0]
        for each in (one, other)
    ]
    psi = np.abs(P[0] - P[1]) / np.sqrt((1.0 + np.abs(P[0]) ** 2) * (1.0 + np.abs(P[1]) ** 2))
    assert found.distance == pytest.approx(psi.max(), rel=1e-6)
    assert found.distance >= psi.max() * (1.0 - 1e-9)


def test_points_do_not_depend_on_their_neighbours() -> None:
    one, other = random_loops(1, 6, 4, 2), random_loops(2, 6, 4, 2)
    grid = [CutLoop(*(M.reshape(2, 3, *M.shape[1:]) for M in (each.A, each.B, each.K))) for each in (one, other)]
    whole, margins, units = nu_gap(*grid), stability_margin(grid[0]), best_units(grid[0])
    for index in np.ndindex(2, 3):
        alone = nu_gap(grid[0].take(index), grid[1].take(index))
        for name in ("gap", "distance", "omega", "comparable"):
            np.testing.assert_array_equal(getattr(whole.take(index), name), getattr(alone, name))
        np.testing.assert_array_equal(margins.margin[index], stability_margin(grid[0].take(index)).margin)
        np.testing.assert_array_equal(units[index], best_units(grid[0].take(index)))


def test_what_cannot_be_compared_is_refused() -> None:
    with pytest.raises(ValueError, match="inputs"):
        nu_gap(random_loops(0, 2, 3, 1), random_loops(0, 2, 3, 2))
    with pytest.raises(ValueError, match="loops over"):
        nu_gap(random_loops(0, 2, 3, 1), random_loops(0, 3, 3, 1))
    broken = random_loops(0, 1, 3, 1)
    with pytest.raises(np.linalg.LinAlgError):
        nu_gap(broken, CutLoop(np.nan * broken.A, broken.B, broken.K))
