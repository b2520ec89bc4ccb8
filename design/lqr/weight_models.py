"""Quadratic models of numbers about a place, made of differences, and the best step of the problem that they pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from design.classical.quadratic_step import quadratic_step
from model.arrays import FloatArray, GridArrays, IntArray

#: Numbers (M, F) of unknowns (M, n) in the searches of these numbers (M,).
Judge = Callable[[FloatArray, IntArray], FloatArray]

#: What a number is in a search.
NOTHING, WALL, AIM = 0, 1, 2

#: Price of a miss, in units of the aim.
PRICE = 5.0
#: Largest push of the walls that is believed.
HIGHEST_PUSH = 50.0
#: Step of the differences: a part of the reach, between these.
_PART_OF_REACH, _FINEST, _COARSEST = 0.15, 2e-3, 0.05
#: Least bending of the aim, so that what is flat moves no further than it must; that of how far the aim falls; and
#: the largest bending of a number that is believed.
_LEAST_BEND, _BEND_OF_AIM, _MOST_BEND = 0.03, 1e-3, 30.0
#: So many of the highest walls and aims are looked at; what is no wall is as low as that.
_LOOKED_AT, _NOWHERE = 20, -1e3
#: How far the aim may fall in one step.
_FALL = 1e2
#: Flat problems by which that of the models is solved.
_INNER = 3


@dataclass(frozen=True, eq=False)
class Place(GridArrays):
    """Where each of K searches is.

    Attributes
    ----------
    z : (K, n)
    numbers : (K, F) there
    aim, miss : (K,) largest aim, and largest wall, at least 0
    """

    z: FloatArray
    numbers: FloatArray
    aim: FloatArray
    miss: FloatArray

    @classmethod
    def of(cls, z: FloatArray, numbers: FloatArray, role: IntArray) -> Place:
        """The places z (..., n) with their numbers (..., F) in these roles (..., F)."""
        return cls(z, numbers, aim_of(numbers, role), miss_of(numbers, role))

    def ranked(self, price: FloatArray | float = PRICE) -> FloatArray:
        """Aim and the price of the miss (...): the less the better."""
        return np.asarray(self.aim + price * self.miss)


def aim_of(numbers: FloatArray, role: IntArray) -> FloatArray:
    """Largest aim of numbers (..., F)."""
    return np.asarray(np.where(role == AIM, numbers, -np.inf).max(axis=-1))


def miss_of(numbers: FloatArray, role: IntArray) -> FloatArray:
    """Largest wall of numbers (..., F), at least 0."""
    return np.asarray(np.where(role == WALL, numbers, 0.0).max(axis=-1, initial=0.0))


@dataclass(frozen=True, eq=False)
class Models:
    """Quadratic models of the numbers of K searches about their places.

    Attributes
    ----------
    value (K, F), slope (K, F, n), bend (K, F, n, n)
    """

    value: FloatArray
    slope: FloatArray
    bend: FloatArray

    def columns(self, columns: IntArray) -> Models:
        """Some of the numbers of each search, by their places (K, f)."""
        slope = np.take_along_axis(self.slope, columns[..., None], axis=1)
        bend = np.take_along_axis(self.bend, columns[..., None, None], axis=1)
        return Models(np.take_along_axis(self.value, columns, axis=1), slope, bend)

    def repeated(self, count: int) -> Models:
        """Each search so many times."""
        return Models(*(np.repeat(each, count, axis=0) for each in (self.value, self.slope, self.bend)))

    def raised(self, by: FloatArray) -> Models:
        """All values differ by these (K, F)."""
        return Models(self.value + by, self.slope, self.bend)

    def at(self, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (K, F) and slopes (K, F, n) after steps v (K, n)."""
        bent = (self.bend * v[:, None, None, :]).sum(axis=-1)
        return self.value + ((self.slope + 0.5 * bent) * v[:, None, :]).sum(axis=-1), self.slope + bent


@dataclass(frozen=True, eq=False)
class Stencil:
    """What the models were made of: offsets (K, O, n), and the numbers there (K, O, F)."""

    offsets: FloatArray
    numbers: FloatArray


