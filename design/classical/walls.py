"""The walls that specs put up about a candidate, made of its figures: at most zero where the specs are met."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.close_poles import CLOSE_WALLS, close_pole_walls
from design.classical.figure import Figure, joined, nothing
from design.classical.judged import Slopes
from design.classical.pole_figures import Poles
from design.classical.requirement import ABSENT, LEAST_DAMPING, SETTLING_SCALE, Requirement
from model.arrays import BoolArray, FloatArray

#: Derivatives larger than this say nothing.
STEEPEST = 1e9


@dataclass(frozen=True, eq=False)
class Settled:
    """What `design.classical.step_figures` says of the error that is to have settled.

    Attributes
    ----------
    error : how far it is outside its band, (E, K)
    by_time : (E, K) the derivatives in the time by which it is to have settled [1/s]
    """

    error: Figure
    by_time: FloatArray

    def missed(self) -> FloatArray:
        """The largest (K,) of what is outside, as it counts against a part of a limit."""
        return np.asarray(SETTLING_SCALE * np.where(self.error.exists, self.error.value, ABSENT).max(axis=0))


@dataclass(frozen=True, eq=False)
class Walls:
    """Walls of K candidates, those of the damping first.

    Attributes
    ----------
    figure : (M, K) figures, at most 0 where the specs are met
    give : (M, K) how they rise with the part by which specs are tightened
    damping : number of those that keep the loop stable
    """

    figure: Figure
    give: FloatArray
    damping: int

    @classmethod
    def of(
        cls,
        requirements: tuple[Requirement, ...],
        figures: dict[str, Figure],
        top: Figure,
        poles: Poles,
        settled: Settled | None,
        part: FloatArray,
    ) -> Walls:
        """Walls of every requirement, tightened by the `part` (K,), and of what bounds the loop at the `top`."""
        made, slopes, offsets, gives = _damping_walls(requirements, poles, part)
        damping = sum(len(give) for give in gives)
        made.append(top)
        slopes.append(np.ones(part.shape))
        offsets.append(np.zeros(part.shape))
        gives.append(np.zeros(top.value.shape))
        for r in requirements:
            if r.quantity == "damping_ratio":
                continue
            if r.quantity == "settling_time":
                assert settled is not None
                figure, slope, offset = settled.error, np.full(part.shape, SETTLING_SCALE), np.zeros(part.shape)
                give = -SETTLING_SCALE * settled.by_time * (r.give * r.scale)
            else:
                figure = figures[r.quantity].exponential() if r.quantity == "bandwidth" else figures[r.quantity]
                slope = r.sign / r.scale
                offset, give = r.give * part - slope * r.limit, np.repeat(r.give[None], len(figure.value), axis=0)
            made.append(figure)
            slopes.append(slope)
            offsets.append(offset)
            gives.append(give)
        counts = [len(figure.value) for figure in made]
        slope, offset = (np.repeat(np.stack(rows), counts, axis=0) for rows in (slopes, offsets))
        every = joined(made)
        value = np.where(every.exists, slope * every.value + offset, ABSENT)
        slope = slope * every.exists
        walls = Figure(value, slope[..., None] * every.gradient, slope[..., None, None] * every.curvature, every.exists)
        return cls(walls, np.concatenate(gives), damping)

    def slopes(self, aim: FloatArray, aim_curvature: FloatArray, lost: BoolArray) -> Slopes:
        """With the derivatives of the aim. Candidates that are `lost` (K,) are to raise their damping, nothing else."""
        made = [self.figure.value.T.copy()]
        made += [_bounded(v.swapaxes(0, 1)) for v in (self.figure.gradient, self.figure.curvature, self.give)]
        aims = [_bounded(aim), _bounded(aim_curvature)]
        if np.any(lost):
            made[0][lost] = np.nan_to_num(made[0][lost], nan=ABSENT, neginf=ABSENT, posinf=-ABSENT)
            made[0][lost, self.damping :] = ABSENT
            for v in made[1:]:
                v[lost, self.damping :] = 0.0
            for v in aims:
                v[lost] = 0.0
        return Slopes(*aims, *made)


def _damping_walls(
    requirements: tuple[Requirement, ...], poles: Poles, part: FloatArray
) -> tuple[list[Figure], list[FloatArray], list[FloatArray], list[FloatArray]]:
    """Of the least damped modes each, or of the two least damped ones together where they are close.

    Returns
    -------
    Figures, their slopes and offsets (K,), and how their walls rise with the part.
    """
    asked = [r for r in requirements if r.quantity == "damping_ratio"]
    one, none = np.ones(part.shape), np.zeros(part.shape)
    limit, scale, give = LEAST_DAMPING * one, one, none
    if asked:
        limit, scale, give = np.maximum(asked[0].limit, LEAST_DAMPING), asked[0].scale, asked[0].give
    single, now = poles.damping(), limit + part * give * scale
    close = poles.close & (now < 1.0)
    pair, rise = nothing(CLOSE_WALLS, single), np.zeros((CLOSE_WALLS, part.size))
    if np.any(close):
        found, rise = close_pole_walls(poles, poles.least[:2], np.clip(now, 0.0, 0.999), scale, give * scale)
        pair = Figure(found.value, found.gradient, found.curvature, found.exists & close)
        apart = single.exists.copy()
        apart[:2] &= ~close
        single = Figure(single.value, single.gradient, single.curvature, apart)
    gives = [np.repeat(give[None], len(single.value), axis=0), rise]
    return [single, pair], [-1.0 / scale, one], [now / scale, none], gives


def _bounded(derivatives: FloatArray) -> FloatArray:
    """Derivatives without what is not finite, or next to it: where poles meet, rounding is all that there is."""
    return np.where(np.abs(derivatives) < STEEPEST, derivatives, 0.0)
