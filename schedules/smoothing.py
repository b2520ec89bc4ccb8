"""Gains that vary smoothly over the grid, bought with a stated part of the bandwidth.

Each point's fastest gains are chosen without a look at its neighbours, and where several are nearly as fast, or another
spec takes over, their table bends. Here all points move together: of the gains that still meet every spec and keep
the bandwidth but for the part that the controller's `smoothness` allows, those are sought whose table has the
least `roughness`: the smallest root mean square of the errors that it would make if one of its lines were left out.
"""

from __future__ import annotations

import numpy as np

from design.classical.controller import ClassicalController
from design.gains import Gain
from model.arrays import BoolArray, FloatArray
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.point_limits import PointLimits
from schedules.roughness import Stencils, roughness
from schedules.smoothed import Smoothed, SmoothingCost
from schedules.smoothest_table import smoothest_table
from schedules.study import Study


def smooth(study: Study, plant: PlantEnvelope, designed: DesignedController) -> Smoothed:
    """The smoothest gains found that meet every spec and keep ``1 - smoothness`` of the bandwidth at every point.

    Points that are not ok are left alone and bend no table. Limits keep a ten-thousandth of themselves in hand, or what
    the design has where that is less. The table is never rougher than the design's: neither the root mean square
    of the errors of all its gains nor the largest of them grows; one gain alone may. Where nothing can be gained, or
    nothing is allowed, the design's own gains come back.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : its fastest gains; `request.smoothness` says how much bandwidth may be given up

    Raises
    ------
    ValueError : the controller is not a classical one, or its smoothness is not from 0 to 1
    """
    request, ok = designed.request, designed.outcomes.ok
    if not isinstance(request, ClassicalController):
        raise ValueError(f"controller {request.name}: smoothness is a preference of classical controllers")
    if not 0.0 <= request.smoothness <= 1.0:
        raise ValueError(f"controller {request.name}: smoothness is a part of the bandwidth, from 0 to 1")
    start = np.stack([gain.values[ok] for gain in designed.gains], axis=-1)
    values, cost = start, SmoothingCost(*np.full((3, *ok.shape), np.nan))
    if np.any(ok):
        limits = PointLimits.of(study, plant, designed, start)
        open_ = np.array([name not in request.gains for name in limits.names])
        stencils = Stencils.of(plant.grid.axes, ok).among(limits.points)
        if request.smoothness > 0.0 and np.any(open_) and stencils.here.size:
            values = smoothest_table(limits, stencils, start, open_)
        cost = _cost(limits, start, values).spread(ok)
    gains = tuple(
        Gain(gain.name, gain.unit, _spread(column, ok)) for gain, column in zip(designed.gains, values.T, strict=True)
    )
    before, after = (tuple(roughness(g.values, plant.grid.axes) for g in which) for which in (designed.gains, gains))
    return Smoothed(gains, before, after, cost)


def _cost(limits: PointLimits, start: FloatArray, values: FloatArray) -> SmoothingCost:
    every = np.arange(len(start))
    before, after = (limits.figures(gains, every) for gains in (start, values))
    nearest = [
        np.min(figures[:, :-1], axis=-1) if limits.specs else np.full(len(start), np.nan) for figures in (before, after)
    ]
    return SmoothingCost(1.0 - after[:, -1] / before[:, -1], *nearest)


def _spread(values: FloatArray, mask: BoolArray) -> FloatArray:
    whole = np.full(mask.shape, np.nan)
    whole[mask] = values
    return whole