def models_about(
    judge: Judge, place: Place, rows: IntArray, reach: FloatArray, thorough: bool
) -> tuple[Models, Stencil]:
    """Models about the places of searches.

    Parameters
    ----------
    judge : numbers of unknowns
    place : of K searches
    rows : (K,) numbers of the searches
    reach : (K,) how far their steps reach
    thorough : whether the models know how two unknowns bend a number together
    """
    (k, n), f = place.z.shape, place.numbers.shape[1]
    one, (i, j) = np.eye(n), np.triu_indices(n if thorough else 0, 1)
    stencil = np.concatenate([one, -one, one[i] + one[j]])
    h = np.clip(_PART_OF_REACH * reach, _FINEST, _COARSEST)[:, None, None]
    z = place.z[:, None, :] + h * stencil
    numbers = judge(z.reshape(-1, n), np.repeat(rows, len(stencil))).reshape(k, -1, f)
    here, up, down, both = place.numbers[:, None], numbers[:, :n], numbers[:, n : 2 * n], numbers[:, 2 * n :]
    bend = np.zeros((k, f, n, n))
    bend[:, :, range(n), range(n)] = np.moveaxis((up - 2.0 * here + down) / h**2, 1, -1)
    bend[:, :, i, j] = bend[:, :, j, i] = np.moveaxis((both - up[:, i] - up[:, j] + here) / h**2, 1, -1)
    slope = np.moveaxis((up - down) / (2.0 * h), 1, -1)
    models = Models(place.numbers, slope, np.clip(bend, -_MOST_BEND, _MOST_BEND))
    return models, Stencil(h * stencil, numbers)


@dataclass(frozen=True, eq=False)
class ModelStep:
    """Best steps of models.

    Attributes
    ----------
    v : (K, n)
    push : (K, F) of walls and aims
    promised : (K,) aim and price of the miss after it
    """

    v: FloatArray
    push: FloatArray
    promised: FloatArray


def best_step(models: Models, role: IntArray, push: FloatArray, low: FloatArray, high: FloatArray) -> ModelStep:
    """Step to the least largest aim of the models with no wall above 0, or with as little as can be.

    Each pass takes walls and aims as flat where the step has come to, and the aim as bent as all of them are that push.

    Parameters
    ----------
    models : of K searches
    role : (K, F)
    push : (K, F) guess of the pushes; zero where there is none
    low, high : (K, n) box of the step, ``low <= 0 <= high``
    """
    top = aim_of(models.value, role)
    height = np.where(role == AIM, models.value - top[:, None], np.where(role == WALL, models.value, -np.inf))
    # Each search looks at as many numbers, whichever searches are solved with it.
    kept = np.argsort(-height, axis=1, kind="stable")[:, :_LOOKED_AT]
    whole, models = push, models.columns(kept)
    role, push = np.take_along_axis(role, kept, axis=1), np.take_along_axis(push, kept, axis=1)
    (k, f), n = role.shape, low.shape[1]
    aims, absent = role == AIM, role == NOTHING
    first = (aims & (models.value >= top[:, None])).astype(float)
    unknown = ~np.any(aims & (push > 0.0), axis=-1)
    push = np.where(unknown[:, None], first / np.maximum(first.sum(axis=-1, keepdims=True), 1.0), push)
    guess = np.concatenate([push > 0.0, np.zeros((k, 2 * n + 2), dtype=bool)], axis=1)
    v, falls = np.zeros((k, n)), np.full((k, 1), _FALL)
    slope, bend = np.zeros((k, n + 1)), np.zeros((k, n + 1, n + 1))
    slope[:, n], bend[:, n, n] = -1.0, _BEND_OF_AIM
    for _ in range(_INNER):
        value, steep = models.at(v)
        size, way = np.linalg.eigh((push[..., None, None] * models.bend).sum(axis=1))
        bend[:, :n, :n] = (way * np.maximum(size, _LEAST_BEND)[:, None]) @ way.mT
        gradient = np.zeros((k, f, n + 1))
        gradient[..., :n], gradient[..., n] = np.where(absent[..., None], 0.0, steep), -aims.astype(float)
        walls = np.where(absent, _NOWHERE, np.where(aims, value - top[:, None], value))
        box = np.concatenate([low - v, -falls], axis=1), np.concatenate([high - v, falls], axis=1)
        step = quadratic_step(slope, bend, walls, gradient, *box, guess)
        v = np.clip(v + step.v[:, :n], low, high)
        push, guess = step.push * _believed(step.push), step.pushing
    pushes = np.zeros_like(whole)
    np.put_along_axis(pushes, kept, push, axis=1)
    value, _ = models.at(v)
    return ModelStep(v, pushes, aim_of(value, role) + PRICE * miss_of(value, role))


def _believed(push: FloatArray) -> FloatArray:
    """Factors (K, 1) that keep pushes at the highest; where walls leave no room they say nothing about the bending."""
    return np.asarray(np.minimum(1.0, HIGHEST_PUSH / np.maximum(push.sum(axis=-1, keepdims=True), 1e-9)))
