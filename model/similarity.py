"""Similarity: what the servo tab's frequency and damping depend on, and whether dynamic pressure alone schedules it.

From seed 2.3.31 to 2.3.33, with the span and without the induced angles' trim rate,

    omega_n = c sqrt(q s phi C_aa / J_aa)
    zeta    = (c ca / 2) sqrt(rho s phi / (2 J_aa C_aa)) (cos(dt0) C_at + C_aa / 4)

omega_n is a function of the dynamic pressure alone; at a given one, zeta goes with the root of the density. The whole
damping matrix of the coupled model does: Kk goes with q, Bk with q/V = sqrt(q rho/2). Mach number (through phi) and
virtual inertia (through J) bend both a little.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from model.arrays import FloatArray, GridArrays
from model.atmosphere import Air
from model.flight import FlightCondition
from model.linearise import linearise
from model.servo_tab import ServoTab, servo_tab
from model.swept_plant import moving_through
from model.system import TabAileron
from model.trim import TrimRequest, trim

_STEP = 1e-4  # of the logarithms


@dataclass(frozen=True, eq=False)
class ServoExponents(GridArrays):
    """Local powers of the servo tab: ``omega_n ~ q^a rho^b`` and ``zeta ~ q^c rho^d``, each (*G,) [-].

    Attributes
    ----------
    frequency_by_pressure, frequency_by_density : a at given density, b at given dynamic pressure
    damping_by_pressure, damping_by_density : c, d of the damping ratio
    """

    frequency_by_pressure: FloatArray
    frequency_by_density: FloatArray
    damping_by_pressure: FloatArray
    damping_by_density: FloatArray

    @property
    def frequency_by_airspeed(self) -> FloatArray:
        """Power of V in omega_n at given density."""
        return np.asarray(2.0 * self.frequency_by_pressure)

    @property
    def damping_by_airspeed(self) -> FloatArray:
        """Power of V in zeta at given density."""
        return np.asarray(2.0 * self.damping_by_pressure)

    @property
    def frequency_by_density_at_airspeed(self) -> FloatArray:
        """Power of rho in omega_n at given airspeed."""
        return np.asarray(self.frequency_by_density + self.frequency_by_pressure)

    @property
    def damping_by_density_at_airspeed(self) -> FloatArray:
        """Power of rho in zeta at given airspeed."""
        return np.asarray(self.damping_by_density + self.damping_by_pressure)


@dataclass(frozen=True, eq=False)
class PressureSchedule(GridArrays):
    """What a schedule in dynamic pressure alone gets wrong on a flight grid.

    It is designed in the reference air and flown, at the same dynamic pressure, in the air of each point.

    Attributes
    ----------
    frequency_factor : (*G,) omega_n the schedule counts on over the one there is [-]
    damping_factor : (*G,) the same of zeta: 1.83 from sea level to 11 km [-]
    reference_density : of the air it is designed in [kg/m^3]
    worst_factor : the largest of both factors and their inverses over the grid [-]
    best_factor : what is left of it with the best reference air, in the middle of the spread [-]
    tolerance : the part by which it may differ from one
    sufficient : whether dynamic pressure alone will do
    reason : the verdict in words and numbers
    """

    frequency_factor: FloatArray
    damping_factor: FloatArray
    reference_density: float
    worst_factor: float
    best_factor: float
    tolerance: float
    sufficient: bool
    reason: str


def servo_exponents(system: TabAileron, condition: FlightCondition, request: TrimRequest) -> ServoExponents:
    """Powers of dynamic pressure and density in the servo tab's omega_n and zeta, by central differences.

    The temperature is held, so Mach number follows the airspeed; powers are exact to about 1e-7.

    Parameters
    ----------
    system, condition, request : the section, its flight condition (*G) and its trim, which is found anew
    """

    def at(pressure: float, density: float) -> ServoTab:
        return _servo(system, _changed(condition, np.exp(pressure), np.exp(density)), request)

    by_pressure = at(_STEP, 0.0), at(-_STEP, 0.0)
    by_density = at(0.0, _STEP), at(0.0, -_STEP)
    return ServoExponents(
        frequency_by_pressure=_power(by_pressure[0].natural_frequency, by_pressure[1].natural_frequency),
        frequency_by_density=_power(by_density[0].natural_frequency, by_density[1].natural_frequency),
        damping_by_pressure=_power(by_pressure[0].damping_ratio, by_pressure[1].damping_ratio),
        damping_by_density=_power(by_density[0].damping_ratio, by_density[1].damping_ratio),
    )


def pressure_schedule(
    system: TabAileron,
    condition: FlightCondition,
    request: TrimRequest,
    tolerance: float = 0.1,
    reference: Air | None = None,
) -> PressureSchedule:
    """Whether a schedule in dynamic pressure alone suffices for a flight grid, and the error it would make.

    Parameters
    ----------
    system, condition, request : the section, its flight grid (*G) inside the model, and its trim
    tolerance : accepted relative error of the servo tab's damping ratio and natural frequency
    reference : air of a single point that the schedule is designed in; by default the densest of the grid

    Raises
    ------
    ValueError : a tolerance that is not positive, or a dynamic pressure that the reference air has at Mach one and
        more
    """
    if not tolerance > 0.0:
        raise ValueError("tolerance must be positive: a relative error")
    air = condition.air if reference is None else reference
    if reference is None and np.ndim(air.density) > 0:
        air = air.take(np.unravel_index(int(np.argmax(air.density)), np.shape(air.density)))
    counted_on = moving_through(air, np.sqrt(2.0 * condition.dynamic_pressure / air.density))
    if not np.all(system.aerodynamics.covers(counted_on.mach)):
        raise ValueError("the reference air reaches a dynamic pressure of the grid at Mach one and more only")
    designed, flown = _servo(system, counted_on, request), _servo(system, condition, request)
    frequency = np.asarray(designed.natural_frequency / flown.natural_frequency)
    damping = np.asarray(designed.damping_ratio / flown.damping_ratio)
    worst, best = max(_largest(frequency), _largest(damping)), max(_middle(frequency), _middle(damping))
    return PressureSchedule(
        frequency_factor=frequency,
        damping_factor=damping,
        reference_density=float(air.density),
        worst_factor=worst,
        best_factor=best,
        tolerance=tolerance,
        sufficient=worst <= 1.0 + tolerance,
        reason=_verdict("damping ratio" if worst == _largest(damping) else "natural frequency", worst, best, tolerance),
    )


def _verdict(name: str, worst: float, best: float, tolerance: float) -> str:
    if not np.isfinite(worst):
        return "no verdict: the air does not restore the aileron everywhere, so it has no natural frequency there"
    verdict = "is enough" if worst <= 1.0 + tolerance else "is not enough"
    return (
        f"a schedule in dynamic pressure alone {verdict}: its {name} is off by a factor of up to {worst:.4g}, and "
        f"{best:.4g} when it is designed in the air in the middle; {1.0 + tolerance:.4g} is accepted"
    )


def _largest(factor: FloatArray) -> float:
    """Largest of a factor and its inverse; inf where it does not exist somewhere or changes sign."""
    if not np.all(factor > 0.0):
        return np.inf
    return float(np.exp(np.max(np.abs(np.log(factor)))))


def _middle(factor: FloatArray) -> float:
    """Half the spread of a factor, as a factor: what is left of it about its middle."""
    if not np.all(factor > 0.0):
        return np.inf
    return float(np.sqrt(np.max(factor) / np.min(factor)))


def _power(up: FloatArray, down: FloatArray) -> FloatArray:
    return np.asarray(np.log(up / down) / (2.0 * _STEP))


def _changed(condition: FlightCondition, pressure: float, density: float) -> FlightCondition:
    """The condition with dynamic pressure and density multiplied, the temperature held."""
    air = replace(
        condition.air,
        density=np.asarray(condition.air.density * density),
        pressure=np.asarray(condition.air.pressure * density),
    )
    return moving_through(air, np.asarray(condition.airspeed * np.sqrt(pressure / density)))


def _servo(system: TabAileron, condition: FlightCondition, request: TrimRequest) -> ServoTab:
    return servo_tab(linearise(system, condition, trim(system, condition, request)))
