"""Requests for a proof between the grid points: of a design's controllers, and of any table of gains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, Field, Tag, model_validator

from schedules.files.header import FORMAT
from schedules.files.json_file import ARRAY_ORDER
from schedules.rules import INTEGRATOR_PLACEMENTS, INTERPOLATIONS, OUTS_OF_RANGE
from schedules.schedule import SCHEMA_VERSION, SIGN_CONVENTION
from service.schemas.actuators import Actuators, Bandwidth
from service.schemas.aerodynamics import Aerodynamics
from service.schemas.any_controller import AnyController, ControllerName
from service.schemas.design import Kind, OutcomeCode
from service.schemas.flight import Airspeed, Altitude, Atmosphere, DynamicPressure, Mach, increasing
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.lqr_requests import RateFilters
from service.schemas.section import Geometry, Inertia
from service.schemas.trim import Trim
from service.schemas.wire import PARAMETERS, Request, refusal

#: Largest relative change of a parameter; 0 leaves it as it is.
Change = Annotated[float, Field(ge=0.0, le=99.0)]
OwnChange = Annotated[Change | None, Field(description="Of this one, instead of that of its group")]
#: A gain of a table, of any law, SI and radians.
TableGain = Annotated[float, Field(ge=-1e12, le=1e12)]
#: Most gains of a table: those of a state feedback with the most states there are.
MOST_GAINS = 200


class WantedProof(BaseModel):
    """What is to be proved, and of which plants."""

    fraction: Annotated[float, Field(ge=0.0, lt=1.0)] = Field(
        default=0.5,
        description="The decay rate wanted of a cell, as a part of that of the slowest pole at its corners; without "
        "`decay_rate_1_s`",
        examples=[0.5],
    )
    decay_rate_1_s: Annotated[float, Field(ge=0.0, le=1e6)] | None = Field(
        default=None, description="The decay rate wanted everywhere; 0 is stability"
    )
    hinge_moment_percent: Change = Field(
        default=0.0,
        description="Largest change of each of the four hinge-moment derivatives by the deflections, that the proof "
        "must hold for",
    )
    inertia_percent: Change = Field(
        default=0.0, description="Of each surface's inertia about its own centre of mass, each alone"
    )
    mass_percent: Change = Field(default=0.0, description="Of each surface's mass, each alone")
    cg_offset_percent: Change = Field(default=0.0, description="Of how far each centre of mass is behind its hinge")
    C_Ha_da_percent: OwnChange = None
    C_Ha_dt_percent: OwnChange = None
    C_Ht_da_percent: OwnChange = None
    C_Ht_dt_percent: OwnChange = None
    aileron_inertia_percent: OwnChange = None
    tab_inertia_percent: OwnChange = None
    aileron_mass_percent: OwnChange = None
    tab_mass_percent: OwnChange = None
    aileron_cg_offset_percent: OwnChange = None
    tab_cg_offset_percent: OwnChange = None
    together: bool = Field(
        default=False,
        description="All parameters off at once, up to six and at most one of the bodies'; or each alone, which covers "
        "mixtures whose parts of the ranges add to no more than one",
    )
    pieces: Annotated[int, Field(ge=1, le=256)] = Field(
        default=16, description="Into how many pieces a cell may be cut, each with a Lyapunov matrix of its own"
    )


class WantedSummary(WantedProof):
    """What is to be proved, and what else is asked of the schedule."""

    margins: bool = Field(
        default=False, description="Whether the error is wanted that the speed the gains are read at may have"
    )
    rates: bool = Field(default=False, description="Whether the rates of flight that are proved are wanted")
    altitude_rate_m_s: Annotated[float, Field(ge=0.0, le=1000.0)] = Field(
        default=10.0, description="How fast the altitude changes, at most, where `rates` are wanted"
    )


class CertificateQuery(WantedProof):
    """What the certificate is to prove."""

    model_config = PARAMETERS


class VerificationQuery(WantedSummary):
    """Which controllers are to be proved, and what of them."""

    model_config = PARAMETERS

    controller: Annotated[list[ControllerName], Field(max_length=100)] | None = Field(
        default=None, description="Names of controllers, repeated; without it, all of the design"
    )


class ProofAsked(WantedSummary):
    """What is to be proved of a table, and what else is asked of it."""

    model_config = Request.model_config


class AltitudeBreakpoints(Request):
    """Geopotential altitude."""

    name: Literal["altitude_m"]
    unit: Literal["m"] = "m"
    values: Annotated[list[Altitude], Field(min_length=1, max_length=10_000), AfterValidator(increasing)] = Field(
        json_schema_extra={"unit": "m"}
    )


class DynamicPressureBreakpoints(Request):
    """Dynamic pressure."""

    name: Literal["dynamic_pressure_pa"]
    unit: Literal["Pa"] = "Pa"
    values: Annotated[list[DynamicPressure], Field(min_length=1, max_length=10_000), AfterValidator(increasing)] = (
        Field(json_schema_extra={"unit": "Pa"})
    )


class AirspeedBreakpoints(Request):
    """True airspeed."""

    name: Literal["airspeed_m_s"]
    unit: Literal["m/s"] = "m/s"
    values: Annotated[list[Airspeed], Field(min_length=1, max_length=10_000), AfterValidator(increasing)] = Field(
        json_schema_extra={"unit": "m/s"}
    )


class MachBreakpoints(Request):
    """Mach number."""

    name: Literal["mach"]
    unit: Literal["1"] = "1"
    values: Annotated[list[Mach], Field(min_length=1, max_length=10_000), AfterValidator(increasing)]


Breakpoints = Annotated[
    AltitudeBreakpoints | DynamicPressureBreakpoints | AirspeedBreakpoints | MachBreakpoints,
    Field(discriminator="name"),
]


def altitude_then_speed(axes: list[Breakpoints]) -> list[Breakpoints]:
    """Two axes, refused unless the first is the altitude and the second a speed."""
    speeds = "dynamic_pressure_pa, airspeed_m_s or mach"
    if not isinstance(axes[0], AltitudeBreakpoints):
        raise refusal("the first axis of a table is the altitude", "altitude_m", at="/0/name")
    if isinstance(axes[1], AltitudeBreakpoints):
        raise refusal("the second axis of a table is a speed", speeds, at="/1/name")
    return axes


T = TypeVar("T")
#: A value a point of the table; of wrong ones the first is named, for there may be a hundred thousand.
Plane = Annotated[list[Annotated[list[T], Field(fail_fast=True)]], Field(fail_fast=True)]


class TableOfGain(Request):
    """One gain over the table, SI and radians; null where the table has none."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,62}$")]
    unit: Annotated[str, Field(max_length=40)]
    values: Plane[TableGain | None] = Field(
        json_schema_extra={"unit": "see `unit`"},
        description="``values[i][j]`` belongs to breakpoint i of the altitude and j of the speed",
    )


