from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from model import examples
from model.flight import flight_condition, flight_grid
from model.linear_model import INPUTS, OUTPUTS, STATES
from model.linearise import linearise
from model.motion import acceleration
from model.trim import TrimRequest, trim

OPTIONS = [
    {"damping": "thesis"},
    {"damping": "thesis", "virtual_inertia": True},
    {"damping": "quasi_steady"},
    {"damping": "quasi_steady", "virtual_inertia": True},
    {"damping": "quasi_steady", "compressibility": "prandtl_glauert"},
]
REQUEST = TrimRequest(0.08, aileron=0.1, tab=-0.05)


def moving_trim(system, grid, seed):
    """A trim at random angles and rates over the grid: linearisation does not need equilibrium."""
    rng = np.random.default_rng(seed)
    rest = trim(system, grid.condition, REQUEST)
    state = rng.uniform(-1.0, 1.0, (*grid.shape, 4)) * np.array([0.4, 15.0, 0.4, 8.0])
    return replace(rest, state=state, alpha=rng.uniform(-0.1, 0.15, grid.shape))


def finite_differences(system, condition, base, steps=(1e-5, 1e-3, 1e-5, 1e-3)):
    """Rows of A and B for the accelerations, from the non-linear equations of motion."""

    def motion(state, torque):
        return acceleration(system, condition, base.alpha, state, torque)

    columns = []
    for k, size in enumerate(steps):
        step = np.zeros(4)
        step[k] = size
        difference = motion(base.state + step, base.torque) - motion(base.state - step, base.torque)
        columns.append(difference / (2 * size))
    inputs = []
    for k in range(2):
        step = np.zeros(2)
        step[k] = 1.0
        inputs.append(0.5 * (motion(base.state, base.torque + step) - motion(base.state, base.torque - step)))
    return np.stack(columns, axis=-1), np.stack(inputs, axis=-1)


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_model_is_the_derivative_of_the_nonlinear_motion(example, grid, variant, options, seed):
    system = variant(example, **options)
    base = moving_trim(system, grid, seed)
    check_twin(system, grid.condition, base)


@pytest.mark.parametrize("options", OPTIONS)
def test_model_is_the_derivative_for_a_nonlinear_source_too(polynomial_system, grid, variant, options):
    system = variant(polynomial_system, **options)
    for seed in range(4):
        check_twin(system, grid.condition, moving_trim(system, grid, seed))


def check_twin(system, condition, base, steps=(1e-5, 1e-3, 1e-5, 1e-3)):
    model = linearise(system, condition, base)
    by_state, by_torque = finite_differences(system, condition, base, steps)
    exact = model.A[..., 1::2, :]
    # Column by column: angles and rates have different units and sizes.
    size = np.abs(exact).max(axis=-2, keepdims=True)
    assert np.max(np.abs(by_state - exact) / size) < 1e-6
    np.testing.assert_allclose(by_torque, model.B[..., 1::2, :], rtol=1e-6)


def test_trim_rate_reaches_the_tab_column_as_in_the_seed(tunnel_condition):
    # Seed 2.3.8 and 2.3.12: the factor 1 - da0' sin(dt0) ca / V on the tab's stiffness.
    system = examples.wind_tunnel_23012()
    rest = trim(system, tunnel_condition, REQUEST)
    moving = replace(rest, state=np.array([0.3, 0.0, 0.1, 7.0]))
    still = linearise(system, tunnel_condition, rest).stiffness
    model = linearise(system, tunnel_condition, moving).stiffness
    np.testing.assert_allclose(model[:, 0] / still[:, 0], 1 - 7.0 * np.sin(0.3) * 0.18 / 50.0, rtol=1e-13)
    np.testing.assert_allclose(model[:, 1], still[:, 1], rtol=1e-13)


def test_thesis_derivatives_written_out(tunnel_condition):
    # Seed 2.3.8 to 2.3.15 with the span; C_H derivatives from the source.
    system = examples.wind_tunnel_23012()
    base = trim(system, tunnel_condition, REQUEST)
    model = linearise(system, tunnel_condition, base)
    (tt, ta), (at, aa) = system.aerodynamics.source.gradient[:, 1:]
    load, V, ca, ct = 0.5 * 1.225 * 2500 * 0.36 * 0.8, 50.0, 0.18, 0.072
    lever = np.cos(-0.05) * ca / V
    stiffness = -load * np.array([[tt, ta], [at, aa]])
    damping = -load * np.array(
        [
            [ct / (4 * V) * tt, lever * tt + ca / (4 * V) * ta],
            [ct / (4 * V) * at, lever * at + ca / (4 * V) * aa],
        ]
    )
    np.testing.assert_allclose(model.stiffness, stiffness, rtol=1e-13)
    np.testing.assert_allclose(model.damping, damping, rtol=1e-13)


def test_matrices_fit_together(example, grid):
    model = linearise(example, grid.condition, trim(example, grid.condition, REQUEST))
    assert (model.states, model.inputs, model.outputs) == (STATES, INPUTS, OUTPUTS)
    assert model.A.shape == (*grid.shape, 4, 4)
    assert model.B.shape == (*grid.shape, 4, 2)
    np.testing.assert_array_equal(model.A[..., 0::2, :], np.broadcast_to(np.eye(4)[1::2], (*grid.shape, 2, 4)))
    np.testing.assert_array_equal(model.B[..., 0::2, :], 0.0)
    np.testing.assert_array_equal(model.C, np.broadcast_to(np.eye(4)[0::2], (*grid.shape, 2, 4)))
    np.testing.assert_array_equal(model.D, np.zeros((*grid.shape, 2, 2)))
    J = model.inertia
    np.testing.assert_allclose(J @ model.A[..., 1::2, 0::2], model.stiffness, rtol=1e-10)
    np.testing.assert_allclose(J @ model.A[..., 1::2, 1::2], model.damping, rtol=1e-10)
    np.testing.assert_array_equal(model.state_offset, np.broadcast_to([-0.05, 0, 0.1, 0], (*grid.shape, 4)))


