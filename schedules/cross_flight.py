"""Every point's design flown at every other point: how far gains carry without a schedule (seed Tables 8.4, 8.6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.loop import Loop
from design.specs import Spec
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray
from schedules.analysis import PlantEnvelope
from schedules.carried_loop import carried_loop
from schedules.designed import DesignedController
from schedules.flown_figures import Flight, FlownFigures, fly, holds
from schedules.judging import horizon
from schedules.study import Study


@dataclass(frozen=True, eq=False)
class CrossFlight(GridArrays):
    """Figures of the designs of a grid flown over the grid: the design's axes first, then those of the flown point.

    Attributes
    ----------
    figures : (*G, *G) ``figures.take((i, j))`` is the design of point (i, j) over the whole grid
    flown : (*G, *G) where the first point carries a design and the second lies inside the model, be there a design of
        its own or not
    held : (*G, *G) where the design of the first is stable and meets the specs at the second
    specs : what was to be met; a limit that varies over the grid is that of the flown point
    axes : number of axes of the grid
    """

    figures: FlownFigures
    flown: BoolArray
    held: BoolArray
    specs: tuple[Spec, ...]
    axes: int

    @property
    def points_held(self) -> IntArray:
        """How many points each design holds (*G,), its own among them; 0 where there is no design."""
        return np.asarray(np.sum(self.held, axis=self._flown_axes))

    @property
    def points_flown(self) -> IntArray:
        """At how many points each design is flown (*G,)."""
        return np.asarray(np.sum(self.flown, axis=self._flown_axes))

    @property
    def worst_damping_ratio(self) -> FloatArray:
        """Least damping ratio of each design over the points that it is flown at (*G,) [-].

        nan where there is no design, and where a delay leaves one of them unproved.
        """
        least = np.min(self._damping, axis=self._flown_axes, initial=np.inf)
        return np.where(np.isfinite(least), least, np.nan)

    @property
    def best(self) -> int | None:
        """Flat index of the design that serves best alone; None where there is none.

        It holds the most points; of those, has the best of the least damping ratios; of those, comes first.
        """
        designs = np.flatnonzero(self.points_flown)
        if not designs.size:
            return None
        worst = np.nan_to_num(self.worst_damping_ratio.ravel()[designs], nan=-np.inf)
        order = np.lexsort((-worst, -self.points_held.ravel()[designs]))
        return int(designs[order[0]])

    @property
    def worst_pair(self) -> tuple[int, int] | None:
        """Flat indices of design and flown point with the least damping ratio of all; None where nothing is flown.

        One that a delay leaves unproved is worst of all; of equal ones, that with the largest real part.
        """
        pairs = np.flatnonzero(self.flown)
        if not pairs.size:
            return None
        growth = np.nan_to_num(self.figures.largest_real_part.ravel()[pairs], nan=np.inf)
        worst = pairs[np.lexsort((-growth, self._damping.ravel()[pairs]))[0]]
        points = int(np.prod(self.flown.shape[self.flown.ndim - self.axes :]))
        return int(worst // points), int(worst % points)

    @property
    def _flown_axes(self) -> tuple[int, ...]:
        return tuple(range(self.flown.ndim - self.axes, self.flown.ndim))

    @property
    def _damping(self) -> FloatArray:
        """Damping ratios, the worst possible where flown without a proof, the best where not flown."""
        unknown = np.where(self.flown, -np.inf, np.inf)
        return np.where(np.isnan(self.figures.damping_ratio), unknown, self.figures.damping_ratio)


def cross_flight(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    specs: Sequence[Spec] = (),
    *,
    duration: float | None = None,
    steps: bool = True,
    margins: bool = False,
) -> CrossFlight:
    """Fly every point's gains at every point inside the model, with all that the design flies: actuator, filter, delay.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : the controller
    specs : what a design must meet to hold a point, besides being stable; what they need is computed
    duration : how long steps are followed [s]; default that of the design
    steps, margins : whether these figures are wanted too

    Raises
    ------
    ValueError : too many pairs (`schedules.flown_figures.MOST_LOOPS`), or a spec on something that is not judged here
    """
    followed = horizon(study, designed.request) if duration is None else duration
    flight = Flight(study.reference.aileron, followed, steps, margins).judging(specs)
    grid, points = plant.outcomes.ok.shape, plant.outcomes.ok.size
    flown = np.outer(designed.outcomes.ok, plant.outcomes.ok)

    def loop_of(pairs: IntArray) -> Loop:
        here = plant.model.take(np.unravel_index(pairs % points, grid))
        return carried_loop(study, plant, designed, here, pairs // points)

    square = (*grid, *grid)
    figures = fly(flown.reshape(square), loop_of, flight)
    return CrossFlight(figures, flown.reshape(square), holds(figures, specs), tuple(specs), len(grid))
