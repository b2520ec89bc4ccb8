"""Controllers on the wire, told apart by their kind."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from service.schemas.actuators import Bandwidth
from service.schemas.any_controller import AnyController
from service.schemas.given_gains import Gains, NegativeFeedbackGains, NoneGivenIsNull, PositiveFeedbackGains
from service.schemas.grid_values import GridAxes, fields_on_grid
from service.schemas.lqr_requests import Lqr
from service.schemas.specs import Specs
from service.schemas.wire import Request, refusal


class Smoothing(Request):
    """How much may be given up so that gains vary smoothly over the grid."""

    bandwidth_loss_percent_max: Annotated[float, Field(ge=0.0, le=50.0)] = Field(
        description="Largest part of its bandwidth that any point may lose"
    )


def null_when_nothing_is_given_up(smoothing: Smoothing | None) -> Smoothing | None:
    """The smoothing, or None when it may lose nothing: both are the same request."""
    return smoothing if smoothing is not None and smoothing.bandwidth_loss_percent_max > 0.0 else None


class Classical(AnyController):
    """What the two classical controllers share: the tab alone is moved, by deflections or by rates."""

    #: Names of the gains around the tab loop, in the order in which the loops are closed.
    outer_gains: ClassVar[tuple[str, ...]]

    tab_command: Literal["deflection", "rate"] = Field(
        default="deflection",
        description="What the tab's actuator is given: a deflection, or a rate by an inner loop on the tab's angle "
        "(seed 4.1.1)",
    )
    specs: Specs = Field(
        default_factory=Specs, description="What the gains that are chosen must meet; may be left out when none is"
    )
    gains: Gains | None = None
    smoothing: Annotated[Smoothing | None, AfterValidator(null_when_nothing_is_given_up)] = Field(
        default=None, description="null: every point has its fastest design"
    )

    @property
    def gain_names(self) -> tuple[str, ...]:
        """Names of the gains of this kind and command, in the order in which the loops are closed."""
        return ("K_theta", *self.outer_gains) if self.tab_command == "rate" else self.outer_gains

    @property
    def all_gains_given(self) -> bool:
        """Whether nothing is left to choose."""
        return self.gains is not None and all(getattr(self.gains, name) is not None for name in self.gain_names)

    @model_validator(mode="after")
    def inner_loop_of_rate_commands(self) -> Self:
        """Refuse the gain of an inner tab loop where there is none."""
        if self.tab_command != "rate" and self.gains is not None and self.gains.K_theta is not None:
            raise refusal(
                "a deflection command has no inner tab loop",
                f"fields {', '.join(self.gain_names)}, or tab_command rate",
                at="/gains/K_theta",
            )
        return self

    @model_validator(mode="after")
    def specs_to_choose_by(self) -> Self:
        """Refuse a controller that says neither what is to be met nor all its gains."""
        if "specs" not in self.model_fields_set and not self.all_gains_given:
            allowed = f"an object of specs, or all the gains {', '.join(self.gain_names)} given"
            raise refusal("this field is required: gains are to be chosen", allowed, at="/specs")
        return self

    def on_grid(self, axes: GridAxes, at: str) -> Self:
        """The controller with its specs and gains in their simplest form; refused unless they fit the grid."""
        specs = fields_on_grid(self.specs, axes, f"{at}/specs")
        gains = None if self.gains is None else fields_on_grid(self.gains, axes, f"{at}/gains")
        return self.model_copy(update={"specs": specs, "gains": gains})


class NegativeFeedback(Classical):
    """``dt_cmd = sigma (K_i int(r - da) - K_p da - K_d da')``: stiffens and damps (seed 4.1.2, 4.2.1)."""

    outer_gains = ("K_d", "K_p", "K_i")

    kind: Literal["negative_feedback"]
    gains: Annotated[NegativeFeedbackGains | None, NoneGivenIsNull] = Field(
        default=None, description="Gains that are given; null: all are chosen"
    )
    rate_filter_hz: Bandwidth | None = Field(
        default=None, description="Cut-off of the filtered derivative that supplies the aileron's rate; null: measured"
    )


class PositiveFeedback(Classical):
    """``dt_cmd = sigma (K_i int(r - da) + K_f da)``: cancels aerodynamic stiffness (seed 4.1.3, 4.2.2)."""

    outer_gains = ("K_f", "K_i")

    kind: Literal["positive_feedback"]
    gains: Annotated[PositiveFeedbackGains | None, NoneGivenIsNull] = Field(
        default=None, description="Gains that are given; null: all are chosen"
    )


Controller = Annotated[NegativeFeedback | PositiveFeedback | Lqr, Field(discriminator="kind")]
