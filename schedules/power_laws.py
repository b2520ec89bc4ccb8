"""Gains as powers of the flight condition: a law of two numbers a gain (seed 4.4).

A law is ``K = c (x / x_ref)^a``. Position gains go with the dynamic pressure, ``x = q``, rate gains with the mass
flux, ``x = rho V``; x_ref is the geometric mean over the designed points, c and a are the least squares of the
logarithms there.

What the exponents would be is read off the non-dimensional model. Tab-only (`design.classical.normal_form`): with time
in ``1/omega_n`` the loop holds the gains as ``K_p |K_ss|``, ``K_f |K_ss|``, ``K_d |K_ss| omega_n``, ``K_i |K_ss| /
omega_n`` and ``K_theta / omega_n``, beside damping ratio and zero of the plant and the bandwidths of servo and filter
over omega_n. Where these four are the same at all points and the steady gain K_ss is too, as they are at one density
with a servo and a filter whose bandwidths scale along, the best non-dimensional gains are the same as well:

    K_p, K_f ~ 1,   K_d ~ 1/omega_n,   K_i, K_theta ~ omega_n,   omega_n^2 ~ q.

At one density ``q ~ (rho V)^2``, so a power a of q is a power 2 a of rho V. Torque gains of state feedback
(`model.nondimensional`, torque in ``q c^2 s``, time in ``c/V``) go with the torque's unit over the state's: those on
angles ~ q, those on rates ~ ``q c/V ~ rho V``, those on the integral ~ ``q V/c``, if their weights scale along.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.gains import Gain
from model.arrays import BoolArray, FloatArray
from model.flight import FlightCondition

Variable = Literal["dynamic_pressure", "mass_flux"]
VARIABLE_UNITS: dict[Variable, str] = {"dynamic_pressure": "Pa", "mass_flux": "kg/(m^2 s)"}

#: Powers of omega_n in the tab-only gains.
_BY_FREQUENCY = {"K_p": 0.0, "K_f": 0.0, "K_d": -1.0, "K_i": 1.0, "K_theta": 1.0}
#: Logarithms that spread less than this are of one value.
_SAME = 1e-9


@dataclass(frozen=True)
class PowerLaw:
    """``coefficient (x / reference)^exponent``.

    Attributes
    ----------
    variable : what x is, in the unit of `VARIABLE_UNITS`
    reference : the x at which the gain is the coefficient
    coefficient : in the gain's unit
    exponent : [-]
    """

    variable: Variable
    reference: float
    coefficient: float
    exponent: float

    def at(self, condition: FlightCondition) -> FloatArray:
        """The gain at flight conditions (*G,)."""
        return np.asarray(self.coefficient * (variable(condition, self.variable) / self.reference) ** self.exponent)


@dataclass(frozen=True)
class GainLaw:
    """The law of one gain, or why it has none.

    Attributes
    ----------
    gain, unit : name and unit of the gain
    variable : that of a position gain is the dynamic pressure, that of a rate gain the mass flux
    law : None when the gain follows none
    reason : why it follows none
    misfit : root mean square of the logarithm of law over gain [-]: 0.05 is 5 per cent; None without a law
    points : how many gains the law rests on; a gain of exactly zero has no logarithm and is left out
    predicted_by_pressure : power of q that the non-dimensional model predicts [-]
    """

    gain: str
    unit: str
    variable: Variable
    law: PowerLaw | None
    reason: str | None
    misfit: float | None
    points: int
    predicted_by_pressure: float

    @property
    def predicted_by_flux(self) -> float:
        """Power of rho V that the non-dimensional model predicts, at given density [-]."""
        return 2.0 * self.predicted_by_pressure

    @property
    def predicted(self) -> float:
        """Predicted power of the law's own variable [-]."""
        return self.predicted_by_pressure if self.variable == "dynamic_pressure" else self.predicted_by_flux


def fit_laws(condition: FlightCondition, gains: Sequence[Gain], ok: BoolArray) -> tuple[GainLaw, ...]:
    """The law of each gain (*G,) by least squares of the logarithms over the points of a mask (*G,).

    A gain that changes its sign has no law, nor has any where the variable has one value only. A gain that is zero
    everywhere stays so.
    """
    return tuple(_fit(gain, condition, ok) for gain in gains)


def variable(condition: FlightCondition, name: Variable) -> FloatArray:
    """A law's variable at flight conditions (*G,), in the unit of `VARIABLE_UNITS`."""
    if name == "dynamic_pressure":
        return condition.dynamic_pressure
    return np.asarray(condition.air.density * condition.airspeed)


def _fit(gain: Gain, condition: FlightCondition, ok: BoolArray) -> GainLaw:
    rate = gain.name == "K_d" or gain.name.endswith("_rate")
    of: Variable = "mass_flux" if rate else "dynamic_pressure"
    predicted = _predicted(gain.name)

    def without(reason: str) -> GainLaw:
        return GainLaw(gain.name, gain.unit, of, None, reason, None, 0, predicted)

    if not np.any(ok):
        return without("no point carries a gain")
    values, logarithm = gain.values[ok], np.log(variable(condition, of)[ok])
    middle = np.mean(logarithm)
    reference, used = float(np.exp(middle)), values != 0.0
    signs = np.unique(np.sign(values[used]))
    if signs.size == 0:
        return GainLaw(gain.name, gain.unit, of, PowerLaw(of, reference, 0.0, 0.0), None, 0.0, 0, predicted)
    if signs.size > 1:
        return without(f"it changes sign over the grid: from {values.min():.4g} to {values.max():.4g} {gain.unit}")
    way, size = logarithm[used] - middle, np.log(np.abs(values[used]))
    if np.ptp(way) < _SAME:
        return without(f"the points with such a gain have one {of.replace('_', ' ')} only, {np.exp(logarithm[0]):.6g}")
    (start, exponent), *_ = np.linalg.lstsq(np.column_stack([np.ones_like(way), way]), size)
    misfit = float(np.sqrt(np.mean((start + exponent * way - size) ** 2)))
    law = PowerLaw(of, reference, float(signs[0] * np.exp(start)), float(exponent))
    return GainLaw(gain.name, gain.unit, of, law, None, misfit, int(used.sum()), predicted)


def _predicted(name: str) -> float:
    """Power of q of a gain by its name; see the module."""
    if name in _BY_FREQUENCY:
        return 0.5 * _BY_FREQUENCY[name]
    if name.endswith("_rate"):
        return 0.5
    return 1.5 if "_int_" in name else 1.0
