"""What this server takes: each limit with its value and its setting, and the checks that name them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from design.loop import Loop
from design.manoeuvre import Manoeuvre
from design.simulation.request import SimulationRequest
from design.simulation.simulate import simulation_steps
from design.simulation.time_grid import LARGEST_COUNT
from model.flight import flight_grid
from schedules.study import PlantStudy
from service.schemas import aerodynamics, flight
from service.schemas.actuators import Actuators
from service.schemas.controller_requests import Controller
from service.schemas.lqr_requests import KalmanFilter, Lqr
from service.schemas.requests import DesignRequest, LinearModelsRequest
from service.schemas.studies import EigenvalueSweepRequest, SteadyStateMapRequest
from service.schemas.weights import PowerWeights
from service.settings import Settings
from service.wire.refusals import FieldRefusal, InvalidRequest, LimitExceeded

#: Limits of a server, in the order in which they are listed, with the unit of each.
LIMITS = {
    "max_body_bytes": "B",
    "max_grid_points": "1",
    "max_controllers": "1",
    "max_point_designs": "1",
    "max_tab_only_designs": "1",
    "max_locus_gains": "1",
    "max_response_samples": "1",
    "max_table_rows": "1",
    "max_map_cells": "1",
    "max_sweep_models": "1",
    "max_flown_loops": "1",
    "max_delayed_loops": "1",
    "max_actuator_candidates": "1",
    "max_manoeuvre_stretches": "1",
    "max_swept_samples": "1",
    "max_step_samples": "1",
    "max_simulated_steps": "1",
    "max_worst_case_rows": "1",
    "max_compared_samples": "1",
    "max_weight_searches": "1",
    "max_profile_steps": "1",
    "max_refined_points": "1",
    "max_proof_pieces": "1",
    "max_cross_checks": "1",
    "max_compared_points": "1",
    "max_listed_designs": "1",
    "max_concurrent_designs": "1",
    "job_work_factor": "1",
    "max_queued_jobs": "1",
    "max_running_jobs": "1",
    "job_workers": "1",
    "max_waiting_designs": "1",
    "max_connections": "1",
    "max_repeatable_answers": "1",
}

#: Those that bound how long an answer takes: a job may be so many times as much (`Settings.job_work_factor`).
WORK_LIMITS = (
    "max_grid_points",
    "max_point_designs",
    "max_tab_only_designs",
    "max_flown_loops",
    "max_delayed_loops",
    "max_swept_samples",
    "max_simulated_steps",
    "max_worst_case_rows",
    "max_compared_samples",
    "max_weight_searches",
    "max_profile_steps",
    "max_refined_points",
    "max_proof_pieces",
    "max_cross_checks",
    "max_compared_points",
)


@dataclass(frozen=True)
class WorkRefusal(FieldRefusal):
    """More work than is done in line, of a kind that a job may do more of.

    Attributes
    ----------
    limit : name of the limit
    size : of the work
    """

    limit: str = ""
    size: int = 0


def of_jobs(settings: Settings) -> Settings:
    """The same settings with the limits that hold for jobs."""
    factor = settings.job_work_factor
    return settings.model_copy(update={name: factor * getattr(settings, name) for name in WORK_LIMITS})


def fits_in_a_job(refused: LimitExceeded, settings: Settings) -> bool:
    """Whether work that is refused in line is within what a job may do.

    Raises
    ------
    LimitExceeded : it is of such a kind, and above what a job may do; names that limit
    """
    if settings.job_work_factor == 1:
        return False
    works = [field for field in refused.fields if isinstance(field, WorkRefusal)]
    for work in works:
        most = settings.job_work_factor * int(getattr(settings, work.limit))
        if work.size > most:
            detail = (
                f"{work.detail}; a job of this server does {most} at most, {settings.job_work_factor} times the limit "
                f"{work.limit} (settings {setting_of('job_work_factor')}, {setting_of(work.limit)})"
            )
            allowed = f"<= {most} in a job"
            raise LimitExceeded(detail, FieldRefusal(work.pointer, work.detail, work.unit, allowed)) from refused
    return bool(works)


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
        field = FieldRefusal(pointer, f"{size} {what}", "1", f"<= {limit}")
        if name in WORK_LIMITS:
            field = WorkRefusal(pointer, field.detail, field.unit, field.allowed, name, size)
        raise LimitExceeded(detail, field)


def check_grid(grid: flight.Grid, settings: Settings) -> int:
    """Refuse a grid of too many points, before any of them exists; how many there are.

    Raises
    ------
    LimitExceeded
    """
    points = _length(grid.altitude_m) * _length(grid.speed_axis[1])
    check_size("/grid", "grid points", points, "max_grid_points", settings)
    return points


def check_table(wire: aerodynamics.Aerodynamics, settings: Settings, fits: int = 1) -> None:
    """Refuse a table of too many rows, before any of them is read, or too many fits of it.

    Raises
    ------
    LimitExceeded
    """
    if not isinstance(wire, aerodynamics.Table):
        return
    by_csv = wire.csv is not None
    rows = len(str(wire.csv).splitlines()) if by_csv else len(wire.rows or ())
    pointer, what = f"/aerodynamics/{'csv' if by_csv else 'rows'}", "lines" if by_csv else "rows"
    check_size(pointer, what, rows, "max_table_rows", settings)
    check_size("/vary/values", f"{what} times values", rows * fits, "max_table_rows", settings)


def check_plant(request: LinearModelsRequest, settings: Settings) -> int:
    """Refuse the plant of too many grid points or table rows; how many points there are.

    Raises
    ------
    LimitExceeded
    """
    check_table(request.aerodynamics, settings)
    return check_grid(request.grid, settings)


def check_map(request: SteadyStateMapRequest, settings: Settings) -> None:
    """Refuse a steady-state map of too many cells.

    Raises
    ------
    LimitExceeded
    """
    plane = request.deflections
    cells = check_plant(request, settings) * _length(plane.aileron_deg) * _length(plane.tab_deg)
    check_size("/deflections", "grid points times cells", cells, "max_map_cells", settings)


def check_sweep(request: EigenvalueSweepRequest, refits: bool, settings: Settings) -> None:
    """Refuse a sweep of too many linear models, or of a table that would be fitted too often.

    Raises
    ------
    LimitExceeded
    """
    points, values = check_plant(request, settings), _length(request.vary.values)
    check_size("/vary/values", "grid points times values", points * values, "max_sweep_models", settings)
    if refits:
        check_table(request.aerodynamics, settings, values)


def check_design(request: DesignRequest, settings: Settings) -> None:
    """Refuse a design of too many points, controllers or rows.

    Raises
    ------
    LimitExceeded
    """
    points, controllers = check_plant(request, settings), len(request.controllers)
    check_size("/controllers", "controllers", controllers, "max_controllers", settings)
    work = points * controllers
    check_size("/grid", "grid points times controllers", work, "max_point_designs", settings)
    searches = points * sum(_searches(wanted, request.actuators) for wanted in request.controllers)
    what = (
        "searches: grid points times tab-only controllers whose gains are chosen and lqr controllers with powers to "
        "meet or with delays, these times 1 + delay_states // 2, and 4 more with a Kalman filter"
    )
    check_size("/grid", what, searches, "max_tab_only_designs", settings)


def check_made_again(request: DesignRequest, settings: Settings) -> None:
    """Refuse to make a stored design again that is larger than what is designed here, its searches not counted.

    Raises
    ------
    LimitExceeded
    """
    work = check_grid(request.grid, settings) * len(request.controllers)
    check_size("/grid", "grid points times controllers", work, "max_point_designs", settings)


#: Stretches that a period of a sine counts for.
_STRETCHES = 8


def check_manoeuvre(manoeuvre: Manoeuvre, duration: float, flights: int, settings: Settings) -> None:
    """Refuse a manoeuvre of too many knots and periods for as many flights: grid points, of each design that flies it.

    Raises
    ------
    LimitExceeded
    """
    periods = int(min(manoeuvre.omega * duration / 6.0, 1e9))
    stretches = (len(manoeuvre.times) + _STRETCHES * periods) * flights
    what = f"stretches: grid points times knots and {_STRETCHES} for each period of a sine, of every design"
    check_size("/manoeuvre", what, stretches, "max_manoeuvre_stretches", settings)


def check_steps(
    pointer: str,
    loop: Loop,
    manoeuvre: Manoeuvre,
    asked: SimulationRequest,
    settings: Settings,
    times: int = 1,
) -> None:
    """Refuse simulations of too many steps: those of all points, and those of the point with most 100 times.

    Parameters
    ----------
    pointer : field that the steps grow with
    loop : of the points that carry a design
    times : how many simulations of this kind

    Raises
    ------
    LimitExceeded
    """
    check_manoeuvre(manoeuvre, asked.duration, 1, settings)
    steps = np.minimum(simulation_steps(loop, manoeuvre, asked), LARGEST_COUNT)
    work = times * int(steps.sum() + 100 * steps.max(initial=0))
    what = "steps of the simulation: of all points, and 100 times those of the point with most"
    check_size(pointer, what, work, "max_simulated_steps", settings)


def _searches(wanted: Controller, actuators: Actuators) -> int:
    """How many searches of some 50 ms a controller takes at each grid point."""
    if not isinstance(wanted, Lqr):
        return 0 if wanted.all_gains_given else 1
    delayed = actuators.tab.delay_s > 0.0 or actuators.aileron.delay_s > 0.0
    powers = isinstance(wanted.weights, PowerWeights) and (
        wanted.weights.form == "balanced" or wanted.weights.keep_settling
    )
    late = 1 + wanted.delay_states // 2 + (4 if isinstance(wanted.measurement, KalmanFilter) else 0) if delayed else 0
    return late + (1 if powers else 0)


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
