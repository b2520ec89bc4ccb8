"""What a proof between grid points says: cell by cell, and in sum."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from model.arrays import FloatArray
from model.flight import GridAxis
from schedules.proof.family import LoopFamily
from schedules.proof.flight_box import Box, Flight
from schedules.proof.frozen import SlowestPoint


class CellStatus(StrEnum):
    """What is known of a cell."""

    PROVED = "proved"
    REFUTED = "refuted"
    UNDECIDED = "undecided"
    SAMPLED = "sampled"


@dataclass(frozen=True, eq=False)
class Piece:
    """A cell, or a part of one, with its own Lyapunov matrix.

    Attributes
    ----------
    box : where it holds, edges included
    alpha : proved: ``x' P x`` decays at least like ``exp(-2 alpha t)`` [1/s] however altitude and speed move inside
    P : (n, n) the Lyapunov matrix, its largest entry 1
    margin : what was taken off alpha for rounding [1/s]
    """

    box: Box
    alpha: float
    P: FloatArray
    margin: float


@dataclass(frozen=True, eq=False)
class CellProof:
    """One cell between four grid points; of an axis with one breakpoint a cell has no width.

    Attributes
    ----------
    index : of its lower corner in the grid, (altitude, speed)
    box : the cell
    status : ``proved``: in every piece, at least at the rate `wanted`; ``refuted``: at a point that is named the frozen
        loop decays slower than `wanted`; ``undecided``: neither was found; ``sampled``: the loop is none of those that
        can be proved, and the points that were looked at decay fast enough
    wanted : decay rate asked for [1/s]; nan where the cell has none
    alpha : proved in all of the cell, the least of its pieces [1/s]; nan where nothing is
    pieces : that cover the cell where it is proved; empty elsewhere. With more than one, what is proved holds for any
        motion inside each piece, not for fast motion from one to the other
    slowest : slowest frozen loop of the points that were looked at, corners among them; None where none was
    reason : in words, where the cell is not proved
    """

    index: tuple[int, int]
    box: Box
    status: CellStatus
    wanted: float
    alpha: float
    pieces: tuple[Piece, ...]
    slowest: SlowestPoint | None
    reason: str | None


@dataclass(frozen=True)
class ProofSummary:
    """A schedule's proof in a few numbers.

    Attributes
    ----------
    proved, refuted, undecided, sampled : numbers of cells
    alpha : least proved rate of all cells [1/s]; nan unless all are proved
    common : whether one Lyapunov matrix proves all cells: then for arbitrarily fast motion across the whole envelope
    pieces : number of pieces of the proof
    words : one sentence
    """

    proved: int
    refuted: int
    undecided: int
    sampled: int
    alpha: float
    common: bool
    pieces: int
    words: str


@dataclass(frozen=True, eq=False)
class ScheduleProof:
    """Proof of a schedule between its grid points.

    Attributes
    ----------
    controller : name
    axes : of the grid
    cells : row by row, the speed varying fastest
    common : (n, n) one Lyapunov matrix that proves every cell at its `wanted`; None where none was found
    family, flight : the loops that were proved, taken apart; None where that cannot be done
    covers : which plants: the model, and which of its parameters off by how much
    reason : why the loops cannot be taken apart, in words
    """

    controller: str
    axes: tuple[GridAxis, GridAxis]
    cells: tuple[CellProof, ...]
    common: FloatArray | None
    family: LoopFamily | None
    flight: Flight
    covers: str
    reason: str | None

    @property
    def proved(self) -> bool:
        """Whether every cell is."""
        return all(cell.status is CellStatus.PROVED for cell in self.cells)

    @property
    def summary(self) -> ProofSummary:
        """Counts, and what they come to in words."""
        counts = {status: sum(cell.status is status for cell in self.cells) for status in CellStatus}
        alpha = min(cell.alpha for cell in self.cells) if self.proved else float("nan")
        return ProofSummary(
            proved=counts[CellStatus.PROVED],
            refuted=counts[CellStatus.REFUTED],
            undecided=counts[CellStatus.UNDECIDED],
            sampled=counts[CellStatus.SAMPLED],
            alpha=alpha,
            common=self.common is not None,
            pieces=sum(len(cell.pieces) for cell in self.cells),
            words=self._words(counts, alpha),
        )

    def _words(self, counts: dict[CellStatus, int], alpha: float) -> str:
        if self.proved:
            if self.common is not None and all(piece.P is self.common for cell in self.cells for piece in cell.pieces):
                how = "however fast altitude and speed change within the envelope"
            elif all(len(cell.pieces) == 1 for cell in self.cells):
                how = "however fast altitude and speed change within a cell"
            else:
                how = "however fast altitude and speed change within a part of a cell"
            return f"every cell is proved for {self.covers}: decay at {alpha:.4g} 1/s or faster, {how}"
        told = ", ".join(f"{count} {status}" for status, count in counts.items() if count)
        why = f": {self.reason}" if self.reason else ""
        return f"of {len(self.cells)} cells {told}{why}"
