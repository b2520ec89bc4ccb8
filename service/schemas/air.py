"""Answers about the air."""

from __future__ import annotations

from service.schemas.wire import Answer


class Air(Answer):
    """Standard atmosphere at geopotential altitudes: numbers, or arrays when `altitude_m` was repeated."""

    altitude_m: float | list[float]
    temperature_k: float | list[float]
    pressure_pa: float | list[float]
    density_kg_m3: float | list[float]
    speed_of_sound_m_s: float | list[float]
    dynamic_viscosity_pa_s: float | list[float]
