"""What this server takes: each limit with its value and its setting, and the checks that name them."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.flight import flight_grid
from schedules.study import PlantStudy
from service.refusals import FieldRefusal, InvalidRequest, LimitExceeded
from service.schemas import flight
from service.schemas.requests import DesignRequest
from service.settings import Settings

#: Limits of a server, in the order in which they are listed, with the unit of each.
LIMITS = {
    "max_body_bytes": "B",
    "max_grid_points": "1",
    "max_controllers": "1",
    "max_point_designs": "1",
    "max_tab_only_designs": "1",
    "max_locus_gains": "1",
    "max_response_samples": "1",
    "max_listed_designs": "1",
    "max_concurrent_designs": "1",
}


def listed(settings: Settings) -> list[dict[str, Any]]:
    """Every limit: name, value, unit, what it bounds, and the setting that changes it."""
    return [
        {
            "name": name,
            "value": getattr(settings, name),
            "unit": unit,
            "description": Settings.model_fields[name].description,
            "setting": setting_of(name),
        }
        for name, unit in LIMITS.items()
    ]


def setting_of(name: str) -> str:
    """Environment variable of a limit."""
    return f"GAINFIELD_{name.upper()}"


def check_size(pointer: str, what: str, size: int, name: str, settings: Settings) -> None:
    """Refuse `size` things when the limit `name` is lower.

    Raises
    ------
    LimitExceeded
    """
    limit: int = getattr(settings, name)
    if size > limit:
        detail = f"{size} {what}; the limit {name} of this server is {limit} (setting {setting_of(name)})"
        raise LimitExceeded(detail, FieldRefusal(pointer, f"{size} {what}", "1", f"<= {limit}"))


def check_grid(grid: flight.Grid, settings: Settings) -> int:
    """Refuse a grid of too many points, before any of them exists; how many there are.

    Raises
    ------
    LimitExceeded
    """
    points = _length(grid.altitude_m) * _length(grid.speed_axis[1])
    check_size("/grid", "grid points", points, "max_grid_points", settings)
    return points


def check_design(request: DesignRequest, settings: Settings) -> None:
    """Refuse a design of too many points or controllers.

    Raises
    ------
    LimitExceeded
    """
    points, controllers = check_grid(request.grid, settings), len(request.controllers)
    check_size("/controllers", "controllers", controllers, "max_controllers", settings)
    work = points * controllers
    check_size("/grid", "grid points times controllers", work, "max_point_designs", settings)
    searches = points * sum(wanted.kind != "lqr" for wanted in request.controllers)
    check_size("/grid", "grid points times tab-only controllers", searches, "max_tab_only_designs", settings)


def check_envelope(study: PlantStudy) -> None:
    """Refuse a grid of which no point lies inside the model: there would be nothing to answer.

    Raises
    ------
    InvalidRequest
    """
    asked = study.grid
    altitude, speed = np.array(asked.altitude), np.array(asked.speed)
    grid = flight_grid(altitude, asked.speed_axis, speed, asked.temperature_offset)
    mach = grid.condition.mach
    if not study.aerodynamics.covers(mach).any():
        detail = f"no grid point lies inside the model: the lowest Mach number is {mach.min():.4g}"
        raise InvalidRequest(f"/grid: {detail}", FieldRefusal("/grid", detail, "1", "Mach < 1 at one point at least"))


def _length(axis: flight.Axis) -> int:
    return axis.count if isinstance(axis, flight.Span) else len(axis)