Text = Annotated[str, Field(max_length=10_000)]


class GainTable(Request):
    """A table of gains, multilinear between its breakpoints: axes and gains alone, or a schedule file in JSON as it is.

    Of a file the words about rules and signs are checked: a table that means something else is refused. Where it came
    from has no part.
    """

    axes: Annotated[list[Breakpoints], Field(min_length=2, max_length=2), AfterValidator(altitude_then_speed)]
    gains: Annotated[list[TableOfGain], Field(min_length=1, max_length=MOST_GAINS)]
    outcomes: Plane[OutcomeCode] | None = Field(
        default=None, description="Of each point, in the table's shape; null: a point has gains, or it has not"
    )
    reasons: Plane[Text | None] | None = Field(default=None, description="Why a point has no gains")
    format: Text | None = None
    schema_version: int | None = None
    design_id: Text | None = None
    design_name: Text | None = None
    request_digest: Text | None = None
    version: Text | None = None
    created_at: Text | None = None
    controller: ControllerName | None = None
    kind: Kind | None = None
    law: Text | None = None
    sign_convention: Text | None = None
    interpolation: Text | None = None
    out_of_range: Text | None = None
    integrator_placement: Text | None = None
    array_order: Text | None = None
    proof: dict[str, Any] | None = Field(
        default=None, description="What a file says of the proof of its table; it has no part: the table is proved anew"
    )
    proof_reason: Text | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """Breakpoints of the two axes."""
        return len(self.axes[0].values), len(self.axes[1].values)

    @model_validator(mode="after")
    def words_that_are_understood(self) -> Self:
        """Refuse another format, rule, sign convention or order than those of the files."""
        rules: dict[str, tuple[object, ...]] = {
            "format": (FORMAT,),
            "schema_version": tuple(range(1, SCHEMA_VERSION + 1)),
            "sign_convention": (SIGN_CONVENTION,),
            "interpolation": (INTERPOLATIONS["multilinear"],),
            "out_of_range": tuple(OUTS_OF_RANGE.values()),
            "integrator_placement": (INTEGRATOR_PLACEMENTS["before_gain"],),
            "array_order": (ARRAY_ORDER,),
        }
        for name, known in rules.items():
            if getattr(self, name) not in (None, *known):
                allowed = " or ".join(map(str, known))
                raise refusal("not what this version reads and proves", f"{allowed}, or null", at=f"/{name}")
        return self

    @model_validator(mode="after")
    def in_one_shape(self) -> Self:
        """Refuse gains, outcomes and reasons that are not of the table's shape, and names that stand twice."""
        seen: set[str] = set()
        for place, gain in enumerate(self.gains):
            if gain.name in seen:
                raise refusal(f"the gain {gain.name} stands twice", "each gain once", at=f"/gains/{place}/name")
            seen.add(gain.name)
            in_shape(gain.values, self.shape, f"/gains/{place}/values")
        for name in ("outcomes", "reasons"):
            if getattr(self, name) is not None:
                in_shape(getattr(self, name), self.shape, f"/{name}")
        return self

    @model_validator(mode="after")
    def gains_where_they_are_said_to_be(self) -> Self:
        """Refuse a point with some of its gains, or with gains that its outcome denies, or the other way round."""
        first = self.gains[0]
        for i, row in enumerate(first.values):
            for j, value in enumerate(row):
                for place, gain in enumerate(self.gains):
                    if (gain.values[i][j] is None) != (value is None):
                        at = f"/gains/{place}/values/{i}/{j}"
                        detail = f"{gain.name} and {first.name} are not missing at the same points"
                        raise refusal(detail, "all gains of a point, or null for each of them", at)
                if self.outcomes is not None and (self.outcomes[i][j] == "ok") != (value is not None):
                    allowed = "ok where there are gains, another outcome where they are null"
                    raise refusal("the outcome is not that of the gains there", allowed, f"/outcomes/{i}/{j}")
        return self


