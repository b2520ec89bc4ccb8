"""Actuators on the wire: one physical actuator a surface, with the bandwidths of its own loops and its limits."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from service.schemas.wire import Request, refusal

Bandwidth = Annotated[float, Field(ge=1e-3, le=1e4)]
#: A delay below this is none [s]: far below what any loop could tell, and where numbers begin to fail.
SHORTEST_DELAY = 1e-9


def none_below_shortest(delay: float) -> float:
    """The delay, or zero when it is so short that it is none: both are the same request."""
    return delay if delay >= SHORTEST_DELAY else 0.0


Delay = Annotated[float, Field(ge=0.0, le=1.0), AfterValidator(none_below_shortest)]

_TORQUE_LOOP = "Bandwidth of the torque loop, a first-order lag, for controllers that command a torque; null: ideal"


class Limits(Request):
    """What the actuator can do; null is unlimited. Limits are judged, they do not steer the design."""

    deflection_deg: Annotated[float, Field(gt=0.0, le=180.0)] | None = None
    rate_deg_s: Annotated[float, Field(gt=0.0, le=1e6)] | None = None
    torque_n_m: Annotated[float, Field(gt=0.0, le=1e9)] | None = None
    power_w: Annotated[float, Field(gt=0.0, le=1e9)] | None = None


class AileronActuator(Request):
    """The aileron's actuator, commanded by torque."""

    torque_loop_bandwidth_hz: Bandwidth | None = Field(default=None, description=_TORQUE_LOOP)
    delay_s: Delay = Field(default=0.0, description="Transport delay of the command; below 1e-9 none")
    limits: Limits = Field(default_factory=Limits)


class TabActuator(Request):
    """The tab's actuator, commanded by deflection (servo), by rate or by torque."""

    servo_bandwidth_hz: Bandwidth | None = Field(
        default=None,
        description="Natural frequency of the deflection servo, its corner when it is of first order; null: ideal, "
        "for controllers whose gains are all given",
        examples=[40.0],
    )
    servo_damping_ratio: Annotated[float, Field(ge=0.05, le=10.0)] | None = Field(
        default=None, description="Damping ratio of the deflection servo; null: it is of first order", examples=[0.7]
    )
    rate_loop_bandwidth_hz: Bandwidth | None = Field(
        default=None,
        description="Bandwidth of the rate loop, for controllers that command a tab rate; null: ideal, where K_theta "
        "is given or the actuator has a delay",
    )
    torque_loop_bandwidth_hz: Bandwidth | None = Field(default=None, description=_TORQUE_LOOP)
    delay_s: Delay = Field(default=0.0, description="Transport delay of the command; below 1e-9 none")
    limits: Limits = Field(default_factory=Limits)

    @model_validator(mode="after")
    def damping_of_a_servo(self) -> Self:
        """Refuse the damping ratio of a servo that is ideal."""
        if self.servo_damping_ratio is not None and self.servo_bandwidth_hz is None:
            raise refusal(
                "the servo has no bandwidth, so it is ideal and has no damping ratio",
                "null, or servo_bandwidth_hz beside it",
                at="/servo_damping_ratio",
            )
        return self


class Actuators(Request):
    """One actuator a surface."""

    tab: TabActuator
    aileron: AileronActuator
