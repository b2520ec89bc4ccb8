"""Gains between the grid points, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from schedules.interpolate import Interpolated
from schedules.schedule import INTERPOLATION_RULE, OUT_OF_RANGE_RULE, GainSchedule


def gains_document(schedule: GainSchedule, coordinates: dict[str, float], found: Interpolated) -> dict[str, Any]:
    """Interpolated gains by name, with the rule, and whether a coordinate was clipped."""
    missing = any(np.isnan(gain.values) for gain in found.gains)
    return {
        "name": schedule.controller,
        "coordinates": coordinates,
        "gains": {gain.name: gain.values for gain in found.gains},
        "units": {gain.name: gain.unit for gain in found.gains},
        "clipped": bool(found.clipped),
        "rule": INTERPOLATION_RULE,
        "out_of_range": OUT_OF_RANGE_RULE,
        "law": schedule.law,
        "reason": "a grid point that carries weight here has no gains" if missing else None,
    }
