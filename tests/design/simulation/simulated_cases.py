"""Plants and loops that are simulated, and the same equations written out for scipy's integrators."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.lqr.flown import flown_loop
from design.lqr.structures import Structure
from design.lqr.synthesis import LqrController, design_lqr
from design.simulation.plant import NonlinearPlant
from model.actuators import Actuator
from model.aerodynamics import Aerodynamics
from model.examples import WIND_TUNNEL_TRIM, wind_tunnel, wind_tunnel_23012
from model.flight import flight_grid
from model.hinge_moments.taylor import fit_taylor
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
from model.linearise import linearise
from model.motion import aerodynamic_torque
from model.servo_tab import servo_tab
from model.system import TabAileron
from model.trim import TrimRequest, trim
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS

SERVO = Actuator(2.0 * np.pi * 40.0, 0.7, 2.0 * np.pi * 80.0)
GAINS = {"K_theta": 100.0, "K_p": 0.3, "K_d": 0.01, "K_i": 3.0, "K_f": 0.3}


@cache
def plant(kind="thesis", floating=False):
    """Two altitudes by three pressures: system, condition, trim, model, servo and non-linear plant."""
    if kind == "table":
        base = wind_tunnel_23012()
        source = fit_taylor(xfoil_naca23012(), 3)
        system = TabAileron(base.geometry, base.inertia, Aerodynamics(source))
    else:
        base = wind_tunnel()
        aerodynamics = Aerodynamics(base.aerodynamics.source, kind, virtual_inertia=kind != "thesis")
        system = TabAileron(base.geometry, base.inertia, aerodynamics)
    grid = flight_grid(np.array([0.0, 3000.0]), "dynamic_pressure", np.array([245.0, 551.25, 980.0]))
    request = TrimRequest(WIND_TUNNEL_TRIM.alpha, aileron="zero_aileron_torque") if floating else WIND_TUNNEL_TRIM
    found = trim(system, grid.condition, request)
    model = linearise(system, grid.condition, found)
    return SimpleNamespace(
        system=system, condition=grid.condition, trim=found, model=model, servo=servo_tab(model),
        nonlinear=NonlinearPlant.of(system, grid.condition, found, model),
    )  # fmt: skip


def torque_loop(p, structure=None):
    """State feedback of both torques; behind lags or delays the gains of the plain structure."""
    design = design_lqr(p.model, LqrController("lqr", WIND_TUNNEL_WEIGHTS))
    structure = structure or Structure()
    K = design.K
    if len(structure.states(p.model.states)) > K.shape[-1]:
        K = np.zeros((*K.shape[:-1], len(structure.states(p.model.states))))
        plain = Structure().states(p.model.states)
        for i, name in enumerate(plain):
            K[..., structure.states(p.model.states).index(name)] = design.K[..., i]
    return flown_loop(p.model, structure, K, design.N)


def tab_only(p, kind="negative_feedback", command="deflection", actuator=SERVO, rate_filter=600.0, **gains):
    """A tab-only loop with gains that are stable at every point."""
    controller = ClassicalController("tab", kind, (), rate_filter, command)
    values = {**GAINS, **gains}
    grid = p.model.A.shape[:-2]
    return tab_loop(
        p.model, p.servo, actuator, controller, {k: np.full(grid, values[k]) for k in controller.gain_units}
    )


def air_of(p, index):
    """Torques of the air (2,) of one point at total angles and rates, by `model.motion`."""
    condition, alpha = p.condition.take(index), p.trim.alpha[index]

    def air(dt, dt_rate, da, da_rate):
        return aerodynamic_torque(p.system, condition, alpha, np.array([dt, dt_rate, da, da_rate]))

    return air


def followed(f, y, stretches, at):
    """States (T, n) of ``y' = f(t, y)`` at times, DOP853 to 1e-10, begun anew at the end of each stretch."""
    found, begin = [], 0.0
    for end in stretches:
        done = solve_ivp(f, (begin, end), y, "DOP853", dense_output=True, rtol=1e-10, atol=1e-13)
        last = end == stretches[-1]
        inside = at[(at >= begin - 1e-12) & ((at < end - 1e-12) | last)]
        found.append(done.sol(inside).T)
        begin, y = end, done.y[:, -1]
    return np.concatenate(found)


def one(p, loop, index=(1, 2)):
    """Plant and loop of one point."""
    return p.nonlinear.take(index), loop.take(index)
