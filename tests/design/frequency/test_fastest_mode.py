"""Which mode of a loop counts as the surfaces' fastest."""

import numpy as np
import pytest

from design.frequency.fastest_mode import fastest_surface_mode

STATES = ("dt", "dt_rate", "da", "da_rate", "int_a", "filter")


def _pair(frequency, ratio):
    return np.array([[0.0, 1.0], [-(frequency**2), -2.0 * ratio * frequency]])


def _blocks(*blocks):
    n = sum(len(b) for b in blocks)
    A, at = np.zeros((n, n)), 0
    for b in blocks:
        A[at : at + len(b), at : at + len(b)] = b
        at += len(b)
    return A


# A tab at 200, an aileron at 60, an integral at 1 and a filter at 900 rad/s, not coupled but for a weak touch.
APART = _blocks(_pair(200.0, 0.7), _pair(60.0, 0.3), np.array([[-1.0]]), np.array([[-900.0]]))


def test_filters_integrals_and_imposed_surfaces_do_not_count():
    aileron = fastest_surface_mode(APART, STATES, ("da",))
    assert complex(aileron) == pytest.approx(60.0 * (-0.3 + 1j * np.sqrt(1 - 0.09)), rel=1e-9)
    both = fastest_surface_mode(APART, STATES, ("dt", "da"))
    assert complex(both) == pytest.approx(200.0 * (-0.7 + 1j * np.sqrt(1 - 0.49)), rel=1e-9)


def test_a_real_mode_of_a_surface_counts():
    A = _blocks(np.array([[0.0, 1.0], [-300.0 * 20.0, -320.0]]), _pair(60.0, 0.3), -np.eye(1), np.array([[-900.0]]))
    assert complex(fastest_surface_mode(A, STATES, ("dt", "da"))) == pytest.approx(-300.0, rel=1e-9)


def test_units_do_not_matter():
    scale = np.array([1.0, 1e-3, 57.3, 1.0, 1e2, 1e-4])
    touch = APART + 0.5 * np.random.default_rng(2).standard_normal(APART.shape)
    touch = np.stack([touch, touch / scale[:, None] * scale])
    one, other = fastest_surface_mode(touch, STATES, ("da",))
    assert one == pytest.approx(other, rel=1e-8)


def test_a_mode_whose_share_cannot_be_told_counts():
    A = _blocks(np.array([[-50.0, 1.0], [0.0, -50.0]]), _pair(30.0, 0.3), -np.eye(1), np.array([[-900.0]]))
    assert abs(complex(fastest_surface_mode(A, STATES, ("da",)))) == pytest.approx(900.0)


@pytest.mark.parametrize("damping", ["thesis", "unsteady"])
def test_batched_equals_single(plant_a, unsteady_a, damping):
    model = unsteady_a.model if damping == "unsteady" else plant_a.model
    whole = fastest_surface_mode(model.A, model.states, ("dt", "da"))
    assert whole.shape == plant_a.grid.shape
    for index in np.ndindex(whole.shape):
        assert whole[index] == pytest.approx(
            complex(fastest_surface_mode(model.A[index], model.states, ("dt", "da"))), rel=1e-10
        )