@pytest.mark.parametrize("options", OPTIONS)
def test_inertia_is_symmetric_positive_definite(example, grid, variant, options):
    system = variant(example, **options)
    J = linearise(system, grid.condition, trim(system, grid.condition, REQUEST)).inertia
    np.testing.assert_allclose(J, np.swapaxes(J, -1, -2), rtol=1e-13)
    assert np.all(np.linalg.eigvalsh(J) > 0)


def test_virtual_inertia_adds_the_air_and_thins_with_altitude(variant):
    system = variant(examples.wind_tunnel(), virtual_inertia=True)
    condition = flight_condition(np.array([0.0, 10000.0]), "airspeed", np.array([[30.0], [60.0]]))
    added = system.moving_inertia(condition) - system.inertia_matrix
    np.testing.assert_allclose(added[0], added[1], rtol=1e-12)
    ratio = condition.air.density[0, 1] / condition.air.density[0, 0]
    np.testing.assert_allclose(added[:, 1], ratio * added[:, 0], rtol=1e-10)


@given(
    speeds=st.tuples(st.floats(5.0, 300.0), st.floats(5.0, 300.0)),
    altitude=st.floats(-1000.0, 20000.0),
    name=st.sampled_from(["wind_tunnel", "wind_tunnel_23012", "airliner_aileron"]),
    options=st.sampled_from(OPTIONS[:4]),
)
@settings(max_examples=60, deadline=None)
def test_eigenvalues_are_proportional_to_airspeed(speeds, altitude, name, options):
    system = getattr(examples, name)()
    aerodynamics = replace(system.aerodynamics, **{"compressibility": "none", **options})
    system = replace(system, aerodynamics=aerodynamics)
    condition = flight_condition(altitude, "airspeed", np.array(speeds))
    model = linearise(system, condition, trim(system, condition, REQUEST))
    slow, fast = np.sort_complex(np.linalg.eigvals(model.A))
    np.testing.assert_allclose(slow / speeds[0], fast / speeds[1], rtol=1e-10)
    np.testing.assert_allclose(-slow.real / np.abs(slow), -fast.real / np.abs(fast), atol=1e-10)


def test_compressibility_stiffens_and_leaves_virtual_inertia(variant):
    plain = variant(examples.airliner_aileron(), compressibility="none", virtual_inertia=True)
    corrected = variant(plain, compressibility="prandtl_glauert")
    condition = flight_condition(3000.0, "mach", 0.6)
    a, b = (linearise(s, condition, trim(s, condition, REQUEST)) for s in (plain, corrected))
    np.testing.assert_allclose(b.stiffness, 1.25 * a.stiffness, rtol=1e-13)
    np.testing.assert_allclose(b.damping, 1.25 * a.damping, rtol=1e-13)
    np.testing.assert_array_equal(b.inertia, a.inertia)
    np.testing.assert_allclose(b.input_offset, 1.25 * a.input_offset, rtol=1e-13)


def test_supersonic_points_are_refused_by_the_correction():
    system = examples.airliner_aileron()
    condition = flight_condition(0.0, "mach", np.array([0.5, 1.2]))
    with pytest.raises(ValueError, match="Mach"):
        trim(system, condition, REQUEST)
    inside = condition.take(system.aerodynamics.covers(condition.mach))
    assert linearise(system, inside, trim(system, inside, REQUEST)).A.shape == (1, 4, 4)


@pytest.mark.parametrize("options", OPTIONS)
def test_batched_equals_single(example, grid, variant, options):
    system = variant(example, **options)
    base = moving_trim(system, grid, 7)
    model = linearise(system, grid.condition, base)
    for index in np.ndindex(grid.shape):
        point = model.take(index)
        single = linearise(system, grid.condition.take(index), base.take(index))
        for name in ("C", "D", "state_offset", "input_offset", "inertia"):
            np.testing.assert_array_equal(getattr(point, name), getattr(single, name))
        for name in ("A", "B", "damping", "stiffness"):
            np.testing.assert_allclose(getattr(point, name), getattr(single, name), rtol=1e-12)


def test_a_thousand_points_in_one_call(example):
    grid = flight_grid(np.linspace(0, 9000, 25), "dynamic_pressure", np.linspace(200, 6000, 40))
    model = linearise(example, grid.condition, trim(example, grid.condition, REQUEST))
    assert model.A.shape == (25, 40, 4, 4)
    assert np.all(np.isfinite(model.A))


def test_geometry_may_vary_instead_of_the_condition(tunnel_condition):
    from model.aerodynamics import Aerodynamics
    from model.hinge_moments.thin_aerofoil import ThinAerofoil
    from model.section import Geometry
    from model.system import TabAileron

    tab_hinge, bodies = np.array([0.8, 0.9, 0.97]), examples.wind_tunnel().inertia

    def system(hinge):
        return TabAileron(Geometry(0.6, 0.8, 0.7, hinge), bodies, Aerodynamics(ThinAerofoil(0.7, hinge)))

    sweep = system(tab_hinge)
    model = linearise(sweep, tunnel_condition, trim(sweep, tunnel_condition, REQUEST))
    assert model.A.shape == (3, 4, 4)
    for i, hinge in enumerate(tab_hinge):
        single = linearise(system(hinge), tunnel_condition, trim(system(hinge), tunnel_condition, REQUEST))
        np.testing.assert_allclose(model.A[i], single.A, rtol=1e-12)
