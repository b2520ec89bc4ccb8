"""What a table with given lines holds: looked at on a mesh between them, and proved."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from model.arrays import FloatArray
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.proof.prove import prove
from schedules.proof.result import CellStatus, ScheduleProof
from schedules.refine.flown import Meshes
from schedules.refine.lines import Lines, read_between
from schedules.refine.losses import (
    Criterion,
    GainError,
    SpecLoss,
    gain_errors,
    largest_gain_errors,
    losses,
    references,
    spec_loss,
    worst,
)
from schedules.refine.point_designs import PointDesigns
from schedules.refine.request import RefineRequest
from schedules.refine.study_on import kinks
from schedules.run import design
from schedules.study import Study

#: Of what is allowed, the part that is kept in hand for what lies between the points that are looked at.
KEPT_IN_HAND = 0.05


@dataclass(frozen=True, eq=False)
class Look:
    """A table looked at on a mesh (Nh, Ns).

    Attributes
    ----------
    mesh : the points
    severity : (Nh, Ns) the largest loss or error as a part of what is allowed; more than 1 is too much, infinite where
        a figure does not exist any more; nan where nothing can be held
    specs : the largest loss of each figure
    gains : the largest error of each gain
    undesigned : how many of the points have no design of their own
    """

    mesh: Lines
    severity: FloatArray
    specs: tuple[SpecLoss, ...]
    gains: tuple[GainError, ...]
    undesigned: int

    @property
    def worst(self) -> tuple[int, int] | None:
        """Where it is worst, as indices of the mesh."""
        return worst(self.severity)

    @property
    def largest(self) -> float:
        """The largest severity; 0 where nothing is held."""
        return 0.0 if self.worst is None else float(self.severity[self.worst])

    @property
    def holds(self) -> bool:
        """Whether everything that was looked at is within what is allowed, less what is kept in hand."""
        return self.largest <= 1.0 - KEPT_IN_HAND

    @property
    def score(self) -> tuple[int, float, float]:
        """To compare tables on the same mesh by, less is better: points lost, the worst of the others, all excess."""
        known = self.severity[~np.isnan(self.severity)]
        finite = known[np.isfinite(known)]
        excess = float(np.sum(np.maximum(finite - 1.0 + KEPT_IN_HAND, 0.0)))
        return int(np.sum(np.isinf(known) & (known > 0.0))), float(np.max(finite, initial=0.0)), excess


@dataclass(frozen=True, eq=False)
class Table:
    """A table designed on its lines, and its proof."""

    study: Study
    plant: PlantEnvelope
    designed: DesignedController
    proof: ScheduleProof

    @property
    def gains(self) -> FloatArray:
        """(nh, ns, g)"""
        return np.stack([gain.values for gain in self.designed.gains], axis=-1)

    @property
    def refuted_or_undecided(self) -> bool:
        """Whether a cell is not proved that might have been."""
        return any(cell.status in (CellStatus.REFUTED, CellStatus.UNDECIDED) for cell in self.proof.cells)


@dataclass(eq=False)
class Judge:
    """Looks at tables of one controller and proves them; what was worked out once is kept.

    Attributes
    ----------
    wanted : what is asked for
    criteria : the figures that are held
    designs : of single points
    meshes : plants, and gains flown on them
    looks, proofs : how many were made
    """

    wanted: RefineRequest
    criteria: tuple[Criterion, ...]
    designs: PointDesigns
    meshes: Meshes
    looks: int = 0
    proofs: int = 0
    _tables: dict[Lines, FloatArray] = field(default_factory=dict)
    _proved: dict[Lines, Table] = field(default_factory=dict)

    def mesh(self, lines: Lines, parts: int) -> Lines:
        """Where a table is looked at: equal parts of its intervals, and wherever what is asked for has kinks."""
        return lines.mesh(parts).joined(kinks(self.designs.study, self.designs.request))

    def gains(self, lines: Lines) -> FloatArray:
        """Gains (nh, ns, g) of a table."""
        if getattr(self.designs.request, "smoothness", 0.0) == 0.0:
            return self.designs.on(lines).gains
        if lines not in self._tables:  # what is smoothed depends on all the lines
            self.designs.on(lines)
            study, plant = self.meshes.at(lines)
            made = design(study, plant, study.controllers[0])
            self._tables[lines] = np.stack([gain.values for gain in made.gains], axis=-1)
        return self._tables[lines]

    def look(self, lines: Lines, mesh: Lines, gains: FloatArray | None = None) -> Look:
        """Look at a table on a mesh between its ends.

        Parameters
        ----------
        gains : (nh, ns, g) of the table; those of its points' designs when left out
        """
        self.looks += 1
        read = read_between(lines, self.gains(lines) if gains is None else gains, mesh)
        own = self.designs.on(mesh)
        names, quantities = self.designs.names, self.designs.quantities
        figures = self.meshes.figures(mesh, names, read, quantities)
        flown = np.asarray(np.isfinite(read).all(axis=-1))
        severity, specs = [], []
        for held in self.criteria:
            if held.quantity in figures:
                against, values = references(self.designs.study, held, own, mesh), figures[held.quantity]
                lost = losses(held, against, values, flown)
                severity.append(lost / self.wanted.spec_tolerance)
                specs.append(spec_loss(held, lost, values, against, mesh))
        errors = gain_errors(read, own)
        if self.wanted.gain_error is not None:
            severity += list(np.moveaxis(errors / self.wanted.gain_error, -1, 0))
        return Look(
            mesh, _largest(severity, flown.shape), tuple(loss for loss in specs if loss is not None),
            largest_gain_errors(names, errors, mesh), int(np.sum(~own.ok)),
        )  # fmt: skip

    def table(self, lines: Lines) -> Table:
        """A table designed on its lines as any grid is, and proved."""
        if lines not in self._proved:
            self.proofs += 1
            study, plant = self.meshes.at(lines)
            designed = design(study, plant, study.controllers[0])
            self._proved[lines] = Table(study, plant, designed, prove(study, plant, designed, self.wanted.proof))
        return self._proved[lines]


def _largest(fields: list[FloatArray], shape: tuple[int, ...]) -> FloatArray:
    """The largest of several fields at each point; nan only where all are."""
    found = np.full(shape, np.nan)
    for each in fields:
        found = np.fmax(found, each)
    return found
