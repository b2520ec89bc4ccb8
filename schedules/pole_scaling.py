"""Poles over the grid without dimensions: how well scaling brings them together (seed Fig 4.31).

A plant that scales perfectly, with a controller whose gains, servo and filter scale along, has the same poles at
every point once time is counted in ``1/omega_n``, omega_n^2 being the static stiffness of the aileron. As ``omega_n^2
~ q``, dividing by ``sqrt(q/q_ref)`` does the same and keeps the unit. What the scaled poles still move over the grid
is what no scaling law can take out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from design.frequency.poles import poles
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray
from model.branches import successors
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController


@dataclass(frozen=True, eq=False)
class Collapse:
    """How near the scaled poles of each branch come together over the grid, (n,) each; nan where there are none.

    Attributes
    ----------
    centre : mean of the branch over the grid
    spread : largest distance from the centre, as a part of the centre's distance from the origin [-]
    rms_spread : root mean square of these distances, as the same part [-]
    point : flat row-major index of the point that is farthest from the centre, -1 where there is none
    """

    centre: ComplexArray
    spread: FloatArray
    rms_spread: FloatArray
    point: IntArray


@dataclass(frozen=True, eq=False)
class ScaledPoles(GridArrays):
    """Poles (*G, n) of one loop, scaled, each branch in one place over the whole grid; nan where there are none."""

    poles: ComplexArray

    @property
    def collapse(self) -> Collapse:
        """How near they come together over the grid."""
        known = _finite(self.poles)
        n = self.poles.shape[-1]
        if not np.any(known):
            none = np.full(n, np.nan)
            return Collapse(none.astype(complex), none, none, np.full(n, -1))
        here = self.poles[known]
        centre = here.mean(axis=0)
        size = np.abs(centre)
        apart = np.abs(here - centre) / np.where(size > 0.0, size, np.nan)
        farthest = np.argmax(apart, axis=0)
        rms = np.sqrt(np.mean(apart**2, axis=0))
        return Collapse(np.asarray(centre), np.max(apart, axis=0), rms, np.flatnonzero(known)[farthest])


@dataclass(frozen=True, eq=False)
class PoleScaling(GridArrays):
    """Poles of a controller's closed loop and of the servo tab without control, scaled in two ways.

    Attributes
    ----------
    frequency : (*G,) omega_n, root of the aileron's static stiffness [rad/s]; nan where that does not restore
    reference_pressure : q_ref, geometric mean of the dynamic pressure inside the model [Pa]
    closed_by_frequency, open_by_frequency : poles over omega_n [-]
    closed_by_pressure, open_by_pressure : poles over ``sqrt(q/q_ref)`` [rad/s]
    """

    frequency: FloatArray
    reference_pressure: float
    closed_by_frequency: ScaledPoles
    closed_by_pressure: ScaledPoles
    open_by_frequency: ScaledPoles
    open_by_pressure: ScaledPoles


def pole_scaling(plant: PlantEnvelope, designed: DesignedController) -> PoleScaling:
    """Scaled poles of a controller, be it a per-point design or one flown by `schedules.scaling_laws`.

    Branches are followed from point to neighbouring point by the poles over ``sqrt(q/q_ref)``, around the points that
    have none; they are numbered as `design.frequency.poles` orders the first point's.
    """
    ok, pressure = plant.outcomes.ok, plant.grid.condition.dynamic_pressure
    stiffness = plant.servo_tab.static_stiffness
    restores = np.asarray(np.nan_to_num(stiffness) > 0.0)
    frequency = np.sqrt(np.where(restores, stiffness, np.nan))
    reference = float(np.exp(np.mean(np.log(pressure[ok])))) if np.any(ok) else np.nan
    ratio = np.sqrt(pressure / reference)
    free = np.full(plant.servo_tab.F.shape[:-1], complex(np.nan, np.nan))
    free[ok] = poles(plant.servo_tab.F[ok])
    scaled = []
    for of_loop in (_closed(designed), free):
        in_place = np.take_along_axis(of_loop, _places(np.asarray(of_loop / ratio[..., None])), axis=-1)
        scaled += [ScaledPoles(np.asarray(in_place / unit[..., None])) for unit in (frequency, ratio)]
    return PoleScaling(frequency, reference, *scaled)


def _closed(designed: DesignedController) -> ComplexArray:
    """Closed-loop poles (*G, n); nan where there is no design."""
    if designed.assessment is None:
        return np.full(designed.loop.A.shape[:-1], complex(np.nan, np.nan))
    return designed.assessment.poles


def _finite(values: ComplexArray) -> BoolArray:
    return np.asarray(np.isfinite(values).all(axis=-1))


def _places(values: ComplexArray) -> IntArray:
    """Where each branch lies in each list of a grid (*G, n)."""
    known, n = _finite(values), values.shape[-1]
    places = np.broadcast_to(np.arange(n), values.shape).copy()
    flat, lists = values.reshape(-1, n), places.reshape(-1, n)
    for points, before in _outward(known):
        beside = np.take_along_axis(flat[before], lists[before], axis=-1)
        lists[points] = successors(np.stack([beside, flat[points]], axis=1))[:, 0]
    return places


def _outward(known: BoolArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Points of a mask in the order in which they are reached from its first, each with one reached before it.

    From neighbour to neighbour; where those end, on to the nearest point that is left. Flat indices, (L,) each.
    """
    index, number = np.argwhere(known), np.full(known.shape, -1)
    number[known] = np.arange(len(index))
    flat, reached = np.flatnonzero(known), np.zeros(len(index), dtype=bool)
    steps = np.concatenate([np.eye(known.ndim, dtype=int), -np.eye(known.ndim, dtype=int)])
    front = np.arange(min(1, len(index)))
    reached[front] = True
    while not np.all(reached):
        beside = index[front][:, None] + steps
        inside = np.all((beside >= 0) & (beside < known.shape), axis=-1)
        found = np.where(inside, number[tuple(np.moveaxis(np.where(inside[..., None], beside, 0), -1, 0))], -1)
        before, _ = np.nonzero(new := (found >= 0) & ~reached[found])
        points, first = np.unique(found[new], return_index=True)
        parents = front[before[first]]
        if not points.size:
            left = np.flatnonzero(~reached)
            apart, nearest = (np.asarray(found) for found in cKDTree(index[reached]).query(index[left]))
            pick = np.argmin(apart, keepdims=True)
            points, parents = left[pick], np.flatnonzero(reached)[nearest[pick]]
        yield flat[points], flat[parents]
        reached[points] = True
        front = points
