"""Statics: hinge moments over the deflections, the lines on which torques vanish or are least, the float (seed 2.5).

At rest the equations of motion are ``T = q c^2 s C_H(alpha, dt, da)``. Of the plane of deflections, the line on
which the aileron's torque vanishes is what a tab alone can hold, and the line on which the sum of the squares of
both torques is least is what two actuators hold most easily. Lines are trims over an axis of deflections: each is a
`Trim` whose last grid axis runs along the line.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.actuators import ActuatorLimits
from model.arrays import BoolArray, FloatArray, Floats, GridArrays
from model.flight import FlightCondition
from model.reachable import UNLIMITED, ReachableAileron, reachable_aileron, search_limit
from model.system import TabAileron
from model.trim import LARGEST_TRIM_ANGLE, HeldTorque, Trim, TrimRequest, trim
from model.trim_request import TabRule


@dataclass(frozen=True, eq=False)
class DeflectionMap(GridArrays):
    """Steady hinge moments over the plane of deflections.

    Attributes
    ----------
    aileron, tab : the angles of both axes (m,), (n,) [rad]
    coefficients : (*G, m, n, 2) ``[C_Ht, C_Ha]``, compressibility included [-]
    torque : (*G, m, n, 2) torques that hold the surfaces there, order [tab, aileron] [N m]
    covered : (*G, m, n) where the source knows its hinge moments
    """

    aileron: tuple[float, ...]
    tab: tuple[float, ...]
    coefficients: FloatArray
    torque: FloatArray
    covered: BoolArray

    @property
    def total_torque(self) -> FloatArray:
        """``sqrt(T_t^2 + T_a^2)`` (*G, m, n) [N m], what the line of least torque makes least."""
        return np.asarray(np.sqrt(np.sum(self.torque**2, axis=-1)))


@dataclass(frozen=True, eq=False)
class FloatLine(GridArrays):
    """A line on which the aileron is held by the air alone, its last grid axis along the line.

    Attributes
    ----------
    trim : the line (*G, n); the aileron's torque is zero
    gain : (*G, n) slope ``da/dt = -C_Ha,dt / C_Ha,da`` along it; nan where the aileron has no stiffness
    stable : (*G, n) whether the air holds the aileron there with the tab fixed: ``C_Ha,da > 0``
    """

    trim: Trim
    gain: FloatArray
    stable: BoolArray


@dataclass(frozen=True, eq=False)
class TabOnlyEquilibrium(GridArrays):
    """Wanted aileron angles (n,), each held by the tab alone.

    Attributes
    ----------
    line : tab angle, and the tab torque there, for each aileron angle (*G, n)
    holds : (*G, n) whether the tab angle exists within its deflection limit and its torque within the torque limit
    """

    line: FloatLine
    holds: BoolArray


@dataclass(frozen=True, eq=False)
class SteadyStateMap(GridArrays):
    """The phase plane of seed Fig 2.14 at every point of the grid.

    Attributes
    ----------
    deflections : hinge moments over the plane
    zero_aileron_torque, zero_tab_torque, least_torque : tab angle for each aileron angle (*G, m)
    floating : aileron angle for each tab angle, the aileron free (*G, n)
    free : both surfaces free (*G,)
    reachable : what the tab alone can do with the aileron (*G,)
    """

    deflections: DeflectionMap
    zero_aileron_torque: Trim
    zero_tab_torque: Trim
    least_torque: Trim
    floating: FloatLine
    free: Trim
    reachable: ReachableAileron


def steady_state_map(
    system: TabAileron,
    condition: FlightCondition,
    alpha: Floats,
    aileron: FloatArray,
    tab: FloatArray,
    tab_limits: ActuatorLimits = UNLIMITED,
    aileron_limits: ActuatorLimits = UNLIMITED,
) -> SteadyStateMap:
    """Everything of this file at once.

    Parameters
    ----------
    system, condition : one section, and its flight condition (*G)
    alpha : incidence (*G,) [rad]
    aileron, tab : axes of the plane (m,), (n,) [rad]
    tab_limits, aileron_limits : solved angles are sought within the deflection limits, the reachable range within
        the torque limit of the tab too

    Raises
    ------
    ValueError : Mach one and more with the Prandtl-Glauert correction
    """
    largest = search_limit(tab_limits), search_limit(aileron_limits)
    free = TrimRequest(alpha, HeldTorque("aileron"), HeldTorque("tab"), *largest)
    return SteadyStateMap(
        deflections=deflection_map(system, condition, alpha, aileron, tab),
        zero_aileron_torque=tab_line(system, condition, alpha, aileron, "zero_aileron_torque", largest[0]),
        zero_tab_torque=tab_line(system, condition, alpha, aileron, "zero_tab_torque", largest[0]),
        least_torque=tab_line(system, condition, alpha, aileron, "least_torque", largest[0]),
        floating=float_line(system, condition, alpha, tab, largest[1]),
        free=trim(system, condition, free),
        reachable=reachable_aileron(system, condition, alpha, tab_limits, aileron_limits),
    )


def deflection_map(
    system: TabAileron, condition: FlightCondition, alpha: Floats, aileron: FloatArray, tab: FloatArray
) -> DeflectionMap:
    """Coefficients and torques over aileron (m,) by tab angles (n,) [rad], at incidence alpha (*G,) [rad]."""
    aileron, tab = np.asarray(aileron, float), np.asarray(tab, float)
    incidence = np.asarray(alpha, float)[..., None, None]
    source, factor = system.aerodynamics.source, system.aerodynamics.amplification(condition.mach)
    coefficients = factor[..., None, None, None] * source.at(incidence, tab, aileron[:, None]).value
    return DeflectionMap(
        aileron=tuple(aileron.tolist()),
        tab=tuple(tab.tolist()),
        coefficients=coefficients,
        torque=system.hinge_load(condition)[..., None, None, None] * coefficients,
        covered=np.broadcast_to(source.covers(incidence, tab, aileron[:, None]), coefficients.shape[:-1]),
    )


def tab_line(
    system: TabAileron,
    condition: FlightCondition,
    alpha: Floats,
    aileron: FloatArray,
    rule: TabRule,
    tab_limit: float = LARGEST_TRIM_ANGLE,
) -> Trim:
    """Tab angle as a function of the aileron's, by one of the rules of `TrimRequest` (*G, n).

    Parameters
    ----------
    alpha : incidence (*G,) [rad]
    aileron : aileron angles (n,) [rad]
    tab_limit : the tab angle is sought between minus and plus this [rad]
    """
    request = TrimRequest(np.asarray(alpha)[..., None], np.asarray(aileron, float), rule, tab_limit=tab_limit)
    return trim(system, along_a_line(condition), request)


def float_line(
    system: TabAileron,
    condition: FlightCondition,
    alpha: Floats,
    tab: FloatArray,
    aileron_limit: float = LARGEST_TRIM_ANGLE,
) -> FloatLine:
    """Angle at which the aileron floats, as a function of the tab angle (n,) [rad] (*G, n)."""
    incidence = np.asarray(alpha)[..., None]
    request = TrimRequest(incidence, "zero_aileron_torque", np.asarray(tab, float), aileron_limit=aileron_limit)
    return _floating(system, trim(system, along_a_line(condition), request))


def tab_only_equilibrium(
    system: TabAileron,
    condition: FlightCondition,
    alpha: Floats,
    aileron: FloatArray,
    tab_limits: ActuatorLimits = UNLIMITED,
) -> TabOnlyEquilibrium:
    """Tab angles that hold wanted aileron angles (n,) [rad] without the aileron's actuator, and what they cost."""
    line = tab_line(system, condition, alpha, aileron, "zero_aileron_torque", search_limit(tab_limits))
    allowed = np.inf if tab_limits.torque is None else tab_limits.torque
    return TabOnlyEquilibrium(
        _floating(system, line), np.asarray(line.reached & (np.abs(line.torque[..., 0]) <= allowed))
    )


def along_a_line(condition: FlightCondition) -> FlightCondition:
    """The condition (*G) with one more grid axis at the end, for a line of deflections."""
    return condition.take((..., None))


def _floating(system: TabAileron, line: Trim) -> FloatLine:
    tab, aileron = line.state[..., 0], line.state[..., 2]
    gradient = system.aerodynamics.source.at(line.alpha, tab, aileron).gradient
    own = gradient[..., 1, 2]
    gain = -gradient[..., 1, 1] / np.where(own != 0.0, own, np.nan)
    return FloatLine(line, np.broadcast_to(gain, tab.shape), np.broadcast_to(own > 0.0, tab.shape))
