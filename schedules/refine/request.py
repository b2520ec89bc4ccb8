"""What a refined table must hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from schedules.perturbations import Uncertainty
from schedules.proof.prove import ProofRequest

#: Figures that can be held against those of the design that each point would have of its own.
RELATIVE = ("damping_ratio", "settling_time", "bandwidth")


@dataclass(frozen=True)
class RefineRequest:
    """What is wanted between the lines of a table, and how large it may be.

    Attributes
    ----------
    fraction, decay, changes, together, most_pieces : what is to be proved, as in `schedules.proof.prove.ProofRequest`
    spec_tolerance : largest loss of a spec between the lines, as a part of its limit, positive; of the model, not of
        plants whose parameters are off
    relative : figures of `RELATIVE` that are held against the point's own design, with the same tolerance; None: those
        of a state feedback but for its bandwidth, none of a classical controller
    gain_error : largest difference between the gain that is read and the one that would be designed there, as a part
        of the gain's largest size in the envelope; None: any. Of a controller that is smoothed over its grid the design
        without that is meant
    most_lines : of altitude and of speed, at least two each
    altitude : lowest and highest [m]; None: those of the study's grid
    speed : slowest and fastest, in the unit of the study's speed axis; None: those of the study's grid
    start : with the ends of the envelope alone, or with the study's own lines between them
    uniform : whether the smallest evenly spaced table is looked for too

    Raises
    ------
    ValueError : a number out of range
    """

    fraction: float = 0.5
    decay: float | None = None
    changes: Sequence[Uncertainty] = ()
    together: bool = False
    most_pieces: int = 64
    spec_tolerance: float = 0.05
    relative: Sequence[str] | None = None
    gain_error: float | None = None
    most_lines: tuple[int, int] = (9, 17)
    altitude: tuple[float, float] | None = None
    speed: tuple[float, float] | None = None
    start: Literal["ends", "study"] = "ends"
    uniform: bool = True

    def __post_init__(self) -> None:
        _ = self.proof
        if not 0.0 < self.spec_tolerance < np.inf:
            raise ValueError(f"spec_tolerance must be positive and finite, is {self.spec_tolerance}")
        if self.gain_error is not None and not 0.0 < self.gain_error < np.inf:
            raise ValueError(f"gain_error must be positive and finite, is {self.gain_error}")
        if unknown := set(self.relative or ()) - set(RELATIVE):
            raise ValueError(f"relative knows {', '.join(RELATIVE)}, not {', '.join(sorted(unknown))}")
        if min(self.most_lines) < 2:
            raise ValueError(f"most_lines must be at least 2 an axis, is {self.most_lines}")
        for name, ends in (("altitude", self.altitude), ("speed", self.speed)):
            if ends is not None and not ends[0] <= ends[1]:
                raise ValueError(f"{name} must go from the lower to the higher, is {ends}")
        if self.start not in ("ends", "study"):
            raise ValueError(f"start must be ends or study, is {self.start!r}")

    @property
    def proof(self) -> ProofRequest:
        """What is to be proved."""
        return ProofRequest(self.fraction, self.decay, self.changes, self.together, self.most_pieces)
