"""A sample time tried, by gains designed for it or emulated, judged by exact figures; and what many of them came to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.assess import Assessment, achieved
from design.lqr.coded_loop import CodedLoop
from design.lqr.controller import LqrController
from design.lqr.sampled_assessment import assess_sampled
from design.lqr.sampled_design import design_lqr_sampled, emulated_lqr_loop, sampled_lqr_loop
from design.lqr.synthesis import LqrDesign
from design.lqr.weights import WeightsRefused
from design.sampling import Sampling
from design.specs import QUANTITIES, Spec
from model.actuators import Actuator
from model.arrays import BoolArray, FloatArray, GridArrays, ObjectArray
from model.linear_model import LinearModel

#: How gains come about: for the sample time, or in continuous time and then run as code.
Way = Literal["redesigned", "emulated"]
#: Figures that are kept of every trial, beside those of the specs; those that are no quantity of `design.specs`:
#: the largest modulus of a pole, and the smallest ``|1 + L|`` of the cuts.
FIGURES = (
    "spectral_radius", "return_difference", "damping_ratio", "gain_margin", "phase_margin", "overshoot",
    "settling_time", "tab_torque", "tab_rate", "aileron_torque", "aileron_rate",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Trial(GridArrays):
    """What one sample time comes to.

    Attributes
    ----------
    figures : (*G, f) nan where there is no stable loop, but for its spectral radius
    met : (*G, q) each spec is met
    passed : (*G,) stable, and every spec is met
    reasons : (*G,) object array of str, None where it passed
    """

    figures: FloatArray
    met: BoolArray
    passed: BoolArray
    reasons: ObjectArray


@dataclass(frozen=True, eq=False)
class Question:
    """What is tried: the same at every sample time.

    Attributes
    ----------
    model (*G), controller, tab, aileron : what is designed
    continuous : (*G) its design in continuous time, whose gains are emulated
    specs : what a trial must meet; limits may vary over the grid
    reference (p,) [rad], duration [s] : the step that is followed
    computation : time from a measurement to its command, in samples, the actuators' own delays apart
    """

    model: LinearModel
    controller: LqrController
    tab: Actuator
    aileron: Actuator
    continuous: LqrDesign
    specs: tuple[Spec, ...]
    reference: FloatArray
    duration: float
    computation: float

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of the figures of a trial: `FIGURES`, then what the specs ask of beside them."""
        return (*FIGURES, *dict.fromkeys(s.quantity for s in self.specs if s.quantity not in FIGURES))

    def flattened(self, points: BoolArray) -> Question:
        """The same of some points (N,) of the grid in one row."""
        specs = tuple(spec.take(points) for spec in self.specs)
        return Question(
            self.model.take(points), self.controller, self.tab, self.aileron, self.continuous.take(points), specs,
            self.reference, self.duration, self.computation,
        )  # fmt: skip

    def tried(self, way: Way, time: float) -> Trial:
        """The trial of one sample time [s] at every point."""
        sampling = Sampling(time, self.computation * time)
        if way == "redesigned":
            try:
                design = design_lqr_sampled(
                    self.model, self.controller, sampling, None, self.tab, self.aileron, self.continuous.retuning
                )
            except WeightsRefused as refused:  # a sample time that loses a mode at every point is one that fails
                return self._failed(str(refused))
            outcomes, loop = design.outcomes, sampled_lqr_loop(self.model, design)
        else:
            outcomes, loop = self.continuous.outcomes, emulated_lqr_loop(self.model, self.continuous, sampling)
        figures, reasons = np.full((*outcomes.ok.shape, len(self.figures)), np.nan), outcomes.reasons.copy()
        stable = self._stable(loop, outcomes.ok, figures, reasons)
        if np.any(stable):
            figures[stable] = self._judged(assess_sampled(loop.take(stable), self.reference, self.duration), time)
        values = [figures[..., self.figures.index(spec.quantity)] for spec in self.specs]
        met = np.zeros((*stable.shape, len(self.specs)), dtype=bool)
        for q, (spec, value) in enumerate(zip(self.specs, values, strict=True)):
            met[..., q] = stable & spec.met(value)
        passed = np.asarray(stable & met.all(axis=-1))
        for index in map(tuple, np.argwhere(stable & ~passed)):
            missed = (
                f"{s.quantity} is {v[index]:.6g}"
                for s, v, m in zip(self.specs, values, met[index], strict=True)
                if not m
            )
            reasons[index] = "; ".join(missed)
        return Trial(figures, met, passed, reasons)

    def _failed(self, reason: str) -> Trial:
        """A trial that comes to nothing at any point."""
        grid = self.model.A.shape[:-2]
        nothing = np.full((*grid, len(self.figures)), np.nan)
        unmet = np.zeros((*grid, len(self.specs)), dtype=bool)
        return Trial(nothing, unmet, np.zeros(grid, dtype=bool), np.full(grid, reason, dtype=object))

    def _stable(self, loop: CodedLoop, ok: BoolArray, figures: FloatArray, reasons: ObjectArray) -> BoolArray:
        """Mask (*G,) of the points with a stable loop; their spectral radii, and why the others are not."""
        radius = np.full(ok.shape, np.nan)
        radius[ok] = np.abs(np.linalg.eigvals(loop.closed[ok])).max(axis=-1, initial=0.0)
        figures[..., FIGURES.index("spectral_radius")] = radius
        for index in map(tuple, np.argwhere(ok & ~(radius < 1.0))):
            reasons[index] = f"the coded loop has a pole of modulus {radius[index]:.6g}"
        return np.asarray(radius < 1.0)

    def _judged(self, found: Assessment, time: float) -> FloatArray:
        """Figures (N, f) of loops that are stable."""
        radius, difference = np.exp(found.largest_real_part * time), found.return_difference.min(axis=-1)
        own = {"spectral_radius": radius, "return_difference": difference}
        values = [own[name] if name in own else achieved(found, name) for name in self.figures]
        return np.stack([value for value in values if value is not None], axis=-1)


