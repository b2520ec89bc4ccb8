"""Designs of many weights at many points at once: gains, loops, and what a search sees of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.loop import Loop
from design.lqr.cost import Cost
from design.lqr.flown import flown_loop
from design.lqr.hamiltonian import stabilising_candidate
from design.lqr.regulator import finite, regulator_problem
from design.lqr.tracking import SteadyState, TrackingPlant, feed_forward
from design.lqr.weight_figures import HIGHEST, Columns, WeightFigures
from design.lqr.weight_request import WEIGHED, WeightSearch
from model.arrays import FloatArray, IntArray
from model.linear_model import INPUTS, LinearModel

#: Candidates judged together; bounds the memory.
TOGETHER = 128


@dataclass(frozen=True, eq=False)
class Candidates:
    """What is designed and judged.

    Attributes
    ----------
    search : what is asked for
    model, plant, rest : (P) points
    cost : of the weights to start from
    """

    search: WeightSearch
    model: LinearModel
    plant: TrackingPlant
    rest: SteadyState
    cost: Cost

    @cached_property
    def columns(self) -> Columns:
        """Which number is which."""
        return Columns.of(self.search)

    def cost_of(self, z: FloatArray) -> Cost:
        """The cost (M) of weights whose largest acceptable values are ``exp(z)`` (M, J) times those of the start."""
        x, u = np.ones((len(z), len(self.plant.states))), np.ones((len(z), len(INPUTS)))
        for name, log in zip(self.search.searched, z.T, strict=True):
            what = WEIGHED[name]
            factors, place = (u, INPUTS) if what in INPUTS else (x, self.plant.states)
            factors[:, place.index(what)] = np.exp(-log)
        return self.cost.scaled(x, u)

    def gains(self, z: FloatArray, points: IntArray) -> FloatArray:
        """Gains (M, 2, n) of weights z (M, J) at the points of these numbers (M,), nan where there are none.

        Of the Hamiltonian's stable subspace, without the certificate that takes four times as long where weights are
        many decades apart: these gains are searched with, and those that are found are solved for again.
        """
        plant, cost = self.plant.take(points), self.cost_of(z)
        with np.errstate(all="ignore"):
            problem = regulator_problem(plant.A, plant.B, cost.Q, cost.R)
            X = stabilising_candidate(problem.equation)
            K = problem.S @ problem.equation.gain_in_states(problem.equation.F.mT @ X)
        return np.asarray(np.where(problem.posed[:, None, None], K, np.nan))

    def loop(self, K: FloatArray, points: IntArray) -> Loop:
        """The loops (M) of gains (M, 2, n)."""
        N = feed_forward(K, self.rest.take(points))
        return flown_loop(self.model.take(points), self.plant.structure, K, N)

    def numbers(self, z: FloatArray, points: IntArray, limits: FloatArray) -> FloatArray:
        """What the search sees (M, F); `HIGHEST` throughout where there is no stable loop.

        Parameters
        ----------
        z : (M, J) logarithms of the largest acceptable values over those of the start; or (M, J + 1), then by that of
            the time by which the aileron is to have settled, over its limit
        points : (M,) numbers of the points
        limits : (M, s) of the specs
        """
        settling, weights = self.search.settling, len(self.search.searched)
        by = np.ones(len(z)) if settling is None else limits[:, settling]
        if z.shape[-1] > weights:
            by = by * np.exp(z[:, weights])
        numbers = np.full((len(z), self.columns.group.size), HIGHEST)
        for first in range(0, len(z), TOGETHER):
            part = np.arange(first, min(first + TOGETHER, len(z)))
            K = self.gains(z[part, :weights], points[part])
            known = finite(K)
            if known.any():
                part = part[known]
                figures = WeightFigures.of(self.search, self.loop(K[known], points[part]))
                numbers[part] = figures.numbers(limits[part], by[part])
        return numbers
