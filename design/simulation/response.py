"""What a non-linear simulation answers, over the grid."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from design.response.demand import ActuatorDemand
from design.simulation.energy import EnergyBalance
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray, ObjectArray


class SimulationOutcome(StrEnum):
    """What became of a point's simulation."""

    COMPLETED = "completed"
    DIVERGED = "diverged"
    TOO_FAST = "too_fast"
    NO_LOOP = "no_loop"


@dataclass(frozen=True, eq=False)
class NonlinearResponse(GridArrays):
    """Response of closed loops with the non-linear plant to a manoeuvre, from trim at t = 0.

    Attributes
    ----------
    time : (*G, T) sample times, those of the knots among them [s]; the same at every point
    states : (*G, T, n) of the loop, deviations from trim; nan from when on a point has diverged
    outputs : (*G, T, o) totals, trim values included, just after a jump; nan likewise
    reference : (*G, T, p) deviations from trim [rad]
    at_limit : (*G, T, 2, 4) which limits are reached: [tab, aileron] by [deflection, rate, torque, power]
    time_at_limit : (*G, 2, 4) how long [s]
    held : (*G, T, 2) by what a surface is held (`contact`): 0 nothing, 1 friction, 2 3 stops, 4 5 limits of rate
    codes, reasons : (*G,) `SimulationOutcome`, and words where it is not completed
    diverged_at : (*G,) when a surface passed a right angle, or a number left the range of doubles [s]; else nan
    left_data_at : (*G,) when the angles left what the hinge-moment source knows [s]; nan where they never do
    demand : one for each actuator of the loop; nan where the point has diverged
    energy : the balance of energy; nan from when on a point has diverged
    anti_windup_gain : (*G, i, m) L of ``int' = r - d + L (v_possible - v)``
    substeps : (*G,) steps between two samples
    error_estimate : (*G, o) largest difference of the outputs when the step is halved; nan where not asked for
    names, state_names : of outputs and states
    unenforced : limits that nothing in the model can be held to (`tab_servo`); they are watched all the same
    duration : [s]
    """

    time: FloatArray
    states: FloatArray
    outputs: FloatArray
    reference: FloatArray
    at_limit: BoolArray
    time_at_limit: FloatArray
    held: IntArray
    codes: ObjectArray
    reasons: ObjectArray
    diverged_at: FloatArray
    left_data_at: FloatArray
    demand: tuple[ActuatorDemand, ...]
    energy: EnergyBalance
    anti_windup_gain: FloatArray
    substeps: IntArray
    error_estimate: FloatArray
    names: tuple[str, ...]
    state_names: tuple[str, ...]
    unenforced: tuple[str, ...]
    duration: float

    def index(self, name: str) -> int:
        """Index of the named output; ValueError when there is none."""
        if name not in self.names:
            raise ValueError(f"the loop has no output {name!r}; it has {', '.join(self.names)}")
        return self.names.index(name)

    def output(self, name: str) -> FloatArray:
        """(*G, T) one output by its name."""
        return self.outputs[..., self.index(name)]
