"""Answers about statics: hinge moments over the deflections, lines of equilibrium, the reachable range."""

from __future__ import annotations

from pydantic import Field

from service.schemas.design import EnvelopeWarning, Grid, GridAir, GridOutcomes, GridReasons, OutcomeCode
from service.schemas.hinge_moments import HingeMomentFit
from service.schemas.point import Trim
from service.schemas.wire import Answer

#: Rows by aileron angle, columns by tab angle; null where the hinge-moment data know nothing.
Plane = list[list[float | None]]
Line = list[float | None]


class Deflections(Answer):
    """Both axes of every plane."""

    aileron_deg: list[float]
    tab_deg: list[float]


class HingeMomentPlane(Answer):
    """Coefficients, compressibility included, and the torques that hold the surfaces there."""

    C_Ha: Plane
    C_Ht: Plane
    T_a_n_m: Plane
    T_t_n_m: Plane
    total_torque_n_m: Plane


class EquilibriumLine(Answer):
    """Angles along a line over one axis of the plane; null where there is none, with the reason beside it."""

    aileron_deg: Line
    tab_deg: Line
    T_a_n_m: Line
    T_t_n_m: Line
    reasons: list[str | None]


class FloatLine(EquilibriumLine):
    """A line on which the air alone holds the aileron: its slope, and whether the air drives it back."""

    gain: Line = Field(description="Slope of the aileron's angle over the tab's along the line")
    stable: list[bool | None]


class TabOnlyLine(FloatLine):
    """Wanted aileron angles held by the tab alone; whether the tab's limits allow it."""

    holds: list[bool]


class FreeSurfaces(Answer):
    """Where both surfaces float."""

    aileron_deg: float | None
    tab_deg: float | None
    reason: str | None


class RangeEnd(Answer):
    """One end of the reachable range, and what ends it."""

    aileron_deg: float | None
    tab_deg: float | None
    T_t_n_m: float | None
    limit: str | None


class ReachableAileron(Answer):
    """Aileron angles that the tab alone reaches within the limits."""

    lower: RangeEnd
    upper: RangeEnd
    reason: str | None


class SteadyStatePoint(Answer):
    """Statics at one grid point; `outcome` is that of the trim. Null where the point is outside the model."""

    index: int
    coordinates: dict[str, float]
    outcome: OutcomeCode
    reason: str | None
    trim: Trim | None
    plane: HingeMomentPlane | None
    zero_aileron_torque: EquilibriumLine | None
    zero_tab_torque: EquilibriumLine | None
    least_torque: EquilibriumLine | None
    tab_only: TabOnlyLine | None
    floating: FloatLine | None
    free: FreeSurfaces | None
    reachable: ReachableAileron | None


class SteadyStateMaps(Answer):
    """The phase plane of deflections at every grid point (seed Fig 2.14)."""

    grid: Grid
    air: GridAir
    outcomes: GridOutcomes
    reasons: GridReasons
    warnings: list[EnvelopeWarning]
    hinge_moment_fit: HingeMomentFit | None
    deflections: Deflections
    points: list[SteadyStatePoint]
