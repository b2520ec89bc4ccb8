"""What can steer the choice of gains, and the reference step that some of it is judged on."""

from __future__ import annotations

from dataclasses import dataclass

from design.specs import Sense, Spec
from model.arrays import FloatArray, GridArrays

#: Quantities that can steer the synthesis, and the one sense in which each does.
STEERABLE: dict[str, Sense] = {
    "damping_ratio": "min",
    "settling_time": "max",
    "overshoot": "max",
    "bandwidth": "min",
    "gain_margin": "min",
    "phase_margin": "min",
    "delay_margin": "min",
    "disk_margin": "min",
    "sensitivity_peak": "max",
    "noise_gain": "max",
    "tab_rate": "max",
    "tab_deflection": "max",
}
#: Of these, the ones that are read off the step of the reference.
OF_THE_STEP = frozenset({"settling_time", "overshoot", "tab_rate", "tab_deflection"})


@dataclass(frozen=True, eq=False)
class StepReference(GridArrays):
    """The step of the aileron that a design is judged on.

    Attributes
    ----------
    size : of the step, from trim [rad]
    horizon : how long the response is followed [s]; a response that has not settled by then does not settle
    tab_trim : (*G,) angle of the tab at trim [rad], from which its deflection starts
    """

    size: float
    horizon: float
    tab_trim: FloatArray


def refuse_unsteerable(specs: tuple[Spec, ...]) -> None:
    """Raise ValueError for specs that cannot steer a synthesis: by quantity, by sense, or two of one quantity."""
    for spec in specs:
        if sum(other.quantity == spec.quantity for other in specs) > 1:
            raise ValueError(f"{spec.quantity} is specified more than once")
        if spec.quantity not in STEERABLE:
            raise ValueError(f"{spec.quantity} cannot steer a synthesis; it can be one of {', '.join(STEERABLE)}")
        sense = STEERABLE[spec.quantity]
        if spec.sense != sense:
            raise ValueError(f"{spec.quantity} steers a synthesis as a '{sense}', not as a '{spec.sense}'")
