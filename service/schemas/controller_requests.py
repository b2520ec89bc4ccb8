"""Controllers on the wire, told apart by their kind."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from service.schemas.actuators import Bandwidth
from service.schemas.weights import BrysonWeights, ExplicitWeights
from service.schemas.wire import Request

ControllerName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,62}$")]
Weights = Annotated[BrysonWeights | ExplicitWeights, Field(discriminator="rule")]


class Specs(Request):
    """What a classical design must meet. A spec that is not given is not imposed; the spec pack is still judged."""

    damping_ratio_min: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    gain_margin_db_min: Annotated[float, Field(ge=0.0, le=60.0)] | None = None
    phase_margin_deg_min: Annotated[float, Field(ge=0.0, le=90.0)] | None = None
    settling_time_s_max: Annotated[float, Field(ge=1e-4, le=1e3)] | None = None
    overshoot_percent_max: Annotated[float, Field(ge=0.0, le=100.0)] | None = None


class Classical(Request):
    """What the two classical controllers share: the tab alone is moved, by deflection commands."""

    name: ControllerName
    tab_command: Literal["deflection"] = "deflection"
    specs: Specs
    gains: None = Field(default=None, description="This version chooses the gains: null")


class NegativeFeedback(Classical):
    """``dt_cmd = sigma (K_i int(r - da) - K_p da - K_d da')``: stiffens and damps (seed 4.2.1)."""

    kind: Literal["negative_feedback"]
    rate_filter_hz: Bandwidth | None = Field(
        default=None, description="Cut-off of the filtered derivative that supplies the aileron's rate; null: measured"
    )


class PositiveFeedback(Classical):
    """``dt_cmd = sigma (K_i int(r - da) + K_f da)``: cancels aerodynamic stiffness (seed 4.2.2)."""

    kind: Literal["positive_feedback"]


class Lqr(Request):
    """Both surfaces by torque: state feedback with an integral of the aileron's error and feed-forward (seed 5.3)."""

    name: ControllerName
    kind: Literal["lqr"]
    reference: Literal["aileron"] = "aileron"
    weights: Weights
    tab_allocation: Literal["zero_aileron_torque"] = Field(
        default="zero_aileron_torque", description="Where the free tab settles: so that the aileron holds itself"
    )
    sample_time_s: None = Field(default=None, description="This version designs in continuous time: null")


Controller = Annotated[NegativeFeedback | PositiveFeedback | Lqr, Field(discriminator="kind")]
