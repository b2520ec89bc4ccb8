"""Frequency responses of a loop at one grid point, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.disturbance.closed_system import closed_system
from design.disturbance.frequency_response import FrequencyResponse, frequency_response
from design.disturbance.loop_responses import loop_responses
from design.loop import Loop
from design.lqr.coded_loop import CodedLoop
from design.lqr.coded_responses import coded_responses
from model.arrays import FloatArray
from service.wire.signal_units import command_signals, ratio_unit, signal_unit

#: What is seen of a disturbance, besides the commands.
_OUTPUTS = ("da", "dt", "da_rate", "dt_rate")


def frequency_response_document(loop: Loop, omega: FloatArray) -> dict[str, Any]:
    """Loop functions, and what references, disturbances and noise do to angles and commands.

    Parameters
    ----------
    loop : at one point
    omega : (W,) [rad/s]
    """
    commands = command_signals(loop.outputs, loop.inputs)
    found = loop_responses(loop, omega)
    outside = (*loop.references, *loop.disturbances)
    seen = frequency_response(closed_system(loop, outside, _OUTPUTS), omega)
    torques = tuple(name for name in loop.disturbances if name.endswith("_disturbance"))
    noise = tuple(name for name in loop.disturbances if name.endswith("_noise"))
    loops = {"loop": found.loop, "sensitivity": found.sensitivity, "complementary": found.complementary}
    return {
        "omega_rad_s": omega,
        **{name: _transfers(response, response.inputs, commands) for name, response in loops.items()},
        "control": _transfers(found.command, outside, commands),
        "reference": _transfers(seen, loop.references, commands),
        "disturbance": _transfers(seen, torques, commands),
        "noise": _transfers(seen, noise, commands),
        "singular_values": {name: response.singular_values.T for name, response in loops.items()},
    }


def coded_responses_document(loop: CodedLoop, omega: FloatArray) -> dict[str, Any]:
    """The same of a loop that runs as code, at its samples; disturbances and noise left out."""
    commands, nothing = command_signals(loop.continuous.outputs, loop.inputs), list[dict[str, Any]]()
    found = coded_responses(loop, omega)
    loops = {"loop": found.loop, "sensitivity": found.sensitivity, "complementary": found.complementary}
    seen = [found.reference.outputs.index(name) for name in _OUTPUTS]
    reference = FrequencyResponse(omega, found.reference.value[:, seen, :], loop.references, _OUTPUTS)
    return {
        "omega_rad_s": omega,
        **{name: _transfers(response, response.inputs, commands) for name, response in loops.items()},
        "control": _transfers(found.command, loop.references, commands),
        "reference": _transfers(reference, loop.references, commands),
        "disturbance": nothing,
        "noise": nothing,
        "singular_values": {name: response.singular_values.T for name, response in loops.items()},
    }


def _transfers(response: FrequencyResponse, sources: tuple[str, ...], commands: dict[str, str]) -> list[dict[str, Any]]:
    """One entry for each pair of a source and an output."""
    magnitude, phase = response.magnitude, response.phase
    entries = []
    for column, source in enumerate(response.inputs):
        if source not in sources:
            continue
        per, per_size = signal_unit(source, commands)
        for row, output in enumerate(response.outputs):
            unit, size = signal_unit(output, commands)
            entries.append(
                {
                    "from": source,
                    "to": output,
                    "unit": ratio_unit(unit, per),
                    "magnitude": magnitude[:, row, column] * (size / per_size),
                    "phase_deg": np.rad2deg(phase[:, row, column]),
                }
            )
    return entries
