"""The linear model of the section about a trim: matrices, offsets and labels together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, GridArrays

STATES = ("dt", "dt_rate", "da", "da_rate")  # then, with unsteady damping, lag_1 and lag_2
INPUTS = ("T_t", "T_a")
OUTPUTS = ("dt", "da")


@dataclass(frozen=True, eq=False)
class LinearModel(GridArrays):
    """``x' = A x + B u``, ``y = C x + D u`` in deviations from trim, over the grid (seed 2.3.20).

    Attributes
    ----------
    A (*G, n, n), B (*G, n, 2), C (*G, 2, n), D (*G, 2, 2); n is 4, or 6 with the lag states of unsteady damping
    state_offset : (*G, n) the trim state: angles [rad], rates [rad/s], lags [rad] where they settle
    input_offset : (*G, 2) the trim torques [N m]
    inertia : (*G, 2, 2) J, order [tab, aileron] [kg m^2]
    damping : (*G, 2, 2) aerodynamic damping Bk of seed 2.3.7: ``J d'' = Bk d' + Kk d + L z + T`` [N m s/rad]
    stiffness : (*G, 2, 2) aerodynamic stiffness Kk of seed 2.3.7 [N m/rad]; with lag states z it is what meets a
        deflection before they move, and `static_stiffness` what is left when they have settled
    lag_torque : (*G, 2, n - 4) torque of the air by the lag states, L [N m/rad]; without columns where n is 4
    states, inputs, outputs : names in order; torques positive when they drive the trailing edge up
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    state_offset: FloatArray
    input_offset: FloatArray
    inertia: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    lag_torque: FloatArray
    states: tuple[str, ...] = STATES
    inputs: tuple[str, ...] = INPUTS
    outputs: tuple[str, ...] = OUTPUTS

    @property
    def air_torque(self) -> FloatArray:
        """Torque of the air by the states (*G, 2, n): ``J d'' = air_torque x + T``, rows [tab, aileron] [N m]."""
        by_motion = np.stack([self.stiffness, self.damping], axis=-1).reshape(*self.stiffness.shape[:-1], 4)
        return np.concatenate([by_motion, self.lag_torque], axis=-1)

    @property
    def static_stiffness(self) -> FloatArray:
        """Aerodynamic stiffness of surfaces at rest (*G, 2, 2) [N m/rad]: the lag states, if any, have settled."""
        settled = -self.A[..., 4:, 0:4:2] / np.diagonal(self.A, axis1=-2, axis2=-1)[..., 4:, None]
        return np.asarray(self.stiffness + self.lag_torque @ settled)
