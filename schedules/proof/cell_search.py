"""Search for the pieces of a cell, each with a Lyapunov matrix that proves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray
from schedules.proof.cells import Cell, corners_of_part
from schedules.proof.control_loops import control_loops, control_sizes
from schedules.proof.decay import decay_rates, rounding
from schedules.proof.family import LoopFamily
from schedules.proof.flight_box import Box, Flight
from schedules.proof.result import Piece
from schedules.proof.search import lyapunov

#: Height over which the density falls by a part e, about [m]: how altitude is weighed against speed.
SCALE_HEIGHT = 9000.0


@dataclass(frozen=True, eq=False)
class Part:
    """A box with the gains at its corners (2, 2, g) and its control loops (K, n, n)."""

    box: Box
    gains: FloatArray
    loops: FloatArray

    def faster(self, rate: float) -> FloatArray:
        """Loops (K, n, n) that are stable where those of the part decay faster than `rate`."""
        return np.asarray(self.loops + rate * np.eye(self.loops.shape[-1]))


@dataclass(frozen=True, eq=False)
class Found:
    """What became of a cell.

    Attributes
    ----------
    pieces : those that were proved
    missing : the part that was not, where there is one: the cell is not proved
    tried : pieces the cell was in, in the end
    """

    pieces: tuple[Piece, ...]
    missing: Part | None
    tried: int


@dataclass(frozen=True, eq=False)
class CellSearch:
    """Proves cells of one family of loops.

    Attributes
    ----------
    made, flight : the loops
    reading : interval of the true speed by the speed that the gains are read at
    most_pieces : into which a cell may be cut
    largest : prove as much as can be
    """

    made: LoopFamily
    flight: Flight
    reading: tuple[float, float] = (1.0, 1.0)
    most_pieces: int = 64
    largest: bool = False

    def part(self, cell: Cell, box: Box) -> Part:
        """A box inside a cell."""
        gains = corners_of_part(cell.box, cell.corners(self.made.tables), box)
        return Part(box, gains, control_loops(self.made, self.flight, box, gains, self.reading))

    def proved(self, cell: Cell, wanted: float, start: FloatArray | None = None) -> Found:
        """Cut a cell in halves until every piece is proved at the rate `wanted` [1/s], or there are too many.

        Parameters
        ----------
        start : a Lyapunov matrix (n, n) that may prove it already
        """
        pieces: list[Piece] = []
        waiting = [self.part(cell, cell.box)]
        while waiting:
            part = waiting.pop()
            piece = self._best(part, wanted, start)
            if piece is not None:
                pieces.append(piece)
                continue
            tried = len(pieces) + len(waiting) + 1
            axis = _longer(part.box)
            if axis is None or tried + 1 > self.most_pieces:
                return Found(tuple(pieces), part, tried)
            waiting += [self.part(cell, half) for half in reversed(part.box.halves(axis))]
        return Found(tuple(pieces), None, len(pieces))

    def piece(self, part: Part, P: FloatArray) -> Piece | None:
        """What a Lyapunov matrix proves of a part, rounding taken off; None where it is not positive definite."""
        try:
            rate = float(np.min(decay_rates(part.loops, P)))
            sizes = control_sizes(self.made, self.flight, part.box, part.gains, self.reading)
            margin = float(np.max(rounding(sizes, P, self.made.parts)))
        except np.linalg.LinAlgError:
            return None
        return Piece(part.box, rate - margin, P, margin)

    def _best(self, part: Part, wanted: float, start: FloatArray | None) -> Piece | None:
        """The part with a Lyapunov matrix that proves it at the rate wanted; None where none was found."""
        found = None if start is None else self.piece(part, start)
        if found is not None and found.alpha > wanted and not self.largest:
            return found
        P = lyapunov(part.faster(wanted), self.largest)
        piece = None if P is None else self.piece(part, P)
        return piece if piece is not None and piece.alpha > wanted else None


def _longer(box: Box) -> int | None:
    """Axis along which a box is cut: 0 altitude, 1 speed, whichever changes the plant more; None where neither does."""
    (low, high), (slow, fast) = box.altitude, box.speed
    by_altitude, by_speed = (high - low) / (2.0 * SCALE_HEIGHT), float(np.log(fast / slow))
    if max(by_altitude, by_speed) <= 0.0:
        return None
    return 1 if by_speed >= by_altitude else 0
