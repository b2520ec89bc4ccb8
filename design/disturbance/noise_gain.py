"""How much noise of the measured aileron angle comes through to the commanded tab deflection."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.disturbance.closed_system import closed_system
from design.disturbance.h_infinity import pair_peaks
from design.loop import Loop
from model.arrays import FloatArray

_NOISE, _COMMAND = "da_noise", "dt_command"


def noise_gain(loop: Loop) -> FloatArray | None:
    """Largest gain over all frequencies from noise on the aileron's angle to the commanded tab deflection.

    Returns
    -------
    (*G,) [rad/rad], nan where the point carries no stable design; None for a loop that commands no deflection
    """
    if _COMMAND not in loop.outputs or _NOISE not in loop.disturbances:
        return None
    system = closed_system(loop, (_NOISE,), (_COMMAND,))
    # The output is the command that the true angle asks for; noise enters it as the angle does.
    gain = loop.C[..., loop.outputs.index(_COMMAND), loop.states.index("da")]
    direct = gain[..., None, None]
    parts = None if system.parts is None else replace(system.parts, J=system.parts.J + direct)
    peak = pair_peaks(replace(system, D=system.D + direct, parts=parts))
    return np.asarray(peak.gain[..., 0, 0])
