"""Weights of a quadratic regulator on the wire: Bryson's rule, matrices of states or outputs, and power on top."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)

from design.lqr.structures import FOLLOWED, Structure
from service.schemas.wire import Request, refusal

LargestAngle = Annotated[float, Field(ge=1e-6, le=1e6)]
LargestTorque = Annotated[float, Field(ge=1e-9, le=1e9)]
Entry = Annotated[float, Field(ge=-1e12, le=1e12)]
Pair = Annotated[list[Entry], Field(min_length=2, max_length=2)]
Matrix = Annotated[list[Annotated[list[Entry], Field(min_length=1, max_length=64)]], Field(min_length=1, max_length=64)]
OfInputs = Annotated[list[Pair], Field(min_length=2, max_length=2)]
OutputName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,31}$")]
Price = Annotated[float, Field(ge=0.0, le=1e12)]
PeakPower = Annotated[float, Field(ge=1e-9, le=1e9)]

INPUTS = "T_t T_a"


class BrysonWeights(Request):
    """Largest acceptable value of each state, integral and input: ``Q = diag(1/max^2)``, ``R = diag(1/max^2)``."""

    rule: Literal["bryson"]
    aileron_deg: LargestAngle
    aileron_rate_deg_s: LargestAngle
    tab_deg: LargestAngle
    tab_rate_deg_s: LargestAngle
    aileron_integral_deg_s: LargestAngle | None = Field(
        default=None,
        description="Integral of the aileron's error, in degrees times seconds; without effect, and null, where the "
        "aileron has no reference",
        json_schema_extra={"unit": "deg s"},
    )
    tab_integral_deg_s: LargestAngle | None = Field(
        default=None,
        description="Integral of the tab's error, in degrees times seconds; only with the reference `aileron_and_tab`",
        json_schema_extra={"unit": "deg s"},
    )
    tab_torque_n_m: LargestTorque
    aileron_torque_n_m: LargestTorque

    def on(self, structure: Structure, states: tuple[str, ...], at: str) -> Self:
        """The weights of the integrals there are; refused unless each of them has one."""
        followed = structure.references
        if "r_a" in followed and self.aileron_integral_deg_s is None:
            raise refusal("this field is required: the aileron has a reference", _RANGE, f"{at}/aileron_integral_deg_s")
        if "r_t" in followed and self.tab_integral_deg_s is None:
            raise refusal("this field is required: the tab has a reference", _RANGE, f"{at}/tab_integral_deg_s")
        if "r_t" not in followed and self.tab_integral_deg_s is not None:
            allowed = "null, or the reference aileron_and_tab"
            raise refusal("the tab has no reference, so there is no such integral", allowed, f"{at}/tab_integral_deg_s")
        return self if "r_a" in followed else self.model_copy(update={"aileron_integral_deg_s": None})


_RANGE = ">= 1e-06 and <= 1e+06"


class ExplicitWeights(Request):
    """The matrices of the cost ``x'Qx + u'Ru + 2x'Nu``, in SI and radians.

    Over the states of the controller's structure in their order: `dt dt_rate da da_rate`, the integrals `int_a` and
    `int_t` of what follows a reference, `tab_torque` and `aileron_torque` where a torque loop has a bandwidth,
    `lag_1 lag_2` with unsteady damping, and the `delay_states` of each actuator with a delay. Or over those up to the
    integrals alone: the others then have no weight.
    """

    rule: Literal["explicit"]
    Q: Matrix = Field(
        description="n x n, states in their order: without lags and delays dt dt_rate da da_rate int_a",
        json_schema_extra={"unit": "SI"},
    )
    R: OfInputs = Field(description="2 x 2, inputs in the order T_t T_a", json_schema_extra={"unit": "SI"})
    N: Matrix | None = Field(default=None, description="n x 2; null for none", json_schema_extra={"unit": "SI"})

    def on(self, structure: Structure, states: tuple[str, ...], at: str) -> Self:
        """The same weights; refused unless they are over the states of the structure."""
        over = dict.fromkeys((states, structure.weighted_states()))
        _refuse_size("Q", self.Q, {len(names): len(names) for names in over}, _sizes(over, None), at)
        if self.N is not None:
            _refuse_size("N", self.N, {len(names): 2 for names in over}, _sizes(over, INPUTS), at)
        return self


class OutputWeights(Request):
    """Weights of named outputs, ``y'W_y y + u'W_u u``, in SI and radians."""

    rule: Literal["output"]
    outputs: Annotated[list[OutputName], Field(min_length=1, max_length=64)] = Field(
        description="What is weighed: any state of the structure; the errors `da_error`, `dt_error` of what follows a "
        "reference; `dt_acceleration`, `da_acceleration`; the torques `T_t`, `T_a` on the surfaces and the commands "
        "`T_t_command`, `T_a_command`",
        examples=[["da_error", "da_rate", "dt"]],
    )
    W_y: Matrix = Field(description="k x k, over the outputs in their order", json_schema_extra={"unit": "SI"})
    W_u: OfInputs = Field(description="2 x 2, commands in the order T_t T_a", json_schema_extra={"unit": "SI"})

    def on(self, structure: Structure, states: tuple[str, ...], at: str) -> Self:
        """The same weights; refused unless there are such outputs, and a weight of each."""
        known = output_names(structure, states)
        for place, name in enumerate(self.outputs):
            if name not in known:
                raise refusal(f"there is no output {name}", f"one of {', '.join(known)}", f"{at}/outputs/{place}")
            if name in self.outputs[:place]:
                raise refusal(f"{name} is among the outputs before", "each output once", f"{at}/outputs/{place}")
        k = len(self.outputs)
        _refuse_size("W_y", self.W_y, {k: k}, f"{_count(k, k)}, over {' '.join(self.outputs)}", at)
        return self


PlainWeights = Annotated[BrysonWeights | ExplicitWeights | OutputWeights, Field(discriminator="rule")]


class PowerWeights(Request):
    """Power weighed on top of other weights (seed 5.2).

    `net_work` adds the price of the work that the actuators do, ``int( w_t T_t dt' + w_a T_a da' ) dt``, to the cost.
    `balanced` scales the weight of each torque together with that of its rate, point by point, until the actuator's
    peak power for the reference step is what is asked for.
    """

    rule: Literal["power"]
    form: Literal["net_work", "balanced"]
    base: PlainWeights = Field(description="The weights without regard to power")
    tab_price: Price | None = Field(
        default=None,
        validate_default=True,
        description="Of net_work: price of the tab actuator's work, in units of the cost per J; one of the two prices "
        "is above 0",
        json_schema_extra={"unit": "1/W"},
    )
    aileron_price: Price | None = Field(
        default=None,
        validate_default=True,
        description="Of net_work: price of the aileron actuator's work",
        json_schema_extra={"unit": "1/W"},
    )
    part: Annotated[float, Field(gt=0.0, le=1.0)] | None = Field(
        default=None,
        description="Of net_work: this part of the largest admissible prices in the proportion of the two given; "
        "null: the prices as they are",
    )
    tab_power_w: PeakPower | None = Field(
        default=None,
        description="Of balanced: peak power of the tab's actuator for the reference step, trim torque included; one "
        "of the two powers is given, and null asks nothing of that actuator",
    )
    aileron_power_w: PeakPower | None = Field(
        default=None, description="Of balanced: peak power of the aileron's actuator"
    )
    keep_settling: bool | None = Field(
        default=None,
        validate_default=True,
        description="Whether the integrals' weights are scaled too, so that the aileron settles on the reference step "
        "as it does with the base; null: true of balanced, false of net_work",
    )

    @field_validator("tab_price", "aileron_price", "part", "tab_power_w", "aileron_power_w")
    @classmethod
    def of_its_form(cls, value: float | None, info: ValidationInfo) -> float | None:
        """A price that is not given is 0; refused where the field belongs to the other form."""
        form = info.data.get("form")
        mine = info.field_name in _OF_FORM.get(str(form), ())
        if value is not None and form is not None and not mine:
            raise refusal(f"no field of the form {form}", f"null; of this form {', '.join(_OF_FORM[str(form)])}")
        return 0.0 if value is None and mine and str(info.field_name).endswith("_price") else value

    @field_validator("keep_settling")
    @classmethod
    def settling_by_form(cls, value: bool | None, info: ValidationInfo) -> bool | None:
        """True of a balance and false of a price unless it is given."""
        return info.data.get("form") == "balanced" if value is None else value

    @model_validator(mode="after")
    def something_asked(self) -> Self:
        """Refuse a price of nothing, and a balance that asks nothing."""
        if self.form == "net_work" and not (self.tab_price or self.aileron_price):
            raise refusal("one of the two prices must be above 0", "> 0 and <= 1e+12", at="/tab_price")
        if self.form == "balanced" and self.tab_power_w is None and self.aileron_power_w is None:
            raise refusal("one of the two powers must be given", ">= 1e-09 and <= 1e+09", at="/tab_power_w")
        return self

    @model_serializer(mode="wrap")
    def without_the_other_form(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """The weights name the fields of their form."""
        others = {name for form, names in _OF_FORM.items() if form != self.form for name in names}
        return {name: value for name, value in handler(self).items() if name not in others}

    def on(self, structure: Structure, states: tuple[str, ...], at: str) -> Self:
        """The weights with their base on the structure; refused where a step is asked about that nothing follows."""
        if not structure.references and self.form == "balanced":
            allowed = "net_work, or the reference aileron or aileron_and_tab"
            raise refusal("nothing follows a reference: there is no step to balance powers on", allowed, f"{at}/form")
        if not structure.references and self.keep_settling:
            allowed = "false, or the reference aileron or aileron_and_tab"
            raise refusal("nothing follows a reference: there is no settling to keep", allowed, f"{at}/keep_settling")
        base = self.base.on(structure, states, f"{at}/base/{self.base.rule}")
        return self.model_copy(update={"base": base})


_OF_FORM = {
    "net_work": ("tab_price", "aileron_price", "part"),
    "balanced": ("tab_power_w", "aileron_power_w"),
}

Weights = Annotated[BrysonWeights | ExplicitWeights | OutputWeights | PowerWeights, Field(discriminator="rule")]


def output_names(structure: Structure, states: tuple[str, ...]) -> tuple[str, ...]:
    """Names of what can be weighed as an output (`design.lqr.output_weights`)."""
    errors = (f"{FOLLOWED[name]}_error" for name in structure.references)
    return (*states, *errors, "dt_acceleration", "da_acceleration", "T_t", "T_a", "T_t_command", "T_a_command")


def _refuse_size(name: str, matrix: list[list[float]], sizes: dict[int, int], allowed: str, at: str) -> None:
    """Refuse a matrix unless it has as many columns as `sizes` says for its number of rows."""
    lengths = sorted({len(row) for row in matrix})
    if lengths == [sizes.get(len(matrix))]:
        return
    said = f"{lengths[0]}" if len(lengths) == 1 else f"{lengths[0]} to {lengths[-1]}"
    raise refusal(f"{name} has {len(matrix)} rows of {said} numbers", allowed, f"{at}/{name}")


def _sizes(over: dict[tuple[str, ...], None], inputs: str | None) -> str:
    """The sizes that a matrix over any of these states may have; its columns are over the inputs, or the same."""
    columns = "" if inputs is None else f" and the inputs {inputs}"
    sizes = (f"{_count(len(n), len(n) if inputs is None else 2)}, over {' '.join(n)}{columns}" for n in over)
    return "; or ".join(sizes)


def _count(rows: int, columns: int) -> str:
    return f"{rows} rows of {columns} numbers"