def check_specs(specs: tuple[Spec, ...]) -> None:
    """Refuse specs of what a coded torque loop does not have.

    Raises
    ------
    ValueError : names the quantity
    """
    for spec in specs:
        if spec.quantity not in QUANTITIES or spec.quantity == "noise_gain":
            raise ValueError(f"{spec.quantity} is not defined for the loop of a sampled state feedback")


@dataclass(frozen=True, eq=False)
class SampleTimeTrials(GridArrays):
    """Trials of S sample times, each at all points or some.

    Attributes
    ----------
    figures (*G, S, f), met (*G, S, q), passed (*G, S), reasons (*G, S) : as of `Trial`; nan, False and None where not
        tried
    tried : (*G, S)
    times : the S sample times, the fastest first [s]
    names : of the f figures
    specs : the q specs
    """

    figures: FloatArray
    met: BoolArray
    passed: BoolArray
    reasons: ObjectArray
    tried: BoolArray
    times: tuple[float, ...]
    names: tuple[str, ...]
    specs: tuple[Spec, ...]

    def figure(self, name: str) -> FloatArray:
        """(*G, S) one of the figures; ValueError when there is no such figure."""
        return self.figures[..., self.names.index(name)]

    @property
    def slowest(self) -> FloatArray:
        """(*G,) the slowest sample time tried that passes [s]; nan where none does."""
        return _last(self.passed, self.times)

    @property
    def unbroken(self) -> FloatArray:
        """(*G,) the slowest that passes with all faster ones that were tried [s]; nan where the fastest does not."""
        return _last(unbroken(self.tried, self.passed) & self.tried, self.times)

    @property
    def limited(self) -> BoolArray:
        """(*G,) a slower one than `slowest` was tried, so that it fails; elsewhere slower ones may pass still."""
        return np.asarray(_last(self.tried, self.times) > np.nan_to_num(self.slowest, nan=-np.inf))


def unbroken(tried: BoolArray, passed: BoolArray) -> BoolArray:
    """(*G, S) mask of the sample times before which, and at which, none fails that was tried."""
    return np.asarray(np.logical_and.accumulate(passed | ~tried, axis=-1))


def _last(mask: BoolArray, times: tuple[float, ...]) -> FloatArray:
    """(*G,) the last time of a mask (*G, S); nan where it is empty."""
    place = mask.shape[-1] - 1 - np.argmax(mask[..., ::-1], axis=-1)
    return np.where(mask.any(axis=-1), np.array(times)[place], np.nan)
