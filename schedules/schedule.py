"""The gain schedule: axes, gains, outcomes, the rules it is flown by, and where it came from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from design.gains import Gain
from design.outcome import Outcomes
from model.flight import GridAxis
from schedules.rules import USUAL_RULES, ScheduleRules

#: Newest layout of the schedule files; raised when a reader of the old one would misread the new.
#: A reader of version 1 takes every integrator to stand before its gain.
SCHEMA_VERSION = 2
SIGN_CONVENTION = (
    "angles and torques positive trailing edge up; tab angle relative to the aileron; "
    "deviations from trim; u = -K x + N r, or for the classical kinds the law given by the kind"
)


@dataclass(frozen=True)
class Provenance:
    """Where a schedule came from: enough to make it again."""

    design_id: str
    design_name: str
    request_digest: str
    version: str
    created_at: str


@dataclass(frozen=True, eq=False)
class GainSchedule:
    """Gains of one controller over the grid.

    Attributes
    ----------
    controller, kind : name and kind of the controller
    axes : one per dimension of the gains, strictly increasing breakpoints
    gains : each (*G,), nan where the outcome is not ok
    outcomes : (*G,) codes and reasons
    law : the control law at a flight point in one line, with the gains by name
    rules : between the points, outside them, and where the integrators stand
    """

    controller: str
    kind: Literal["negative_feedback", "positive_feedback", "lqr"]
    axes: tuple[GridAxis, ...]
    gains: tuple[Gain, ...]
    outcomes: Outcomes
    law: str
    provenance: Provenance
    rules: ScheduleRules = USUAL_RULES

    @property
    def schema_version(self) -> int:
        """The oldest layout whose readers read this schedule as it is meant: files state no newer one."""
        return SCHEMA_VERSION if self.rules.integrator_placement != "before_gain" else 1

    @property
    def shape(self) -> tuple[int, ...]:
        """Grid shape ``G``."""
        return tuple(len(axis.values) for axis in self.axes)
