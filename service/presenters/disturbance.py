"""What disturbances and noise do to a loop at one grid point, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.disturbance.assessment import Disturbance, assess_disturbances
from design.loop import Loop
from service.wire.signal_units import command_signals, ratio_unit, signal_unit


def disturbance_documents(loop: Loop) -> list[dict[str, Any]]:
    """One entry for each pair of a disturbance and what it reaches; `loop` is that of one point."""
    found = assess_disturbances(loop)
    commands = command_signals(loop.outputs, loop.inputs)
    entries = []
    for column, source in enumerate(found.disturbances):
        per, per_size = signal_unit(source, commands)
        for row, output in enumerate(found.outputs):
            unit, size = signal_unit(output, commands)
            scale, pair = size / per_size, (row, column)
            entries.append(
                {
                    "from": source,
                    "to": output,
                    "unit": ratio_unit(unit, per),
                    "peak_gain": _number(found.peak.gain[pair] * scale),
                    "peak_omega_rad_s": _number(found.peak.omega[pair]),
                    "h2": _number(found.h2.pairs[pair] * scale),
                    "h2_unit": f"{ratio_unit(unit, per)} s^-1/2",
                    "step": _step(found, pair, scale) if source.endswith("_disturbance") else None,
                }
            )
    return entries


def _step(found: Disturbance, pair: tuple[int, int], scale: float) -> dict[str, Any]:
    rejection = found.rejection
    return {
        "peak": _number(rejection.peak[pair] * scale),
        "peak_time_s": _number(rejection.peak_time[pair]),
        "rejection_time_s": _number(rejection.rejection_time[pair]),
        "residual": _number(rejection.residual[pair] * scale),
    }


def _number(value: Any) -> float | None:
    """A figure, or None where it is unlimited or does not exist."""
    return float(value) if np.isfinite(value) else None
