"""Statics on the wire: planes and lines of deflections at each grid point."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.arrays import FloatArray
from model.reachable import RangeEnd, ReachableAileron
from model.steady_state import DeflectionMap, FloatLine, SteadyStateMap, TabOnlyEquilibrium
from model.trim import Trim
from service.presenters.grid import (
    air_document,
    coordinates,
    grid_document,
    grid_index,
    outcome_documents,
    warning_documents,
)
from service.presenters.hinge_moments import fit_document
from service.presenters.plant import trim_document
from service.studies.plant import SteadyStates

_STATICS = (
    "trim",
    "plane",
    "zero_aileron_torque",
    "zero_tab_torque",
    "least_torque",
    "tab_only",
    "floating",
    "free",
    "reachable",
)


def statics_document(statics: SteadyStates) -> dict[str, Any]:
    """The answer to a request for steady-state maps."""
    plant, plane = statics.plant, statics.found.deflections
    return {
        "grid": grid_document(plant.grid),
        "air": air_document(plant.grid.condition),
        **outcome_documents(plant.outcomes),
        "warnings": warning_documents(plant.warnings),
        "hinge_moment_fit": fit_document(plant.system.aerodynamics.source),
        "deflections": {"aileron_deg": _degrees(plane.aileron), "tab_deg": _degrees(plane.tab)},
        "points": [_point(statics, point) for point in range(plant.outcomes.codes.size)],
    }


def _point(statics: SteadyStates, point: int) -> dict[str, Any]:
    plant = statics.plant
    index = grid_index(plant.grid, point)
    document = {
        "index": point,
        "coordinates": coordinates(plant.grid, index),
        "outcome": plant.outcomes.codes[index],
        "reason": plant.outcomes.reasons[index],
    }
    if not statics.covered[index]:
        return document | dict.fromkeys(_STATICS)
    found, tab_only = statics.found.take(index), statics.tab_only.take(index)
    return document | {"trim": trim_document(plant.trim.take(index))} | _statics(found, tab_only)


def _statics(found: SteadyStateMap, tab_only: TabOnlyEquilibrium) -> dict[str, Any]:
    return {
        "plane": _plane(found.deflections),
        "zero_aileron_torque": _line(found.zero_aileron_torque),
        "zero_tab_torque": _line(found.zero_tab_torque),
        "least_torque": _line(found.least_torque),
        "tab_only": _float_line(tab_only.line) | {"holds": tab_only.holds},
        "floating": _float_line(found.floating),
        "free": _free(found.free),
        "reachable": _reachable(found.reachable),
    }


def _plane(found: DeflectionMap) -> dict[str, Any]:
    """Planes (m, n) by aileron and tab angle, null beyond the hinge-moment data."""

    def known(values: FloatArray) -> FloatArray:
        return np.where(found.covered, values, np.nan)

    return {
        "C_Ha": known(found.coefficients[..., 1]),
        "C_Ht": known(found.coefficients[..., 0]),
        "T_a_n_m": known(found.torque[..., 1]),
        "T_t_n_m": known(found.torque[..., 0]),
        "total_torque_n_m": known(found.total_torque),
    }


def _line(trim: Trim) -> dict[str, Any]:
    """Angles and torques along a line, null where it does not exist."""

    def reached(values: FloatArray) -> FloatArray:
        return np.where(trim.reached, values, np.nan)

    return {
        "aileron_deg": reached(np.rad2deg(trim.state[..., 2])),
        "tab_deg": reached(np.rad2deg(trim.state[..., 0])),
        "T_a_n_m": reached(trim.torque[..., 1]),
        "T_t_n_m": reached(trim.torque[..., 0]),
        "reasons": trim.reason,
    }


def _float_line(line: FloatLine) -> dict[str, Any]:
    reached = line.trim.reached
    stable = [bool(s) if r else None for s, r in zip(line.stable, reached, strict=True)]
    return _line(line.trim) | {"gain": np.where(reached, line.gain, np.nan), "stable": stable}


def _free(trim: Trim) -> dict[str, Any]:
    aileron, tab = np.where(trim.reached, np.rad2deg(trim.state[[2, 0]]), np.nan)
    return {"aileron_deg": aileron, "tab_deg": tab, "reason": trim.reason}


def _reachable(found: ReachableAileron) -> dict[str, Any]:
    return {"lower": _end(found.lower), "upper": _end(found.upper), "reason": found.reason}


def _end(end: RangeEnd) -> dict[str, Any]:
    return {
        "aileron_deg": np.rad2deg(end.aileron),
        "tab_deg": np.rad2deg(end.tab),
        "T_t_n_m": end.torque,
        "limit": end.limit,
    }


def _degrees(angles: tuple[float, ...]) -> FloatArray:
    return np.rad2deg(angles)
