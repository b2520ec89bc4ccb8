"""Search for the fastest gains that meet the specs, every point for itself and all points at once.

The fastest design nearly always lies where several specs bind at once, at the tip of a wedge. So, after a coarse grid
has shown where to start, the search goes from vertex to vertex: the bandwidth of r_a -> da and all specs are linearised
in the gains (damping of every mode by the exact derivative of its pole), the linear programme is solved inside a trust
region, and the step is kept when the bandwidth less the price of what is missed has risen. The search is deterministic,
and a point's answer does not depend on its neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from design.classical.candidates import CandidateJudge, Judged
from design.classical.normal_form import NormalForm
from design.classical.vertex_step import best_vertex
from design.specs import QUANTITIES, Spec
from model.arrays import BoolArray, FloatArray, IntArray

#: Quantities that can steer the synthesis.
STEERABLE = ("damping_ratio", "gain_margin", "phase_margin", "settling_time", "overshoot")
#: Part of each limit kept in hand, because the search's figures are interpolated ones.
IN_HAND = 1e-3
STARTS = 3
ITERATIONS = 40
#: A search whose trust region has shrunk to this, in its coordinates, has arrived.
SMALLEST_RADIUS = 3e-5
#: Resolution of the closer look at the winners, and of the search where it finds them flattered.
FINER = 8
#: Points searched together; bounds the memory.
BLOCK = 128
#: What missing a spec by its whole limit costs, in the logarithm of the bandwidth.
PRICE = 20.0
#: Rank of a candidate that meets all specs, above all that miss one (their rank is negative).
_MET = 1.0
#: Rank below every candidate that was judged to the end.
_UNJUDGED = -1e9
#: Step of the finite differences, in the search's coordinates.
_STEP = 1e-4


@dataclass(frozen=True)
class Infeasibility:
    """Why a point has no gains.

    Attributes
    ----------
    blocking : the spec whose relaxation alone is enough and is the smallest part of its limit; None when no single
        relaxation is enough
    reachable : best value of its quantity with all other specs met; nan without one
    missed : the specs that the nearest design misses, the one whose largest miss is least
    nearest : their values there; nan where no stable design comes near
    """

    blocking: Spec | None
    reachable: float
    missed: tuple[Spec, ...]
    nearest: tuple[float, ...]

    def describe(self) -> str:
        """In words and numbers, angles in degrees."""
        if self.blocking is None:
            first = "no single spec is in the way"
        else:
            asked, got = _in_words(self.blocking, self.blocking.limit, True), _in_words(self.blocking, self.reachable)
            first = f"asked: {asked}; with all other specs met the best reachable is {got}"
        misses = (
            f"{_in_words(spec, spec.limit, True)} ({'none' if np.isnan(value) else _with_unit(spec, value)})"
            for spec, value in zip(self.missed, self.nearest, strict=True)
        )
        return f"{first}; the nearest design misses {', '.join(misses)}"


def _in_words(spec: Spec, value: float, bound: bool = False) -> str:
    relation = {"min": "at least ", "max": "at most "}[spec.sense] if bound else ""
    return f"{spec.quantity.replace('_', ' ')} {relation}{_with_unit(spec, value)}"


def _with_unit(spec: Spec, value: float) -> str:
    unit = QUANTITIES[spec.quantity]
    if unit == "rad":
        value, unit = float(np.rad2deg(value)), "deg"
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"


@dataclass(frozen=True, eq=False)
class Found:
    """Best candidate of each of P points.

    Attributes
    ----------
    coordinates : (P, J) non-dimensional gains
    feasible : (P,) whether they meet all specs
    infeasibility : one for each point, None where feasible
    """

    coordinates: FloatArray
    feasible: BoolArray
    infeasibility: tuple[Infeasibility | None, ...]


def search_gains(form: NormalForm, specs: tuple[Spec, ...], horizon: float) -> Found:
    """Largest bandwidth that meets `specs` at each of P points.

    Parameters
    ----------
    form : normal form, G = (P,)
    specs : quantities of `STEERABLE` only
    horizon : how long step responses are followed [s]

    Raises
    ------
    ValueError : a spec's quantity cannot steer the synthesis
    """
    for spec in specs:
        if spec.quantity not in STEERABLE:
            raise ValueError(f"{spec.quantity} cannot steer a synthesis; it can be one of {', '.join(STEERABLE)}")
    points = form.frequency.size
    blocks = [
        _search_block(form.take(slice(start, start + BLOCK)), specs, horizon) for start in range(0, points, BLOCK)
    ]
    return Found(
        np.concatenate([b.coordinates for b in blocks]),
        np.concatenate([b.feasible for b in blocks]),
        tuple(reason for b in blocks for reason in b.infeasibility),
    )


def _search_block(form: NormalForm, specs: tuple[Spec, ...], horizon: float) -> Found:
    with np.errstate(over="ignore", divide="ignore", invalid="ignore", under="ignore"):
        best = _Search(form, horizon, specs, None).run()
        # A resonance between the samples flatters a candidate: look closer at what won, and search there again.
        flattered = np.flatnonzero((best.merit >= _MET) & _missed_closely(form, horizon, specs, best.kappa))
        if flattered.size:
            again = _Search(form.take(flattered), horizon, specs, None, FINER).run()
            best.kappa[flattered], best.merit[flattered] = again.kappa, again.merit
            best.judged.put(flattered, again.judged)
        feasible = best.merit >= _MET
        infeasibility: list[Infeasibility | None] = [None] * feasible.size
        if not np.all(feasible):
            lost = np.flatnonzero(~feasible)
            for point, found in zip(lost, _blocking(form.take(lost), horizon, specs, best, lost), strict=True):
                infeasibility[point] = found
    return Found(best.kappa, feasible, tuple(infeasibility))


def _missed_closely(form: NormalForm, horizon: float, specs: tuple[Spec, ...], kappa: FloatArray) -> BoolArray:
    """Mask (P,) of the candidates that miss a spec when they are judged at the finer resolution."""
    judged = CandidateJudge(form, horizon, FINER).judge(np.arange(form.frequency.size), kappa, specs)
    missed = np.zeros(form.frequency.size, dtype=bool)
    for spec in specs:
        missed |= judged.miss(spec) > 0
    return missed


@dataclass(frozen=True, eq=False)
class _Best:
    """Winner of each point: non-dimensional gains (P, J), strict rank (P,) and figures."""

    kappa: FloatArray
    merit: FloatArray
    judged: Judged


def _blocking(
    form: NormalForm, horizon: float, specs: tuple[Spec, ...], nearest: _Best, lost: IntArray
) -> list[Infeasibility]:
    """For each point, the one spec to relax, where one is enough, and what the nearest design misses."""
    relaxations, reached = [], []
    for spec in specs:
        others = tuple(s for s in specs if s is not spec)
        best = _Search(form, horizon, others, spec).run()
        met = best.merit >= _MET
        relaxations.append(np.where(met, best.judged.miss(spec), np.inf))
        reached.append(best.judged.values[spec.quantity])
    order = np.argmin(relaxations, axis=0)
    misses = [nearest.judged.miss(spec) for spec in specs]
    found = []
    for i, k in enumerate(order):
        missed = [s for s, miss in enumerate(misses) if miss[lost[i]] > 0]
        nearest_values = tuple(float(nearest.judged.values[specs[s].quantity][lost[i]]) for s in missed)
        alone = np.isfinite(relaxations[k][i])
        found.append(
            Infeasibility(
                specs[k] if alone else None,
                float(reached[k][i]) if alone else np.nan,
                tuple(specs[s] for s in missed),
                nearest_values,
            )
        )
    return found


class _Search:
    """One search: the specs to meet, and what is made best (the bandwidth, or one quantity)."""

    def __init__(
        self, form: NormalForm, horizon: float, specs: tuple[Spec, ...], aim: Spec | None, fineness: int = 1
    ) -> None:
        self.judge = CandidateJudge(form, horizon, fineness)
        self.specs = tuple(_in_hand(s) for s in specs)
        self.steering = self.specs if aim is None else (*self.specs, _always(aim))
        self.aim = aim
        self.form = form
        self.points = form.frequency.size
        self.smooth = [k for k, spec in enumerate(self.specs) if spec.quantity != "damping_ratio"]
        self.damping = max((s.limit for s in self.specs if s.quantity == "damping_ratio"), default=None)

    def run(self) -> _Best:
        """Best candidate of each point."""
        grid, spacing = coarse_grid(self.form.kind)
        at = np.repeat(np.arange(self.points), len(grid))
        judged = self._judge(at, np.tile(grid, (self.points, 1)))
        u = _starts(grid, self._priced(judged).reshape(self.points, -1), 1.6 * spacing).reshape(-1, grid.shape[-1])
        at = np.repeat(np.arange(self.points), STARTS)
        radius = np.tile(spacing, (u.shape[0], 1))
        judged = self._judge(at, u)
        best_u, best = u.copy(), self._strict(judged)
        going = np.arange(u.shape[0])
        for _ in range(ITERATIONS):
            here = judged.take(going)
            tried, new = self._advance(at[going], u[going], here, radius[going])
            better = self._priced(new) > self._priced(here)
            radius[going] *= np.where(better, 1.5, 0.35)[:, None]
            strict = self._strict(new)
            record = strict > best[going]
            best_u[going[record]], best[going[record]] = tried[record], strict[record]
            u[going[better]] = tried[better]
            judged.put(going[better], new.take(better))
            going = going[np.max(radius[going], axis=-1) > SMALLEST_RADIUS]
            if going.size == 0:
                break
        return self._winner(best_u, best)

    def _advance(self, at: IntArray, u: FloatArray, judged: Judged, radius: FloatArray) -> tuple[FloatArray, Judged]:
        """Best vertex of the linearised problem, and once more from where that led: the walls are curved."""
        low, high = np.maximum(u - radius, 0.0), np.minimum(u + radius, 1.0)
        slope, gradient = self._slopes(at, u, judged)
        tried = u + best_vertex(slope, self._constraints(at, u, judged), gradient, low - u, high - u)
        new = self._judge(at, tried)
        again = tried + best_vertex(slope, self._constraints(at, tried, new), gradient, low - tried, high - tried)
        corrected = self._judge(at, again)
        straight = self._priced(new) >= self._priced(corrected)
        return np.where(straight[:, None], tried, again), new.where(straight, corrected)

    def _winner(self, u: FloatArray, merit: FloatArray) -> _Best:
        merit = merit.reshape(self.points, STARTS)
        pick = np.argmax(merit, axis=-1)
        row = np.arange(self.points)
        final = u.reshape(self.points, STARTS, -1)[row, pick]
        judged = self._judge(row, final)
        kappa = kappa_of(self.form, row, final)
        return _Best(kappa, merit[row, pick], judged)

    def _judge(self, at: IntArray, u: FloatArray) -> Judged:
        return self.judge.judge(at, kappa_of(self.form, at, u), self.steering)

    def _aim(self, judged: Judged) -> FloatArray:
        """What is made best; nan where the candidate was not judged."""
        if self.aim is None:
            return np.log(np.where(judged.bandwidth > 0, judged.bandwidth, np.nan))
        miss = judged.miss(self.aim)
        return np.where(np.isfinite(miss), -miss, np.nan)

    def _misses(self, judged: Judged) -> FloatArray:
        """(K, S) miss of each spec."""
        rows = [judged.miss(spec) for spec in self.specs]
        return np.stack(rows, axis=-1) if rows else np.zeros((*judged.bandwidth.shape, 0))

    def _priced(self, judged: Judged) -> FloatArray:
        """Aim less the price of the miss; candidates never judged come last, best damped first."""
        priced = self._aim(judged) - PRICE * np.maximum(np.max(self._misses(judged), axis=-1, initial=-np.inf), 0.0)
        last = _UNJUDGED + np.nan_to_num(judged.values["damping_ratio"], nan=-1.0)
        return np.where(np.isfinite(priced), priced, last)

    def _strict(self, judged: Judged) -> FloatArray:
        """Strict rank: candidates that meet all specs by their aim; above all others, which go by their miss."""
        miss = np.max(self._misses(judged), axis=-1, initial=-np.inf)
        aim = self._aim(judged)
        # The aim keeps its order between 0 and 1, whatever its size and sign: meeting the specs is what ranks first.
        ordered = 0.5 + np.arctan(np.nan_to_num(aim)) / np.pi
        return np.where((miss <= 0) & np.isfinite(aim), _MET + ordered, np.where(np.isfinite(miss), -miss, -np.inf))

    def _constraints(self, at: IntArray, u: FloatArray, judged: Judged) -> FloatArray:
        """(K, M) misses of the specs, damping mode by mode: at most 0 when met."""
        value = self._misses(judged)[:, self.smooth]
        if self.damping is not None:
            ratios, _ = self.judge.mode_damping(at, kappa_of(self.form, at, u))
            value = np.concatenate([value, 1.0 - ratios / self.damping], axis=-1)
        return np.clip(np.nan_to_num(value, nan=0.0, posinf=1e3, neginf=-1e3), -1e3, 1e3)

    def _slopes(self, at: IntArray, u: FloatArray, judged: Judged) -> tuple[FloatArray, FloatArray]:
        """Gradients of the aim (K, J) and of the constraints (K, M, J) in the search's coordinates."""
        aim, misses, kappa = self._aim(judged), self._misses(judged), kappa_of(self.form, at, u)
        slope, gradient, dkappa = [], [], []
        for j in range(u.shape[-1]):
            h = np.where(u[:, j] > 0.5, -_STEP, _STEP)
            moved = u.copy()
            moved[:, j] += h
            near = self._judge(at, moved)
            slope.append((self._aim(near) - aim) / h)
            gradient.append((self._misses(near) - misses)[:, self.smooth] / h[:, None])
            dkappa.append((kappa_of(self.form, at, moved) - kappa) / h[:, None])
        slopes = np.stack(gradient, axis=-1)
        if self.damping is not None:
            _, by_kappa = self.judge.mode_damping(at, kappa)
            by_u = np.einsum("kri,kji->krj", by_kappa, np.stack(dkappa, axis=1))
            slopes = np.concatenate([slopes, -by_u / self.damping], axis=1)
        return np.nan_to_num(np.stack(slope, axis=-1)), np.nan_to_num(slopes)


