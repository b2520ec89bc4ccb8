"""Trim, motion and linear model with every source of hinge moments."""

from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.hinge_moments.derivatives import first_order
from model.hinge_moments.expansion import Angles
from model.hinge_moments.interpolant import fit_interpolant
from model.hinge_moments.taylor import fit_taylor
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
from model.linearise import linearise
from model.motion import acceleration, required_torque
from model.trim import TrimRequest, trim
from tests.model.hinge_moments.tables import tabulate, uneven_grid
from tests.model.test_linearise import OPTIONS, check_twin, moving_trim

SOURCES = {
    "thin_aerofoil": lambda: examples.wind_tunnel_23012().aerodynamics.source,
    "derivatives": lambda: first_order(fit_interpolant(xfoil_naca23012()), Angles(0.05, 0.1, -0.1)),
    "taylor_1": lambda: fit_taylor(xfoil_naca23012(), 1),
    "taylor_3": lambda: fit_taylor(xfoil_naca23012(), 3, Angles(0.05, 0.0, 0.1)),
    "multilinear": lambda: fit_interpolant(xfoil_naca23012(), "multilinear"),
    "cubic": lambda: fit_interpolant(xfoil_naca23012(), "cubic"),
}


def with_source(source, **options):
    tunnel = examples.wind_tunnel_23012()
    return replace(tunnel, aerodynamics=replace(tunnel.aerodynamics, source=source, **options))


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("name", SOURCES)
def test_model_is_the_derivative_of_the_nonlinear_motion(grid, name, options):
    system = with_source(SOURCES[name](), **options)
    for seed in (0, 1):
        # Small steps: hardly any of them crosses a level of the table, where an interpolant's gradient has a kink.
        check_twin(system, grid.condition, moving_trim(system, grid, seed), steps=(1e-6, 1e-4, 1e-6, 1e-4))


@pytest.mark.parametrize("name", SOURCES)
def test_torque_and_acceleration_are_inverse(grid, name):
    system = with_source(SOURCES[name](), damping="quasi_steady", virtual_inertia=True)
    base = moving_trim(system, grid, 3)
    wanted = np.array([3.0, -7.0])
    torque = required_torque(system, grid.condition, base.alpha, base.state, wanted)
    found = acceleration(system, grid.condition, base.alpha, base.state, torque)
    np.testing.assert_allclose(found, np.broadcast_to(wanted, found.shape), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", SOURCES)
def test_tab_carries_the_aileron(grid, name):
    source = SOURCES[name]()
    system = with_source(source)
    result = trim(system, grid.condition, TrimRequest(0.04, aileron=0.1, tab="zero_aileron_torque"))
    assert np.all(result.reached)
    assert np.max(np.abs(source.at(0.04, result.state[..., 0], 0.1).value[..., 1])) < 1e-14
    assert np.all(source.covers(0.04, result.state[..., 0], 0.1))
    assert np.all(result.state[..., 0] < 0)


@pytest.mark.parametrize("name", SOURCES)
def test_batched_equals_single(grid, name):
    system = with_source(SOURCES[name]())
    base = moving_trim(system, grid, 7)
    model = linearise(system, grid.condition, base)
    for index in np.ndindex(grid.shape):
        single = linearise(system, grid.condition.take(index), base.take(index))
        np.testing.assert_allclose(model.take(index).A, single.A, rtol=1e-12)


@pytest.mark.parametrize("fit", [lambda t: fit_taylor(t, 1), lambda t: fit_taylor(t, 2), fit_interpolant])
@pytest.mark.parametrize("options", OPTIONS)
def test_theory_as_a_table_gives_the_theorys_model(grid, fit, options):
    theory = with_source(SOURCES["thin_aerofoil"](), **options)
    table = with_source(fit(tabulate(theory.aerodynamics.source, uneven_grid())), **options)
    base = moving_trim(theory, grid, 2)
    expected, found = linearise(theory, grid.condition, base), linearise(table, grid.condition, base)
    np.testing.assert_allclose(found.A, expected.A, rtol=1e-9, atol=1e-9)
