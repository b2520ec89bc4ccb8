"""Specs on the wire: what a controller must meet, and packs of what every controller is judged on."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, Tag

from service.schemas.forms import BY_JSON_TYPE
from service.schemas.grid_values import OverGrid, Values, Varying
from service.schemas.wire import Request, refusal

DampingRatio = Annotated[float, Field(ge=0.0, le=1.0)]
GainMargin = Annotated[float, Field(ge=0.0, le=60.0)]
PhaseMargin = Annotated[float, Field(ge=0.0, le=90.0)]
DelayMargin = Annotated[float, Field(ge=0.0, le=10.0)]
DiskMargin = Annotated[float, Field(ge=0.0, le=2.0)]
SensitivityPeak = Annotated[float, Field(ge=1.0, le=1e3)]
SettlingTime = Annotated[float, Field(ge=1e-4, le=1e3)]
Overshoot = Annotated[float, Field(ge=0.0, le=100.0)]
Bandwidth = Annotated[float, Field(ge=1e-3, le=1e5)]
NoiseGain = Annotated[float, Field(ge=1e-6, le=1e6)]
Rate = Annotated[float, Field(gt=0.0, le=1e6)]
Deflection = Annotated[float, Field(gt=0.0, le=180.0)]
Torque = Annotated[float, Field(gt=0.0, le=1e9)]
Power = Annotated[float, Field(gt=0.0, le=1e9)]


class DampingRatios(OverGrid):
    """Damping ratios over the grid."""

    values: Values[DampingRatio]


class GainMargins(OverGrid):
    """Gain margins over the grid."""

    values: Values[GainMargin] = Field(json_schema_extra={"unit": "dB"})


class PhaseMargins(OverGrid):
    """Phase margins over the grid."""

    values: Values[PhaseMargin] = Field(json_schema_extra={"unit": "deg"})


class DelayMargins(OverGrid):
    """Delay margins over the grid."""

    values: Values[DelayMargin] = Field(json_schema_extra={"unit": "s"})


class DiskMargins(OverGrid):
    """Disk margins over the grid."""

    values: Values[DiskMargin]


class SensitivityPeaks(OverGrid):
    """Peaks of the sensitivity over the grid."""

    values: Values[SensitivityPeak]


class SettlingTimes(OverGrid):
    """Settling times over the grid."""

    values: Values[SettlingTime] = Field(json_schema_extra={"unit": "s"})


class Overshoots(OverGrid):
    """Overshoots over the grid."""

    values: Values[Overshoot] = Field(json_schema_extra={"unit": "%"})


class Bandwidths(OverGrid):
    """Bandwidths over the grid."""

    values: Values[Bandwidth] = Field(json_schema_extra={"unit": "rad/s"})


class NoiseGains(OverGrid):
    """Noise gains over the grid."""

    values: Values[NoiseGain]


class RateLimits(OverGrid):
    """Rates of a surface over the grid."""

    values: Values[Rate] = Field(json_schema_extra={"unit": "deg/s"})


class DeflectionLimits(OverGrid):
    """Deflections of a surface over the grid."""

    values: Values[Deflection] = Field(json_schema_extra={"unit": "deg"})


class TorqueLimits(OverGrid):
    """Torques of an actuator over the grid."""

    values: Values[Torque] = Field(json_schema_extra={"unit": "N m"})


class PowerLimits(OverGrid):
    """Powers of an actuator over the grid."""

    values: Values[Power] = Field(json_schema_extra={"unit": "W"})


class Specs(Request):
    """What a design must meet, each limit a number or a value that varies over the grid.

    A spec that is not given is not imposed; the spec pack is still judged. Margins of several cuts mean the smallest of
    them; what is asked of the tab's actuator is the peak of the total after the reference step.
    """

    damping_ratio_min: Varying[DampingRatio, DampingRatios] | None = Field(
        default=None, description="Damping ratio of every closed-loop mode"
    )
    gain_margin_db_min: Varying[GainMargin, GainMargins] | None = Field(
        default=None, description="Gain margin, both raising and lowering the gain"
    )
    phase_margin_deg_min: Varying[PhaseMargin, PhaseMargins] | None = None
    delay_margin_s_min: Varying[DelayMargin, DelayMargins] | None = Field(
        default=None, description="Delay that the loop bears beside the one it has"
    )
    disk_margin_min: Varying[DiskMargin, DiskMargins] | None = Field(
        default=None, description="Disk margin without skew, `2 / max |S - T|`: gain and phase at the same time"
    )
    sensitivity_peak_max: Varying[SensitivityPeak, SensitivityPeaks] | None = Field(
        default=None, description="Largest `|1 / (1 + L)|` over all frequencies"
    )
    settling_time_s_max: Varying[SettlingTime, SettlingTimes] | None = Field(
        default=None, description="Time after which the step response stays within 2 % of its change"
    )
    overshoot_percent_max: Varying[Overshoot, Overshoots] | None = None
    bandwidth_rad_s_min: Varying[Bandwidth, Bandwidths] | None = Field(
        default=None, description="Frequency at which the aileron follows its reference 3 dB below the steady gain"
    )
    noise_gain_max: Varying[NoiseGain, NoiseGains] | None = Field(
        default=None,
        description="Largest gain over all frequencies from noise on the measured aileron angle to the commanded "
        "tab deflection",
    )
    tab_rate_deg_s_max: Varying[Rate, RateLimits] | None = None
    tab_deflection_deg_max: Varying[Deflection, DeflectionLimits] | None = None


class PackSpecs(Specs):
    """Every quantity that can be judged, each limit a number or a value that varies over the grid."""

    tab_torque_n_m_max: Varying[Torque, TorqueLimits] | None = None
    tab_power_w_max: Varying[Power, PowerLimits] | None = None
    aileron_rate_deg_s_max: Varying[Rate, RateLimits] | None = None
    aileron_deflection_deg_max: Varying[Deflection, DeflectionLimits] | None = None
    aileron_torque_n_m_max: Varying[Torque, TorqueLimits] | None = None
    aileron_power_w_max: Varying[Power, PowerLimits] | None = None


PackName = Literal["default", "limit_speed"]
PACK_NAMES: tuple[PackName, ...] = ("default", "limit_speed")


def own_name(name: str) -> str:
    """Name of a pack that a request brings, refused when it is that of a shipped one."""
    if name in PACK_NAMES:
        raise refusal(f"there is a shipped pack of the name {name}", f"text other than {', '.join(PACK_NAMES)}")
    return name


class SpecPack(Request):
    """A pack of one's own."""

    name: Annotated[str, Field(min_length=1, max_length=200), AfterValidator(own_name)]
    specs: PackSpecs


AnySpecPack = Annotated[Annotated[PackName, Tag("string")] | Annotated[SpecPack, Tag("object")], BY_JSON_TYPE]
