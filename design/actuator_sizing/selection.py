"""Candidate actuators against a requirement: headroom of each, with the gear ratio that leaves the most of it (6.3.2).

Behind a gear of ratio n the motor turns n times as fast as the surface and gives n times its torque to it, less what
the gear loses. Its rotor must be accelerated too. So at the motor a surface torque T, rate w and acceleration a are::

    T_m = T e / n + J n a ,   w_m = n w ,      e = 1 / efficiency where the motor drives the surface or holds it,
                                                   the efficiency where the surface drives the motor

A headroom is the part of a capability that is left, ``1 - asked / available``: 1 where nothing is asked for, below 0
where it is not enough.

Every part asked for falls with n and then rises (torques as ``x / n + y n``, rates as n, powers as ``x + y n^2``), so
the largest of them does too: it has one valley, and a search that only compares two places at a time finds its floor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from design.actuator_sizing.requirement import SurfaceRequirement
from model.arrays import FloatArray, GridArrays

#: Each step of the search leaves this part of the interval; after so many steps 1e-12 of it is left.
_GOLDEN, _STEPS = 0.5 * (np.sqrt(5.0) - 1.0), 58


@dataclass(frozen=True)
class RatioRange:
    """Any gear ratio from `low` to `high`, motor over surface."""

    low: float
    high: float


@dataclass(frozen=True)
class Candidate:
    """An actuator that can be bought, by its motor's numbers, before the gear. Without a limit: inf.

    Attributes
    ----------
    name : what it is called
    stall_torque : torque at rest [N m]
    no_load_rate : rate without torque [rad/s]
    continuous_torque : RMS torque that it bears for ever [N m]
    power : largest power [W]
    inertia : of the rotor [kg m^2]
    gear_ratio : motor over surface, one, some, or a range of them
    efficiency : of the gear, above 0, at most 1

    Raises
    ------
    ValueError : numbers that are not positive, an efficiency above 1, or no gear ratio
    """

    name: str
    stall_torque: float
    no_load_rate: float
    continuous_torque: float = np.inf
    power: float = np.inf
    inertia: float = 0.0
    gear_ratio: float | tuple[float, ...] | RatioRange = 1.0
    efficiency: float = 1.0

    def __post_init__(self) -> None:
        for what in ("stall_torque", "no_load_rate", "continuous_torque", "power"):
            if not getattr(self, what) > 0.0:
                raise ValueError(f"{what} of {self.name!r} must be positive, not {getattr(self, what)}")
        if not 0.0 <= self.inertia < np.inf:
            raise ValueError(f"inertia of {self.name!r} must be finite and not negative, not {self.inertia} kg m^2")
        if not 0.0 < self.efficiency <= 1.0:
            raise ValueError(f"efficiency of {self.name!r} must be above 0 and at most 1, not {self.efficiency}")
        ratios = self.ratios
        if not ratios or not all(0.0 < ratio < np.inf for ratio in ratios) or list(ratios) != sorted(ratios):
            raise ValueError(f"gear ratios of {self.name!r} must be positive and rise, are {self.gear_ratio}")

    @property
    def ratios(self) -> tuple[float, ...]:
        """The ratios to choose from, or the two ends of their range."""
        if isinstance(self.gear_ratio, RatioRange):
            return (self.gear_ratio.low, self.gear_ratio.high)
        return self.gear_ratio if isinstance(self.gear_ratio, tuple) else (self.gear_ratio,)


@dataclass(frozen=True)
class AtSurface:
    """A candidate behind a gear, seen from the surface, losses left out.

    Attributes
    ----------
    stall_torque, continuous_torque : [N m]
    no_load_rate : [rad/s]
    inertia : of the rotor [kg m^2]
    """

    stall_torque: float
    continuous_torque: float
    no_load_rate: float
    inertia: float


@dataclass(frozen=True, eq=False)
class Headroom(GridArrays):
    """What is left of each capability, each (*G,), as a part of it; nan where nothing is known of the requirement.

    Attributes
    ----------
    torque : of the stall torque at the peak torque
    static : of the stall torque at the largest static load
    rate : of the no-load rate at the peak rate
    continuous : of the continuous torque
    power : of the power
    line : of the torque-speed line ``|T_m| / T_stall + |w_m| / w_no_load <= 1``, over the cloud
    """

    torque: FloatArray
    static: FloatArray
    rate: FloatArray
    continuous: FloatArray
    power: FloatArray
    line: FloatArray

    @cached_property
    def least(self) -> FloatArray:
        """(*G,) the least of them."""
        return np.asarray(np.min(np.stack([getattr(self, field.name) for field in fields(self)]), axis=0))


@dataclass(frozen=True)
class Fit:
    """A candidate with the gear ratio that leaves it the largest least headroom over the grid.

    Attributes
    ----------
    candidate, ratio : the choice
    headroom : over the grid
    least : the least headroom over the grid; nan when no point is known
    capability : field of `Headroom` that sets it; None when no point is known
    point : flat index of the point that sets it; None when no point is known
    """

    candidate: Candidate
    ratio: float
    headroom: Headroom
    least: float
    capability: str | None
    point: int | None

    @property
    def enough(self) -> bool:
        """Whether every requirement is met at every point that is known."""
        return self.least >= 0.0


def at_surface(candidate: Candidate, ratio: float) -> AtSurface:
    """The candidate behind a gear of this ratio: torque times ratio, rate over ratio, inertia times its square."""
    return AtSurface(
        candidate.stall_torque * ratio,
        candidate.continuous_torque * ratio,
        candidate.no_load_rate / ratio,
        candidate.inertia * ratio**2,
    )


def headroom(candidate: Candidate, ratio: float, required: SurfaceRequirement) -> Headroom:
    """Headroom of a candidate behind a gear of this ratio.

    Torque and acceleration of the cloud are taken together, sample by sample. Of peaks and means it is not known
    which of them meet, so that there the rotor's torque adds to the other one's magnitude: never less than is
    needed. The line is also asked for where the surface drives the motor, and a real motor could brake harder.
    """
    seen, loss = at_surface(candidate, ratio), 1.0 / candidate.efficiency
    rotor = _rotor_torque(seen.inertia, required.peak_acceleration)
    mean_rotor = _rotor_torque(seen.inertia, required.rms_acceleration)
    rotor_power = np.where(rotor > 0.0, rotor * required.peak_rate, 0.0) if seen.inertia > 0.0 else rotor
    torque = np.abs(required.peak_torque) * loss + rotor
    static = np.max(np.abs(required.static_torque), axis=-1, initial=0.0) * loss
    continuous = np.abs(required.rms_torque) * loss + mean_rotor
    power = np.abs(required.peak_power) * loss + rotor_power
    drives = required.torque * required.rate >= 0.0
    samples = required.torque * np.where(drives, loss, candidate.efficiency)
    samples = np.abs(samples + _rotor_torque(seen.inertia, required.acceleration)) / seen.stall_torque
    samples = samples + np.abs(required.rate) / seen.no_load_rate
    line = np.max(samples, axis=-1, initial=0.0)
    return Headroom(
        torque=_left(torque, seen.stall_torque),
        static=_left(static, seen.stall_torque),
        rate=_left(np.abs(required.peak_rate), seen.no_load_rate),
        continuous=_left(continuous, seen.continuous_torque),
        power=_left(power, candidate.power),
        line=_left(line, 1.0),
    )


def best_ratio(candidate: Candidate, required: SurfaceRequirement) -> float:
    """The gear ratio of the candidate's with the largest least headroom over the grid; the smallest of equal ones.

    Of a range it is found to 1e-10 of itself, or the valley of what is asked for is flat there.
    """

    def asked(ratio: float) -> float:
        return -_least(headroom(candidate, ratio, required))

    if not isinstance(candidate.gear_ratio, RatioRange):
        return min(candidate.ratios, key=asked)
    low, high = np.log(candidate.ratios)
    inner, outer = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_inner, at_outer = asked(np.exp(inner)), asked(np.exp(outer))
    for _ in range(_STEPS):
        if at_inner <= at_outer:
            high, outer, at_outer = outer, inner, at_inner
            inner = high - _GOLDEN * (high - low)
            at_inner = asked(np.exp(inner))
        else:
            low, inner, at_inner = inner, outer, at_outer
            outer = low + _GOLDEN * (high - low)
            at_outer = asked(np.exp(outer))
    return min((candidate.gear_ratio.low, float(np.exp(0.5 * (low + high))), candidate.gear_ratio.high), key=asked)


def select(candidates: Sequence[Candidate], required: SurfaceRequirement) -> tuple[Fit, ...]:
    """Every candidate at its best gear ratio, the one with the largest least headroom first, unknown ones last."""
    fits = [fit(candidate, required) for candidate in candidates]
    return tuple(sorted(fits, key=lambda each: (np.isnan(each.least), -each.least)))


def fit(candidate: Candidate, required: SurfaceRequirement) -> Fit:
    """One candidate at its best gear ratio, and what sets its headroom."""
    ratio = best_ratio(candidate, required)
    found = headroom(candidate, ratio, required)
    names = [field.name for field in fields(Headroom)]
    flat = np.stack([getattr(found, name).reshape(-1) for name in names])
    if np.all(np.isnan(flat)):
        return Fit(candidate, ratio, found, np.nan, None, None)
    capability, point = np.unravel_index(int(np.nanargmin(flat)), flat.shape)
    return Fit(candidate, ratio, found, float(flat[capability, point]), names[int(capability)], int(point))


def _left(asked: FloatArray, available: float) -> FloatArray:
    """Part of a capability that is left; all of it where there is no limit, however much is asked for."""
    if np.isinf(available):
        return np.where(np.isnan(asked), np.nan, 1.0)
    return np.asarray(1.0 - asked / available)


def _rotor_torque(inertia: float, acceleration: FloatArray) -> FloatArray:
    """Torque that the rotor takes; none without inertia, whatever the acceleration."""
    return inertia * acceleration if inertia > 0.0 else np.zeros(acceleration.shape)


def _least(found: Headroom) -> float:
    """The least headroom over the points that are known; inf without any."""
    values = np.stack([getattr(found, field.name) for field in fields(found)])
    return float(np.min(values, initial=np.inf, where=~np.isnan(values)))
