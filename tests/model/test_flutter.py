import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from model.flutter import Mechanism, flutter_criterion, flutter_range, mechanism

RNG = np.random.default_rng(5)


def undamped(J, K):
    """Squares of the exponents of ``J d'' + K d = 0``: real and negative when it oscillates for ever."""
    return np.linalg.eigvals(np.linalg.solve(J, -K))


def random_models(count):
    root = RNG.normal(size=(count, 2, 2))
    return root @ np.swapaxes(root, -1, -2) + 0.1 * np.eye(2), RNG.normal(size=(count, 2, 2)) + 0.5 * np.eye(2)


def test_criterion_agrees_with_the_undamped_eigenvalues():
    J, K = random_models(500)
    found = flutter_criterion(J, -K)
    seen = set()
    for i in range(500):
        squares = undamped(J[i], K[i])
        if np.any(np.abs(squares.imag) > 1e-12 * np.abs(squares)):
            expected = Mechanism.UNDAMPED_FLUTTER
        else:
            expected = Mechanism.NEUTRAL if np.all(squares.real < 0.0) else Mechanism.DIVERGENCE
        assert found.undamped[i] is expected
        assert (found.discriminant[i] < 0.0) == (expected is Mechanism.UNDAMPED_FLUTTER)
        seen.add(expected)
    assert len(seen) == 3


def test_criterion_is_the_one_of_the_inertia_ratio_and_coupling():
    J, K = random_models(50)
    found = flutter_criterion(J, -K)
    r, k = J[:, 1, 1] / J[:, 0, 0], J[:, 0, 1] / J[:, 0, 0]
    np.testing.assert_array_equal(found.inertia_ratio, r)
    np.testing.assert_array_equal(found.inertia_coupling, k)
    left = (r * K[:, 0, 0] + K[:, 1, 1] - k * (K[:, 0, 1] + K[:, 1, 0])) ** 2
    right = 4 * (r - k**2) * np.linalg.det(K)
    size = np.sum(K**2, axis=(-2, -1))
    np.testing.assert_allclose(found.left, left / size, rtol=1e-12)
    np.testing.assert_allclose(found.right, right / size, rtol=1e-9)


@given(st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3), st.floats(0.1, 5.0), st.floats(-0.9, 0.9))
@settings(max_examples=100, deadline=None)
def test_a_symmetric_stiffness_never_flutters(entries, inertia, coupling):
    a, b, c = entries
    J = np.array([[1.0, coupling * np.sqrt(inertia)], [coupling * np.sqrt(inertia), inertia]])
    found = flutter_criterion(J, -np.array([[a, b], [b, c]]))
    assert found.discriminant >= -1e-12 * max(1.0, float(found.left))


def test_criterion_does_not_depend_on_the_dynamic_pressure():
    J, K = random_models(20)
    a, b = flutter_criterion(J, -K), flutter_criterion(J, -731.0 * K)
    np.testing.assert_allclose(a.discriminant, b.discriminant, rtol=1e-10)
    np.testing.assert_array_equal(a.undamped, b.undamped)


def test_range_is_where_the_criterion_holds():
    K = np.abs(RNG.normal(size=(200, 2, 2)))
    k = RNG.uniform(0.5, 1.5, 200)
    found = flutter_range(K, k)
    exists = np.isfinite(found.lower)
    assert np.any(exists)
    assert not np.all(exists)
    r = np.geomspace(1e-2, 1e3, 400)[:, None]
    for i in range(200):
        J = np.empty((400, 2, 2))
        J[:, 0, 0], J[:, 0, 1], J[:, 1, 0], J[:, 1, 1] = 1.0, k[i], k[i], np.maximum(r[:, 0], 1.0001 * k[i] ** 2)
        flutters = flutter_criterion(J, -np.broadcast_to(K[i], J.shape)).discriminant < 0.0
        ratio = J[:, 1, 1]
        expected = (ratio > found.lower[i]) & (ratio < found.upper[i]) if exists[i] else np.zeros(400, dtype=bool)
        close = np.zeros(400, dtype=bool)
        if exists[i]:
            close = np.minimum(np.abs(ratio / found.lower[i] - 1), np.abs(ratio / found.upper[i] - 1)) < 1e-9
        np.testing.assert_array_equal(flutters[~close], expected[~close])


def test_range_exists_where_the_coupling_lies_between_the_cross_stiffnesses():
    K = np.array([[1.0, 0.4], [3.0, 2.0]])
    for k, exists in ((0.3, False), (0.5, True), (2.9, True), (3.1, False)):
        assert bool(np.isfinite(flutter_range(K, k).lower)) is exists


@pytest.mark.parametrize(
    ("growth", "undamped_word", "expected"),
    [
        (-1.0, Mechanism.UNDAMPED_FLUTTER, Mechanism.STABLE),
        (1.0, Mechanism.UNDAMPED_FLUTTER, Mechanism.UNDAMPED_FLUTTER),
        (1.0, Mechanism.NEUTRAL, Mechanism.DAMPING_DRIVEN),
        (1.0, Mechanism.DIVERGENCE, Mechanism.DIVERGENCE),
        (1e-12, Mechanism.NEUTRAL, Mechanism.NEUTRAL),
        (-1e-12, Mechanism.UNDAMPED_FLUTTER, Mechanism.NEUTRAL),
    ],
)
def test_mechanism(growth, undamped_word, expected):
    values = np.array([growth + 3j, growth - 3j, -2.0, -5.0])
    undamped = np.array(undamped_word, dtype=object)
    assert mechanism(values, undamped).item() is expected
    batch = mechanism(np.broadcast_to(values, (2, 3, 4)), np.broadcast_to(undamped, (2, 3)))
    assert batch.shape == (2, 3)
    assert all(word is expected for word in batch.flat)


def test_no_stiffness_at_all_is_neutral():
    found = flutter_criterion(np.eye(2), np.zeros((2, 2)))
    assert found.undamped.item() is Mechanism.NEUTRAL
    assert float(found.discriminant) == 0.0


def test_batched_equals_single():
    J, K = random_models(10)
    batch, ranges = flutter_criterion(J, -K), flutter_range(K, 1.0)
    for i in range(10):
        single = flutter_criterion(J[i], -K[i])
        for name in ("inertia_ratio", "inertia_coupling", "left", "right", "discriminant"):
            np.testing.assert_allclose(getattr(batch, name)[i], getattr(single, name), rtol=1e-13)
        assert batch.undamped[i] is single.undamped.item()
        np.testing.assert_array_equal(ranges.upper[i], flutter_range(K[i], 1.0).upper)