def in_shape(values: Sequence[Sequence[object]], shape: tuple[int, int], at: str) -> None:
    """Refuse nested lists that are not of the table's shape."""
    rows, columns = shape
    allowed = f"{rows} lists of {columns} entries, altitude by speed"
    if len(values) != rows:
        raise refusal(f"{len(values)} rows, in a table of {rows} by {columns} points", allowed, at)
    for place, row in enumerate(values):
        if len(row) != columns:
            raise refusal(f"{len(row)} entries in a row of {columns}", allowed, f"{at}/{place}")


class FlownPlant(Request):
    """The plant that a table is flown with: the parts of a design request that say so, without a grid."""

    geometry: Geometry
    inertia: Inertia
    aerodynamics: Aerodynamics
    atmosphere: Atmosphere = Field(default_factory=Atmosphere)
    trim: Trim = Field(default_factory=Trim)
    actuators: Actuators


#: Fields of a flown controller that only some kinds have.
_OF_KINDS = {
    "tab_command": ("negative_feedback", "positive_feedback"),
    "rate_filter_hz": ("negative_feedback",),
    "sample_time_s": ("negative_feedback", "positive_feedback"),
    "computational_delay_s": ("negative_feedback", "positive_feedback"),
    "reference": ("lqr",),
    "delay_states": ("lqr",),
    "measurement": ("lqr",),
}


class FlownController(AnyController):
    """The law that flies a table: what a controller of a design request says of its structure, no specs or weights."""

    name: ControllerName = "uploaded"
    kind: Kind
    tab_command: Literal["deflection", "rate"] = Field(
        default="deflection", description="Of tab-only controllers: what the tab's actuator is given"
    )
    rate_filter_hz: Bandwidth | None = Field(
        default=None, description="Of negative feedback: cut-off of the filtered derivative; null: the rate is measured"
    )
    reference: Literal["none", "aileron", "aileron_and_tab"] = Field(
        default="aileron", description="Of state feedback: what follows a reference, and so has an integral"
    )
    delay_states: Annotated[int, Field(ge=0, le=8)] = Field(
        default=0, description="Of state feedback: states that it runs for the transport delay of each actuator"
    )
    measurement: RateFilters | None = Field(
        default=None, description="Of state feedback: null where every state is measured"
    )

    @model_validator(mode="after")
    def fields_of_its_kind(self) -> Self:
        """Refuse a field that another kind has."""
        for name, kinds in _OF_KINDS.items():
            if self.kind not in kinds and getattr(self, name) != type(self).model_fields[name].default:
                raise refusal(f"{self.kind} has no {name}", f"only with the kind {' or '.join(kinds)}", at=f"/{name}")
        return self


class VerificationRequest(Request):
    """A table of gains, the law that flies it and the plant it is flown with."""

    design: FlownPlant | None = Field(default=None, description="The plant; or `design_id`")
    design_id: Annotated[str, Field(max_length=100)] | None = Field(
        default=None, description="A stored design whose plant and actuators are taken; or `design`"
    )
    controller: Annotated[
        Annotated[ControllerName, Tag("string")] | Annotated[FlownController, Tag("object")], BY_JSON_TYPE
    ] = Field(description="The law: by the name of a controller of the stored design, or given")
    schedule: GainTable
    proof: ProofAsked = Field(default_factory=ProofAsked)
    certificate: bool = Field(default=False, description="Whether the certificate is wanted with the answer")

    @model_validator(mode="after")
    def one_plant(self) -> Self:
        """Refuse no plant, two of them, and the name of a controller without a stored design."""
        if (self.design is None) == (self.design_id is None):
            raise refusal("exactly one plant is wanted", "either design or design_id", at="/design")
        if self.design_id is None and isinstance(self.controller, str):
            detail = "only a stored design has controllers by name"
            raise refusal(detail, "an object that says the law; or a design_id", at="/controller")
        return self
