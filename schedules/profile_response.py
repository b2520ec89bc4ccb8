"""How a profile is flown, and what a flight over it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

from design.gains import Gain
from design.response.demand import ActuatorDemand
from design.simulation.request import check_steps
from design.simulation.response import SimulationOutcome
from model.arrays import BoolArray, FloatArray
from model.flight import FlightCondition
from schedules.profile_instants import ControllerTrim


@dataclass(frozen=True)
class ProfileRequest:
    """How a profile is flown.

    Attributes
    ----------
    duration : [s]; beyond its end the profile is held
    samples : of the response, both ends included; knots and crossings of grid lines add theirs
    trim : the one that the controller works from
    tolerance : error that the step is chosen for, relative to the largest change (`design.simulation.time_grid`)
    substeps : steps between two samples; None: what the tolerance needs
    estimate_error : fly with half the step too, return that, and how far the two are apart

    Raises
    ------
    ValueError : a number out of its range
    """

    duration: float
    samples: int = 501
    trim: ControllerTrim = "scheduled"
    tolerance: float = 1e-6
    substeps: int | None = None
    estimate_error: bool = False

    def __post_init__(self) -> None:
        check_steps(self.duration, self.samples, self.tolerance, self.substeps)
        if self.trim not in get_args(ControllerTrim):
            raise ValueError(f"trim must be scheduled, exact or held, not {self.trim!r}")


@dataclass(frozen=True, eq=False)
class TrackingError:
    """How far a surface is from where it is to be, ``trim of the controller + reference``, over the whole flight.

    Attributes
    ----------
    reference : its name, ``r_a`` or ``r_t``
    peak, rms, last : largest, root of the mean square, and at the end [rad]
    """

    reference: str
    peak: float
    rms: float
    last: float


@dataclass(frozen=True, eq=False)
class ProfileResponse:
    """A flight over a profile, from rest at its first instant, at T samples until its end or until it has diverged.

    Attributes
    ----------
    time : (T,) [s]
    condition : (T,) air and speed
    outputs : (T, o) of the loop, totals, just after a jump
    target : (T, p) angles that the surfaces are to have, totals [rad]
    gains : each (T,)
    clipped : (T,) outside the grid, whose edge the gains are of
    slowest : (T,) largest real part of a pole of the frozen loop [1/s]
    at_limit : (T, 2, 4) where limits would be reached: [tab, aileron] by [deflection, rate, torque, power]
    time_at_limit : (2, 4) how long [s]
    demand : on each actuator, over the whole flight, single numbers; nan where it has diverged
    tracking : of each reference
    code, reason : completed or diverged, and words where it has diverged
    diverged_at : when a surface passed a right angle [s]; None where none has
    left_data_at : when the angles left what the hinge-moment source knows [s]; None where they have not
    names, references, actuators : of outputs, targets and demands
    steps : of the integration
    error_estimate : (o,) largest difference of the outputs when the step is halved; None where not asked for
    """

    time: FloatArray
    condition: FlightCondition
    outputs: FloatArray
    target: FloatArray
    gains: tuple[Gain, ...]
    clipped: BoolArray
    slowest: FloatArray
    at_limit: BoolArray
    time_at_limit: FloatArray
    demand: tuple[ActuatorDemand, ...]
    tracking: tuple[TrackingError, ...]
    code: SimulationOutcome
    reason: str | None
    diverged_at: float | None
    left_data_at: float | None
    names: tuple[str, ...]
    references: tuple[str, ...]
    actuators: tuple[str, ...]
    steps: int
    error_estimate: FloatArray | None = None

    def output(self, name: str) -> FloatArray:
        """(T,) one output by its name."""
        return self.outputs[:, self.names.index(name)]
