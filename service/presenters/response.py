"""A step response on the wire: the time, and every signal under a name that ends in its unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.lqr.sampled_response import SampledResponse
from design.response.manoeuvre_response import ManoeuvreResponse
from design.response.step_response import Response
from design.simulation.response import NonlinearResponse
from model.arrays import FloatArray
from schedules.wire_names import wire_name
from service.wire.signal_units import signal_unit


def response_document(response: Response | ManoeuvreResponse | NonlinearResponse) -> dict[str, Any]:
    """Response at one point; totals, trim values included."""
    return _document(response.names, response.time, response.outputs)


def sampled_response_document(response: SampledResponse, samples: int) -> dict[str, Any]:
    """The same of a loop that runs as code, between its samples too: exact values at some `samples` times.

    Where a command arrives its jump is in two values at one time, if it is among these times.
    """
    times = response.held.times.reshape(-1)
    signals = response.held.signals(response.rows).reshape(len(response.names), -1)
    chosen = np.unique(np.linspace(0, times.size - 1, min(samples, times.size)).round().astype(int))
    return _document(response.names, times[chosen], signals[:, chosen].T)


def _document(names: tuple[str, ...], time: FloatArray, outputs: FloatArray) -> dict[str, Any]:
    signals, units = {}, {}
    for column, name in enumerate(names):
        unit, size = signal_unit(name, {})
        signals[wire_name(name, unit)] = outputs[:, column] * size
        units[wire_name(name, unit)] = unit
    return {"time_s": time, "signals": signals, "units": units}
