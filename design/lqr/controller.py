"""What a controller of concurrent actuation is asked for (seed chapter 5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from design.lqr.allocation import TabAllocation
from design.lqr.measurement import KalmanMeasurement, Measurement, RateFilters
from design.lqr.power_weights import Weights
from design.lqr.structures import Reference, Structure
from design.sampling import Sampling
from model.actuators import Actuator


@dataclass(frozen=True)
class LqrController:
    """A state feedback asked for by its weights.

    Attributes
    ----------
    name : unique in its study
    weights : Bryson's rule, explicit matrices, weights of outputs, or one of them with power weighed
    tab_allocation : where the free tab rests when the aileron is on its reference; without effect where the tab has a
        reference of its own, or nothing has one
    reference : what follows a reference, with integral action and feed-forward; ``none`` is a plain regulator
    delay_states : states that the design gives to the transport delay of a torque, run by the controller; 0 designs
        without the delay. The loop is judged with the delay itself either way
    sampling : how the controller runs on a computer; None is a continuous one
    measurement : what the controller works out its states from; None where every state is measured
    """

    name: str
    weights: Weights
    tab_allocation: TabAllocation = "zero_aileron_torque"
    reference: Reference = "aileron"
    delay_states: int = 0
    sampling: Sampling | None = None
    measurement: Measurement | None = None

    @property
    def kind(self) -> Literal["lqr"]:
        """Kind of controller, as in requests and files."""
        return "lqr"

    @property
    def law(self) -> str:
        """The control law in one line, with the gains by name."""
        forward = "" if self.reference == "none" else " + N r"
        if self.sampling is not None:
            return (
                f"u_k = -K [x_k, u_(k-1), ..]{forward}, u = [T_t, T_a], every {self.sampling.time:g} s, commanded "
                f"{self.sampling.delay:g} s after it is measured; integrals by the trapezoidal rule"
            )
        law = f"u = -K x{forward}, u = [T_t, T_a]"
        if isinstance(self.measurement, RateFilters):
            return (
                f"{law}; the rates in x are w s/(s + w) of the measured angles, w = {self.measurement.cutoff:.9g} rad/s"
            )
        if isinstance(self.measurement, KalmanMeasurement):
            estimate = "z' = A z + B v + L ([dt, da] - [z_dt, z_da]), v the torques that reach the actuators"
            return f"{law}; x estimated, but for the integrals: {estimate}"
        return law

    def structure(self, tab: Actuator, aileron: Actuator) -> Structure:
        """What is built around the model with these actuators.

        Raises
        ------
        ValueError : `Structure` refuses it
        """
        return Structure(self.reference, tab, aileron, self.delay_states)
