"""The design that each point of the envelope would have of its own, made where it is asked for and kept.

Points are designed in rectangles, each independent of the others: a gain does not depend on what it was designed with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from design.assess import achieved
from design.classical.controller import ClassicalController
from model.arrays import BoolArray, FloatArray
from schedules.analysis import analyse
from schedules.designed import DesignedController
from schedules.refine.lines import Lines
from schedules.refine.study_on import study_on
from schedules.run import design
from schedules.study import Controller, Study


@dataclass(frozen=True, eq=False)
class OwnDesigns:
    """Designs on a mesh (Nh, Ns).

    Attributes
    ----------
    gains : (Nh, Ns, g) nan where there is no design
    ok : (Nh, Ns) where there is one
    figures : (Nh, Ns) each, by quantity; nan where it does not exist
    """

    gains: FloatArray
    ok: BoolArray
    figures: dict[str, FloatArray]


@dataclass(eq=False)
class PointDesigns:
    """Designs of single points, those made so far kept.

    A controller that is smoothed over its grid is designed here without that: smoothness is not a point's own.

    Attributes
    ----------
    study : with the grid that its limits and gains stand on
    request : the controller
    quantities : figures that are wanted
    names : of the gains, once a point was designed
    """

    study: Study
    request: Controller
    quantities: Sequence[str]
    names: tuple[str, ...] = ()
    _known: dict[tuple[float, float], FloatArray] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """How many points were designed."""
        return len(self._known)

    def on(self, mesh: Lines) -> OwnDesigns:
        """Designs on a mesh; those that are not known yet are made."""
        missing = np.array([[(h, s) not in self._known for s in mesh.speed] for h in mesh.altitude])
        # New lines cross old ones: whole rows first, then what is left, so that little is made twice.
        rows = np.all(missing, axis=1)
        for rectangle in (missing & rows[:, None], missing & ~rows[:, None]):
            if np.any(rectangle):
                self._make(_picked(mesh, np.any(rectangle, axis=1), np.any(rectangle, axis=0)))
        table = np.array([[self._known[h, s] for s in mesh.speed] for h in mesh.altitude])
        count = len(self.names)
        return OwnDesigns(
            table[..., :count],
            np.asarray(np.isfinite(table[..., :count]).all(axis=-1)),
            {name: table[..., count + k] for k, name in enumerate(self.quantities)},
        )

    def _make(self, lines: Lines) -> None:
        study = study_on(self.study, _alone(self.request), lines)
        designed = design(study, analyse(study), study.controllers[0])
        self.names = tuple(gain.name for gain in designed.gains)
        found = np.stack([*(gain.values for gain in designed.gains), *self._figures(designed)], axis=-1)
        for i, h in enumerate(lines.altitude):
            for j, s in enumerate(lines.speed):
                self._known.setdefault((h, s), found[i, j])

    def _figures(self, designed: DesignedController) -> list[FloatArray]:
        none, assessment = np.full(designed.outcomes.ok.shape, np.nan), designed.assessment
        found = [None if assessment is None else achieved(assessment, name) for name in self.quantities]
        return [none if values is None else np.where(designed.outcomes.ok, values, np.nan) for values in found]


def _alone(request: Controller) -> Controller:
    """The controller as a point alone has it."""
    if isinstance(request, ClassicalController) and request.smoothness > 0.0:
        return replace(request, smoothness=0.0)
    return request


def _picked(mesh: Lines, rows: BoolArray, columns: BoolArray) -> Lines:
    return Lines(
        tuple(x for x, wanted in zip(mesh.altitude, rows, strict=True) if wanted),
        tuple(x for x, wanted in zip(mesh.speed, columns, strict=True) if wanted),
    )
