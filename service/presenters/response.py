"""A step response on the wire: the time, and every signal under a name that ends in its unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.response.step_response import Response
from schedules.wire_names import wire_name

#: Output of a loop -> its unit inside; angles are turned to degrees.
_UNITS = {
    "da": "rad",
    "dt": "rad",
    "da_rate": "rad/s",
    "dt_rate": "rad/s",
    "dt_command": "rad",
    "T_t": "N m",
    "T_a": "N m",
}
_DEGREES = {"rad": "deg", "rad/s": "deg/s"}


def response_document(response: Response) -> dict[str, Any]:
    """Response at one point; totals, trim values included."""
    signals, units = {}, {}
    for column, name in enumerate(response.names):
        unit = _UNITS[name]
        values = response.outputs[:, column]
        if unit in _DEGREES:
            unit, values = _DEGREES[unit], np.rad2deg(values)
        signals[wire_name(name, unit)] = values
        units[wire_name(name, unit)] = unit
    return {"time_s": response.time, "signals": signals, "units": units}
