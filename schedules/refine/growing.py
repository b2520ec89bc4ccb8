"""Lines added where a table needs them most: where a spec is lost, a gain is wrong, or a cell is not proved."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from schedules.proof.cells import Cell, cells
from schedules.proof.frozen import frozen_loops, rightmost
from schedules.proof.result import CellProof, CellStatus
from schedules.refine.history import Step
from schedules.refine.judge import Judge, Look, Table
from schedules.refine.lines import Lines
from schedules.refine.moving import moved

#: Parts that each interval is cut into to be looked at: while lines are chosen, and in the end.
COARSE, FINE = 4, 8
#: A line helps that lowers what is worst by this part.
HELPS = 0.25
#: An interval is not cut that is shorter than this part of the envelope.
SHORTEST = 1e-3


@dataclass(frozen=True, eq=False)
class Grown:
    """Where adding lines led to.

    Attributes
    ----------
    lines : of the table
    holds : whether everything that is wanted does, as far as lines could help
    steps : the way
    why : why it stopped, in words, where not everything holds
    """

    lines: Lines
    holds: bool
    steps: tuple[Step, ...]
    why: str | None


def grow(judge: Judge, start: Lines) -> Grown:
    """Add lines one by one until everything holds, or no line is left that could help."""
    lines, parts, may_move = start, COARSE, True
    steps: list[Step] = []
    while True:
        look = judge.look(lines, judge.mesh(lines, parts))
        if not look.holds:
            step, why = _for_specs(judge, lines, look), "the specs or gains between the lines"
            if step is None and may_move:  # once: another mesh might lead back
                may_move, others = False, moved(judge, lines, judge.mesh(lines, FINE))
                if others:
                    steps += others
                    lines = others[-1].lines
                    continue
        elif parts < FINE:
            parts = FINE
            continue
        else:
            table = judge.table(lines)
            if not table.refuted_or_undecided:
                return Grown(lines, True, tuple(steps), None)
            step, why = _for_proof(judge, lines, table), "the proof"
        if step is None:
            hopeless = look.holds and not _by_need(judge.table(lines))
            return Grown(lines, False, tuple(steps), _stopped(judge, lines, why, hopeless))
        steps.append(step)
        lines = step.lines


def _stopped(judge: Judge, lines: Lines, what: str, hopeless: bool) -> str:
    """Why no line was added, in words; `hopeless` where none could help."""
    most = judge.wanted.most_lines
    full = [name for name, count, top in zip(("altitude", "speed"), lines.shape, most, strict=True) if count >= top]
    if full and not hopeless:
        return f"{what} would need more lines of {' or '.join(full)} than {most[0]} by {most[1]}"
    return f"no line that could be added helps {what}"


def _for_specs(judge: Judge, lines: Lines, look: Look) -> Step | None:
    """The line through the worst cell that helps at the worst point and leaves the least to be desired on the mesh."""
    assert look.worst is not None
    point = look.mesh.altitude[look.worst[0]], look.mesh.speed[look.worst[1]]
    tried = []
    for axis in (0, 1):
        for value in _inside(look.mesh[axis], lines[axis], point[axis]):
            candidate = _with_line(judge, lines, axis, value)
            if candidate is not None:
                found = judge.look(candidate, look.mesh)
                # Designs that do more than is asked hide what others lose: the best line may bring to light what is
                # worse elsewhere, and one that changes nothing would look better.
                idle = not found.severity[look.worst] <= (1.0 - HELPS) * look.largest
                tried.append((idle, found.score, axis, value, candidate))
    if not tried:
        return None
    _, _, axis, value, candidate = min(tried, key=lambda each: each[:4])
    cause, words = _lost(judge, look)
    return Step("add", cause, axis, value, candidate, words)


def _lost(judge: Judge, look: Look) -> tuple[Literal["spec", "gain"], str]:
    """The worst that a look found, in words."""
    spec = max(look.specs, key=lambda each: each.loss, default=None)
    gain = max(look.gains, key=lambda each: each.error, default=None)
    allowed = judge.wanted.gain_error
    if spec is not None and (
        gain is None or allowed is None or spec.loss / judge.wanted.spec_tolerance >= gain.error / allowed
    ):
        what = "its limit" if spec.against == "limit" else "the design there"
        return "spec", (
            f"{spec.quantity} is {spec.value:.4g} at {spec.altitude:.6g} m and {spec.speed:.6g}, "
            f"{100.0 * spec.loss:.3g} % worse than {what}, {spec.reference:.4g}"
        )
    assert gain is not None
    return "gain", (
        f"{gain.name} is off by {100.0 * gain.error:.3g} % of its size at {gain.altitude:.6g} m and {gain.speed:.6g}"
    )


def _inside(mesh: tuple[float, ...], lines: tuple[float, ...], value: float) -> list[float]:
    """Places of the mesh inside the intervals that a value lies in, its ends included."""
    found = []
    for low, high in pairwise(lines):
        if low <= value <= high and high - low > 2.0 * SHORTEST * (lines[-1] - lines[0]):
            found += [x for x in mesh if low < x < high]
    return sorted(set(found))


def _with_line(judge: Judge, lines: Lines, axis: int, value: float) -> Lines | None:
    """The lines and one more; None where there may not be more, or where it would spoil a cell.

    A point of it that has no design must lie beside one that has none already.
    """
    if len(lines[axis]) >= judge.wanted.most_lines[axis] or len(lines[axis]) < 2:
        return None
    found = lines.added(axis, value)
    ok = np.asarray(np.isfinite(judge.gains(found)).all(axis=-1))
    across = ok if axis == 0 else ok.T
    k = found[axis].index(value)
    return found if np.all(across[k] | ~across[k - 1] | ~across[k + 1]) else None


def _for_proof(judge: Judge, lines: Lines, table: Table) -> Step | None:
    """A line through the middle of the cell that is farthest from its proof, across or along, whichever proves more."""
    for proof in _by_need(table):
        tried = []
        for axis, ends in ((0, proof.box.altitude), (1, proof.box.speed)):
            middle = 0.5 * (ends[0] + ends[1])
            if ends[1] - ends[0] <= 2.0 * SHORTEST * (lines[axis][-1] - lines[axis][0]):
                continue
            if (candidate := _with_line(judge, lines, axis, middle)) is not None:
                tried.append((_unproved(judge.table(candidate)), -axis, middle, candidate))
        if tried:
            _, axis, middle, candidate = min(tried, key=lambda each: each[:3])
            words = f"cell {list(proof.index)} is {proof.status}: {proof.reason}"
            return Step("add", "proof", -axis, middle, candidate, words)
    return None


def _by_need(table: Table) -> list[CellProof]:
    """Cells that a line might help to prove, those first that decay slowest for what is wanted of them."""
    whole = {cell.index: cell for cell in cells(table.plant.grid.axes)}
    open_cells = [
        cell
        for cell in table.proof.cells
        if cell.status in (CellStatus.REFUTED, CellStatus.UNDECIDED)
        and cell.slowest is not None
        and too_slow_at_a_point(table, whole[cell.index], cell) is None
    ]
    return sorted(open_cells, key=lambda cell: cell.slowest.rate - cell.wanted if cell.slowest else 0.0)


def too_slow_at_a_point(table: Table, cell: Cell, proof: CellProof) -> str | None:
    """Why no line can help: at a corner of the cell the designed loop itself is too slow; None where it is not."""
    made = table.proof.family
    if made is None:
        return None
    if not np.all(np.isfinite(cell.corners(made.tables))):
        return None  # without gains at a corner there is no loop to be slow
    side = np.array([[0.0, 0.0], [1.0, 1.0]])
    loops = frozen_loops(made, table.proof.flight, cell.box, cell.corners(made.tables), side, side.T)
    rates = np.min(-rightmost(loops).real, axis=0)
    if np.any(rates <= proof.wanted):
        k = np.unravel_index(int(np.argmin(rates)), rates.shape)
        altitude, speed = cell.box.altitude[k[0]], cell.box.speed[k[1]]
        return f"at the grid point {altitude:.6g} m and {speed:.6g} the design itself decays at {rates[k]:.4g} 1/s"
    return None


def _unproved(table: Table) -> float:
    """Part of the envelope that is not proved."""
    whole = [_area(cell) for cell in table.proof.cells]
    left = [_area(cell) for cell in table.proof.cells if cell.status is not CellStatus.PROVED]
    return float(np.sum(left) / max(np.sum(whole), np.finfo(float).tiny))


def _area(proof: CellProof) -> float:
    """Size of a cell; an axis of no width counts as one."""
    (low, high), (slow, fast) = proof.box.altitude, proof.box.speed
    return (high - low or 1.0) * (fast - slow or 1.0)
