"""Gains as designed for the nominal plant, flown on plants that are off: corners and random draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import betaincinv

from design.specs import Spec
from model.arrays import BoolArray, FloatArray, GridArrays
from schedules.analysis import PlantEnvelope
from schedules.case_statistics import Bad, Distribution, Influence, distribution_of, influence_of
from schedules.designed import DesignedController
from schedules.flown_figures import Flight, FlownFigures, holds
from schedules.judging import horizon
from schedules.perturbations import Cases, Uncertainty, corner_cases, drawn_cases
from schedules.perturbed_cases import (
    FlownCases,
    case_blocks,
    cases_in_a_row,
    flown_digest,
    flown_factors,
    fly_cases,
    nominal,
)
from schedules.study import Study

#: A figure over the cases.
Quantity = Literal[
    "damping_ratio", "largest_real_part", "settling_time", "overshoot",
    "gain_margin", "phase_margin", "delay_margin", "disk_margin",
]  # fmt: skip
_BAD: dict[Quantity, Bad] = {"largest_real_part": "large", "settling_time": "large", "overshoot": "large"}


@dataclass(frozen=True, eq=False)
class RobustPerformance(GridArrays):
    """Figures of every case of perturbed plants over the grid, the same cases at every point.

    Attributes
    ----------
    cases : D cases: parameters and what they are multiplied by
    specs : what is to be met
    flown : (*G,) where there is a design
    nominal : (*G,) figures of the plant as modelled
    figures : (*G, D) of the cases
    held : (*G, D) where the loop is stable and meets the specs
    """

    cases: Cases
    specs: tuple[Spec, ...]
    flown: BoolArray
    nominal: FlownFigures
    figures: FlownFigures
    held: BoolArray

    @property
    def stable_fraction(self) -> FloatArray:
        """Part of the cases in which the loop is stable (*G,); nan where there is no design."""
        return self._part(self.figures.stable)

    @property
    def held_fraction(self) -> FloatArray:
        """Part of the cases in which it is stable and meets the specs (*G,); nan where there is no design."""
        return self._part(self.held)

    @property
    def stable_everywhere(self) -> BoolArray:
        """Cases (D,) in which the loop is stable at every point with a design, one plant over the envelope."""
        return self._everywhere(self.figures.stable)

    @property
    def held_everywhere(self) -> BoolArray:
        """Cases (D,) in which it is stable and meets the specs at every point with a design."""
        return self._everywhere(self.held)

    def distribution(self, quantity: Quantity) -> Distribution:
        """The worst of a figure, the case that gives it, and percentiles."""
        values, growth = getattr(self.figures, quantity), self.figures.largest_real_part
        return distribution_of(values, growth, self.flown, self.cases.factors, _BAD.get(quantity, "small"))

    def influence(self, quantity: Quantity) -> Influence:
        """How a figure depends on each parameter."""
        return influence_of(getattr(self.figures, quantity), self.cases.factors)

    def _everywhere(self, met: BoolArray) -> BoolArray:
        return np.asarray(np.any(self.flown) & np.all(met[self.flown], axis=0))

    def _part(self, met: BoolArray) -> FloatArray:
        return np.where(self.flown, np.mean(met, axis=-1), np.nan)


def least_fraction(fraction: FloatArray, draws: int, confidence: float = 0.95) -> FloatArray:
    """What a part of independent draws says of the part of all plants that could be drawn, at least.

    The one-sided limit of Clopper and Pearson (1934): with all of n draws, ``(1 - confidence)^(1/n)``. Corners are not
    independent draws, and have none.

    Parameters
    ----------
    fraction : (*G,) part of the draws, nan where there is none
    draws : number of draws n
    confidence : how sure, more than 0 and less than 1

    Raises
    ------
    ValueError : a number out of range
    """
    if draws < 1 or not 0.0 < confidence < 1.0:
        raise ValueError(f"draws must be at least 1 and confidence between 0 and 1, are {draws} and {confidence}")
    met = np.rint(np.asarray(fraction, dtype=float) * draws)
    with np.errstate(invalid="ignore"):
        least = betaincinv(np.maximum(met, 1.0), draws - met + 1.0, 1.0 - confidence)
    return np.where(met == 0.0, 0.0, least)


def corners(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    uncertainties: Sequence[Uncertainty],
    specs: Sequence[Spec] = (),
    *,
    duration: float | None = None,
    steps: bool = True,
    margins: bool = False,
) -> RobustPerformance:
    """Fly all 2^k combinations of the parameters' largest changes; see `perturbed_performance`.

    A figure may be worse inside than at any corner: corners are a quick look, and what depends on each parameter
    nearly linearly is at its worst at one of them.

    Raises
    ------
    ValueError : as `schedules.perturbations.corner_cases` and `perturbed_performance`
    """
    cases = corner_cases(uncertainties)
    return perturbed_performance(study, plant, designed, cases, specs, duration=duration, steps=steps, margins=margins)


def monte_carlo(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    uncertainties: Sequence[Uncertainty],
    draws: int,
    seed: int,
    specs: Sequence[Spec] = (),
    *,
    duration: float | None = None,
    steps: bool = True,
    margins: bool = False,
) -> RobustPerformance:
    """Fly random draws of the parameters, the same ones at every point; see `perturbed_performance`.

    Raises
    ------
    ValueError : as `schedules.perturbations.drawn_cases` and `perturbed_performance`
    """
    cases = drawn_cases(uncertainties, draws, seed)
    return perturbed_performance(study, plant, designed, cases, specs, duration=duration, steps=steps, margins=margins)


def perturbed_performance(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    cases: Cases,
    specs: Sequence[Spec] = (),
    *,
    duration: float | None = None,
    steps: bool = True,
    margins: bool = False,
) -> RobustPerformance:
    """Fly given cases of perturbed plants with the gains that were designed for the nominal one.

    Each plant is linearised afresh about the nominal trim (`schedules.perturbations`), and flown with all that the
    design flies: actuator, filter, integral, feed-forward, delay. Neither depends on how many cases there are. The
    same answer comes of cases flown some at a time elsewhere (`flight_of`, `schedules.perturbed_cases`, `assemble`).

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : the controller
    cases : the parameters and what they are multiplied by
    specs : what is to be met besides being stable; what they need is computed
    duration : how long steps are followed [s]; default that of the design
    steps, margins : whether these figures are wanted too

    Raises
    ------
    ValueError : too many loops (`schedules.flown_figures.MOST_LOOPS`), a spec on something that is not judged here, or
        factors that leave a mass or inertia which is not positive
    """
    flight = flight_of(study, designed, specs, duration=duration, steps=steps, margins=margins)
    done = [fly_cases(study, plant, designed, cases, flight, *block) for block in case_blocks(designed, cases)]
    return assemble(study, plant, designed, cases, specs, flight, done)


def flight_of(
    study: Study,
    designed: DesignedController,
    specs: Sequence[Spec] = (),
    *,
    duration: float | None = None,
    steps: bool = True,
    margins: bool = False,
) -> Flight:
    """What every case is asked for, parameters as of `perturbed_performance`.

    Raises
    ------
    ValueError : a spec on something that is not judged here
    """
    followed = horizon(study, designed.request) if duration is None else duration
    return Flight(study.reference.aileron, followed, steps, margins).judging(specs)


def assemble(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    cases: Cases,
    specs: Sequence[Spec],
    flight: Flight,
    done: Sequence[FlownCases],
) -> RobustPerformance:
    """The performance of all cases from pieces of them (`schedules.perturbed_cases.fly_cases`), and the nominal plant.

    However the cases were cut, the answer is the same to the last bit.

    Parameters
    ----------
    study, plant, designed, cases : as the pieces were flown
    specs : what is to be met besides being stable
    flight : `flight_of` these specs
    done : pieces that are all the cases together, in any order

    Raises
    ------
    ValueError : pieces of something else, cases that are in none of them or in two
    """
    pieces = sorted(done, key=lambda one: one.start)
    ends = [0, *(one.stop for one in pieces)]
    if [one.start for one in pieces] != ends[:-1] or ends[-1] != len(cases):
        said = ", ".join(f"{one.start} to {one.stop}" for one in pieces) or "none"
        raise ValueError(f"cases 0 to {len(cases)} are wanted, each once: there are {said}")
    of = flown_digest(study, designed, cases, flight)
    if any(one.of != of for one in pieces):
        raise ValueError("flown for another study, controller, other cases, or asked for something else")
    figures = cases_in_a_row([one.figures for one in pieces])
    as_modelled = flown_factors(study, plant, designed, nominal(cases), flight, slice(1)).take((..., 0))
    held = holds(figures, specs, axes_after_grid=1)
    return RobustPerformance(cases, tuple(specs), designed.outcomes.ok, as_modelled, figures, held)
