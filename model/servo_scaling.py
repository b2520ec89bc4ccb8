"""From a measured servo tab to one of another size, in other air and at another speed (seed 4.4, 7.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from model.arrays import FloatArray, Floats, GridArrays
from model.flight import FlightCondition
from model.hinge_moments.compressibility import prandtl_glauert

#: What the scaling takes for granted.
ASSUMPTIONS: Final = (
    "both sections are the same shape: same mean line, thickness, hinge positions in fractions of the chord and gaps",
    "both are at the same incidence and deflections, so that the coefficients of the steady hinge moments are the same",
    "the coefficients do not depend on Reynolds number: transition and separation lie alike",
    "the air follows the motion at once (reduced frequency below about 0.05), and its virtual inertia is neglected",
    "the aileron is held by the air alone: no spring, no friction, no freeplay, no lag of the tab's actuator",
    "the reaction of the tab's acceleration on the aileron is neglected, as in the servo-tab model itself",
)
_COMPRESSIBLE: Final = "compressibility acts as the Prandtl-Glauert factor, on steady coefficients and damping alike"
_INCOMPRESSIBLE: Final = "compressibility is neglected"


@dataclass(frozen=True, eq=False)
class MeasuredServo(GridArrays):
    """A servo tab as identified: ``da/dt = (beta1 s + K w^2)/(s^2 + 2 zeta w s + w^2)``, each (*G,).

    Attributes
    ----------
    natural_frequency : w [rad/s]
    damping_ratio : zeta [-]
    gain : K, radians of aileron for a radian of tab [-]
    """

    natural_frequency: FloatArray
    damping_ratio: FloatArray
    gain: FloatArray


@dataclass(frozen=True)
class SectionSize:
    """Size of a section: wing chord [m], span [m], inertia ``J_aa`` about the aileron's hinge [kg m^2].

    Raises
    ------
    ValueError : a number that is not positive and finite
    """

    chord: Floats
    span: Floats
    inertia: Floats

    def __post_init__(self) -> None:
        sizes = np.broadcast_arrays(self.chord, self.span, self.inertia)
        if not np.all(np.isfinite(sizes) & (np.asarray(sizes) > 0.0)):
            raise ValueError("chord [m], span [m] and inertia [kg m^2] must be positive and finite")


@dataclass(frozen=True, eq=False)
class ScaledServo(GridArrays):
    """The servo tab at the other size and condition.

    Attributes
    ----------
    servo : natural frequency, damping ratio and gain there (*G,)
    frequency_factor, damping_factor : new over old (*G,) [-]
    reduced_frequency : ``omega_n c / (2 V)`` there (*G,) [-]
    assumptions : what was taken for granted, in words
    """

    servo: MeasuredServo
    frequency_factor: FloatArray
    damping_factor: FloatArray
    reduced_frequency: FloatArray
    assumptions: tuple[str, ...]


def same_structure(size: SectionSize, chord: Floats, span: Floats) -> SectionSize:
    """Another size of the same structure: the same density of material everywhere, so ``J ~ c^4 s``."""
    ratio = (np.asarray(chord) / size.chord) ** 4 * (np.asarray(span) / size.span)
    return SectionSize(chord, span, np.asarray(size.inertia * ratio))


def scale_servo(
    measured: MeasuredServo,
    size: SectionSize,
    condition: FlightCondition,
    new_size: SectionSize,
    new_condition: FlightCondition,
    compressible: bool = False,
) -> ScaledServo:
    """Scale a measured servo tab; arguments broadcast over the grid (*G).

    From seed 2.3.31 to 2.3.33 with the span, ``omega_n ~ c sqrt(q s phi / J)`` and
    ``zeta ~ c^2 sqrt(rho s phi / J)``; the gain stays. See `ASSUMPTIONS`.

    Parameters
    ----------
    measured, size, condition : what was measured, on what, in what air and at what speed
    new_size, new_condition : where it is wanted
    compressible : put the Prandtl-Glauert factor phi in at both Mach numbers; one without

    Raises
    ------
    ValueError : Mach one and more with `compressible`
    """
    chord = np.asarray(new_size.chord / size.chord)
    load = np.asarray(new_size.span / size.span) * np.asarray(size.inertia / new_size.inertia)
    if compressible:
        load = load * prandtl_glauert(new_condition.mach) / prandtl_glauert(condition.mach)
    frequency = chord * np.sqrt(load * new_condition.dynamic_pressure / condition.dynamic_pressure)
    damping = chord**2 * np.sqrt(load * new_condition.air.density / condition.air.density)
    shape = np.broadcast_shapes(frequency.shape, np.shape(measured.natural_frequency))
    servo = MeasuredServo(
        natural_frequency=np.asarray(measured.natural_frequency * frequency),
        damping_ratio=np.asarray(measured.damping_ratio * damping),
        gain=np.broadcast_to(measured.gain, shape),
    )
    return ScaledServo(
        servo=servo,
        frequency_factor=np.broadcast_to(frequency, shape),
        damping_factor=np.broadcast_to(damping, shape),
        reduced_frequency=np.asarray(servo.natural_frequency * new_size.chord / (2.0 * new_condition.airspeed)),
        assumptions=(*ASSUMPTIONS, _COMPRESSIBLE if compressible else _INCOMPRESSIBLE),
    )
