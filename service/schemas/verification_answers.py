"""Answers about a schedule between its grid points: proofs cell by cell, and what they come to."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from service.schemas.design import Grid, Kind
from service.schemas.wire import Answer


class SlowPoint(Answer):
    """A flight point, and the plant there, whose frozen loop decays slowest of those that were looked at."""

    altitude_m: float
    dynamic_pressure_pa: float
    largest_real_part: float = Field(
        json_schema_extra={"unit": "1/s"}, description="Of its poles; the rate is minus it"
    )
    factors: dict[str, float] = Field(
        json_schema_extra={"unit": "1"}, description="What parameters of the plant are multiplied by; empty: the model"
    )


class ProvedCell(Answer):
    """A cell between four grid points: `index` [i, j] lies between lines i, i + 1 and j, j + 1 of the grid.

    An axis of one breakpoint has one cell, of no width.
    """

    index: list[int]
    status: Literal["proved", "refuted", "undecided", "sampled"]
    decay_rate_1_s: float | None = Field(
        description="Proved in all of the cell, however altitude and speed move inside each piece; null where it is not"
    )
    wanted_1_s: float | None = Field(description="The rate that was asked for; null where the cell has no gains")
    pieces: int = Field(description="Pieces of the cell that have a Lyapunov matrix each; 0 where it is not proved")
    reason: str | None = Field(description="Why it is not proved")
    counterexample: SlowPoint | None = Field(
        description="Of a refuted cell: a point of it that decays slower than was asked for"
    )
    slowest: SlowPoint | None = Field(
        description="Slowest of the points that were looked at; null where none was. It proves nothing"
    )


class RateBound(Answer):
    """Rates of flight for which the whole envelope is proved, both at once and either way."""

    altitude_rate_m_s: float
    axis: Literal["dynamic_pressure_pa", "airspeed_m_s", "mach"]
    speed_rate: float | None = Field(
        json_schema_extra={"unit": "see `unit`"},
        description="Of the second axis; 0 where nothing was proved at that rate of altitude, null where any is proved",
    )
    unit: str
    unlimited: bool = Field(description="One Lyapunov matrix proves the envelope: however fast altitude and speed move")
    decay_rate_1_s: float = Field(description="That is kept meanwhile; 0 is stability")


class ReadingError(Answer):
    """Errors of the speed that the gains are read at, in per cent of it, that stay stable.

    Looked for up to `searched_percent`, so that this value means: as far as was looked.
    """

    index: list[int] | None = Field(description="Of the cell; null: the whole envelope")
    proved_percent: float = Field(description="Proved both ways, changing however fast")
    stable_down_percent: float = Field(description="Frozen loops are stable for readings too low by up to this")
    stable_up_percent: float = Field(description="Frozen loops are stable for readings too high by up to this")


class SignalError(ReadingError):
    """The scheduling-signal error margin of the envelope, and of each cell that has gains."""

    searched_percent: float
    cells: list[ReadingError]


class ProofSummary(Answer):
    """A schedule's proof in a few numbers."""

    proved: int
    refuted: int
    undecided: int
    sampled: int
    decay_rate_1_s: float | None = Field(description="Least of all cells; null unless all are proved")
    pieces: int
    common: bool = Field(description="Whether one Lyapunov matrix proves every cell, however fast the point moves")
    words: str
    rate_bound: RateBound | None = Field(description="Null where `rates` were not asked for, or there are none")
    rate_bound_reason: str | None
    signal_error: SignalError | None = Field(description="Null where `margins` were not asked for, or there are none")
    signal_error_reason: str | None


class ControllerProof(Answer):
    """One controller's schedule between its grid points."""

    kind: Kind
    covers: str = Field(description="The plants that the proof is of: the model, and what is off by how much")
    reason: str | None = Field(description="Why its loops cannot be proved at all; its cells are then sampled")
    cells: list[ProvedCell]
    summary: ProofSummary


class Verification(Answer):
    """Proofs between the grid points, by controller."""

    grid: Grid
    interpolation: str
    out_of_range: str
    controllers: dict[str, ControllerProof]


class UploadedVerification(Verification):
    """Proof of an uploaded table, and its certificate."""

    certificate: dict[str, Any] | None = Field(
        description="As `GET /v1/designs/{id}/controllers/{name}/certificate` answers it; null where it was not asked "
        "for, or no cell is proved"
    )
