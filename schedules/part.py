"""Parts of a study: the costly controllers, a block of grid points each, as plain numbers and words.

Which parts there are depends on the study alone, never on who computes them, how many there are at once or in what
order: figures that are taken of many loops together differ in their last bits with the company.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.classical.controller import ClassicalController
from design.delay.characteristic import SHORTEST
from design.lqr.controller import LqrController
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights
from model.arrays import Floats, IntArray
from model.flight import FlightGrid, GridAxis
from schedules.analysis import PlantEnvelope
from schedules.study import Controller, Study

#: Points of a part: gains that are searched together cost less a point, but for a few dozen of them hardly less.
#: Loops of state feedback with delays are judged one by one, each up to a quarter of a second.
POINTS, DELAYED_POINTS = 25, 8
#: Points that are designed and judged at once where that is cheap: it takes 130 kB a point while it lasts.
AT_ONCE = 2500


@dataclass(frozen=True, order=True)
class Part:
    """One controller at some of the grid's points.

    Attributes
    ----------
    controller : its name
    start, stop : flat row-major indices of the first point, and of the one behind the last

    Raises
    ------
    ValueError : no points
    """

    controller: str
    start: int
    stop: int

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.stop:
            raise ValueError(f"a part begins at 0 or later and has a point at least: not {self.start} to {self.stop}")

    @property
    def points(self) -> IntArray:
        """Flat indices (n,) of its points."""
        return np.arange(self.start, self.stop)


def parts(study: Study) -> tuple[Part, ...]:
    """The parts of a study, controller by controller: what is worth being computed elsewhere and kept.

    Controllers that are designed and judged within a millisecond or two a point have none.
    """
    return tuple(part for request in study.controllers for part in parts_of(study, request))


def parts_of(study: Study, request: Controller) -> tuple[Part, ...]:
    """The parts of one of its controllers, in the order of the grid; none where it is cheap."""
    count, size = _points(study, request), len(study.grid.altitude) * len(study.grid.speed)
    if count is None:
        return ()
    return tuple(Part(request.name, first, min(first + count, size)) for first in range(0, size, count))


def blocks_of(study: Study, request: Controller) -> tuple[Part, ...]:
    """The pieces that one of the study's controllers is computed in: its parts, or as much as memory is to hold.

    None where all of the grid is computed at once.
    """
    size = len(study.grid.altitude) * len(study.grid.speed)
    if (pieces := parts_of(study, request)) or size <= AT_ONCE:
        return pieces
    return tuple(Part(request.name, first, min(first + AT_ONCE, size)) for first in range(0, size, AT_ONCE))


def _points(study: Study, request: Controller) -> int | None:
    """Points of a part where gains are searched, or delayed state feedback has to be judged; None where neither is."""
    if isinstance(request, ClassicalController):
        return None if request.all_gains_given else POINTS
    if request.sampling is None and max(study.tab_actuator.delay, study.aileron_actuator.delay) > SHORTEST:
        return DELAYED_POINTS
    return POINTS if _powers_wanted(request) else None


def _powers_wanted(request: LqrController) -> bool:
    """Whether the weights are scaled point by point until powers or settling are what is wanted."""
    weights = request.weights
    if isinstance(weights, NetWorkWeights):
        return weights.retuned_on is not None
    return isinstance(weights, PowerBalancedWeights)


def requested(study: Study, part: Part) -> Controller:
    """What is asked of the controller of one of the study's parts."""
    return next(request for request in study.controllers if request.name == part.controller)


def request_at(request: Controller, points: IntArray, shape: tuple[int, ...]) -> Controller:
    """The request of some points (n,) of a grid of this shape, as a grid (1, n): limits and given gains of these."""
    if not isinstance(request, ClassicalController):
        return request

    def taken(value: Floats) -> Floats:
        if not isinstance(value, np.ndarray):
            return value
        return np.asarray(np.broadcast_to(value, shape).ravel()[points][None], dtype=float)

    specs = tuple(replace(spec, limit=taken(spec.limit)) for spec in request.specs)
    return replace(request, specs=specs, gains={name: taken(gain) for name, gain in request.gains.items()})


def plant_at(plant: PlantEnvelope, points: IntArray) -> PlantEnvelope:
    """The plant at some points (n,), flat indices of its grid, as a grid (1, n) whose axes count them."""
    at = np.unravel_index(points[None], plant.grid.shape)
    axes = GridAxis("row", "1", (0.0,)), GridAxis("point", "1", tuple(float(i) for i in range(len(points))))
    return replace(
        plant, grid=FlightGrid(axes, plant.grid.condition.take(at)), outcomes=plant.outcomes.take(at),
        trim=plant.trim.take(at), hinge_moments=plant.hinge_moments.take(at), model=plant.model.take(at),
        servo_tab=plant.servo_tab.take(at), warnings=(),
    )  # fmt: skip
