"""Concurrent actuation on the wire: state feedback of both torques (seed chapter 5)."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from design.lqr.structures import Structure
from model.actuators import Actuator
from model.lag_states import LAG_STATES
from model.linear_model import STATES
from service.schemas.actuators import Actuators, Bandwidth
from service.schemas.any_controller import AnyController
from service.schemas.forms import BY_JSON_TYPE
from service.schemas.weights import Weights
from service.schemas.wire import Request, refusal

TorqueNoise = Annotated[float, Field(ge=0.0, le=1e6)]
AngleNoise = Annotated[float, Field(ge=1e-12, le=1e3)]


class TabTravel(Request):
    """How far the tab travels, at rest, with the aileron."""

    tab_per_aileron: Annotated[float, Field(ge=-1e3, le=1e3)] = Field(
        description="Tab angle per aileron angle, both from trim", examples=[-1.2]
    )


TabRule = Literal["zero_aileron_torque", "least_torque", "least_power"]
TabAllocation = Annotated[Annotated[TabRule, Tag("string")] | Annotated[TabTravel, Tag("object")], BY_JSON_TYPE]


class RateFilters(Request):
    """The angles are measured; filtered derivatives of them supply the rates."""

    kind: Literal["rate_filters"]
    cutoff_hz: Bandwidth = Field(description="Cut-off of both filters", examples=[200.0])


class KalmanFilter(Request):
    """The angles are measured; a Kalman filter estimates the states.

    Noises are roots of spectral densities that count negative frequencies too; one that counts positive frequencies
    only, as data sheets do, is larger by the root of 2.
    """

    kind: Literal["kalman"]
    tab_torque_noise: TorqueNoise = Field(
        description="Of the torque on the tab beside that of its actuator", json_schema_extra={"unit": "N m/sqrt(Hz)"}
    )
    aileron_torque_noise: TorqueNoise = Field(
        description="Of the torque on the aileron beside that of its actuator",
        json_schema_extra={"unit": "N m/sqrt(Hz)"},
    )
    tab_angle_noise_deg: AngleNoise = Field(
        description="Of the error of the measured tab angle", json_schema_extra={"unit": "deg/sqrt(Hz)"}
    )
    aileron_angle_noise_deg: AngleNoise = Field(
        description="Of the error of the measured aileron angle", json_schema_extra={"unit": "deg/sqrt(Hz)"}
    )
    recovery: Annotated[float, Field(ge=0.0, le=1e12)] = Field(
        default=0.0,
        description="Loop-transfer recovery: the filter believes in noise on the commands too, of this many times the "
        "intensity of that of the torques. As it grows the loops tend to those of full-state feedback",
    )


Measurement = Annotated[RateFilters | KalmanFilter, Field(discriminator="kind")]


class Lqr(AnyController):
    """Both surfaces by torque: state feedback with integrals of the errors and feed-forward (seed 5.3, 5.4)."""

    kind: Literal["lqr"]
    reference: Literal["none", "aileron", "aileron_and_tab"] = Field(
        default="aileron",
        description="What follows a reference. `none`: a plain regulator; `aileron`: the aileron, the tab rests where "
        "`tab_allocation` says; `aileron_and_tab`: both",
    )
    weights: Weights
    tab_allocation: TabAllocation = Field(
        default="zero_aileron_torque",
        description="Where the free tab rests when the aileron is on its reference: `zero_aileron_torque` so that the "
        "aileron holds itself, `least_torque` and `least_power` so that both actuators together need least, as parts "
        "of their limits where both have one; or how far it travels with the aileron. Only with the reference "
        "`aileron`",
    )
    delay_states: Annotated[int, Field(ge=0, le=8)] = Field(
        default=0,
        description="States that the design gives to the transport delay of each actuator that has one, run by the "
        "controller; 0 designs without the delay. The loop is judged with it either way. 0 with a sample time: from "
        "sample to sample delays are exact",
    )
    measurement: Measurement | None = Field(
        default=None,
        description="What the states are worked out from, in continuous time; null: every state is measured",
    )

    @model_validator(mode="after")
    def a_free_tab_to_allocate(self) -> Self:
        """Refuse a rule for the tab where it is not free, or nothing comes to rest on a reference."""
        if self.reference != "aileron" and self.tab_allocation != "zero_aileron_torque":
            raise refusal(
                f"with the reference {self.reference} no free tab is left to allocate",
                "zero_aileron_torque, which has no effect there; or the reference aileron",
                at="/tab_allocation",
            )
        return self

    @model_validator(mode="after")
    def what_samples_do_not_take(self) -> Self:
        """Refuse a digital controller that measures the angles only, or that would approximate delays."""
        if self.sample_time_s is None:
            return self
        if self.measurement is not None:
            detail, allowed = "this version estimates states in continuous time", "null, or no sample_time_s"
            raise refusal(detail, allowed, at="/measurement")
        if self.delay_states > 0:
            detail, allowed = "from sample to sample delays are exact, and take no states", "0, or no sample_time_s"
            raise refusal(detail, allowed, at="/delay_states")
        return self

    def on_plant(self, actuators: Actuators, damping: str, at: str) -> Self:
        """The controller with its weights in their simplest form; refused unless they fit its states.

        Parameters
        ----------
        at : where the controller stands, as a pointer that names the branches of unions too
        """
        structure = self._structure(actuators)
        lags = LAG_STATES if damping == "unsteady" else ()
        at = f"{at}/weights/{self.weights.rule}"
        return self.model_copy(update={"weights": self.weights.on(structure, structure.states((*STATES, *lags)), at)})

    def _structure(self, actuators: Actuators) -> Structure:
        """What is built around the model, for the names of its states: only whether there is a lag or delay counts."""
        tab, aileron = (
            Actuator(torque_loop_bandwidth=wire.torque_loop_bandwidth_hz, delay=wire.delay_s)
            for wire in (actuators.tab, actuators.aileron)
        )
        return Structure(self.reference, tab, aileron, self.delay_states)
