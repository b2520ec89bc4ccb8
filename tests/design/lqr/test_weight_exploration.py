import numpy as np
from scipy.optimize import minimize

from design.lqr.weight_exploration import covering_points, explore, settle
from design.lqr.weight_models import AIM, NOTHING, WALL, Models, best_step

LOW, HIGH = np.full(3, -2.0), np.full(3, 2.0)


def _wells(z, rows):
    """A deep narrow well in one corner beside a wide shallow one, behind a wall; another corner for each search."""
    corner = np.where(rows[:, None] % 2 == 0, 1.4, -1.4) * np.array([1.0, -1.0, 1.0])
    wide = 0.3 * ((z + corner) ** 2).sum(axis=-1)
    deep = 3.0 * ((z - corner) ** 2).sum(axis=-1) - 2.0
    aim = np.minimum(wide, deep)
    wall = 1.3 - np.abs(z[:, 0])
    return np.stack([aim, aim - 5.0, wall, np.full(len(z), 7.0)], axis=1)


def test_the_deeper_well_is_found_whichever_searches_there_are():
    role = np.tile([AIM, AIM, WALL, NOTHING], (3, 1))
    begin = np.zeros((3, 1, 3))
    low, high = np.tile(LOW, (3, 1)), np.tile(HIGH, (3, 1))
    place = explore(_wells, role, begin, low, high)
    np.testing.assert_allclose(place.aim, -2.0, atol=1e-3)
    assert (place.miss < 1e-6).all()
    np.testing.assert_allclose(place.z[0], [1.4, -1.4, 1.4], atol=0.03)
    alone = explore(_wells, role[:1], begin[:1], low[:1], high[:1])
    np.testing.assert_array_equal(alone.z[0], place.z[0])
    np.testing.assert_array_equal(place.z[2], place.z[0])


def test_least_maximum_of_kinked_numbers_behind_walls():
    """Against SLSQP in epigraph form: the least largest of three quadratics, two walls of which one is met exactly."""
    random = np.random.default_rng(6)
    centres, walls = random.uniform(-1.0, 1.0, (3, 3)), np.array([[1.0, 0.5, 0.2], [-0.3, 1.0, -1.0]])

    def numbers(z, rows):
        aims = ((z[:, None] - centres) ** 2).sum(axis=-1)
        return np.concatenate([aims, z @ walls.T + 0.2], axis=1)

    role = np.array([[AIM, AIM, AIM, WALL, WALL]])
    place = settle(numbers, role, np.array([[[1.5, 1.5, 1.5], [-1.0, 0.0, 1.0]]]), LOW[None], HIGH[None])
    constraints = [
        {"type": "ineq", "fun": lambda v, i=i: v[3] - ((v[:3] - centres[i]) ** 2).sum()} for i in range(3)
    ] + [{"type": "ineq", "fun": lambda v, w=w: -(v[:3] @ w + 0.2)} for w in walls]
    reference = minimize(lambda v: v[3], np.array([0.0, 0.0, 0.0, 5.0]), constraints=constraints, tol=1e-10)
    assert reference.success
    assert place.miss[0] < 1e-3
    np.testing.assert_allclose(place.aim[0], reference.fun, atol=2e-3)


def test_where_walls_leave_no_room_the_largest_miss_is_least():
    def numbers(z, rows):
        return np.stack([z[:, 0] ** 2, z[:, 0] + 1.0, 0.5 - z[:, 0]], axis=1)

    place = settle(numbers, np.array([[AIM, WALL, WALL]]), np.zeros((1, 1, 3)), LOW[None], HIGH[None])
    np.testing.assert_allclose(place.miss, 0.75, atol=0.02)


def test_a_step_of_quadratic_models_is_that_of_their_problem():
    models = Models(
        np.array([[1.0, -0.5]]),
        np.array([[[-1.0, 0.3], [1.0, 0.0]]]),
        np.array([[np.diag([1.0, 2.0]), np.zeros((2, 2))]]),
    )
    step = best_step(models, np.array([[AIM, WALL]]), np.zeros((1, 2)), np.full((1, 2), -3.0), np.full((1, 2), 3.0))
    np.testing.assert_allclose(step.v[0], [0.5, -0.15], atol=1e-3)
    np.testing.assert_allclose(step.push[0], [1.0, 0.5], atol=1e-2)


def test_covering_points_cover():
    points = covering_points(512, 4)
    assert (points >= 0.0).all()
    assert (points < 1.0).all()
    cells = np.floor(points * 4).astype(int) @ 4 ** np.arange(4)
    assert np.unique(cells).size > 0.85 * 256
    assert np.bincount(cells).max() <= 6
