"""The gain schedule: axes, gains, outcomes, the rule between the points, and where it came from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from design.gains import Gain
from design.outcome import Outcomes
from model.flight import GridAxis

#: Version of the layout of every schedule file; raised when a reader of the old one would misread the new.
SCHEMA_VERSION = 1

#: The rule between the grid points, word for word as every file and answer states it.
INTERPOLATION_RULE = "multilinear in the grid's own axes"
OUT_OF_RANGE_RULE = "clipped to the grid's edges"
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
    law : the control law in one line, with the gains by name
    """

    controller: str
    kind: Literal["negative_feedback", "positive_feedback", "lqr"]
    axes: tuple[GridAxis, ...]
    gains: tuple[Gain, ...]
    outcomes: Outcomes
    law: str
    provenance: Provenance

    @property
    def shape(self) -> tuple[int, ...]:
        """Grid shape ``G``."""
        return tuple(len(axis.values) for axis in self.axes)
