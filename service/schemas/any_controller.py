"""What every controller has on the wire: a name, and how it runs on a computer."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator

from service.schemas.wire import Request, refusal

ControllerName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,62}$")]

#: Longest computational delay, in samples.
MOST_DELAY = 10.0


class AnyController(Request):
    """A controller of any kind."""

    name: ControllerName
    sample_time_s: Annotated[float, Field(ge=1e-5, le=1.0)] | None = Field(
        default=None, description="Sample time of a digital controller; null: a continuous one"
    )
    computational_delay_s: Annotated[float, Field(ge=0.0, le=MOST_DELAY)] | None = Field(
        default=None,
        validate_default=True,
        description="Time from a measurement to the command that is computed from it, at most ten samples; null: one "
        "sample",
    )

    @field_validator("computational_delay_s")
    @classmethod
    def delay_of_samples(cls, delay: float | None, info: ValidationInfo) -> float | None:
        """One sample unless it is given; refused without a sample time, or over too many samples."""
        sample = info.data.get("sample_time_s")
        if delay is None:
            return sample if isinstance(sample, float) else None
        if "sample_time_s" in info.data and sample is None:
            raise refusal("a continuous controller has no computational delay", "null, or sample_time_s beside it")
        if sample is not None and delay > MOST_DELAY * sample * (1.0 + 1e-9):
            raise refusal(
                f"longer than {MOST_DELAY:g} samples of {sample:g} s", f">= 0 and <= {MOST_DELAY * sample:g}, or null"
            )
        return delay
