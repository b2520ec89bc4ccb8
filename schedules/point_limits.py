"""What every point of a schedule must keep while its gains are moved: its specs, and its bandwidth but for a part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.assess import Assessment, achieved, assess
from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.specs import Spec
from model.arrays import BoolArray, FloatArray, IntArray
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.judging import horizon
from schedules.study import Study

#: Part of every limit that is kept in hand; a point that has less to begin with keeps what it has.
RESERVE = 1e-4
_ROUNDING = 1e-12
#: Loops judged together; bounds the memory.
_TOGETHER = 512


@dataclass(frozen=True, eq=False)
class PointLimits:
    """Limits of the P points that carry gains, judged exactly on the loop that is flown.

    Attributes
    ----------
    study, plant, request : whose loop it is
    points : (P,) flat row-major indices of the points
    specs : the specs of the request that this loop has a value for
    names : names of the J gains
    bandwidth : (P,) that of the fastest design [rad/s]
    reserve : (P, s) part of each spec's limit that is kept in hand
    """

    study: Study
    plant: PlantEnvelope
    request: ClassicalController
    points: IntArray
    specs: tuple[Spec, ...]
    names: tuple[str, ...]
    bandwidth: FloatArray
    reserve: FloatArray

    @classmethod
    def of(cls, study: Study, plant: PlantEnvelope, designed: DesignedController, start: FloatArray) -> PointLimits:
        """Limits of the points of a design that are ok, `start` (P, J) being its gains there.

        Raises
        ------
        ValueError : the controller is not a classical one
        """
        request = designed.request
        if not isinstance(request, ClassicalController) or designed.assessment is None:
            raise ValueError(f"controller {request.name} is not a classical controller with a design")
        known = tuple(spec for spec in request.specs if achieved(designed.assessment, spec.quantity) is not None)
        points = np.flatnonzero(designed.outcomes.ok)
        names = tuple(gain.name for gain in designed.gains)
        blank = cls(
            study, plant, request, points, known, names, np.ones(points.size), np.zeros((points.size, len(known)))
        )
        found = blank.figures(start, np.arange(points.size))
        return replace(blank, bandwidth=found[:, -1], reserve=np.minimum(RESERVE, found[:, :-1]))

    def figures(self, values: FloatArray, of: IntArray) -> FloatArray:
        """Distance inside each spec as a part of its limit, then the bandwidth [rad/s]; nan where there is none.

        Parameters
        ----------
        values : (N, J) gains
        of : (N,) to which of the points each row belongs

        Returns
        -------
        (N, s + 1)
        """
        rows = [
            self._figures(values[at : at + _TOGETHER], of[at : at + _TOGETHER]) for at in range(0, len(of), _TOGETHER)
        ]
        return np.concatenate(rows)

    def room(self, values: FloatArray, of: IntArray) -> FloatArray:
        """How far the gains are inside each spec less its reserve, and the bandwidth inside the part that may be lost.

        As parts of the limits and of the fastest bandwidth, (N, s + 1); -inf where a value does not exist.
        """
        found = self.figures(values, of)
        room = np.empty_like(found)
        room[:, :-1] = found[:, :-1] - self.reserve[of]
        room[:, -1] = found[:, -1] / self.bandwidth[of] - (1.0 - self.request.smoothness)
        return np.where(np.isnan(room), -np.inf, room)

    def _figures(self, values: FloatArray, of: IntArray) -> FloatArray:
        try:
            return self._judged(values, of)
        except np.linalg.LinAlgError:
            # One loop whose numbers LAPACK gives up on must not speak for the others.
            if len(of) == 1:
                return np.full((1, len(self.specs) + 1), np.nan)
            return np.concatenate([self._figures(values[i : i + 1], of[i : i + 1]) for i in range(len(of))])

    def _judged(self, values: FloatArray, of: IntArray) -> FloatArray:
        index = np.unravel_index(self.points[of], self.plant.grid.shape)
        gains = dict(zip(self.names, values.T, strict=True))
        model, servo = self.plant.model.take(index), self.plant.servo_tab.take(index)
        loop = tab_loop(model, servo, self.study.tab_actuator, self.request, gains)
        step, duration = self.study.reference.sizes(loop.references), horizon(self.study, self.request)
        found = assess(loop, step, duration, sampling=self.request.sampling)
        return np.column_stack([spec_distances(found, [s.take(index) for s in self.specs]), found.step.bandwidth])


def kept(room: FloatArray) -> BoolArray:
    """Mask (N,) of the rows (N, c) of `PointLimits.room` in which nothing is exceeded."""
    return np.asarray(np.all(room >= -_ROUNDING, axis=-1))


def spec_distances(found: Assessment, specs: Sequence[Spec]) -> FloatArray:
    """Distance inside each spec as a part of its limit (*G, s); nan where the loop has no such value."""
    grid = found.poles.shape[:-1]
    parts = np.full((*grid, len(specs)), np.nan)
    for i, spec in enumerate(specs):
        values = achieved(found, spec.quantity)
        if values is not None:
            parts[..., i] = spec.distance(values) / spec.scale
    return parts
