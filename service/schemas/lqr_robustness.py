"""Answers of studies of state feedback over frequency: simultaneous margins, and norms of whole systems."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.point import Complex
from service.schemas.wire import Answer


class CutMargins(Answer):
    """Margins of the loop cut at one actuator, the other closed; null where there is none.

    `return_difference` is the smallest ``|1 + L|`` over frequency.
    """

    disk_margin: float | None
    gain_margin_up_db: float | None
    gain_margin_down_db: float | None
    phase_margin_deg: float | None
    return_difference: float | None


class MarginCurves(Answer):
    """Over frequency: smallest singular value of ``I + L``, and the disk margins of both actuators at once and of each.

    `simultaneous_disk_margin` is ``2 / mu(S - T)``, mu for one complex factor at each actuator; `disk_margins` the same
    of the loop cut at one actuator, ``2 / |S - T|``. Their lowest values over all frequencies are the margins.
    """

    omega_rad_s: list[float]
    return_difference: list[float | None]
    simultaneous_disk_margin: list[float | None]
    disk_margins: dict[str, list[float | None]]


class SimultaneousMargins(Answer):
    """What the loop stands when both actuators change at once, independently; a null figure has its reason.

    With the disk margin m the loop is stable for all complex factors ``(1 + d/2) / (1 - d/2)``, ``|d| < m``, one at
    each actuator; with `worst_factors` of that disk a pole stands on the imaginary axis at `disk_omega_rad_s`.
    `sensitivity_margin` is the same for factors ``1 / (1 - d)``, `complementary_margin` for ``1 + d``. The return
    difference is the smallest singular value of ``I + L``, at most 1; the peaks are the largest ones of S and T.
    """

    name: str
    point: int
    actuators: list[str]
    disk_margin: float | None
    disk_omega_rad_s: float | None
    worst_factors: dict[str, Complex | None]
    gain_margin_up_db: float | None = Field(description="Of both gains at once, each by up to this")
    gain_margin_down_db: float | None = Field(description="Of both gains at once, each by down to this")
    phase_margin_deg: float | None = Field(description="Of both phases at once, each by up to this")
    sensitivity_margin: float | None
    complementary_margin: float | None
    return_difference: float | None
    return_difference_omega_rad_s: float | None
    sensitivity_peak: float | None
    sensitivity_peak_omega_rad_s: float | None
    complementary_peak: float | None
    complementary_peak_omega_rad_s: float | None
    proved: bool = Field(
        description="That no frequency between those looked at is worse; with transport delays frequencies are searched"
    )
    reasons: dict[str, str]
    one_at_a_time: dict[str, CutMargins]
    curves: MarginCurves


class SystemNorm(Answer):
    """Norms of the transfer from all of some signals to all of others; a null norm has its reason.

    `h_infinity` is the largest singular value over all frequencies: the most by which the root mean square of all
    outputs together can exceed that of all inputs together. `h2` times the root of the intensity of independent white
    noises at the inputs, all alike, is the root mean square of all outputs together.
    """

    from_: list[str] = Field(alias="from")
    to: list[str]
    unit: str
    h_infinity: float | None = Field(json_schema_extra={"unit": "see `unit`"})
    omega_rad_s: float | None = Field(description="Where; null where it is approached as the frequency grows")
    h_infinity_reason: str | None
    h2: float | None = Field(json_schema_extra={"unit": "see `h2_unit`"})
    h2_unit: str
    h2_reason: str | None


class Norms(Answer):
    """Norms of the closed loop, from torque disturbances and sensor noise to angles and commands.

    `method` is how the peak over frequency is found: `level_sets` of a Hamiltonian matrix, which prove that nothing is
    higher; or, with transport delays, whose transfer is not rational, a dense `frequency_grid` and a closer look at
    its summits, which prove nothing.
    """

    name: str
    point: int
    method: Literal["level_sets", "frequency_grid"]
    systems: list[SystemNorm]
