import numpy as np
import scipy.linalg

from model import examples
from model.linearise import linearise
from model.modes import modes, tracked_modes
from model.trim import trim

RNG = np.random.default_rng(2)
C = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])


def test_eigenvectors_diagonalise_the_model(example, grid):
    # Seed 2.4.1 to 2.4.9: X = V Xbar (2.4.3 prints the inverse), Fbar = Lambda, Cbar = C V.
    model = linearise(example, grid.condition, trim(example, grid.condition, examples.WIND_TUNNEL_TRIM))
    found = modes(model.A, model.C)
    for index in ((0, 0), (3, 2)):
        values, vectors = scipy.linalg.eig(model.A[index])
        order = [int(np.argmin(np.abs(values - value))) for value in found.eigenvalues[index]]
        assert sorted(order) == [0, 1, 2, 3]
        V = vectors[:, order]
        np.testing.assert_allclose(found.eigenvalues[index], values[order], rtol=1e-10)
        np.testing.assert_allclose(np.linalg.norm(V, axis=0), 1.0)
        np.testing.assert_allclose(found.output[index], np.abs(model.C[index] @ V), rtol=1e-9)
        diagonal = np.linalg.solve(V, model.A[index] @ V)
        np.testing.assert_allclose(np.diag(diagonal), values[order], rtol=1e-9)


def test_participation_does_not_depend_on_units():
    A = RNG.normal(size=(20, 4, 4))
    units = np.array([1.0, 57.3, 0.001, 12.0])
    scaled = units[:, None] * A / units
    one, other = modes(A, C), modes(scaled, C)
    np.testing.assert_allclose(one.eigenvalues, other.eigenvalues, rtol=1e-8)
    np.testing.assert_allclose(one.participation, other.participation, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(one.participation.sum(axis=-2), 1.0)
    assert np.max(np.abs(one.output - other.output)) > 0.1


def test_uncoupled_modes_belong_to_their_states():
    A = np.zeros((4, 4))
    A[:2, :2], A[2:, 2:] = [[0.0, 1.0], [-9.0, -1.0]], [[0.0, 1.0], [-25.0, -2.0]]
    found = modes(A, C)
    slow = np.abs(np.abs(found.eigenvalues) - 3.0) < 1e-9
    assert np.sum(slow) == 2
    np.testing.assert_allclose(found.participation[:2, slow].sum(axis=0), 1.0)
    np.testing.assert_allclose(found.participation[2:, slow], 0.0, atol=1e-14)
    np.testing.assert_allclose(found.output[1, slow], 0.0, atol=1e-14)
    np.testing.assert_allclose(np.sort(found.damping_ratio), [1 / 6, 1 / 6, 0.2, 0.2], rtol=1e-12)
    np.testing.assert_allclose(np.sort(found.natural_frequency), [3.0, 3.0, 5.0, 5.0], rtol=1e-12)


def test_shared_eigenvectors_have_no_participation():
    found = modes(np.array([[0.0, 1.0], [0.0, 0.0]]), np.eye(2))
    assert np.all(np.isnan(found.participation))
    np.testing.assert_array_equal(found.eigenvalues, 0.0)
    assert np.all(np.isnan(found.damping_ratio))


def test_tracked_modes_are_the_same_modes_in_another_order():
    A = RNG.normal(size=(3, 8, 4, 4))
    plain, tracked = modes(A, C), tracked_modes(A, C)
    for index in np.ndindex(3, 8):
        order = [int(np.argmin(np.abs(plain.eigenvalues[index] - v))) for v in tracked.eigenvalues[index]]
        assert sorted(order) == [0, 1, 2, 3]
        np.testing.assert_array_equal(tracked.output[index], plain.output[index][:, order])
        np.testing.assert_array_equal(tracked.participation[index], plain.participation[index][:, order])
    np.testing.assert_array_equal(tracked.eigenvalues[:, 0], plain.eigenvalues[:, 0])


def test_batched_equals_single():
    A = RNG.normal(size=(3, 8, 4, 4))
    batch = tracked_modes(A, C)
    for i in range(3):
        single = tracked_modes(A[i], C)
        np.testing.assert_array_equal(batch.eigenvalues[i], single.eigenvalues)
        np.testing.assert_allclose(batch.participation[i], single.participation, rtol=1e-10)
