"""Conditions and sources shared by the tests of the model."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from model import examples
from model.aerodynamics import Aerodynamics
from model.flight import flight_condition, flight_grid
from model.hinge_moments.expansion import HingeMoments, every_angle
from model.system import TabAileron

# Linear part of the made-up source: rows [tab, aileron], columns alpha, dt, da.
LINEAR = np.array([[-0.004, 0.010, 0.006], [-0.05, 0.12, 0.08]])
QUADRATIC = np.array([[0.002, -0.013, 0.004], [0.03, 0.05, -0.06]])
CUBIC = np.array([[0.011, 0.024, -0.017], [-0.08, 0.2, 0.15]])


@dataclass(frozen=True)
class PolynomialSource:
    """A source that is not linear and couples its angles, with its exact gradient."""

    offset: tuple[float, float] = (-0.0002, -0.002)

    def at(self, alpha, dt, da):
        angles = np.stack(np.broadcast_arrays(*(np.asarray(v, float) for v in (alpha, dt, da))), axis=-1)
        x = angles[..., None, :]
        product = np.prod(x, axis=-1)
        value = np.asarray(self.offset) + np.sum(LINEAR * x + QUADRATIC * x**2 + CUBIC * x**3, axis=-1)
        others = np.stack([x[..., 1] * x[..., 2], x[..., 0] * x[..., 2], x[..., 0] * x[..., 1]], axis=-1)
        gradient = LINEAR + 2 * QUADRATIC * x + 3 * CUBIC * x**2 + others
        return HingeMoments(value + product, gradient)

    def covers(self, alpha, dt, da):
        return every_angle(alpha, dt, da)

    domain = "every angle"


@pytest.fixture(scope="session")
def polynomial_system():
    tunnel = examples.wind_tunnel_23012()
    return TabAileron(tunnel.geometry, tunnel.inertia, Aerodynamics(PolynomialSource()))


@pytest.fixture(scope="session")
def polynomial_source():
    return PolynomialSource()


@pytest.fixture(scope="session")
def tunnel_condition():
    """50 m/s in air of exactly 1.225 kg/m^3."""
    standard = flight_condition(0.0, "airspeed", 50.0)
    air = replace(standard.air, density=np.array(1.225))
    return replace(standard, air=air, dynamic_pressure=np.array(0.5 * 1.225 * 50.0**2))


@pytest.fixture(scope="session")
def grid():
    """Five altitudes by four dynamic pressures, Mach 0.06 to 0.7."""
    return flight_grid(np.linspace(0.0, 12000.0, 5), "dynamic_pressure", np.array([245.0, 980.0, 3000.0, 6500.0]))


@pytest.fixture(params=["wind_tunnel", "wind_tunnel_23012", "airliner_aileron"])
def example(request):
    return getattr(examples, request.param)()


def variant(system, **options):
    """The same section with other aerodynamic options."""
    return replace(system, aerodynamics=replace(system.aerodynamics, **options))


@pytest.fixture(scope="session", name="variant")
def _variant():
    return variant
