"""The linear model of the section about a trim: matrices, offsets and labels together."""

from __future__ import annotations

from dataclasses import dataclass

from model.arrays import FloatArray, GridArrays

STATES = ("dt", "dt_rate", "da", "da_rate")
INPUTS = ("T_t", "T_a")
OUTPUTS = ("dt", "da")


@dataclass(frozen=True, eq=False)
class LinearModel(GridArrays):
    """``x' = A x + B u``, ``y = C x + D u`` in deviations from trim, over the grid (seed 2.3.20).

    Attributes
    ----------
    A (*G, n, n), B (*G, n, 2), C (*G, 2, n), D (*G, 2, 2)
    state_offset : (*G, n) the trim state: angles [rad], rates [rad/s]
    input_offset : (*G, 2) the trim torques [N m]
    inertia : (*G, 2, 2) J, order [tab, aileron] [kg m^2]
    damping : (*G, 2, 2) aerodynamic damping Bk of seed 2.3.7: ``J d'' = Bk d' + Kk d + T`` [N m s/rad]
    stiffness : (*G, 2, 2) aerodynamic stiffness Kk of seed 2.3.7 [N m/rad]
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
    states: tuple[str, ...] = STATES
    inputs: tuple[str, ...] = INPUTS
    outputs: tuple[str, ...] = OUTPUTS
