"""What a schedule says of itself beside its table: between the points, outside them, and where it integrates.

Each rule has a name, by which programs choose, and words, which every file and answer states.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

Interpolation = Literal["multilinear", "monotone_cubic"]
OutOfRange = Literal["clip", "hold", "refuse"]
IntegratorPlacement = Literal["before_gain", "after_gain"]

#: Between the grid points. What is multilinear can be proved cell by cell; a monotone cubic can be sampled only.
INTERPOLATIONS: dict[Interpolation, str] = {
    "multilinear": "multilinear in the grid's own axes",
    "monotone_cubic": "monotone cubic (PCHIP) along one of the grid's own axes after the other, the last axis first",
}

#: Outside the breakpoints.
OUTS_OF_RANGE: dict[OutOfRange, str] = {
    "clip": "clipped to the grid's edges",
    "hold": "the last gains that were inside the grid are held; the grid's edges where there were none",
    "refuse": "refused: there are no gains outside the grid",
}

#: Where the integrators stand. Both are the same law while the flight point stays where it is.
INTEGRATOR_PLACEMENTS: dict[IntegratorPlacement, str] = {
    "before_gain": "before the gain: int' = error, u = K_i int; what it has stored counts at the gain of now",
    "after_gain": "after the gain: int' = K_i error, u = int; what it has stored stays as K_i changes",
}


@dataclass(frozen=True)
class ScheduleRules:
    """The rules by which a schedule is flown.

    Attributes
    ----------
    interpolation : between the points, a key of `INTERPOLATIONS`
    out_of_range : outside them, a key of `OUTS_OF_RANGE`
    integrator_placement : a key of `INTEGRATOR_PLACEMENTS`

    Raises
    ------
    ValueError : a rule that there is not
    """

    interpolation: Interpolation = "multilinear"
    out_of_range: OutOfRange = "clip"
    integrator_placement: IntegratorPlacement = "before_gain"

    def __post_init__(self) -> None:
        for what, chosen, among in (
            ("interpolation", self.interpolation, get_args(Interpolation)),
            ("out_of_range", self.out_of_range, get_args(OutOfRange)),
            ("integrator_placement", self.integrator_placement, get_args(IntegratorPlacement)),
        ):
            if chosen not in among:
                raise ValueError(f"{what} must be one of {', '.join(among)}, not {chosen!r}")


#: What a flight computer's table does, and every file can hold.
USUAL_RULES = ScheduleRules()
