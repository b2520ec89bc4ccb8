"""The second opinion on the wire: figures of a design beside the same by python-control."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from design.python_control import version
from schedules.cross_check import Checked, CrossCheck
from schedules.designed import DesignedController, DesignedEnvelope
from service.presenters.grid import coordinates, grid_index

_DEGREES = float(np.rad2deg(1.0))
#: Figure inside -> field on the wire, its unit, and how many of it make one inside.
_WIRE = {
    "gain_margin_up": ("gain_margin_up_db", "dB", 1.0),
    "gain_margin_down": ("gain_margin_down_db", "dB", 1.0),
    "phase_margin": ("phase_margin_deg", "deg", _DEGREES),
    "sensitivity_peak": ("sensitivity_peak", "1", 1.0),
    "rise_time": ("rise_time_s", "s", 1.0),
    "settling_time": ("settling_time_s", "s", 1.0),
    "overshoot": ("overshoot_percent", "%", 100.0),
    "undershoot": ("undershoot_percent", "%", 100.0),
    "steady_state_value": ("steady_state_value_deg", "deg", _DEGREES),
}


@dataclass(frozen=True)
class CheckedHere:
    """A controller at a flat point, and its check; None where it has no gains."""

    point: int
    controller: DesignedController
    check: CrossCheck | None


def cross_check_document(envelope: DesignedEnvelope, points: list[int], found: list[CheckedHere]) -> dict[str, Any]:
    """All checks, point by point, and the largest difference of each figure."""
    grid = envelope.plant.grid
    return {
        "python_control": version(),
        "agrees": all(each.check is None or each.check.agrees for each in found),
        "points": [
            {
                "point": point,
                "coordinates": coordinates(grid, grid_index(grid, point)),
                "controllers": [_controller(each, grid_index(grid, point)) for each in found if each.point == point],
            }
            for point in points
        ],
        "largest_differences": _largest(found),
    }


def _controller(here: CheckedHere, index: tuple[int, ...]) -> dict[str, Any]:
    controller, check = here.controller, here.check or CrossCheck()
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        "outcome": controller.outcomes.codes[index],
        "reason": controller.outcomes.reasons[index],
        "agrees": None if here.check is None else check.agrees,
        "gains": [_checked(each, relative=True) for each in check.gains],
        "poles": [_checked(each, relative=True) for each in check.poles],
        "margins": {cut: [_checked(each) for each in figures] for cut, figures in check.margins.items()},
        "step": [_checked(each) for each in check.step],
        "left_out": [{"figure": each.figure, "reason": each.reason} for each in check.left_out],
    }


def _checked(figure: Checked, relative: bool = False) -> dict[str, Any]:
    name, unit, size = _WIRE.get(figure.name, (figure.name, figure.unit, 1.0))
    return {
        "name": name,
        "unit": unit,
        "value": _number(figure.value, size),
        "python_control": _number(figure.by_control, size),
        "difference": figure.difference * size,
        "difference_unit": "1" if relative else unit,
        "tolerance": figure.tolerance * size,
        "agrees": figure.agrees,
    }


def _number(value: float | complex, size: float) -> Any:
    return {"re": value.real, "im": value.imag} if isinstance(value, complex) else value * size


def _largest(found: list[CheckedHere]) -> list[dict[str, Any]]:
    """The largest difference of gains, of poles, and of each figure of margins and step; one that is nan is largest."""
    worst: dict[tuple[str, str], tuple[float, dict[str, Any]]] = {}
    for each in found:
        for group, cut, figure in _figures(each.check):
            relative = group in ("gains", "poles")
            said = _checked(figure, relative)
            name = group if relative else said["name"]
            part = figure.difference / figure.tolerance
            rank = part if np.isfinite(part) else np.inf
            if (group, name) not in worst or rank > worst[group, name][0]:
                place = {"controller": each.controller.request.name, "point": each.point, "cut": cut}
                kept = {key: said[key] for key in ("difference", "difference_unit", "tolerance", "agrees")}
                worst[group, name] = (rank, {"figure": group, "name": said["name"], **kept, **place})
    return [document for _, document in worst.values()]


def _figures(check: CrossCheck | None) -> Iterator[tuple[str, str | None, Checked]]:
    if check is None:
        return
    for group, figures in (("gains", check.gains), ("poles", check.poles), ("step", check.step)):
        yield from ((group, None, figure) for figure in figures)
    for cut, figures in check.margins.items():
        yield from (("margins", cut, figure) for figure in figures)
