"""Gains between the grid points, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from schedules.interpolate import Interpolated
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from schedules.schedule import GainSchedule


def gains_document(schedule: GainSchedule, coordinates: dict[str, float], found: Interpolated) -> dict[str, Any]:
    """Interpolated gains by name, with the rule, and whether a coordinate was clipped."""
    missing = any(np.isnan(gain.values) for gain in found.gains)
    return {
        "name": schedule.controller,
        "coordinates": coordinates,
        "gains": {gain.name: gain.values for gain in found.gains},
        "units": {gain.name: gain.unit for gain in found.gains},
        "clipped": bool(found.clipped),
        "held": bool(found.held),
        "rule": INTERPOLATIONS[schedule.rules.interpolation],
        "out_of_range": OUTS_OF_RANGE[schedule.rules.out_of_range],
        "law": schedule.law,
        "reason": "a grid point that carries weight here has no gains" if missing else None,
    }
