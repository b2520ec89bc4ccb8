"""The smallest table of a controller that is proved everywhere and keeps its specs between the lines."""

from __future__ import annotations

import numpy as np

from schedules.proof.cells import Cell, cells
from schedules.proof.result import CellStatus
from schedules.refine.flown import Meshes, refuse_unflown
from schedules.refine.growing import FINE, grow, too_slow_at_a_point
from schedules.refine.history import Step
from schedules.refine.judge import Judge, Look, Table
from schedules.refine.lines import Lines
from schedules.refine.losses import criteria
from schedules.refine.point_designs import PointDesigns
from schedules.refine.request import RefineRequest
from schedules.refine.result import RefinedSchedule, Remaining, Work
from schedules.refine.thinning import thin
from schedules.refine.uniform_tables import UniformTable, smallest_uniform
from schedules.study import Controller, Study


def refine(study: Study, controller: str | Controller, wanted: RefineRequest | None = None) -> RefinedSchedule:
    """Find the smallest table of a controller that holds what is wanted, every cell proved.

    From a coarse start lines are added one by one: through the cell where most is lost between the lines, at the place
    that leaves the least to be desired; and through the middle of cells that are not proved. Then lines are taken away
    that are not needed, others moved in their place. No smaller table is known to exist; none is known not to.
    The same request gives the same table.

    Parameters
    ----------
    study : the envelope is that of its grid unless `wanted` says another
    controller : name of one of the study's, or any other
    wanted : what must hold

    Raises
    ------
    KeyError : the study has no controller of this name
    ValueError : a controller whose gains cannot be read away from their points, a trim given grid point by grid point,
        or a start of more lines than there may be
    schedules.designed.ControllerRefused : weights that cannot work at any point
    """
    wanted = wanted or RefineRequest()
    request = _named(study, controller)
    refuse_unflown(request)
    start = _start(study, wanted)
    held = criteria(study, request, wanted)
    quantities = tuple(dict.fromkeys(each.quantity for each in held))
    judge = Judge(wanted, held, PointDesigns(study, request, quantities), Meshes(study, request))
    steps = [Step("start", None, None, None, start, f"{start.shape[0]} by {start.shape[1]} lines")]
    grown = grow(judge, start)
    steps += grown.steps
    lines, beside = grown.lines, None
    if grown.holds:
        thinned = thin(judge, lines)
        steps += thinned.steps
        lines = thinned.lines
        if wanted.uniform:
            beside = smallest_uniform(judge, lines)
            lines = _smaller(lines, beside, steps)
    table = judge.table(lines)
    look = judge.look(lines, judge.mesh(lines, FINE), table.gains)
    left = _remaining(judge, table, look, lines)
    why = grown.why if grown.why is not None else table.proof.reason
    return RefinedSchedule(
        wanted, table.study, table.plant, table.designed, table.proof, lines, look.specs, look.gains, look.undesigned,
        look.mesh.points, tuple(steps), beside, left, why if left else None,
        Work(judge.looks, judge.proofs, judge.designs.count),
    )  # fmt: skip


def _named(study: Study, controller: str | Controller) -> Controller:
    if not isinstance(controller, str):
        return controller
    for request in study.controllers:
        if request.name == controller:
            return request
    raise KeyError(controller)


def _start(study: Study, wanted: RefineRequest) -> Lines:
    """The lines that are begun with.

    Raises
    ------
    ValueError : more of them than there may be
    """
    found = []
    for own, ends in ((study.grid.altitude, wanted.altitude), (study.grid.speed, wanted.speed)):
        low, high = (own[0], own[-1]) if ends is None else ends
        between = tuple(x for x in own if low < x < high) if wanted.start == "study" else ()
        found.append((low,) if low == high else (low, *between, high))
    lines = Lines(*found)
    if any(count > most for count, most in zip(lines.shape, wanted.most_lines, strict=True)):
        raise ValueError(f"the start has {lines.shape} lines, more than most_lines {wanted.most_lines}")
    return lines


def _smaller(lines: Lines, beside: UniformTable, steps: list[Step]) -> Lines:
    """The evenly spaced table where that has fewer points."""
    if beside.lines is None or beside.lines.points >= lines.points:
        return lines
    steps.append(Step("evenly", "size", None, None, beside.lines, beside.words))
    return beside.lines


def _remaining(judge: Judge, table: Table, look: Look, lines: Lines) -> tuple[Remaining, ...]:
    """Cells that are not proved, or in which more is lost than is allowed, and why."""
    found = []
    for cell, proof in zip(cells(table.plant.grid.axes), table.proof.cells, strict=True):
        reasons = []
        if proof.status is not CellStatus.PROVED:
            slow = too_slow_at_a_point(table, cell, proof) if proof.status is not CellStatus.SAMPLED else None
            reasons.append(f"{proof.status}: {slow or proof.reason}")
        lost = _largest_inside(look, lines, cell)
        if lost > 1.0:
            reasons.append(f"the worst loss or error is {100.0 * lost:.4g} % of what is allowed")
        if reasons:
            found.append(Remaining(cell.index, cell.box, "; ".join(reasons)))
    return tuple(found)


def _largest_inside(look: Look, lines: Lines, cell: Cell) -> float:
    """The largest severity of a look in one cell, its edges included; 0 where nothing is held."""
    inside = [
        [k for k, x in enumerate(look.mesh[axis]) if ends[0] <= x <= ends[1]]
        for axis, ends in ((0, cell.box.altitude), (1, cell.box.speed))
    ]
    values = look.severity[inside[0][0] : inside[0][-1] + 1, inside[1][0] : inside[1][-1] + 1]
    return float(np.nanmax(values)) if np.any(~np.isnan(values)) else 0.0
