"""What became of a non-linear simulation, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.gains import Gain
from design.simulation.anti_windup import INTEGRALS
from design.simulation.response import NonlinearResponse
from service.wire.signal_units import command_signals, signal_unit

#: Limits in the order of `NonlinearResponse.at_limit`.
LIMITED = ("deflection", "rate", "torque", "power")


def anti_windup_gains(found: NonlinearResponse, inputs: tuple[str, ...]) -> list[Gain]:
    """Back-calculation gains by name, ``W_int_a_T_t``: SI and radians."""
    commands = command_signals(found.names, inputs)
    integrals = [name for name in found.state_names if name in INTEGRALS]
    # An integral's rate is an angle.
    units = {"deg": "1", "deg/s": "s", "N m": "rad/(N m)"}
    return [
        Gain(
            f"W_{integral}_{commands[name]}",
            units[signal_unit(commands[name], {})[0]],
            found.anti_windup_gain[..., i, j],
        )
        for i, integral in enumerate(integrals)
        for j, name in enumerate(inputs)
    ]


def simulation_document(found: NonlinearResponse, inputs: tuple[str, ...]) -> dict[str, Any]:
    """Outcome, limits reached, energies and anti-windup of a simulation at one point."""
    energy = found.energy
    tab, aileron = np.moveaxis(energy.actuators, -1, 0)
    reached = dict(zip(("tab", "aileron"), np.moveaxis(found.at_limit, -2, 0), strict=True))
    return {
        "outcome": str(found.codes[()]),
        "reason": found.reasons[()],
        "diverged_at_s": _number(found.diverged_at),
        "left_data_at_s": _number(found.left_data_at),
        "limits_reached": {name: {what: reached[name][:, i] for i, what in enumerate(LIMITED)} for name in inputs},
        "energy": {
            "kinetic_j": energy.kinetic,
            "tab_actuator_j": tab,
            "aileron_actuator_j": aileron,
            "air_j": energy.air.sum(axis=-1),
            "friction_j": energy.friction,
            "reaction_j": energy.reaction,
            "stops_j": energy.stops,
            "residual_j": energy.residual,
        },
        "anti_windup": [
            {"name": gain.name, "unit": gain.unit, "value": float(gain.values)}
            for gain in anti_windup_gains(found, inputs)
        ],
        "unenforced": list(found.unenforced),
    }


def _number(value: Any) -> float | None:
    """A time, or None where it never came."""
    return float(value) if np.isfinite(value) else None
