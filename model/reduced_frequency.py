"""Reduced frequency: how fast a mode is against the air that passes, and so whether the circulation keeps up."""

from __future__ import annotations

from typing import Final

import numpy as np

from model.arrays import ComplexArray, FloatArray, Floats
from model.flight import FlightCondition

#: Above this the circulation is noticeably late: Theodorsen's C(k) is 0.91 - 0.13j there.
QUASI_STEADY_LIMIT: Final = 0.05


def reduced_frequency(poles: ComplexArray | FloatArray, condition: FlightCondition, chord: Floats) -> FloatArray:
    """``k = |s| c / (2 V)`` of modes ``exp(s t)`` (*G, n) [-]: the modulus of the p in C(p).

    For undamped modes it is Theodorsen's reduced frequency. A motion that decays or grows within the time
    the air takes to pass is as fast as one that oscillates, which is why the modulus counts and not the imaginary part.

    Parameters
    ----------
    poles : (*G, n) [rad/s]
    condition : (*G)
    chord : wing chord [m], a number or (*G,)
    """
    time = np.asarray(chord / (2.0 * condition.airspeed))
    return np.asarray(np.abs(poles) * time[..., None])
