"""The grid and the air over it, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.outcome import Outcomes
from model.flight import FlightCondition, FlightGrid
from schedules.analysis import EnvelopeWarning
from schedules.wire_names import axis_name


def grid_document(grid: FlightGrid) -> dict[str, Any]:
    """Axes with their breakpoints, and the shape of every array over the grid."""
    axes = [{"name": axis_name(axis), "values": list(axis.values)} for axis in grid.axes]
    return {"axes": axes, "shape": list(grid.shape)}


def air_document(condition: FlightCondition) -> dict[str, Any]:
    """Air and speed, in the shape of the condition: grid arrays, or numbers at a point."""
    return {
        "altitude_m": condition.air.altitude,
        "airspeed_m_s": condition.airspeed,
        "dynamic_pressure_pa": condition.dynamic_pressure,
        "mach": condition.mach,
        "density_kg_m3": condition.air.density,
        "temperature_k": condition.air.temperature,
        "pressure_pa": condition.air.pressure,
        "speed_of_sound_m_s": condition.air.speed_of_sound,
    }


def outcome_documents(outcomes: Outcomes) -> dict[str, Any]:
    """Outcome of each point, and the reason where it is not ok."""
    return {"outcomes": outcomes.codes, "reasons": outcomes.reasons}


def warning_documents(warnings: tuple[EnvelopeWarning, ...]) -> list[dict[str, Any]]:
    """Warnings about some points of the grid."""
    return [{"code": w.code, "detail": w.detail, "points": list(w.points)} for w in warnings]


def coordinates(grid: FlightGrid, index: tuple[int, ...]) -> dict[str, float]:
    """The point's coordinate on each axis, by the axis's name."""
    return {axis_name(axis): axis.values[i] for axis, i in zip(grid.axes, index, strict=True)}


def grid_index(grid: FlightGrid, point: int) -> tuple[int, ...]:
    """Index into grid arrays of a flat row-major point."""
    return tuple(int(i) for i in np.unravel_index(point, grid.shape))
