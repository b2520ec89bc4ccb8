import itertools

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from schedules.interpolate import interpolate


def nodes(schedule):
    return np.meshgrid(*(np.asarray(axis.values) for axis in schedule.axes), indexing="ij")


def random_points(schedule, count, margin=0.3, seed=1):
    rng = np.random.default_rng(seed)
    edges = [(axis.values[0], axis.values[-1]) for axis in schedule.axes]
    return tuple(rng.uniform(a - margin * (b - a), b + margin * (b - a), count) for a, b in edges)


def clip(schedule, points):
    pairs = zip(schedule.axes, points, strict=True)
    return tuple(np.clip(x, axis.values[0], axis.values[-1]) for axis, x in pairs)


@pytest.mark.parametrize("shape", [(7,), (4, 6), (2, 2), (3, 4, 5)])
def test_agrees_with_scipy_at_random_points(make_schedule, shape):
    schedule = make_schedule(shape)
    points = random_points(schedule, 1000)
    inside = clip(schedule, points)
    found = interpolate(schedule, points)
    for gain, original in zip(found.gains, schedule.gains, strict=True):
        oracle = RegularGridInterpolator([axis.values for axis in schedule.axes], original.values)
        np.testing.assert_allclose(
            gain.values,
            oracle(np.stack(inside, axis=-1)),
            rtol=1e-13,
            atol=1e-15 * np.max(np.abs(original.values)),
        )
        assert (gain.name, gain.unit) == (original.name, original.unit)
    outside = np.any([x != y for x, y in zip(points, inside, strict=True)], axis=0)
    np.testing.assert_array_equal(found.clipped, outside)
    assert 0 < np.count_nonzero(outside) < 1000


@pytest.mark.parametrize("shape", [(7,), (4, 6), (3, 4, 5), (1, 6), (4, 1), (1, 1)])
@pytest.mark.parametrize("failed", [(), ((0, 0), (1, 2))])
def test_nodes_come_back_exactly(make_schedule, shape, failed):
    failed = [p for p in failed if len(p) == len(shape) and all(i < n for i, n in zip(p, shape, strict=True))]
    schedule = make_schedule(shape, failed=failed)
    found = interpolate(schedule, nodes(schedule))
    for gain, original in zip(found.gains, schedule.gains, strict=True):
        np.testing.assert_array_equal(gain.values, original.values)
    assert not np.any(found.clipped)


def test_batch_is_the_single_points(make_schedule):
    schedule = make_schedule((4, 6), failed=[(1, 2)])
    points = random_points(schedule, 30)
    found = interpolate(schedule, points)
    for i, point in enumerate(zip(*points, strict=True)):
        one = interpolate(schedule, point)
        assert one.clipped.shape == ()
        assert one.clipped == found.take(i).clipped
        for a, b in zip(one.gains, found.take(i).gains, strict=True):
            np.testing.assert_array_equal(a.values, b.values)


def test_coordinates_broadcast(make_schedule):
    schedule = make_schedule((4, 6))
    h, q = (np.asarray(axis.values) for axis in schedule.axes)
    found = interpolate(schedule, (h[:, None], q[None, :]))
    np.testing.assert_array_equal(found.gains[0].values, schedule.gains[0].values)


def test_a_failed_point_spoils_only_what_it_carries_weight_for(make_schedule):
    """Every node, edge and inside of the cells: nan exactly where a corner of non-zero weight failed."""
    failed = {(1, 2), (3, 5)}
    schedule = make_schedule((4, 6), failed=failed)
    h, q = (np.asarray(axis.values) for axis in schedule.axes)
    halves = [np.arange(0.0, n - 0.5, 0.5) for n in (4, 6)]
    for i, j in itertools.product(*halves):
        x = np.interp(i, np.arange(4), h), np.interp(j, np.arange(6), q)
        corners = set(itertools.product({int(i), int(np.ceil(i))}, {int(j), int(np.ceil(j))}))
        value = interpolate(schedule, x).gains[0].values
        assert np.isnan(value) == bool(corners & failed), (i, j)


def test_a_number_at_a_failed_point_is_never_used(make_schedule):
    whole, spoilt = make_schedule((4, 6)), make_schedule((4, 6), failed=[(1, 2)])
    mixed = type(whole)(**{**vars(whole), "outcomes": spoilt.outcomes})
    h, q = (axis.values for axis in whole.axes)
    assert np.isnan(interpolate(mixed, (h[1], q[2])).gains[0].values)
    assert not np.isnan(interpolate(whole, (h[1], q[2])).gains[0].values)


@pytest.mark.parametrize(("shape", "single"), [((1, 6), 0), ((4, 1), 1)])
def test_constant_along_an_axis_of_one_breakpoint(make_schedule, shape, single):
    schedule = make_schedule(shape)
    other = schedule.axes[1 - single].values
    x = np.linspace(other[0], other[-1], 50)
    at = schedule.axes[single].values[0]
    for y, clipped in ((at, False), (at - 1.0, True), (at + 1.0, True), (np.inf, True)):
        found = interpolate(schedule, (y, x) if single == 0 else (x, y))
        assert np.all(found.clipped == clipped)
        for gain, original in zip(found.gains, schedule.gains, strict=True):
            line = original.values.ravel()
            np.testing.assert_allclose(gain.values, np.interp(x, other, line), rtol=1e-13, atol=1e-15 * abs(line).max())


def test_infinities_are_clipped_and_nan_is_refused(make_schedule):
    schedule = make_schedule((4, 6))
    found = interpolate(schedule, (-np.inf, np.inf))
    assert found.clipped
    assert found.gains[0].values == schedule.gains[0].values[0, -1]
    with pytest.raises(ValueError, match=r"dynamic_pressure \[Pa\] must be a number"):
        interpolate(schedule, (0.0, np.array([1.0, np.nan])))


@pytest.mark.parametrize("coordinates", [(), (1.0,), (1.0, 2.0, 3.0)])
def test_one_coordinate_an_axis(make_schedule, coordinates):
    with pytest.raises(ValueError, match="2 axes"):
        interpolate(make_schedule((4, 6)), coordinates)


def test_results_are_read_only(make_schedule):
    found = interpolate(make_schedule((4, 6)), (np.zeros(3), np.zeros(3)))
    with pytest.raises(ValueError, match="read-only"):
        found.gains[0].values[0] = 1.0
