"""A step response on the wire: the time, and every signal under a name that ends in its unit."""

from __future__ import annotations

from typing import Any

from design.response.step_response import Response
from schedules.wire_names import wire_name
from service.signal_units import signal_unit


def response_document(response: Response) -> dict[str, Any]:
    """Response at one point; totals, trim values included."""
    signals, units = {}, {}
    for column, name in enumerate(response.names):
        unit, size = signal_unit(name, {})
        signals[wire_name(name, unit)] = response.outputs[:, column] * size
        units[wire_name(name, unit)] = unit
    return {"time_s": response.time, "signals": signals, "units": units}
