"""Why a point has no gains: the one spec in the way, what it can reach, and what the nearest design misses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.classical.found import Found
from design.classical.open_gains import OpenGains
from design.classical.steering import StepReference
from design.classical.thorough_search import every_start, tightened
from design.specs import QUANTITIES, Spec
from model.arrays import FloatArray, Floats


@dataclass(frozen=True)
class Relaxation:
    """A spec whose relaxation alone makes a point feasible.

    Attributes
    ----------
    spec : as asked for at the point
    limit : the limit that is needed, in the spec's unit: the best value that the quantity reaches with all the
        other specs met
    percent : by how much that is less strict than asked, as per cent of the limit; of a limit of zero, of 1
    """

    spec: Spec
    limit: float
    percent: float

    def describe(self) -> str:
        """In words and numbers, angles in degrees."""
        return f"{in_words(self.spec, self.limit, bound=True)} ({self.percent:.3g} % of the limit)"


@dataclass(frozen=True)
class Infeasibility:
    """Why a point has no gains.

    Attributes
    ----------
    relaxations : specs whose relaxation alone is enough, the smallest one as a part of its limit first; empty when no
        single relaxation is enough
    missed : the specs that the nearest design misses, the one whose largest miss is least
    nearest : their values there; nan where it has none
    """

    relaxations: tuple[Relaxation, ...]
    missed: tuple[Spec, ...]
    nearest: tuple[float, ...]

    @property
    def blocking(self) -> Spec | None:
        """The spec whose relaxation alone is enough and is the smallest part of its limit; None without one."""
        return self.relaxations[0].spec if self.relaxations else None

    @property
    def reachable(self) -> float:
        """Best value of the blocking spec's quantity with all other specs met; nan without one."""
        return self.relaxations[0].limit if self.relaxations else np.nan

    def describe(self) -> str:
        """In words and numbers, angles in degrees."""
        if not self.relaxations:
            first = "no single spec is in the way"
        else:
            best, *others = self.relaxations
            first = (
                f"asked: {in_words(best.spec, best.spec.limit, bound=True)}; with all other specs met the best "
                f"reachable is {in_words(best.spec, best.limit)}, {best.percent:.3g} % of the limit away"
            )
            if others:
                first += f"; relaxed alone it would also do: {', '.join(other.describe() for other in others)}"
        misses = (
            f"{in_words(spec, spec.limit, bound=True)} ({'none' if np.isnan(value) else _with_unit(spec, value)})"
            for spec, value in zip(self.missed, self.nearest, strict=True)
        )
        return f"{first}; the nearest design misses {', '.join(misses)}"


def in_words(spec: Spec, value: Floats, bound: bool = False) -> str:
    """A value of the spec's quantity in words, as a bound or as it is."""
    relation = {"min": "at least ", "max": "at most "}[spec.sense] if bound else ""
    return f"{spec.quantity.replace('_', ' ')} {relation}{_with_unit(spec, float(value))}"


def _with_unit(spec: Spec, value: float) -> str:
    unit = QUANTITIES[spec.quantity]
    if unit == "rad":
        value, unit = float(np.rad2deg(value)), "deg"
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"


def why_infeasible(
    family: OpenGains, reference: StepReference, specs: tuple[Spec, ...], nearest: Found
) -> list[Infeasibility]:
    """For each of P points without gains: which one spec to relax, and by how much; and what the nearest design misses.

    Parameters
    ----------
    family, reference, specs : of the points
    nearest : the design at each point whose largest miss is least
    """
    points = nearest.aim.size
    each = [spec.take(np.arange(points)) for spec in specs]
    begin = np.concatenate([nearest.z[None], every_start(family)])
    reached = []
    for k in range(len(specs)):
        asked = (*specs[:k], _within_reach(each[k], nearest.achieved[:, k]), *specs[k + 1 :])
        with np.errstate(all="ignore"):
            which = tuple(i == k for i in range(len(specs)))
            reached.append(tightened(family, reference, asked, which, begin))
    found = []
    for p in range(points):
        at = [_at(spec, p) for spec in each]
        misses = [_miss(spec, nearest.achieved[p, k]) for k, spec in enumerate(at)]
        relaxed = [
            Relaxation(spec, float(one.achieved[p, k]), 100.0 * _miss(spec, one.achieved[p, k]))
            for k, (spec, one) in enumerate(zip(at, reached, strict=True))
            if one.met[p]
        ]
        missed = [k for k, miss in enumerate(misses) if not miss <= 0.0]
        found.append(
            Infeasibility(
                tuple(sorted(relaxed, key=lambda r: r.percent)),
                tuple(at[k] for k in missed),
                tuple(float(nearest.achieved[p, k]) for k in missed),
            )
        )
    return found


def _within_reach(spec: Spec, achieved: FloatArray) -> Spec:
    """A spec (P,) that is to be relaxed, with a limit that is of the size of what can be achieved."""
    limit = np.broadcast_to(np.asarray(spec.limit, dtype=float), achieved.shape)
    far = (limit == 0.0) | (-spec.distance(achieved) > np.abs(limit))
    return replace(spec, limit=np.where(far & np.isfinite(achieved) & (achieved != 0.0), achieved, limit))


def _at(spec: Spec, point: int) -> Spec:
    """The spec at one point, its limit a number."""
    limit = spec.limit if isinstance(spec.limit, float) else float(np.asarray(spec.limit)[point])
    return Spec(spec.quantity, spec.sense, limit, spec.source)


def _miss(spec: Spec, value: float) -> float:
    """How far a value misses a spec, as a part of the limit."""
    return float(-spec.distance(np.asarray(value)) / spec.scale)
