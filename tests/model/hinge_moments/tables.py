"""Tables and angles shared by the tests of tabulated hinge moments."""

import numpy as np

from model.hinge_moments.table import table_of_rows


def grid_angles(alpha, dt, da):
    """Rows (n, 3) of every combination of these angles [rad]."""
    return np.stack(np.meshgrid(alpha, dt, da, indexing="ij"), axis=-1).reshape(-1, 3)


def tabulate(source, angles):
    """Table of a source at rows of angles (n, 3)."""
    alpha, dt, da = np.asarray(angles).T
    tab, aileron = source.at(alpha, dt, da).value.T
    return table_of_rows(alpha=alpha, da=da, dt=dt, C_Ha=aileron, C_Ht=tab)


def uneven_grid():
    """A grid of uneven steps, 5 by 7 by 6, within +/-0.4 rad."""
    rng = np.random.default_rng(3)
    return grid_angles(*(np.linspace(-0.4, 0.4, n) + rng.uniform(-0.02, 0.02, n) for n in (5, 7, 6)))


def random_angles(shape, seed=0, within=0.35):
    """Angles alpha, dt, da of this shape [rad]."""
    return np.random.default_rng(seed).uniform(-within, within, (3, *shape))


def gradient_by_differences(source, alpha, dt, da, step=1e-6):
    """Central differences (*G, 2, 3) of a source's values."""
    angles, columns = np.stack([alpha, dt, da]), []
    for k in range(3):
        turn = np.zeros((3, *(1,) * (angles.ndim - 1)))
        turn[k] = step
        columns.append((source.at(*(angles + turn)).value - source.at(*(angles - turn)).value) / (2 * step))
    return np.stack(columns, axis=-1)


def assert_batched_is_single(source, angles):
    """A source gives over a batch (3, n, m) what it gives for each point, to the last bit."""
    whole, covered = source.at(*angles), source.covers(*angles)
    for index in np.ndindex(angles.shape[1:]):
        point = [float(a[index]) for a in angles]
        single = source.at(*point)
        assert single.value.shape == (2,)
        np.testing.assert_array_equal(whole.take(index).value, single.value)
        np.testing.assert_array_equal(whole.take(index).gradient, single.gradient)
        assert bool(source.covers(*point)) == covered[index]
