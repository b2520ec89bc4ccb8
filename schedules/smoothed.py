"""Smoothed gains, and what smoothing costs."""

from __future__ import annotations

from dataclasses import dataclass

from design.gains import Gain
from model.arrays import FloatArray, GridArrays
from schedules.roughness import Roughness


@dataclass(frozen=True, eq=False)
class SmoothingCost(GridArrays):
    """What smoothing costs at each point, (*G,); nan where the design carries no gains.

    Attributes
    ----------
    bandwidth_lost : part of the fastest design's bandwidth that is given up [-], at most the smoothness; negative
        where the bandwidth has grown
    distance_before, distance_after : to the nearest of the requested specs, as a part of its limit [-]; nan without
        specs
    """

    bandwidth_lost: FloatArray
    distance_before: FloatArray
    distance_after: FloatArray


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Smoothed gains over the grid, how smooth they are and what that costs.

    Attributes
    ----------
    gains : each (*G,), nan where the design carries none; those that the request gives are as given
    before, after : roughness of each gain, in the order of `gains`
    cost : at each point
    """

    gains: tuple[Gain, ...]
    before: tuple[Roughness, ...]
    after: tuple[Roughness, ...]
    cost: SmoothingCost
