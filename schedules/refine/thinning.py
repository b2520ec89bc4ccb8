"""Lines taken away that a table does not need, the others moved where that lets one more go.

Whatever is tried is proved and looked at between its own lines before it is kept: a table never gets worse than what is
wanted of it.
"""

from __future__ import annotations

from dataclasses import dataclass

from schedules.refine.growing import FINE
from schedules.refine.history import Step
from schedules.refine.judge import Judge
from schedules.refine.lines import Lines
from schedules.refine.moving import moved

#: Removals for which the other lines are moved, of those that leave the least to be desired.
MOVED_FOR = 2


@dataclass(frozen=True, eq=False)
class Thinned:
    """What is left of a table, and the way there."""

    lines: Lines
    steps: tuple[Step, ...]


def everything_holds(judge: Judge, lines: Lines) -> bool:
    """Whether a table is within what is allowed between its own lines, and proved wherever it can be."""
    return judge.look(lines, judge.mesh(lines, FINE)).holds and not judge.table(lines).refuted_or_undecided


def thin(judge: Judge, start: Lines) -> Thinned:
    """Take lines away one by one as long as everything still holds, the least needed first."""
    lines, steps = start, []
    while step := _one_less(judge, lines):
        steps += step
        lines = step[-1].lines
    return Thinned(lines, tuple(steps))


def _one_less(judge: Judge, lines: Lines) -> list[Step]:
    """Steps to a table of one line less; none where none was found."""
    mesh = judge.mesh(lines, FINE)
    tried = []
    for axis, value in lines.interior():
        fewer = lines.without(axis, value)
        tried.append((judge.look(fewer, mesh).score, axis, value, fewer))
    tried.sort(key=lambda each: each[:3])
    for score, axis, value, fewer in tried:
        if judge.look(fewer, mesh).holds and everything_holds(judge, fewer):
            words = f"not needed: without it the worst is {100.0 * score[1]:.3g} % of what is allowed"
            return [Step("remove", "size", axis, value, fewer, words)]
    for _, axis, value, fewer in tried[:MOVED_FOR]:
        others = moved(judge, fewer, mesh)
        if others and everything_holds(judge, others[-1].lines):
            words = "not needed where the others stand after it"
            return [Step("remove", "size", axis, value, fewer, words), *others]
    return []
