"""Answers about frequency responses."""

from __future__ import annotations

from pydantic import Field

from service.schemas.wire import Answer


class TransferResponse(Answer):
    """Response of one signal to another over the frequencies; null exactly at a pole on the axis."""

    from_: str = Field(alias="from")
    to: str
    unit: str
    magnitude: list[float | None] = Field(json_schema_extra={"unit": "see `unit`"})
    phase_deg: list[float | None] = Field(description="Without jumps of a turn")


class LoopSingularValues(Answer):
    """Singular values, the largest first, over the frequencies: one list for each actuator."""

    loop: list[list[float | None]]
    sensitivity: list[list[float | None]]
    complementary: list[list[float | None]]


class FrequencyResponses(Answer):
    """Loop functions at the actuators' commands, and transfers of reference, disturbances and noise, at a point.

    `loop` is L, `sensitivity` ``S = (I + L)^-1``, `complementary` ``T = I - S``, `control` what reaches the commands
    (KS for noise), the others what reaches angles and rates.
    """

    name: str
    point: int
    omega_rad_s: list[float]
    loop: list[TransferResponse]
    sensitivity: list[TransferResponse]
    complementary: list[TransferResponse]
    control: list[TransferResponse]
    reference: list[TransferResponse]
    disturbance: list[TransferResponse]
    noise: list[TransferResponse]
    singular_values: LoopSingularValues
