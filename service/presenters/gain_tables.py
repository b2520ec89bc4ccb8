"""Gains over the grid on the wire: their values, how smoothly they vary, and what was given up for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from design.gains import Gain
from model.flight import GridAxis
from schedules.roughness import Roughness, roughness
from schedules.smoothed import Smoothed


def gain_document(gain: Gain, axes: Sequence[GridAxis]) -> dict[str, Any]:
    """One gain over the grid."""
    rough = roughness_document(roughness(gain.values, axes))
    return {"name": gain.name, "unit": gain.unit, "values": gain.values, "roughness": rough}


def roughness_document(rough: Roughness) -> dict[str, Any]:
    """How far a table without one of its lines would be from the gain there, over all lines."""
    return {
        "worst_percent": None if rough.worst is None else 100.0 * rough.worst,
        "worst_point": rough.point,
        "rms_percent": None if rough.rms is None else 100.0 * rough.rms,
    }


def smoothing_document(smoothed: Smoothed | None) -> dict[str, Any] | None:
    """What smoothing changed and what it cost; None where none was asked for."""
    if smoothed is None:
        return None
    names = [gain.name for gain in smoothed.gains]
    return {
        "roughness_before": {n: roughness_document(r) for n, r in zip(names, smoothed.before, strict=True)},
        "bandwidth_lost_percent": 100.0 * smoothed.cost.bandwidth_lost,
        "distance_before_percent": 100.0 * smoothed.cost.distance_before,
        "distance_after_percent": 100.0 * smoothed.cost.distance_after,
    }
