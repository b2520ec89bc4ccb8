"""The search's problem at each of P points, and candidates judged by it with all derivatives.

Either the bandwidth is made largest with all specs met, or some of the specs are tightened together, by the same part
of each limit, as far as the others allow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.figure import Figure, joined
from design.classical.frequency_figures import FrequencyFigures
from design.classical.frequency_samples import OF_FREQUENCY
from design.classical.judged import UNSTABLE, Judged, Slopes, Values
from design.classical.open_gains import OpenGains
from design.classical.pole_figures import Poles
from design.classical.requirement import AT_TOP, IN_HAND, Requirement
from design.classical.steering import StepReference
from design.classical.step_figures import BAND, StepFigures, StepLoops
from design.classical.walls import Settled, Walls
from design.specs import Spec
from model.arrays import ComplexArray, FloatArray, GridArrays

#: Specs are not tightened or relaxed by more parts of their limits than this.
FARTHEST = 100.0
#: Part of the band of the settled error that is kept in hand, over that of the limits.
OF_BAND = 5.0


@dataclass(frozen=True, eq=False)
class Problem(GridArrays):
    """The problem of P points.

    Attributes
    ----------
    family : of loops
    frequency, loops : what figures are worked out from
    requirements : one for each spec
    tightens : whether specs are tightened; else the bandwidth is made largest
    band, top : of the settled error, and of the loop transfer where its samples end, with a part in hand
    fineness : how many times as many samples
    """

    family: OpenGains
    frequency: FrequencyFigures
    loops: StepLoops
    requirements: tuple[Requirement, ...]
    tightens: bool
    band: float
    top: float
    fineness: int

    @classmethod
    def of(
        cls,
        family: OpenGains,
        reference: StepReference,
        specs: tuple[Spec, ...],
        tightened: tuple[bool, ...] | None = None,
        fineness: int = 1,
        modes: ComplexArray | None = None,
        in_hand: float = IN_HAND,
    ) -> Problem:
        """Problem of each point of a family, with limits (P,) or one for all, and which specs are tightened.

        There are `fineness` times as many samples, and some about the `modes` (P, m). The part of each limit that is
        kept `in_hand` is so much.
        """
        kinds = {spec.quantity for spec in specs} & (OF_FREQUENCY - {"bandwidth"})
        points = family.form.frequency.size
        which = tightened or (False,) * len(specs)
        return cls(
            family,
            FrequencyFigures.of(family, kinds, fineness, modes),
            StepLoops.of(family, reference),
            tuple(Requirement.of(spec, points, float(give), in_hand) for spec, give in zip(specs, which, strict=True)),
            tightened is not None,
            BAND * (1.0 - OF_BAND * in_hand),
            AT_TOP * (1.0 - in_hand),
            fineness,
        )

    def judge(self, z: FloatArray) -> Judged:
        """Judge K = P candidates z (K, J).

        The settling time itself is only worked out where specs are tightened; else whether the loop settles in time.
        """
        figures = _Figures(self, z, 1)
        values = figures.values(exact=self.tightens)
        return Judged(values, figures.slopes(values))

    def look(self, z: FloatArray, passes: int = 1) -> Values:
        """Values of K = P candidates z (K, J), all of them; `passes` sharpen the events on the frequency axis."""
        return _Figures(self, z, passes).values(exact=True)


class _Figures:
    """All figures of K candidates that a problem asks for."""

    def __init__(self, problem: Problem, z: FloatArray, passes: int) -> None:
        self._problem = problem
        self._asked = {r.quantity: r for r in problem.requirements}
        self._poles = Poles.of(problem.family.characteristic, problem.family.form.delay, z)
        self._step = StepFigures(problem.loops, self._poles, z, problem.fineness)
        self._settled: Settled | None = None
        self._figures = problem.frequency.judge(z, passes)
        self._top = problem.frequency.samples.at_top(z, problem.top)
        for kind, figure in (("tab_rate", self._step.tab_rate), ("tab_deflection", self._step.tab_deflection)):
            if kind in self._asked:
                self._figures[kind] = figure()
        if "noise_gain" in self._asked:
            self._figures["noise_gain"] = joined([self._figures["noise_gain"], _noise_at_infinity(problem, z)])
        settling = self._asked.get("settling_time")
        by = None if settling is None or problem.tightens else settling.limit
        if by is not None or "overshoot" in self._asked:
            summit, self._settled = self._step.of_error("overshoot" in self._asked, by, problem.band)
            if summit is not None:
                self._figures["overshoot"] = summit

    def values(self, exact: bool) -> Values:
        """Values, with the settling time itself where it is to be exact."""
        requirements = self._problem.requirements
        achieved = np.full((self._poles.s.shape[0], len(requirements)), np.nan)
        missed = np.full_like(achieved, -np.inf)
        for s, r in enumerate(requirements):
            settling = r.quantity == "settling_time"
            if settling and self._settled is not None:
                missed[:, s] = self._settled.missed()
            if exact or not settling:
                achieved[:, s] = self._achieved(r)
                missed[:, s] = np.maximum(missed[:, s], r.miss(achieved[:, s]))
        part, miss = self._parts(missed)
        bandwidth = self._figures["bandwidth"]
        aim = part if self._problem.tightens else bandwidth.value[0]
        stable = (self._poles.decay > 0.0) & bandwidth.exists[0] & np.isfinite(aim)
        damping = np.nan_to_num(self._poles.damping_ratio, nan=-1.0)
        return Values(np.where(stable, aim, UNSTABLE + damping), achieved, missed, miss, stable)

    def slopes(self, values: Values) -> Slopes:
        """Derivatives, and the walls of the specs, tightened by the part that the candidates meet them by."""
        problem, part = self._problem, np.zeros(values.aim.shape)
        if problem.tightens:
            part = np.clip(values.aim, -FARTHEST, FARTHEST)
            settling = self._asked.get("settling_time")
            if settling is not None:
                by = np.maximum(settling.limit - part * settling.give * settling.scale, 0.0)
                _, self._settled = self._step.of_error(False, by, problem.band)
        walls = Walls.of(problem.requirements, self._figures, self._top, self._poles, self._settled, part)
        bandwidth = self._figures["bandwidth"]
        slope, bend = bandwidth.gradient[0], bandwidth.curvature[0]
        if problem.tightens:
            slope, bend = np.zeros_like(slope), np.zeros_like(bend)
        return walls.slopes(slope, bend, ~values.stable)

    def _achieved(self, r: Requirement) -> FloatArray:
        """Value (K,) of a quantity: the worst of its figures."""
        if r.quantity == "damping_ratio":
            return self._poles.damping_ratio
        if r.quantity == "settling_time":
            return self._step.settling_time()
        figure = self._figures[r.quantity]
        if r.quantity == "bandwidth":
            return np.where(figure.exists[0], np.exp(figure.value[0]), np.nan)
        if r.sign < 0.0:
            none = 2.0 if r.quantity == "disk_margin" else np.inf
            return np.asarray(np.where(figure.exists, figure.value, none).min(axis=0))
        # At rest the loop undoes what it hears: the command is the noise over K_ss, whatever the gains.
        least = {"sensitivity_peak": np.ones(1), "noise_gain": self._problem.frequency.noise_unit}
        largest = np.where(figure.exists, figure.value, 0.0).max(axis=0)
        return np.asarray(np.maximum(largest, least.get(r.quantity, np.zeros(1))))

    def _parts(self, missed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The part (K,) by which the specs that are tightened are all met, and the largest miss (K,) of the others."""
        part, miss = np.full(missed.shape[0], np.inf), self._top.value[0]
        for s, r in enumerate(self._problem.requirements):
            if not self._problem.tightens:
                miss = np.maximum(miss, missed[:, s])
                continue
            gives = r.give > 0.0
            part = np.where(gives, np.minimum(part, -missed[:, s] / np.where(gives, r.give, 1.0)), part)
            miss = np.where(gives, miss, np.maximum(miss, missed[:, s]))
        return np.where(part == np.inf, 0.0, part), miss


def _noise_at_infinity(problem: Problem, z: FloatArray) -> Figure:
    """Gain from noise to the commanded deflection at high frequency, where the loop does not answer any more."""
    family = problem.family
    top = (family.products @ family.form.noise_top[:, :, None])[..., 0] * problem.frequency.noise_unit[:, None]
    bottom = family.products[:, :, 0] if family.form.rate_command else np.eye(1, top.shape[1])
    under = bottom[:, 0] + (bottom[:, 1:] * z).sum(axis=-1)
    value = (top[:, 0] + (top[:, 1:] * z).sum(axis=-1)) / under
    gradient = (top[:, 1:] - value[:, None] * bottom[:, 1:]) / under[:, None]
    mixed = gradient[:, :, None] * (bottom[:, 1:] / under[:, None])[:, None, :]
    curvature = -(mixed + mixed.swapaxes(-1, -2))
    return Figure(value[None], gradient[None], curvature[None], np.ones((1, value.size), dtype=bool))
