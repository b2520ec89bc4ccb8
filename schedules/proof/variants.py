"""Plants that a proof must hold for at once: the model, and it with parameters off by some part.

Hinge-moment derivatives enter the model linearly, so that what holds at the ends of their ranges holds between them. An
inertia enters through the inverse of the mass matrix, to which it adds a matrix of rank one: along its range the model
moves on a straight line, if not evenly (Sherman and Morrison). Both ends prove it again, but not two inertias together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from model.arrays import FloatArray, IntArray
from model.linear_model import LinearModel
from schedules.analysis import PlantEnvelope
from schedules.perturbations import Parameter, Uncertainty, perturbed_model

#: A model may be off the line between two others by this part, rounding.
ROUNDING = 1e-11


@dataclass(frozen=True, eq=False)
class Variants:
    """Factors of perturbed plants.

    Attributes
    ----------
    parameters : names, k of them
    factors : (W, k) what each is multiplied by; the first row, all ones, is the model
    words : what is covered
    """

    parameters: tuple[Parameter, ...]
    factors: FloatArray
    words: str

    @property
    def corners(self) -> slice:
        """Rows that stand for all: without the model where it lies between others."""
        return slice(1 if len(self.factors) > 1 else 0, None)


def variants(changes: Sequence[Uncertainty], together: bool) -> Variants:
    """Ends of the ranges: of each parameter alone (2 k plants), or of all together (2^k plants).

    A proof with one Lyapunov function for the plants of each alone holds for mixtures too, as long as the parts of
    their ranges that are used up add to no more than one.
    """
    parameters = tuple(change.parameter for change in changes)
    if len(set(parameters)) != len(parameters):
        raise ValueError(f"a parameter is named twice: {', '.join(parameters)}")
    if not parameters:
        return Variants((), np.ones((1, 0)), "the model")
    sizes = np.array([change.change for change in changes])
    if together:
        factors = 1.0 + np.array(list(product((-1.0, 1.0), repeat=len(sizes)))) * sizes
    else:
        factors = 1.0 + np.concatenate([-np.diag(sizes), np.diag(sizes)])
    factors = np.concatenate([np.ones((1, len(sizes))), factors])
    each = ", ".join(f"{change.parameter} +-{100.0 * change.change:g} %" for change in changes)
    return Variants(parameters, factors, f"{each}, {'together' if together else 'each alone'}")


def inertias_in_line(
    plant: PlantEnvelope, point: int, found: Variants, together: bool, loops: Callable[[LinearModel], FloatArray]
) -> str | None:
    """Why the ends of an inertia's range do not stand for all of it, in words; None where they do.

    Parameters
    ----------
    point : flat index of a grid point
    loops : closed loops (N, n, m) of models (N,), of several gains side by side
    """
    rigid = [k for k, name in enumerate(found.parameters) if not name.startswith("C_")]
    if together and len(rigid) > 1:
        names = ", ".join(found.parameters[k] for k in rigid)
        return f"{names} together: the mass matrix is inverted, and two inertias off at once leave the straight line"
    for k in rigid:
        ends = np.min(found.factors[:, k]), np.max(found.factors[:, k])
        steps = np.linspace(*ends, 7)[:, None]
        models = perturbed_model(plant, np.full(7, point), (found.parameters[k],), steps)
        if not _in_line(loops(models)):
            return f"{found.parameters[k]}: the loop does not move on a straight line between the ends of its range"
    return None


def _in_line(matrices: FloatArray) -> bool:
    """Whether matrices (k, n, m) lie between the first and the last."""
    flat = matrices.reshape(len(matrices), -1)
    along = flat[-1] - flat[0]
    if not np.any(along):
        return True
    # Entries differ in size by orders: each is weighed by its own change.
    weight = np.where(along != 0.0, 1.0 / np.where(along != 0.0, along, 1.0), 0.0)
    parts = (flat - flat[0]) * weight
    moved = along != 0.0
    size = np.maximum(np.max(np.abs(flat), axis=0) * np.abs(weight), 1.0)
    share = np.median(parts[:, moved], axis=1)
    off = np.abs(parts - share[:, None])[:, moved] / size[moved]
    still = np.abs(flat - flat[0])[:, ~moved]
    fits = np.max(off) <= ROUNDING and np.max(still, initial=0.0) <= ROUNDING * np.max(np.abs(flat))
    return bool(fits and np.min(share) >= -ROUNDING and np.max(share) <= 1.0 + ROUNDING)


def models_of(plant: PlantEnvelope, points: IntArray, found: Variants) -> LinearModel:
    """Models (W * P,) of every variant at flat indices `points` (P,), the points varying fastest."""
    if not found.parameters:
        return plant.model.take(np.unravel_index(points, plant.outcomes.ok.shape))
    rows, each = len(found.factors), len(points)
    return perturbed_model(plant, np.tile(points, rows), found.parameters, np.repeat(found.factors, each, axis=0))
