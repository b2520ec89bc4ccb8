"""Servo-tab reduction: the tab's motion is imposed, the aileron follows (seed 2.3.21 to 2.3.31)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, GridArrays
from model.linear_model import LinearModel


@dataclass(frozen=True, eq=False)
class ServoTab(GridArrays):
    """Aileron driven by the tab alone: ``[da, da'] ' = F [da, da'] + G [dt, dt']``, over the grid.

    The transfer function from tab to aileron deflection is

        da/dt = (beta1 s + beta0) / (s^2 + 2 zeta omega s + omega^2).

    Attributes
    ----------
    F : (*G, 2, 2), G : (*G, 2, 2) columns [dt, dt'] (seed 2.3.22)
    numerator : (*G, 2) ``[beta1, beta0]`` (seed 2.3.29)
    denominator : (*G, 3) ``[1, 2 zeta omega, omega^2]``
    dc_gain : (*G,) ``beta0 / omega^2`` (seed 2.3.30 with its sign: negative); nan without stiffness
    zero : (*G,) ``-beta0 / beta1`` [rad/s]; nan when beta1 is zero
    natural_frequency : (*G,) omega [rad/s]; nan where the aileron's own stiffness does not restore
    damping_ratio : (*G,) zeta [-]; nan there too
    """

    F: FloatArray
    G: FloatArray
    numerator: FloatArray
    denominator: FloatArray
    dc_gain: FloatArray
    zero: FloatArray
    natural_frequency: FloatArray
    damping_ratio: FloatArray


def servo_tab(model: LinearModel) -> ServoTab:
    """Reduce a linear model to its aileron, the tab's angle and rate being inputs.

    As in seed 2.3.21 the inertial reaction of the tab's acceleration is left out, and the inertia is
    ``I_at = J[a, a]``, virtual inertia included when the model has it.
    """
    inertia = model.inertia[..., 1, 1, None]
    stiffness = model.stiffness[..., 1, :] / inertia
    damping = model.damping[..., 1, :] / inertia
    F, G = np.zeros((*stiffness.shape[:-1], 2, 2)), np.zeros((*stiffness.shape[:-1], 2, 2))
    F[..., 0, 1] = 1.0
    F[..., 1, 0], F[..., 1, 1] = stiffness[..., 1], damping[..., 1]
    G[..., 1, 0], G[..., 1, 1] = stiffness[..., 0], damping[..., 0]
    beta1, beta0 = damping[..., 0], stiffness[..., 0]
    restoring, drag = -stiffness[..., 1], -damping[..., 1]
    omega = np.sqrt(np.where(restoring > 0.0, restoring, np.nan))
    return ServoTab(
        F=F,
        G=G,
        numerator=np.stack([beta1, beta0], axis=-1),
        denominator=np.stack([np.ones_like(drag), drag, restoring], axis=-1),
        dc_gain=_ratio(beta0, restoring),
        zero=_ratio(-beta0, beta1),
        natural_frequency=np.asarray(omega),
        damping_ratio=np.asarray(drag / (2.0 * omega)),
    )


def _ratio(top: FloatArray, bottom: FloatArray) -> FloatArray:
    """``top / bottom``, nan where the bottom is zero."""
    return np.asarray(top / np.where(bottom != 0.0, bottom, np.nan))
