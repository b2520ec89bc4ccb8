"""Static load cases of a control surface, as torques about its hinge: 14 CFR 25.395(a) and 25.415."""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray, Floats

#: Part of the computed hinge moments that the control system is designed for, 14 CFR 25.395(a).
SYSTEM_FACTOR = 1.25
#: Limit hinge moment factors of an aileron in ground gusts, 14 CFR 25.415: locked in mid-position, and at full throw.
AILERON_LOCKED, AILERON_FULL_THROW = 0.75, 0.50
#: 65 knots [m/s], and the density of the standard atmosphere at sea level [kg/m^3], for ground gusts.
GUST_SPEED, SEA_LEVEL_DENSITY = 65.0 * 1852.0 / 3600.0, 1.225


def system_torque(hinge_moment: Floats, factor: float = SYSTEM_FACTOR) -> FloatArray:
    """Torque (*G,) that the control system must hold [N m]: the computed hinge moment with its factor.

    Parameters
    ----------
    hinge_moment : (*G,) of the surface [N m], of either sign
    factor : at least 1

    Raises
    ------
    ValueError : the factor is below 1 or not finite
    """
    if not 1.0 <= factor < np.inf:
        raise ValueError(f"the factor of the hinge moment must be at least 1, not {factor}")
    return np.asarray(factor * np.abs(hinge_moment))


def ground_gust_torque(
    chord: Floats,
    area: Floats,
    factor: float = AILERON_LOCKED,
    speed: float = GUST_SPEED,
    density: float = SEA_LEVEL_DENSITY,
) -> FloatArray:
    """Limit hinge moment of a ground gust ``H = K (rho V^2 / 2) c S`` [N m], of either sign.

    Parameters
    ----------
    chord : mean chord c of the surface aft of its hinge line [m]
    area : area S of the surface aft of its hinge line [m^2]
    factor : K [-]
    speed : wind V [m/s]
    density : of the air [kg/m^3]

    Raises
    ------
    ValueError : a number is not positive and finite
    """
    given = {"chord": chord, "area": area, "factor": factor, "speed": speed, "density": density}
    for name, value in given.items():
        if not np.all((np.asarray(value) > 0.0) & np.isfinite(value)):
            raise ValueError(f"the {name} of a ground gust must be positive and finite, not {value}")
    return np.asarray(factor * 0.5 * density * speed**2 * np.multiply(chord, area))
