import numpy as np
import pytest

from design.frequency import locus_roots
from design.frequency.locus_roots import other_places, product, settled_roots
from design.frequency.locus_segments import Segments


def conjugate_lists(count, above, real, seed):
    """Lists (n, count): `above` poles above the axis, real ones, and the conjugates."""
    rng = np.random.default_rng(seed)
    upper = rng.uniform(-3.0, 0.0, (above, count)) + 1j * rng.uniform(0.5, 3.0, (above, count))
    return np.concatenate([upper, np.sort(rng.uniform(-5.0, 0.0, (real, count)), axis=0), upper.conj()])


def residual(s, a, b, t):
    """Value of the polynomial at the roots over the sum of what it is the difference of."""
    size = (1.0 - t) * np.prod(np.abs(s[:, None]) + np.abs(a), axis=1)
    return np.abs((1.0 - t) * product(s, a) + t * product(s, b)) / (
        size + t * np.prod(np.abs(s[:, None]) + np.abs(b), 1)
    )


def test_products():
    a = conjugate_lists(7, 2, 1, seed=0)
    s = conjugate_lists(7, 1, 1, seed=1)
    np.testing.assert_allclose(product(s, a), np.prod(s[:, None] - a, axis=1))
    np.testing.assert_array_equal(other_places(3), [[1, 2], [0, 2], [0, 1]])
    assert other_places(1).shape == (1, 0)


def test_two_roots_on_one_zero_are_not_sure():
    """Both guesses of the real roots fall on the same one, where a step of each alone is nil."""
    a = b = np.array([[-1.0], [-2.0], [-4.0]], dtype=complex)
    t, half = np.array([0.5]), np.zeros((3, 1), dtype=int)
    good, sure = settled_roots(a + 1e-3, a, b, t, half)
    assert sure.all()
    np.testing.assert_allclose(good, a, atol=1e-12)
    for twice in ([-1.0, -1.0, -4.0], [-1.0, -1.0 + 1e-14, -4.0], [-2.0, -2.0, -2.0]):
        roots, sure = settled_roots(np.array(twice, dtype=complex)[:, None], a, b, t, half)
        assert not sure.any() or np.allclose(np.sort(roots.real, axis=0), [[-4.0], [-2.0], [-1.0]])


def test_a_pair_guessed_as_real_is_not_sure_and_the_reverse():
    t = np.array([0.5])
    pair, real = np.array([[-1 - 1j], [-1 + 1j]]), np.array([[-3.0 + 0j], [-1.0 + 0j]])
    for zeros, guess, half in ((pair, real, [[0], [0]]), (real, pair, [[-1], [1]])):
        _, sure = settled_roots(guess.copy(), zeros, zeros, t, np.array(half))
        assert not sure.any()


@pytest.mark.parametrize(("above", "real"), [(0, 1), (0, 4), (1, 0), (1, 3), (2, 1), (3, 0), (3, 2)])
def test_sure_roots_are_all_roots(above, real):
    """Whatever the guesses: what is called sure holds every zero of the polynomial once, and is exactly symmetric."""
    count = 300
    a, b = (conjugate_lists(count, above, real, seed) for seed in (2, 3))
    t = np.random.default_rng(4).uniform(0.0, 1.0, count)
    R, n = above + real, 2 * above + real
    rng = np.random.default_rng(5)
    guess = (1.0 - t) * a[:R] + t * b[:R]
    guess[:above] += rng.normal(0.0, 0.3, (above, count)) + 1j * rng.normal(0.0, 0.3, (above, count))
    guess[above:] += rng.normal(0.0, 0.3, (real, count))
    s, sure = settled_roots(guess, a, b, t, np.zeros((real, count), dtype=int))
    assert sure.mean() > 0.05
    s, a, b, t = s[:, sure], a[:, sure], b[:, sure], t[sure]
    assert np.all(residual(s, a, b, t) < 1e-11)
    np.testing.assert_array_equal(s[R:], s[:above].conj())
    np.testing.assert_array_equal(s[above:R].imag, 0.0)
    for i in range(t.size):
        expected = np.roots((1.0 - t[i]) * np.poly(a[:, i]).real + t[i] * np.poly(b[:, i]).real)
        apart = np.abs(expected[:, None] - s[:, i])
        assert sorted(apart.argmin(axis=1)) == list(range(n))
        np.testing.assert_allclose(apart.min(axis=1), 0.0, atol=1e-8)


def test_a_root_far_below_the_others_keeps_its_digits():
    a = np.array([[-1e-5], [-1e2], [-3e3]], dtype=complex)
    b = np.array([[-3e-5], [-2e2], [-2e3]], dtype=complex)
    t = np.array([0.3])
    times_sure = 0
    for off in (1.0, 1.1, 1.5, 5.0):
        s, sure = settled_roots((0.7 * a + 0.3 * b) * off, a, b, t, np.zeros((3, 1), dtype=int))
        if sure[0]:
            step = ((1.0 - t) * product(s, a) + t * product(s, b)) / (s[:, None] - s[other_places(3)]).prod(axis=1)
            assert np.all(np.abs(step) < 1e-11 * np.abs(s))
            times_sure += 1
    assert times_sure > 2


def test_segments_find_nearly_all_between_random_ends():
    """Poles of matrices a good part of the way apart, a pair meeting in between or not."""
    rng = np.random.default_rng(6)
    A, b, c = rng.standard_normal((400, 5, 5)), rng.standard_normal((400, 5, 1)), rng.standard_normal((400, 1, 5))
    start, end, middle = (np.linalg.eigvals(A - k * b @ c).astype(complex) for k in (0.5, 0.8, 0.65))
    segments = Segments.between(start, end)
    found, sure = segments.poles(np.arange(400), np.full(400, 0.5))
    assert sure.mean() > 0.9
    met = segments.ends.meeting >= 0
    assert met.sum() > 20
    assert sure[met].mean() > 0.8
    np.testing.assert_allclose(np.sort_complex(found[sure]).sum(axis=-1), middle[sure].sum(axis=-1), atol=1e-9)
    apart = np.abs(found[sure][:, :, None] - middle[sure][:, None, :])
    assert np.all(apart.min(axis=1) < 1e-6)


def test_iterations_double_the_digits(monkeypatch):
    a = np.array([[-1.0 + 2.0j], [-6.0], [-3.0], [-1.0 - 2.0j]])
    t, half = np.array([0.4]), np.zeros((2, 1), dtype=int)
    exact, sure = settled_roots(a[:3], a, 1.1 * a, t, half)
    assert sure.all()
    monkeypatch.setattr(locus_roots, "ITERATIONS", (1,))
    for off in (1e-2, 1e-3, 1e-4):
        once, _ = settled_roots(exact[:3] * (1.0 + off), a, 1.1 * a, t, half)
        assert np.abs(once - exact).max() < 20.0 * off**2
