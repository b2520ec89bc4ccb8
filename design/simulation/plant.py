"""What the non-linear plant adds to the linear one: the air's torque beyond its linear part, point by point.

The loop that is flown stays the linear `Loop`, with its controller, drives, filters and integrals; only the surface
accelerations are replaced. With x the deviations from trim and R the torque of the air that its linear part misses,

    x' = A x + B v + E r + J^-1 R(x),     R(x) = M(x0 + x) - M(x0) - (dM/dx) x

so the linear and the non-linear simulation cannot disagree about the controller, and agree to second order.
Everything linear in the motion (rate derivatives, lag states, virtual inertia) cancels in R exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, GridArrays
from model.flight import FlightCondition
from model.hinge_moments.derivatives import Derivatives
from model.hinge_moments.expansion import HingeMomentSource
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from model.linear_model import LinearModel
from model.system import TabAileron
from model.trim import Trim


@dataclass(frozen=True, eq=False)
class NonlinearPlant(GridArrays):
    """The section in its trims over the grid, as `model.linearise.linearise` took them.

    Attributes
    ----------
    source : steady hinge moments
    linear_source : whether they are linear in the angles, so that only the thesis's cosine is not
    thesis : whether motion acts by induced angles (seed 2.2.12, 2.2.13)
    alpha : (*G,) incidence [rad]
    angles : (*G, 2) trim angles, order [tab, aileron] [rad]
    load : (*G,) torque of a unit hinge-moment coefficient, compressibility included [N m]
    value : (*G, 2) coefficients at the trim [-]
    gradient : (*G, 2, 2) by the angles, rows and columns [tab, aileron] [1/rad]
    levers : (*G, 3) ``ca/V, ct/4V, ca/4V``: induced angles by the rates [s]
    model : (*G, ...) the linear model
    """

    source: HingeMomentSource
    linear_source: bool
    thesis: bool
    alpha: FloatArray
    angles: FloatArray
    load: FloatArray
    value: FloatArray
    gradient: FloatArray
    levers: FloatArray
    model: LinearModel

    @classmethod
    def of(cls, system: TabAileron, condition: FlightCondition, trim: Trim, model: LinearModel) -> NonlinearPlant:
        """The plant of a linear model, from what it was linearised from.

        Parameters
        ----------
        system, condition, trim, model : over one grid (*G); points whose model is nan are nan

        Raises
        ------
        ValueError : a trim whose surfaces move
        """
        known = np.asarray(np.isfinite(model.A).all(axis=(-2, -1)))
        if not known.all():
            return cls.of(system, condition.take(known), trim.take(known), model.take(known)).spread(known)
        if np.any(trim.state[..., 1::2] != 0.0):
            raise ValueError("a non-linear simulation starts from a trim at rest")
        grid = model.A.shape[:-2]
        source, geometry = system.aerodynamics.source, system.geometry
        load = system.hinge_load(condition) * system.aerodynamics.amplification(condition.mach)
        moments = source.at(trim.alpha, trim.state[..., 0], trim.state[..., 2])
        chords = (geometry.aileron_chord, geometry.tab_chord / 4.0, geometry.aileron_chord / 4.0)
        levers = np.stack([np.broadcast_to(chord / condition.airspeed, grid) for chord in chords], axis=-1)
        return cls(
            source=source,
            linear_source=isinstance(source, ThinAerofoil | Derivatives),
            thesis=system.aerodynamics.damping == "thesis",
            alpha=np.broadcast_to(trim.alpha, grid),
            angles=np.broadcast_to(trim.state[..., 0::2], (*grid, 2)),
            load=np.broadcast_to(load, grid),
            value=np.broadcast_to(moments.value, (*grid, 2)),
            gradient=np.broadcast_to(moments.gradient[..., 1:], (*grid, 2, 2)),
            levers=levers,
            model=model,
        )


class AirResidual:
    """R of some points in a row, each array with the points last: what is called in every stage.

    Attributes
    ----------
    is_zero : the model is linear: R vanishes
    """

    def __init__(self, plant: NonlinearPlant) -> None:
        self.is_zero = plant.linear_source and not plant.thesis
        self._plant = plant
        self._levers = np.ascontiguousarray(plant.levers.T)
        self._trim = np.ascontiguousarray(plant.angles.T)
        self._cosine = np.cos(self._trim[0])
        # A linear source leaves the cosine of the induced angle of the tab: torque = direction (cos - cos0) da'.
        self._direction = np.ascontiguousarray((-plant.load[:, None] * plant.gradient[..., 0]).T) * self._levers[0]

    def torque(self, dt: FloatArray, dt_rate: FloatArray, da: FloatArray, da_rate: FloatArray) -> FloatArray:
        """R (2, ..., P) [N m], order [tab, aileron], at deviations from trim (..., P) [rad], [rad/s]."""
        if self._plant.linear_source:
            if not self._plant.thesis:
                return np.zeros((2, *dt.shape))
            change = np.cos(self._trim[0] + dt)
            change -= self._cosine
            change *= da_rate
            return np.asarray(self._direction.reshape(2, *(1,) * (dt.ndim - 1), -1) * change)
        return self._of_source(dt, dt_rate, da, da_rate)

    def _of_source(self, dt: FloatArray, dt_rate: FloatArray, da: FloatArray, da_rate: FloatArray) -> FloatArray:
        """R of a source that is not linear in the angles."""
        plant, tab, aileron = self._plant, self._trim[0] + dt, self._trim[1] + da
        linear_tab, linear_aileron = dt, da
        if plant.thesis:
            lever, own, induced = self._levers[0], self._levers[1] * dt_rate, self._levers[2] * da_rate
            linear_tab = dt + self._cosine * lever * da_rate + own
            linear_aileron = da + induced
            tab, aileron = tab + np.cos(tab) * lever * da_rate + own, aileron + induced
        found = plant.source.at(plant.alpha, tab, aileron).value
        linear = plant.gradient[..., 0] * linear_tab[..., None] + plant.gradient[..., 1] * linear_aileron[..., None]
        return np.moveaxis(-plant.load[:, None] * (found - plant.value - linear), -1, 0)
