"""Lines moved to where they serve best: towards the worst point, a step of the mesh at a time."""

from __future__ import annotations

from schedules.refine.history import Step
from schedules.refine.judge import Judge, Look
from schedules.refine.lines import AXES, Lines


def moved(judge: Judge, lines: Lines, mesh: Lines) -> list[Step] | None:
    """Steps after which a table holds on a mesh; None where moving lines does not lead there.

    Parameters
    ----------
    lines : of the table, places of the mesh all of them
    mesh : the points that are looked at, and the places where lines may stand
    """
    steps: list[Step] = []
    look = judge.look(lines, mesh)
    while not look.holds:
        found = [(judge.look(other, mesh), axis, value, other) for axis, value, other in _nearer(lines, look, mesh)]
        better = [each for each in found if each[0].score < look.score]
        if not better:
            return None
        look, axis, value, lines = min(better, key=lambda each: each[0].score)
        words = f"the worst is {100.0 * look.score[1]:.3g} % of what is allowed"
        steps.append(Step("move", "size", axis, value, lines, words))
    return steps


def _nearer(lines: Lines, look: Look, mesh: Lines) -> list[tuple[int, float, Lines]]:
    """Tables in which inner lines stand a step of the mesh nearer to the worst point: axis, new place of one, lines.

    The nearest line alone moves, or others behind it with it, which may be all that lets it move.
    """
    assert look.worst is not None
    found = []
    for axis in range(len(AXES)):
        at, places = mesh[axis][look.worst[axis]], list(mesh[axis])
        below = [x for x in reversed(lines[axis][1:-1]) if x < at]
        above = [x for x in lines[axis][1:-1] if x > at]
        for side, step in ((below, 1), (above, -1)):
            for count in range(1, len(side) + 1):
                to = [places[places.index(x) + step] for x in side[:count]]
                values = sorted({*lines[axis], *to} - (set(side[:count]) - set(to)))
                if len(values) == len(lines[axis]):  # none has met another
                    found.append((axis, to[0], lines.replaced(axis, tuple(values))))
    return found
