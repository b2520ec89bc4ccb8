"""The way to a table, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from schedules.refine.lines import AXES, Lines


@dataclass(frozen=True)
class Step:
    """One step of the way.

    Attributes
    ----------
    action : ``start``; ``add``, ``remove`` or ``move`` a line; ``evenly``: all lines changed for evenly spaced ones
    cause : what it was for: a ``spec`` lost between the lines, an error of a ``gain``, the ``proof``, or the ``size``
    axis : 0 altitude, 1 speed; None for all
    line : its place; None for all. Of one that was moved, where it is now
    lines : those of the table after it
    words : why, in words and numbers
    """

    action: Literal["start", "add", "remove", "move", "evenly"]
    cause: Literal["spec", "gain", "proof", "size"] | None
    axis: int | None
    line: float | None
    lines: Lines
    words: str

    @property
    def axis_name(self) -> str | None:
        """``altitude`` or ``speed``."""
        return None if self.axis is None else AXES[self.axis]
