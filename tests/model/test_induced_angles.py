import numpy as np

from model.induced_angles import induced_angle_derivatives, induced_angles
from model.section import Geometry

GEOMETRY = Geometry(0.6, 0.8, 0.7, 0.88)
RNG = np.random.default_rng(3)
STATES = RNG.uniform(-1.0, 1.0, (20, 4)) * np.array([0.5, 20.0, 0.5, 10.0])
AIRSPEED = RNG.uniform(10.0, 80.0, 20)


def test_angles_are_those_of_the_seed():
    # Seed 2.2.12 and 2.2.13, written out: aileron chord 0.18 m, tab chord 0.072 m.
    dt, tab_rate, _, aileron_rate = STATES.T
    tab = (aileron_rate * np.cos(dt) * 0.18 + 0.072 / 4 * tab_rate) / AIRSPEED
    aileron = 0.18 / 4 * aileron_rate / AIRSPEED
    np.testing.assert_allclose(
        induced_angles(GEOMETRY, AIRSPEED, STATES), np.stack([tab, aileron], axis=-1), rtol=1e-13
    )


def test_derivatives_match_finite_differences():
    exact = induced_angle_derivatives(GEOMETRY, AIRSPEED, STATES)
    for k in range(4):
        step = np.zeros(4)
        step[k] = 1e-6
        forward, backward = (induced_angles(GEOMETRY, AIRSPEED, STATES + d) for d in (step, -step))
        np.testing.assert_allclose(exact[..., k], (forward - backward) / 2e-6, atol=1e-9)


def test_batched_equals_single():
    angles = induced_angles(GEOMETRY, AIRSPEED, STATES)
    derivatives = induced_angle_derivatives(GEOMETRY, AIRSPEED, STATES)
    for i in range(20):
        np.testing.assert_array_equal(angles[i], induced_angles(GEOMETRY, AIRSPEED[i], STATES[i]))
        np.testing.assert_array_equal(derivatives[i], induced_angle_derivatives(GEOMETRY, AIRSPEED[i], STATES[i]))
