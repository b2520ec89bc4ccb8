"""What the synthesis of a part gives: gains, outcomes, the loop and what is said of it, at the part's points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from design.assess import Assessment
from design.classical.infeasibility import Infeasibility, Relaxation
from design.estimation.kalman_filter import KalmanFilter
from design.frequency.margins import Margins
from design.gains import Gain
from design.loop import Loop, SisoLoop
from design.lqr.coded_loop import CodedLoop
from design.lqr.power_figures import PowerFigures
from design.lqr.retuning import Retuning
from design.lqr.sampled_design import SampledLqrDesign
from design.lqr.structures import Structure
from design.lqr.synthesis import LqrDesign
from design.lqr.weights import WeightName, WeightsRefused
from design.outcome import Outcomes
from design.response.demand import ActuatorDemand
from design.response.manoeuvre_demand import ManoeuvreDemand
from design.response.step_metrics import StepMetrics
from design.sampling import Sampling
from design.specs import Spec
from model.actuators import Actuator, ActuatorLimits
from model.arrays import ComplexArray, FloatArray, GridArrays, ObjectArray
from schedules.designed import DesignedController
from schedules.exact_bytes import read, written
from schedules.part import Part


@dataclass(frozen=True)
class Refused:
    """Weights that cannot work at any of a part's points; fields as of `design.lqr.weights.WeightsRefused`."""

    matrix: WeightName
    eigenvalue: complex | None
    reason: str

    @classmethod
    def of(cls, error: WeightsRefused) -> Refused:
        """What was refused."""
        return cls(error.matrix, None if error.eigenvalue is None else complex(error.eigenvalue), error.reason)

    def error(self) -> WeightsRefused:
        """The exception."""
        return WeightsRefused(self.matrix, self.eigenvalue, self.reason)


@dataclass(frozen=True, eq=False)
class PartDesign(GridArrays):
    """A controller designed and judged at n points, before its gains are smoothed and its verdicts given.

    Fields are those of `schedules.designed.DesignedController`, (n,) each.

    Attributes
    ----------
    refused : what the weights lack where they cannot work at any of the points; None elsewhere
    """

    outcomes: Outcomes
    gains: tuple[Gain, ...]
    loop: Loop | CodedLoop
    assessment: Assessment | None
    fastest_mode: ComplexArray
    reduced_frequency: FloatArray
    optimum: LqrDesign | SampledLqrDesign | None
    observer: KalmanFilter | None
    infeasibility: ObjectArray | None
    refused: Refused | None = None

    @classmethod
    def of(cls, designed: DesignedController, refused: Refused | None = None) -> Self:
        """What a design over a grid holds, its points in one row."""
        shape = designed.outcomes.codes.shape
        over_grid = cls(
            designed.outcomes, designed.gains, designed.loop, designed.assessment, designed.fastest_mode,
            designed.reduced_frequency, designed.optimum, designed.observer, designed.infeasibility, refused,
        )  # fmt: skip
        return over_grid.take(np.unravel_index(np.arange(designed.outcomes.codes.size), shape))


_KINDS = (
    Refused, PartDesign, Part, Outcomes, Gain, Loop, SisoLoop, CodedLoop, Sampling, Assessment, Margins, StepMetrics,
    ActuatorDemand, ManoeuvreDemand, LqrDesign, SampledLqrDesign, Retuning, PowerFigures, Structure, Actuator,
    ActuatorLimits, KalmanFilter, Infeasibility, Relaxation, Spec,
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Synthesised:
    """The synthesis of a part of a study.

    Attributes
    ----------
    part : which part
    study : digest of what it depends on (`schedules.digests`)
    design : gains, outcomes and figures at its points

    Raises
    ------
    ValueError : another number of points
    """

    part: Part
    study: str
    design: PartDesign

    def __post_init__(self) -> None:
        points = self.design.outcomes.codes.shape
        if points != self.part.points.shape:
            raise ValueError(f"{self.part} has {self.part.points.size} points, not {points}")

    def to_bytes(self) -> bytes:
        """The same bytes for the same synthesis, whenever and wherever they are written; no pickle."""
        return written(self)

    @classmethod
    def from_bytes(cls, content: bytes) -> Synthesised:
        """What was written, to the last bit.

        Raises
        ------
        ValueError : damaged, or not the bytes of a synthesis
        """
        found = read(content, (cls, *_KINDS))
        if not isinstance(found, cls):
            raise ValueError(f"not a synthesis: {type(found).__name__}")
        return found
