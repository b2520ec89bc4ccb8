"""Norms of the closed loop as systems of several inputs and outputs, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.disturbance.closed_system import ClosedSystem, closed_system
from design.disturbance.h2 import h2_norm
from design.disturbance.h_infinity import h_infinity_norm
from design.loop import Loop
from service.wire.signal_units import command_signals, ratio_unit, signal_unit

_ANGLES = ("da", "dt")


def norms_document(loop: Loop) -> dict[str, Any]:
    """Norms from torques, from noise of angles and from noise of rates, each to the angles and to the commands.

    Signals of a group are alike, so that the norm of the whole has a unit.
    """
    noise = [name for name in loop.disturbances if name.endswith("_noise")]
    sources = (
        tuple(name for name in loop.disturbances if name.endswith("_disturbance")),
        tuple(name for name in noise if not name.endswith("_rate_noise")),
        tuple(name for name in noise if name.endswith("_rate_noise")),
    )
    systems = [closed_system(loop, inputs, outputs) for inputs in sources for outputs in (_ANGLES, loop.inputs)]
    commands = command_signals(loop.outputs, loop.inputs)
    return {
        "method": "frequency_grid" if any(loop.delay) else "level_sets",
        "systems": [_system(system, commands) for system in systems],
    }


def _system(system: ClosedSystem, commands: dict[str, str]) -> dict[str, Any]:
    peak, norm = h_infinity_norm(system), float(h2_norm(system).total)
    per, per_size = signal_unit(system.inputs[0], commands)
    to, size = signal_unit(system.outputs[0], commands)
    unit, scale, largest = ratio_unit(to, per), size / per_size, float(peak.gain)
    return {
        "from": list(system.inputs),
        "to": list(system.outputs),
        "unit": unit,
        "h_infinity": largest * scale,
        "omega_rad_s": float(peak.omega),
        "h_infinity_reason": None if np.isfinite(largest) else "the largest singular value could not be proved",
        "h2": norm * scale,
        "h2_unit": f"{unit} s^-1/2",
        "h2_reason": _why_no_norm(norm),
    }


def _why_no_norm(norm: float) -> str | None:
    if np.isfinite(norm):
        return None
    if np.isinf(norm):
        return "white noise reaches an output at once: its variance is infinite"
    return "the loop is too ill-conditioned for the norm to be known to a part in ten thousand"