def kappa_of(form: NormalForm, at: IntArray, u: FloatArray) -> FloatArray:
    """Non-dimensional gains (K, J) from search coordinates (K, J) in [0, 1], each at its own point.

    The faster the servo against the aileron, the higher the gains worth trying.
    """
    r = form.servo_ratio[at]
    integral = 0.01 * (np.maximum(4.0, 2.0 * r) / 0.01) ** u[:, -1]
    if form.kind == "positive_feedback":
        return np.stack([u[:, 0], integral], axis=-1)
    rate = np.maximum(3.0, r / 1.5) * u[:, 0] ** 2
    position = np.maximum(4.0, r**2 / 6.0) * u[:, 1] ** 3
    return np.stack([rate, position, integral], axis=-1)


def coarse_grid(kind: str) -> tuple[FloatArray, FloatArray]:
    """Search coordinates (M, J) to start from, and their spacing (J,)."""
    counts = (13, 15) if kind == "positive_feedback" else (9, 8, 13)
    axes = [np.linspace(0.0, 1.0, n) for n in counts]
    return np.array(list(product(*axes))), np.array([axis[1] for axis in axes])


def _starts(u: FloatArray, merit: FloatArray, apart: FloatArray) -> FloatArray:
    """Best candidates (P, STARTS, J) of each point, none within `apart` of a better one in all coordinates."""
    merit = merit.copy()
    picked = []
    for _ in range(STARTS):
        best = u[np.argmax(merit, axis=-1)]
        picked.append(best)
        close = np.all(np.abs(u[None] - best[:, None, :]) < apart, axis=-1)
        merit = np.where(close, -np.inf, merit)
    return np.stack(picked, axis=1)


def _in_hand(spec: Spec) -> Spec:
    shift = IN_HAND * abs(spec.limit) * (1.0 if spec.sense == "min" else -1.0)
    return Spec(spec.quantity, spec.sense, spec.limit + shift, spec.source)


def _always(spec: Spec) -> Spec:
    """The same quantity with a limit that every candidate meets, so that none is dropped for it."""
    return Spec(spec.quantity, spec.sense, -1e12 if spec.sense == "min" else 1e12, spec.source)
