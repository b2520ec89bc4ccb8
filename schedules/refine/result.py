"""A refined schedule: the table, its proof, what it keeps between its lines, and how it came about."""

from __future__ import annotations

from dataclasses import dataclass

from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.envelope_warnings import envelope_warnings
from schedules.proof.flight_box import Box
from schedules.proof.result import ScheduleProof
from schedules.refine.history import Step
from schedules.refine.lines import Lines
from schedules.refine.losses import GainError, SpecLoss
from schedules.refine.request import RefineRequest
from schedules.refine.uniform_tables import UniformTable
from schedules.study import Study


@dataclass(frozen=True)
class Remaining:
    """A cell that does not hold all that is wanted.

    Attributes
    ----------
    index : of its lower corner in the table, (altitude, speed)
    box : the cell
    reason : what does not hold, in words
    """

    index: tuple[int, int]
    box: Box
    reason: str


@dataclass(frozen=True)
class Work:
    """What the search took: tables looked at, tables proved, points designed."""

    looks: int
    proofs: int
    designs: int


@dataclass(frozen=True, eq=False)
class RefinedSchedule:
    """The smallest table that was found.

    Attributes
    ----------
    wanted : what was asked for
    study : the study with the table's grid and this controller alone
    plant, designed : on that grid, as `schedules.run` makes them
    proof : of all its cells
    lines : of the table
    specs : the largest loss of each figure between the lines
    gains : the largest error of each gain between the lines
    undesigned : of the points looked at between the lines, how many have no design of their own to be held against
    looked_at : how many points were
    history : how lines came and went
    uniform : the smallest evenly spaced table that holds as much; None where it was not asked for, or the table itself
        does not hold
    remaining : cells that do not hold all that is wanted; none where the table does
    why : why the search stopped before everything held, in words; None where it does
    work : what the search took
    """

    wanted: RefineRequest
    study: Study
    plant: PlantEnvelope
    designed: DesignedController
    proof: ScheduleProof
    lines: Lines
    specs: tuple[SpecLoss, ...]
    gains: tuple[GainError, ...]
    undesigned: int
    looked_at: int
    history: tuple[Step, ...]
    uniform: UniformTable | None
    remaining: tuple[Remaining, ...]
    why: str | None
    work: Work

    @property
    def holds(self) -> bool:
        """Whether every cell is proved and everything is within what is allowed between the lines."""
        return not self.remaining

    @property
    def points(self) -> int:
        """Number of points of the table."""
        return self.lines.points

    @property
    def envelope(self) -> DesignedEnvelope:
        """The table as `schedules.run.run` would give it, for files and for everything else that takes one."""
        warnings = self.plant.warnings + envelope_warnings(self.study, self.plant, (self.designed,))
        return DesignedEnvelope(self.study, self.plant, (self.designed,), warnings)

    @property
    def words(self) -> str:
        """What was found, in a few sentences."""
        altitude, speed = self.lines.shape
        size = f"{altitude} lines of altitude by {speed} of speed, {self.points} points"
        beside = f"; {self.uniform.words}" if self.uniform is not None else ""
        if self.holds:
            lost = max((loss.loss for loss in self.specs), default=0.0)
            kept = f"the specs lose at most {100.0 * max(lost, 0.0):.3g} % between the lines"
            return f"{size}: {self.proof.summary.words}; {kept}{beside}"
        return f"{size} do not hold in {len(self.remaining)} cells: {self.why}"
