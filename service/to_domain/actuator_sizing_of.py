"""From the wire to the sizing of actuators: candidates, loads and manoeuvres in SI and radians."""

from __future__ import annotations

import math
from math import radians

from design.actuator_sizing.selection import Candidate, RatioRange
from schedules.study import Study
from schedules.surface_requirement import GroundGust, LoadCases, Sized
from service.schemas import actuator_sizing as wire
from service.to_domain.manoeuvre_of import manoeuvre_of


def candidate(asked: wire.Candidate) -> Candidate:
    """A candidate; null is unlimited, and gear ratios to choose from are sorted."""
    return Candidate(
        name=asked.name,
        stall_torque=asked.stall_torque_n_m,
        no_load_rate=radians(asked.no_load_rate_deg_s),
        continuous_torque=_unlimited(asked.continuous_torque_n_m),
        power=_unlimited(asked.power_w),
        inertia=asked.rotor_inertia_kg_m2,
        gear_ratio=_gear_ratio(asked.gear_ratio),
        efficiency=asked.efficiency,
    )


def sized(asked: wire.ActuatorSelectionRequest, study: Study, references: tuple[str, ...]) -> Sized:
    """What the actuator is sized for; without a manoeuvre the reference of the study."""
    flown = study.reference.manoeuvre(references)
    if asked.manoeuvre is not None:
        flown = manoeuvre_of(asked.manoeuvre, references)
    gust = asked.load_cases.ground_gust
    loads = LoadCases(asked.load_cases.system_factor, None if gust is None else GroundGust(gust.factor, gust.wind_m_s))
    return Sized(asked.actuator, flown, asked.duration_s or study.reference.duration, loads)


def _unlimited(limit: float | None) -> float:
    return math.inf if limit is None else limit


def _gear_ratio(asked: float | list[float] | wire.RatioRange) -> float | tuple[float, ...] | RatioRange:
    if isinstance(asked, wire.RatioRange):
        return RatioRange(asked.low, asked.high)
    return tuple(sorted(set(asked))) if isinstance(asked, list) else asked
