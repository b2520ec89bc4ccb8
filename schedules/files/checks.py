"""What every schedule must be before it is written to a file: a file outlives the program that made it."""

from __future__ import annotations

import re

import numpy as np

from design.gains import Gain
from design.outcome import Outcome
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name

#: Valid as a variable name in MATLAB (63 characters) and in C.
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")

#: Names that the files use for themselves, so that no gain may have them.
RESERVED = frozenset({"outcome", "ok", "filled", "gainfield", "lookup", "K", "N"})


def require_writable(schedule: GainSchedule) -> None:
    """Check that names, shapes and missing values are what the files promise to their readers.

    Raises
    ------
    ValueError : breakpoints that are not finite and strictly increasing, a name that is not valid or
        stands twice, a gain or outcomes of another shape than the grid, a point without an
        outcome, a reason at an ok point, a gain that is not finite there or that has a number where
        the point failed
    """
    names = [axis_name(axis) for axis in schedule.axes] + [gain.name for gain in schedule.gains]
    for name in names:
        if not NAME.fullmatch(name) or name in RESERVED:
            raise ValueError(f"{name!r} cannot be the name of an axis or a gain in a file")
    if len(set(names)) != len(names):
        raise ValueError(f"names of axes and gains must differ: {', '.join(names)}")
    for axis in schedule.axes:
        values = np.asarray(axis.values, dtype=float)
        if values.size == 0 or not np.all(np.isfinite(values)) or np.any(np.diff(values) <= 0):
            raise ValueError(f"breakpoints of {axis_name(axis)} must be finite and strictly increasing")
    if schedule.outcomes.codes.shape != schedule.shape or schedule.outcomes.reasons.shape != schedule.shape:
        raise ValueError(f"outcomes and reasons must have the grid's shape {schedule.shape}")
    if not all(code in tuple(Outcome) for code in schedule.outcomes.codes.flat):
        raise ValueError("every point has an outcome")
    if np.any(schedule.outcomes.ok & (schedule.outcomes.reasons != None)):  # noqa: E711 - elementwise
        raise ValueError("a point that is ok has no reason")
    for gain in schedule.gains:
        _require_gain(schedule, gain)


def _require_gain(schedule: GainSchedule, gain: Gain) -> None:
    if gain.values.shape != schedule.shape:
        raise ValueError(f"{gain.name} has shape {gain.values.shape}, the grid has {schedule.shape}")
    ok = schedule.outcomes.ok
    wrong = np.where(ok, ~np.isfinite(gain.values), ~np.isnan(gain.values))
    if np.any(wrong):
        point = tuple(int(i) for i in np.argwhere(wrong)[0])
        value = float(gain.values[point])
        raise ValueError(
            f"{gain.name} is {value!r} at point {point}, whose outcome is {schedule.outcomes.codes[point]}"
        )
