"""Manoeuvres on the wire: what the references do in time, of a stored design's loops (seed 5.7, 6.3.2)."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.schemas.flight import SurfaceAngle
from service.schemas.wire import Request, refusal

Duration = Annotated[float, Field(ge=1e-3, le=1e3)]
Rate = Annotated[float, Field(ge=-1e5, le=1e5)]
RateLimit = Annotated[float, Field(gt=0.0, ge=1e-3, le=1e6)]

#: Two times that are not equal are this far apart [s] at least: the slope between them must be a number.
SHORTEST_GAP = 1e-10

_TAB = "The same of the tab; without effect unless the controller has the reference `aileron_and_tab`"


class Step(Request):
    """A step from trim, at once or at a limited rate (seed Fig 5.20)."""

    kind: Literal["step"]
    aileron_deg: SurfaceAngle = Field(description="Size of the aileron's step", examples=[10.0])
    tab_deg: SurfaceAngle = Field(default=0.0, description=_TAB)
    rate_limit_deg_s: RateLimit | None = Field(default=None, description="Rate of the references; null: at once")


class Ramp(Request):
    """A ramp without end."""

    kind: Literal["ramp"]
    aileron_deg_s: Rate = Field(description="Slope of the aileron's reference", examples=[30.0])
    tab_deg_s: Rate = Field(default=0.0, description=_TAB)


class Sine(Request):
    """A sine about trim."""

    kind: Literal["sine"]
    aileron_deg: SurfaceAngle = Field(description="Amplitude of the aileron's reference", examples=[5.0])
    tab_deg: SurfaceAngle = Field(default=0.0, description=_TAB)
    frequency_hz: Annotated[float, Field(ge=1e-3, le=1e3)] = Field(examples=[2.0])


class Doublet(Request):
    """One way for a while, the other way for as long, and back to trim."""

    kind: Literal["doublet"]
    aileron_deg: SurfaceAngle = Field(description="Size each way, of the aileron's reference", examples=[5.0])
    tab_deg: SurfaceAngle = Field(default=0.0, description=_TAB)
    length_s: Duration = Field(description="How long it is held each way", examples=[0.2])


class Recorded(Request):
    """A recorded series from trim, straight lines between its samples, held at the end; two equal times are a jump."""

    kind: Literal["recorded"]
    times_s: Annotated[list[Annotated[float, Field(ge=0.0, le=1e3)]], Field(min_length=1, max_length=10_000)] = Field(
        description="From 0, rising by 1e-6 at least; two may be equal", examples=[[0.0, 0.1, 0.5]]
    )
    aileron_deg: Annotated[list[SurfaceAngle], Field(min_length=1, max_length=10_000)] = Field(
        description="The aileron's reference at these times, from trim", examples=[[0.0, 4.0, -2.0]]
    )
    tab_deg: Annotated[list[SurfaceAngle], Field(min_length=1, max_length=10_000)] | None = Field(
        default=None, description=_TAB
    )

    @model_validator(mode="after")
    def one_value_a_time(self) -> Self:
        """Refuse series of other lengths, and times that do not rise from 0 or stand there three times."""
        times = self.times_s
        for name, series in (("aileron_deg", self.aileron_deg), ("tab_deg", self.tab_deg)):
            if series is not None and len(series) != len(times):
                raise refusal(f"{len(series)} values at {len(times)} times", f"{len(times)} numbers", at=f"/{name}")
        gaps = [after - before for before, after in pairwise(times)]
        falling = any(gap < SHORTEST_GAP and gap != 0.0 for gap in gaps)
        if times[0] != 0.0 or falling or any(a == b == 0.0 for a, b in pairwise(gaps)):
            allowed = f"rising from 0, by {SHORTEST_GAP:g} s at least; two may be equal"
            raise refusal("the times do not rise from 0", allowed, at="/times_s")
        return self


Manoeuvre = Annotated[Step | Ramp | Sine | Doublet | Recorded, Field(discriminator="kind")]
