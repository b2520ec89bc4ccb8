import numpy as np

from design.lqr.root_search import search_roots


def test_each_point_finds_its_own_root():
    """x^2 + y = a, x - y = b, another pair at every point, against the closed form."""
    a, b = np.random.default_rng(0).uniform(1.0, 5.0, (2, 40))

    def errors(unknowns, points):
        x, y = unknowns[..., 0] + 1.0, unknowns[..., 1]
        return np.stack([x**2 + y - a[points], x - y - b[points]], axis=-1)

    found = search_roots(errors, 40, 2, 1e-9)
    x = 0.5 * (-1.0 + np.sqrt(1.0 + 4.0 * (a + b)))
    np.testing.assert_allclose(found.unknowns[:, 0] + 1.0, x, rtol=1e-8)
    np.testing.assert_allclose(found.unknowns[:, 1], x - b, rtol=1e-7, atol=1e-8)
    assert np.abs(found.errors).max() <= 1e-9


def test_a_point_without_a_root_stops_where_it_is_nearest_and_keeps_the_others():
    def errors(unknowns, points):
        x = unknowns[..., 0]
        return np.where(points == 1, x**2 + 1.0 + 0.1 * x, np.exp(x) - 3.0)[..., None]

    found = search_roots(errors, 3, 1, 1e-9)
    np.testing.assert_allclose(found.unknowns[[0, 2], 0], np.log(3.0), rtol=1e-8)
    assert 0.99 < found.errors[1, 0] < 1.0


def test_a_kink_is_crossed_and_a_flat_or_missing_error_ends_the_search():
    def errors(unknowns, points):
        x = unknowns[..., 0]
        kink = np.where(x < 0.5, 4.0 - x, 3.5 - 8.0 * (x - 0.5))
        flat, missing = np.full_like(x, 2.0), np.where(x == 0.0, 1.0, np.nan)
        return np.choose(points, [kink, flat, missing, np.full_like(x, np.nan)])[..., None]

    found = search_roots(errors, 4, 1, 1e-9)
    assert abs(found.unknowns[0, 0] - 0.9375) < 1e-9
    np.testing.assert_array_equal(found.unknowns[1:, 0], 0.0)
    np.testing.assert_array_equal(found.errors[1:, 0], [2.0, 1.0, np.nan])


def test_no_points():
    assert search_roots(lambda unknowns, points: unknowns, 0, 3, 1e-9).unknowns.shape == (0, 3)
