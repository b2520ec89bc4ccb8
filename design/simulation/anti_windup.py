"""Anti-windup by back-calculation: integrals follow what the actuators can do.

    int' = r - d + L (v_possible - v),     L = -rate pinv(K_int)

With ``v = -K_int int + ...`` the second term alone would take v to v_possible at ``rate`` [1/s]: the inverse of the
tracking time constant of back-calculation (Astrom and Hagglund). It vanishes while nothing saturates.

The rule for the rate is the modulus of the slowest closed-loop pole, delays left out: an integral that has wound up
comes back as fast as the loop's slowest mode, and the term makes nothing stiffer than the loop is.
"""

from __future__ import annotations

import numpy as np

from design.loop import Loop
from model.arrays import FloatArray

#: The states that are integrals of errors.
INTEGRALS = ("int_a", "int_t")


def integral_states(loop: Loop) -> tuple[str, ...]:
    """Names of the integrals of the loop, in its order."""
    return tuple(name for name in loop.states if name in INTEGRALS)


def anti_windup_gain(loop: Loop, rate: float | None) -> FloatArray:
    """L (*G, i, m), the integrals' rate by a unit of command that the actuator cannot follow.

    Parameters
    ----------
    loop : finite at every point
    rate : [1/s], or None for the rule; 0 leaves the integrals alone
    """
    names = integral_states(loop)
    K = loop.K[..., [loop.states.index(name) for name in names]]
    if not names or rate == 0.0:
        return np.zeros((*K.shape[:-2], len(names), K.shape[-2]))
    speed = np.abs(np.linalg.eigvals(loop.closed)).min(axis=-1) if rate is None else np.full(K.shape[:-2], rate)
    return np.asarray(-speed[..., None, None] * np.linalg.pinv(K))
