import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from model.flight import flight_condition
from model.motion import acceleration, aerodynamic_torque, required_torque

OPTIONS = [
    {"damping": "thesis"},
    {"damping": "quasi_steady"},
    {"damping": "quasi_steady", "virtual_inertia": True, "compressibility": "prandtl_glauert"},
    {"damping": "thesis", "virtual_inertia": True},
]


def random_states(shape, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.0, 1.0, (*shape, 4)) * np.array([0.4, 20.0, 0.4, 10.0])


@pytest.mark.parametrize("options", OPTIONS)
def test_required_torque_is_the_inverse_of_acceleration(example, grid, variant, options):
    system = variant(example, **options)
    states = random_states(grid.shape)
    torque = np.random.default_rng(1).uniform(-2.0, 2.0, (*grid.shape, 2))
    accelerations = acceleration(system, grid.condition, 0.08, states, torque)
    back = required_torque(system, grid.condition, 0.08, states, accelerations)
    scale = np.abs(aerodynamic_torque(system, grid.condition, 0.08, states)).max(axis=-1, keepdims=True) + 2.0
    assert np.max(np.abs(back - torque) / scale) < 1e-12


def test_equations_are_those_of_the_seed_written_out(tunnel_condition, polynomial_system):
    # Seed 2.2.17 with the span, for one state, number by number (data set B, ca 0.18 m, ct 0.072 m).
    dt, tab_rate, da, aileron_rate = state = np.array([0.2, 12.0, -0.1, -6.0])
    V, alpha = 50.0, 0.08
    tab = dt + (aileron_rate * np.cos(dt) * 0.18 + 0.072 / 4 * tab_rate) / V
    aileron = da + 0.18 / 4 * aileron_rate / V
    C_H = polynomial_system.aerodynamics.source.at(alpha, tab, aileron).value
    load = 0.5 * 1.225 * V**2 * 0.6**2 * 0.8
    l_cg = (0.88 - 0.70) * 0.6 + 0.0005
    J = np.array(
        [
            [3.5e-4 + 0.08 * 0.0005**2, 3.5e-4 + 0.08 * 0.0005 * l_cg],
            [3.5e-4 + 0.08 * 0.0005 * l_cg, 7e-3 + 3.5e-4 + 0.9 * 0.01**2 + 0.08 * l_cg**2],
        ]
    )
    torque = np.array([0.3, -1.2])
    expected = np.linalg.solve(J, torque - load * C_H)
    actual = acceleration(polynomial_system, tunnel_condition, alpha, state, torque)
    np.testing.assert_allclose(actual, expected, rtol=1e-12)


def test_air_resists_a_deflection_and_a_rate(example, grid):
    calm = np.zeros((*grid.shape, 4))
    base = aerodynamic_torque(example, grid.condition, 0.0, calm)
    for column, surface in ((0, 0), (1, 0), (2, 1), (3, 1)):
        moved = calm.copy()
        moved[..., column] = 0.1
        change = aerodynamic_torque(example, grid.condition, 0.0, moved) - base
        assert np.all(change[..., surface] < 0)


def test_incidence_floats_the_surfaces_up(example, grid):
    calm = np.zeros((*grid.shape, 4))
    change = aerodynamic_torque(example, grid.condition, 0.1, calm) - aerodynamic_torque(
        example, grid.condition, 0.0, calm
    )
    assert np.all(change > 0)


@pytest.mark.parametrize("options", OPTIONS)
def test_batched_equals_single(example, grid, variant, options):
    system = variant(example, **options)
    states, torque = random_states(grid.shape), random_states((*grid.shape,), 5)[..., :2]
    alpha = np.linspace(-0.1, 0.1, 4)
    forward = acceleration(system, grid.condition, alpha, states, torque)
    inverse = required_torque(system, grid.condition, alpha, states, torque)
    assert forward.shape == inverse.shape == (*grid.shape, 2)
    for i, j in np.ndindex(grid.shape):
        point = grid.condition.take((i, j))
        single = acceleration(system, point, alpha[j], states[i, j], torque[i, j])
        np.testing.assert_allclose(forward[i, j], single, rtol=1e-13)
        single = required_torque(system, point, alpha[j], states[i, j], torque[i, j])
        np.testing.assert_allclose(inverse[i, j], single, rtol=1e-13)


@settings(max_examples=20, deadline=None)
@given(
    start=st.tuples(*[st.floats(-0.3, 0.3), st.floats(-20.0, 20.0)] * 2),
    torque=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
)
def test_energy_is_conserved_with_the_air_off(start, torque):
    """What the actuators put in is what the bodies' kinetic energy gains; without torque it stays as it is."""
    from model.examples import wind_tunnel

    system = wind_tunnel()
    still = flight_condition(0.0, "airspeed", 1e-7)
    J = system.inertia_matrix

    def motion(t, x, T):
        dt2, da2 = acceleration(system, still, 0.1, x, np.array(T))
        return [x[1], dt2, x[3], da2]

    def kinetic(x):
        rates = np.array([x[1], x[3]])
        return 0.5 * rates @ J @ rates

    for T in ((0.0, 0.0), torque):
        end = solve_ivp(motion, (0.0, 0.3), start, args=(T,), rtol=1e-10, atol=1e-12).y[:, -1]
        work = T[0] * (end[0] - start[0]) + T[1] * (end[2] - start[2])
        scale = kinetic(start) + kinetic(end) + 1e-6
        assert abs(kinetic(end) - kinetic(start) - work) < 1e-7 * scale
