"""The smallest evenly spaced table that holds as much: what the adaptive one is compared with."""

from __future__ import annotations

from dataclasses import dataclass

from schedules.refine.growing import COARSE
from schedules.refine.judge import Judge
from schedules.refine.lines import Lines, uniform
from schedules.refine.thinning import everything_holds

#: Parts of each interval that are looked at before it is looked at closely: most tables fail there.
GLANCES = (2, COARSE)
#: Tables of up to this many times the points of the adaptive one are tried.
TIMES = 4


@dataclass(frozen=True)
class UniformTable:
    """The smallest evenly spaced table that was found.

    Attributes
    ----------
    lines : its lines; None where none of those that were tried holds
    tried : how many tables were looked at, in the order of their sizes
    largest : the largest number of points that was tried
    """

    lines: Lines | None
    tried: int
    largest: int

    @property
    def words(self) -> str:
        """One sentence."""
        if self.lines is None:
            return f"no evenly spaced table of up to {self.largest} points holds"
        altitude, speed = self.lines.shape
        return f"the smallest evenly spaced table that holds is {altitude} by {speed}: {self.lines.points} points"


def smallest_uniform(judge: Judge, lines: Lines) -> UniformTable:
    """Try evenly spaced tables between the same ends, the smallest first; of equal ones, fewer altitudes first.

    Parameters
    ----------
    lines : of the adaptive table
    """
    counts = [range(2, most + 1) if len(own) > 1 else range(1, 2) for own, most in _sizes(judge, lines)]
    shapes = sorted(((n, m) for n in counts[0] for m in counts[1]), key=lambda shape: (shape[0] * shape[1], shape))
    shapes = [shape for shape in shapes if shape[0] * shape[1] <= TIMES * lines.points]
    for k, shape in enumerate(shapes):
        table = uniform(lines, shape)
        quick = all(judge.look(table, judge.mesh(table, parts)).holds for parts in GLANCES)
        if quick and everything_holds(judge, table):
            return UniformTable(table, k + 1, table.points)
    return UniformTable(None, len(shapes), shapes[-1][0] * shapes[-1][1])


def _sizes(judge: Judge, lines: Lines) -> list[tuple[tuple[float, ...], int]]:
    return [(lines[axis], judge.wanted.most_lines[axis]) for axis in (0, 1)]
