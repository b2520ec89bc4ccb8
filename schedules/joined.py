"""A controller over the whole grid, from the designs of its parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from design.assess import verdicts
from model.arrays import GridArrays
from schedules.designed import ControllerRefused, DesignedController
from schedules.judging import asked
from schedules.study import Controller, Study
from schedules.synthesised import PartDesign


def joined(study: Study, request: Controller, designs: Sequence[PartDesign]) -> DesignedController:
    """The controller over the study's grid, before its gains are smoothed.

    Parameters
    ----------
    study, request : the controller is one of the study's
    designs : of all its parts, in the order of the grid

    Raises
    ------
    ControllerRefused : no point has gains, and at all points of a part the weights cannot work
    ValueError : the designs do not belong together
    """
    with_gains = [one for one in designs if np.any(one.outcomes.ok)]
    refused = [one.refused for one in designs if one.refused is not None]
    if refused and not with_gains:
        raise ControllerRefused(request.name, refused[0].error())
    # What is said of a loop only exists where there are gains, and says how wide it is elsewhere.
    loop = _spread([one.loop for one in designs], designs) if with_gains else _row([one.loop for one in designs])
    whole = PartDesign(
        _row([one.outcomes for one in designs]),
        _row([one.gains for one in designs]),
        loop,
        _spread([one.assessment for one in designs], designs) if with_gains else None,
        _row([one.fastest_mode for one in designs]),
        _row([one.reduced_frequency for one in designs]),
        _row([one.optimum for one in designs]),
        _row([one.observer for one in designs]),
        _row([one.infeasibility for one in designs]),
    )
    shape = len(study.grid.altitude), len(study.grid.speed)
    over_grid = whole.take(np.arange(whole.outcomes.codes.size).reshape(shape))
    assessment, actuators = over_grid.assessment, {"tab": study.tab_actuator, "aileron": study.aileron_actuator}
    said = (
        () if assessment is None
        else verdicts(assessment, over_grid.outcomes.ok, asked(request), study.spec_pack, actuators)
    )  # fmt: skip
    return DesignedController(
        request, over_grid.outcomes, over_grid.gains, over_grid.loop, assessment, over_grid.fastest_mode,
        over_grid.reduced_frequency, said, over_grid.optimum, over_grid.observer, over_grid.infeasibility,
    )  # fmt: skip


def _spread(values: Sequence[Any], designs: Sequence[PartDesign]) -> Any:
    """In one row what only parts with gains have, and nan at the points of the others."""
    with_gains = [bool(np.any(one.outcomes.ok)) for one in designs]
    pattern = values[with_gains.index(True)].take(slice(0, 0))
    return _row(
        [
            value if there else pattern.spread(np.zeros_like(one.outcomes.ok))
            for value, there, one in zip(values, with_gains, designs, strict=True)
        ]
    )


def _row(values: Sequence[Any]) -> Any:
    """Results (n,) one behind the other; what belongs to no point must be the same in all of them.

    Lists that are padded with nan, as crossovers and poles are, become as long as the longest.
    """
    first = values[0]
    if any(type(value) is not type(first) for value in values):
        raise ValueError("the designs of these parts are not of one kind")
    if isinstance(first, np.ndarray):
        widths = tuple(int(n) for n in np.max([value.shape[1:] for value in values], axis=0))
        return np.concatenate([_padded(value, widths) for value in values])
    if isinstance(first, GridArrays):
        names = [field.name for field in fields(first)]  # type: ignore[arg-type]
        return type(first)(**{name: _row([getattr(value, name) for value in values]) for name in names})
    if isinstance(first, tuple) and all(is_dataclass(one) for one in first):
        return tuple(_row(each) for each in zip(*values, strict=True))
    if any(value != first for value in values):
        raise ValueError(f"the designs of these parts do not belong together: {first} is not the same in all")
    return first


def _padded(array: np.ndarray[Any, Any], widths: tuple[int, ...]) -> np.ndarray[Any, Any]:
    """The array (n, ...) with nan behind its entries along the axes after the first; ValueError where nan is none."""
    if array.shape[1:] == widths:
        return array
    if array.dtype.kind not in "fc":
        raise ValueError(f"the designs of these parts do not belong together: shapes {array.shape[1:]} and {widths}")
    wide = np.full((len(array), *widths), np.nan, dtype=array.dtype)
    wide[tuple(slice(n) for n in array.shape)] = array
    return wide
