"""How slowly the code may run: sample times scanned and refined, gains redesigned for each or emulated (seed 6.4.2).

Whether a sample time passes is decided by the exact figures of its loop, so a time that is said to pass does. Figures
need not get worse steadily as the sample time grows: a settling time jumps, an overshoot or a margin may come back. So
no more is claimed than was tried:

- ``slowest`` passes, and the next slower time that was tried does not. A yet slower one between or beyond them may.
- ``unbroken`` passes, and so does every faster time that was tried. Between these a time may fail that was not tried.

A finer scan narrows both doubts; the refinement only narrows the last step from passing to failing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from design.lqr.controller import LqrController
from design.lqr.sample_time_trials import Question, SampleTimeTrials, Trial, Way, check_specs, unbroken
from design.lqr.synthesis import design_lqr
from design.outcome import Outcomes
from design.specs import Spec
from model.actuators import Actuator
from model.arrays import BoolArray, FloatArray, GridArrays
from model.linear_model import LinearModel

_IDEAL = Actuator()
#: A bracket of two neighbouring times tried, the faster one passing, the slower one failing.
_Bracket = tuple[float, float]


@dataclass(frozen=True, eq=False)
class SweptWay(GridArrays):
    """Sample times of one way to come to gains.

    Attributes
    ----------
    by_point : refined for each point by itself
    together : every time tried at all points that count, refined for all of them to pass at once
    counted : (*G,) the points that count
    """

    by_point: SampleTimeTrials
    together: SampleTimeTrials
    counted: BoolArray

    @property
    def slowest_together(self) -> float | None:
        """The slowest time tried at which every point passes [s]; None when there is none."""
        return self._last(self._all)

    @property
    def unbroken_together(self) -> float | None:
        """The slowest one at which, and at every faster one tried, every point passes [s]; None when there is none."""
        return self._last(np.logical_and.accumulate(self._all))

    @property
    def _all(self) -> BoolArray:
        return np.asarray(self.together.passed[self.counted].all(axis=0) & np.any(self.counted))

    def _last(self, mask: BoolArray) -> float | None:
        return self.together.times[int(np.flatnonzero(mask)[-1])] if np.any(mask) else None


@dataclass(frozen=True, eq=False)
class SampleTimeSweep(GridArrays):
    """Both ways side by side: gains designed for each sample time, and the continuous gains run as code."""

    redesigned: SweptWay
    emulated: SweptWay


def sweep_sample_time(
    model: LinearModel,
    controller: LqrController,
    times: Sequence[float],
    specs: tuple[Spec, ...],
    reference: FloatArray,
    duration: float,
    computation: float = 1.0,
    outcomes: Outcomes | None = None,
    tab: Actuator = _IDEAL,
    aileron: Actuator = _IDEAL,
    halvings: int = 4,
) -> SampleTimeSweep:
    """Try sample times, point by point and for all points together, with gains of both ways.

    A time passes where the loop is stable and every spec is met.

    Parameters
    ----------
    model : (*G) plant
    controller : weights and structure; without states for delays, which could not be emulated
    times : sample times to scan [s], in any order
    specs : what must be met, of `design.specs.QUANTITIES`; damping is that of ``ln z / T``, margins are at the
        actuators, one at a time, overshoot and settling include what is between the samples
    reference : (p,) the step that is followed [rad]
    duration : how long, at least [s]
    computation : time from a measurement to its command, in samples; the actuators' own delays add to it
    outcomes : (*G) points that are not ok do not count; all do when None
    tab, aileron : actuators
    halvings : how often each step from passing to failing is halved, in proportion

    Raises
    ------
    ValueError : no sample time or one that is not positive, a spec that cannot be judged, a controller that cannot be
        emulated, or what `design_lqr` raises
    """
    scan = tuple(sorted({float(time) for time in times}))
    if not scan or not (scan[0] > 0.0 and np.isfinite(scan[-1])):
        raise ValueError(f"sample times must be positive, at least one of them, not {tuple(times)}")
    check_specs(specs)
    if controller.delay_states:
        raise ValueError("a controller that runs a model of its delays is not emulated; use delay_states 0")
    if outcomes is None:
        outcomes = Outcomes.all_ok(model.A.shape[:-2])
    counted = outcomes.ok
    continuous = design_lqr(model, controller, outcomes, tab, aileron)
    question = Question(
        model, controller, tab, aileron, continuous, specs, np.asarray(reference, dtype=float), duration, computation
    ).flattened(counted)
    return SampleTimeSweep(
        _swept(question, "redesigned", scan, counted, halvings),
        _swept(question, "emulated", scan, counted, halvings),
    )


def _swept(question: Question, way: Way, scan: tuple[float, ...], counted: BoolArray, halvings: int) -> SweptWay:
    """One way, at the points of the question (N,), spread over the grid."""
    every = np.ones(np.count_nonzero(counted), dtype=bool)

    def tried(time: float, some: BoolArray) -> Trial:
        return question.flattened(some).tried(way, time).spread(some)

    first = {time: tried(time, every) for time in scan}
    masks = dict.fromkeys(first, every)
    found = [
        _trials(question, *_refined(dict(first), dict(masks), tried, brackets, halvings))
        for brackets in (_brackets_by_point, _brackets_together)
    ]
    return SweptWay(found[0].spread(counted), found[1].spread(counted), counted)


def _refined(
    trials: dict[float, Trial],
    masks: dict[float, BoolArray],
    tried: Callable[[float, BoolArray], Trial],
    brackets: Callable[[tuple[float, ...], BoolArray, BoolArray], dict[_Bracket, BoolArray]],
    halvings: int,
) -> tuple[dict[float, Trial], dict[float, BoolArray]]:
    """Trials and the points they were made at, by sample time, with the middles of the brackets, `halvings` times."""
    for _ in range(halvings):
        times = tuple(sorted(trials))
        passed = np.stack([trials[time].passed for time in times], axis=-1)
        mask = np.stack([masks[time] for time in times], axis=-1)
        for (low, high), points in brackets(times, mask, passed).items():
            middle = float(np.sqrt(low * high))
            trials[middle], masks[middle] = tried(middle, points), points
    return trials, masks


def _brackets_by_point(times: tuple[float, ...], tried: BoolArray, passed: BoolArray) -> dict[_Bracket, BoolArray]:
    """The steps from passing to failing at the ends of `slowest` and `unbroken`, and the points (N,) that have each."""
    found: dict[_Bracket, BoolArray] = {}
    for ends in (passed, unbroken(tried, passed) & tried):
        for i, row in enumerate(ends):
            places = np.flatnonzero(row)
            if not places.size:
                continue
            slower = np.flatnonzero(tried[i, places[-1] + 1 :])
            if slower.size:
                bracket = times[places[-1]], times[places[-1] + 1 + slower[0]]
                found.setdefault(bracket, np.zeros(len(passed), dtype=bool))[i] = True
    return found


def _brackets_together(times: tuple[float, ...], tried: BoolArray, passed: BoolArray) -> dict[_Bracket, BoolArray]:
    """The same for all points passing at once: every time is tried at every point."""
    every, all_pass = np.asarray(tried.all(axis=0)), np.asarray(passed.all(axis=0))
    found = _brackets_by_point(times, every[None], all_pass[None])
    return {bracket: np.ones(len(passed), dtype=bool) for bracket in found}


def _trials(question: Question, trials: dict[float, Trial], masks: dict[float, BoolArray]) -> SampleTimeTrials:
    """All trials (N, S, ...), the fastest sample time first."""
    times = tuple(sorted(trials))
    each = [trials[time] for time in times]
    return SampleTimeTrials(
        figures=np.stack([trial.figures for trial in each], axis=1),
        met=np.stack([trial.met for trial in each], axis=1),
        passed=np.stack([trial.passed for trial in each], axis=1),
        reasons=np.stack([trial.reasons for trial in each], axis=1),
        tried=np.stack([masks[time] for time in times], axis=1),
        times=times,
        names=question.figures,
        specs=question.specs,
    )
