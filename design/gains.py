"""A named gain over the grid, and its unit."""

from __future__ import annotations

from dataclasses import dataclass

from model.arrays import FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class Gain(GridArrays):
    """One gain of a controller.

    Attributes
    ----------
    name : valid as a variable name in MATLAB and C: ``K_p``, ``K_T_a_da_rate``, ``N_T_t_r_a``
    unit : SI and radians, ``1`` for none
    values : (*G,) nan where the point carries no gain
    """

    name: str
    unit: str
    values: FloatArray
