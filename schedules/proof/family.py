"""A schedule's closed loops over its whole envelope, taken apart into constant matrices.

    Acl(h, s) = A_1 + Q A_Q + D A_D + V A_V + sum over m of k_m(h, s) G_m

The k_m are gains or products of two gains, each multilinear between grid points; A and G are constant, one set a
variant of the plant. The matrices are found by evaluating the loop as the product assembles it (`flown_with`) at a few
plants and gains, and the sum is then compared with that loop at others, with every loop that the design flies among
them: a loop that is not of this form is found out and not proved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from model.arrays import FloatArray, IntArray
from model.flight import flight_condition
from model.linear_model import LinearModel
from model.linearise import linearise
from model.trim import trim
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.perturbations import Uncertainty
from schedules.proof.flown_with import NotProvable, closed_with, feedback_gains, unprovable
from schedules.proof.plant_terms import TERMS, given_point_by_point, misfit, scaled_model, term_values
from schedules.proof.variants import Variants, inertias_in_line, models_of, variants
from schedules.study import Study

#: Largest difference between a loop and the sum of its parts, relative to the sum of the parts' sizes.
LARGEST_MISFIT = 1e-9
#: Loops of random plants and gains that the sum is compared with.
TRIALS = 16


@dataclass(frozen=True, eq=False)
class LoopFamily:
    """Closed loops of one controller over the envelope.

    Attributes
    ----------
    terms : names of what multiplies the plant's matrices: ``1``, ``Q`` [Pa], ``D`` [Pa s/m] and, with lags, ``V`` [m/s]
    plants : (W, J, n, n) A_j of every variant
    gains : names
    tables : (nh, ns, g) the gains at the grid points; nan where there is none
    monomials : indices of the gain or of the two gains whose product is k_m
    injections : (W, M, n, n) G_m of every variant
    variants : which parameters are off in each, and by what factor
    """

    terms: tuple[str, ...]
    plants: FloatArray
    gains: tuple[str, ...]
    tables: FloatArray
    monomials: tuple[tuple[int, ...], ...]
    injections: FloatArray
    variants: Variants

    @property
    def order(self) -> int:
        """Number of states n."""
        return int(self.plants.shape[-1])

    @property
    def gain_degree(self) -> int:
        """Degree of the k_m in each coordinate: 2 where gains are multiplied."""
        return max((len(monomial) for monomial in self.monomials), default=1)

    @property
    def parts(self) -> int:
        """Number of matrices that a loop is the sum of."""
        return int(self.plants.shape[1] + self.injections.shape[1])

    def products(self, gains: FloatArray) -> FloatArray:
        """The k_m (..., M) of gains (..., g)."""
        columns = [np.prod(gains[..., list(monomial)], axis=-1) for monomial in self.monomials]
        return np.stack(columns, axis=-1) if columns else np.zeros((*gains.shape[:-1], 0))

    def closed(self, terms: FloatArray, products: FloatArray) -> FloatArray:
        """Closed loops (W, ..., n, n) of values of the terms (..., J) and of the k_m (..., M)."""
        W, _, n, _ = self.plants.shape
        weights = np.concatenate([terms, products], axis=-1)
        parts = np.concatenate([self.plants, self.injections], axis=1).reshape(W, -1, n * n)
        return np.asarray((weights.reshape(-1, weights.shape[-1]) @ parts).reshape(W, *weights.shape[:-1], n, n))


def family(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    changes: Sequence[Uncertainty] = (),
    together: bool = False,
) -> LoopFamily | NotProvable:
    """Take a controller's closed loops apart, or say why that cannot be done.

    Parameters
    ----------
    changes, together : parameters of the plant that are off, each alone or all together

    Raises
    ------
    ValueError : a parameter named twice
    """
    found = variants(changes, together)
    refused = unprovable(study, plant, designed)
    if refused is not None:
        return refused
    points = np.flatnonzero(designed.outcomes.ok)
    if points.size == 0:
        return NotProvable("no grid point has gains", known=False)

    def side_by_side(models: LinearModel) -> FloatArray:
        return _at_some_gains(study, plant, designed, models)

    reference = models_of(plant, points[:1], found)
    reason = inertias_in_line(plant, int(points[0]), found, together, side_by_side)
    if reason is None:
        reason = _plant_changes(study, plant, reference, points, found)
    if reason is not None:
        return NotProvable(reason, known=True)
    made = _taken_apart(study, plant, designed, reference, int(points[0]), found)
    reason = _loop_differs(study, plant, designed, reference, made, points)
    return made if reason is None else NotProvable(reason, known=True)


def _at_some_gains(study: Study, plant: PlantEnvelope, designed: DesignedController, models: LinearModel) -> FloatArray:
    """Loops (N, n, 3 n) of models (N,) with no gains, with those of the first point, and with half of those."""
    first = int(np.flatnonzero(designed.outcomes.ok)[0])
    table = {name: values.reshape(-1)[first] for name, values in feedback_gains(designed).items()}
    count = models.A.shape[0]
    each = [
        closed_with(
            study, plant, designed, models, {name: np.full(count, part * value) for name, value in table.items()}
        )
        for part in (0.0, 1.0, 0.5)
    ]
    return np.concatenate(each, axis=-1)


def _values_at(plant: PlantEnvelope, points: IntArray) -> FloatArray:
    """Values of the terms (P, T) at flat points inside the model: outside of it they need not exist."""
    inside = plant.grid.condition.take(np.unravel_index(points, plant.outcomes.ok.shape))
    return term_values(plant.system, inside)


def _plant_changes(
    study: Study, plant: PlantEnvelope, reference: LinearModel, points: IntArray, found: Variants
) -> str | None:
    """Why the plant is not affine over the envelope, in words; None where its own models are."""
    values = _values_at(plant, points)
    ratios = values / values[0]
    rows = len(found.factors)
    apart = misfit(
        reference.take(np.repeat(np.arange(rows), len(points))),
        np.tile(ratios, (rows, 1)),
        models_of(plant, points, found),
    )
    if apart <= LARGEST_MISFIT:
        apart = _between(study, plant, points)
    if apart > LARGEST_MISFIT:
        return (
            f"the plant is not affine in dynamic pressure and mass flux: off by {apart:.1e} of an entry "
            "(a trim that changes with the flight point, or slopes of hinge moments that do)"
        )
    return None


def _between(study: Study, plant: PlantEnvelope, points: IntArray) -> float:
    """Misfit of models between the grid points, trimmed and linearised anew; 0 where there are none."""
    axes = [np.asarray(axis.values) for axis in plant.grid.axes]
    middle = [0.5 * (values[1:] + values[:-1]) if values.size > 1 else values for values in axes]
    asked = study.trim
    if given_point_by_point(asked):
        return 0.0  # angles given point by point say nothing of what is between
    grid = study.grid
    condition = flight_condition(middle[0][:, None], grid.speed_axis, middle[1], grid.temperature_offset)
    inside = plant.system.aerodynamics.covers(condition.mach)
    condition = condition.take(inside)
    held = trim(plant.system, condition, asked)
    condition, held = condition.take(held.reached), held.take(held.reached)
    if condition.mach.size == 0:
        return 0.0
    first = np.unravel_index(points[:1], plant.outcomes.ok.shape)
    start = _values_at(plant, points[:1])
    ratios = term_values(plant.system, condition) / start
    return misfit(
        plant.model.take(first).take(np.zeros(len(ratios), dtype=int)), ratios, linearise(plant.system, condition, held)
    )


def _taken_apart(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    reference: LinearModel,
    point: int,
    found: Variants,
) -> LoopFamily:
    table = feedback_gains(designed)
    names = tuple(table)
    tables = np.stack([table[name] for name in names], axis=-1)
    sizes = np.max(np.abs(np.where(np.isnan(tables), 0.0, tables)), axis=tuple(range(tables.ndim - 1)))
    # Powers of two: what they multiply is divided by them without rounding.
    unit = 2.0 ** np.round(np.log2(np.where(sizes > 0.0, sizes, 1.0)))
    lagged = reference.lag_torque.shape[-1] > 0
    terms = TERMS if lagged else TERMS[:2]
    pairs = list(combinations(range(len(names)), 2))
    singles = [(i,) for i in range(len(names))]
    ratios = np.ones((1 + len(terms) + len(singles) + len(pairs), len(TERMS)))
    ratios[np.arange(1, 1 + len(terms)), np.arange(len(terms))] = 0.5
    gains = np.zeros((len(ratios), len(names)))
    for row, monomial in enumerate([*singles, *pairs], start=1 + len(terms)):
        gains[row, list(monomial)] = unit[list(monomial)]
    loops = _assembled(study, plant, designed, reference, names, ratios, gains)
    values = _values_at(plant, np.array([point]))[0, : len(terms)]
    whole, halved = loops[:, :1], loops[:, 1 : 1 + len(terms)]
    parts = 2.0 * (whole - halved)
    plants = np.concatenate([whole - np.sum(parts, axis=1, keepdims=True), parts / values[:, None, None]], axis=1)
    alone = loops[:, 1 + len(terms) :][:, : len(singles)] - whole
    both = loops[:, 1 + len(terms) + len(singles) :] - whole
    monomials: list[tuple[int, ...]] = list(singles)
    injections = [alone[:, i] / unit[i] for i in range(len(names))]
    size = np.abs(whole[:, 0]) + np.sum(np.abs(alone), axis=1)
    for k, (i, j) in enumerate(pairs):
        cross = both[:, k] - alone[:, i] - alone[:, j]
        if np.any(np.abs(cross) > 1e-12 * (size + np.abs(both[:, k]))):
            monomials.append((i, j))
            injections.append(cross / (unit[i] * unit[j]))
    used = [m for m, matrix in enumerate(injections) if np.any(matrix)]
    return LoopFamily(
        terms=("1", *terms), plants=plants, gains=names, tables=tables, monomials=tuple(monomials[m] for m in used),
        injections=np.stack([injections[m] for m in used], axis=1), variants=found,
    )  # fmt: skip


def _loop_differs(
    study: Study, plant: PlantEnvelope, designed: DesignedController, reference: LinearModel, made: LoopFamily,
    points: IntArray,
) -> str | None:  # fmt: skip
    """Why the sum of the parts is not the loop, in words; None where it is, at the grid and at random."""
    gains, values = made.tables.reshape(-1, len(made.gains)), _values_at(plant, points)
    apart = _apart(made, values, gains[points], designed.loop.closed.reshape(-1, made.order, made.order)[points])
    rng = np.random.default_rng(0)
    ratios, size = rng.uniform(0.25, 4.0, (TRIALS, len(TERMS))), np.nanmax(np.abs(gains), axis=0)
    tried = rng.standard_normal((TRIALS, len(made.gains))) * size
    real = _assembled(study, plant, designed, reference, made.gains, ratios, tried)
    apart = max(apart, *(_apart(made, values[0] * ratios, tried, loops, w) for w, loops in enumerate(real)))
    if apart > LARGEST_MISFIT:
        return (
            f"the closed loop is not a sum of matrices times flight condition or gains: off by {apart:.1e} of an entry"
        )
    return None


def _apart(made: LoopFamily, values: FloatArray, gains: FloatArray, real: FloatArray, variant: int = 0) -> float:
    """Largest difference of loops (N, n, n) from the sum, relative to the sizes of its parts."""
    terms = np.concatenate([np.ones((len(values), 1)), values[:, : len(made.terms) - 1]], axis=-1)
    products = made.products(gains)
    expected = made.closed(terms, products)[variant]
    parts = np.einsum("nj,jab->nab", np.abs(terms), np.abs(made.plants[variant]))
    parts = parts + np.einsum("nm,mab->nab", np.abs(products), np.abs(made.injections[variant]))
    off = np.abs(expected - real)
    return float(
        np.max(np.where(parts > 0.0, off / np.where(parts > 0.0, parts, 1.0), np.where(off > 0.0, np.inf, 0.0)))
    )


def _assembled(
    study: Study, plant: PlantEnvelope, designed: DesignedController, reference: LinearModel, names: Sequence[str],
    ratios: FloatArray, gains: FloatArray,
) -> FloatArray:  # fmt: skip
    """Loops (W, N, n, n) as the product assembles them, of every variant at `ratios` (N, 3) with gains (N, g)."""
    W, N = reference.A.shape[0], len(ratios)
    model = scaled_model(reference.take(np.repeat(np.arange(W), N)), np.tile(ratios, (W, 1)))
    by_name: Mapping[str, FloatArray] = {name: np.tile(gains[:, i], W) for i, name in enumerate(names)}
    closed = closed_with(study, plant, designed, model, by_name)
    return closed.reshape(W, N, *closed.shape[-2:])
