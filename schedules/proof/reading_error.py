"""How wrong the speed may be that a schedule reads its gains at: the scheduling-signal error margin.

The gains are read at ``(1 + e)`` times the true speed coordinate, the altitude is read right. In a cell of the *table*
the speed read is s and the true one is s times a ratio within ``[1/(1 + e), 1/(1 - e)]``, so that the loops of all
errors up to e, however they change in time, lie between the control loops of one box more. Reading beyond the table
takes its edge, which the cell at the edge covers. Beside what is proved stands where the frozen loop really stops
decaying; the true speed then stays inside the envelope.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from model.arrays import BoolArray, FloatArray
from schedules.proof.cell_search import CellSearch
from schedules.proof.cells import Cell, cells, gains_at
from schedules.proof.family import LoopFamily
from schedules.proof.flight_box import Flight
from schedules.proof.frozen import SAMPLES, rightmost
from schedules.proof.result import ScheduleProof

#: Largest error that is looked at, both ways.
LARGEST_ERROR = 0.8
#: Proved margins are found to this.
RESOLUTION = 0.02
#: Errors at which frozen loops are looked at, each way, and rounds in which the first bad one is closed in on.
STEPS, ROUNDS = 40, 5


@dataclass(frozen=True)
class ReadingMargin:
    """Errors of the scheduling signal that one cell of the table, or the envelope, bears.

    Attributes
    ----------
    index : of the cell's lower corner; None for the envelope
    proved : stable for every error up to this both ways, changing however fast; 0 where nothing is proved
    low, high : frozen loops of true conditions in the cell are stable for errors from ``-low`` to ``high``, as far as
        was looked; `LARGEST_ERROR` where no unstable one was found
    """

    index: tuple[int, int] | None
    proved: float
    low: float
    high: float


@dataclass(frozen=True)
class ReadingMargins:
    """Margins of the envelope, the least of its cells, and of each cell that has gains."""

    envelope: ReadingMargin
    cells: tuple[ReadingMargin, ...]


def reading_margins(proof: ScheduleProof, decay: float = 0.0, most_pieces: int = 2) -> ReadingMargins:
    """Scheduling-signal error margins of a schedule that was taken apart.

    Parameters
    ----------
    decay : rate that must be kept [1/s]; 0 is stability
    most_pieces : into which a cell may be cut

    Raises
    ------
    ValueError : the schedule's loops cannot be taken apart, or no cell has gains
    """
    made, flight = proof.family, proof.flight
    if made is None:
        raise ValueError(f"controller {proof.controller}: {proof.reason}")
    usable = [cell for cell in cells(proof.axes) if np.all(np.isfinite(cell.corners(made.tables)))]
    if not usable:
        raise ValueError(f"controller {proof.controller}: no cell has gains at all its corners")
    found = tuple(
        ReadingMargin(cell.index, _proved(made, flight, cell, decay, most_pieces), *_exact(proof, made, cell, decay))
        for cell in usable
    )
    least = ReadingMargin(None, *(min(getattr(one, name) for one in found) for name in ("proved", "low", "high")))
    return ReadingMargins(least, found)


def true_by_read(error: float) -> tuple[float, float]:
    """Interval of the true speed by the speed read, of all errors up to `error` either way."""
    return 1.0 / (1.0 + error), 1.0 / (1.0 - error)


def _proved(made: LoopFamily, flight: Flight, cell: Cell, decay: float, most_pieces: int) -> float:
    """Largest error that a cell is proved for, both ways."""
    start = None
    low, high = 0.0, LARGEST_ERROR
    trial = 0.0
    while True:
        reading = true_by_read(trial)
        if flight.within_model(cell.box, reading):
            found = CellSearch(made, flight, reading, most_pieces).proved(cell, decay, start)
            holds = found.missing is None
        else:
            holds = False
        if holds:
            start = found.pieces[0].P
            low = trial
        elif trial == 0.0:
            return 0.0
        else:
            high = trial
        if high - low <= RESOLUTION:
            return low
        # The first steps double, so that small margins are found as fast as large ones.
        trial = min(max(2.0 * low, 0.05), 0.5 * (low + high)) if high == LARGEST_ERROR else 0.5 * (low + high)


def _exact(proof: ScheduleProof, made: LoopFamily, cell: Cell, decay: float) -> tuple[float, float]:
    """Smallest errors ``-low`` and ``high`` at which a frozen loop of the cell no longer decays at the rate."""
    fractions = np.linspace(0.0, 1.0, SAMPLES)
    (h1, h2), (s1, s2) = cell.box.altitude, cell.box.speed
    altitude, speed = (
        x.ravel() for x in np.meshgrid(h1 + fractions * (h2 - h1), s1 + fractions * (s2 - s1), indexing="ij")
    )
    terms = proof.flight.terms(altitude, speed, made.terms)

    def too_slow(errors: FloatArray) -> BoolArray:
        gains = gains_at(proof.axes, made.tables, altitude, speed * (1.0 + errors[:, None]))
        known = np.isfinite(gains).all(axis=-1)
        every = np.broadcast_to(terms, (*known.shape, terms.shape[-1]))
        bad = np.zeros(known.shape, dtype=bool)
        values = rightmost(made.closed(every[known], made.products(gains[known])))
        bad[known] = np.any(values.real >= -decay, axis=0)
        return np.asarray(np.any(bad, axis=-1))

    return _first(too_slow, -1.0), _first(too_slow, 1.0)


def _first(too_slow: Callable[[FloatArray], BoolArray], sign: float) -> float:
    """Smallest size of an error of this sign that is too much, of those that were looked at."""
    errors = np.linspace(0.0, LARGEST_ERROR, STEPS + 1)
    for _ in range(ROUNDS):
        bad = too_slow(sign * errors)
        if bad[0]:
            return float(errors[0])
        if not np.any(bad):
            return float(errors[-1])
        k = int(np.argmax(bad))
        errors = np.linspace(errors[k - 1], errors[k], 9)
    return float(errors[0])
