"""The programme on a mesh and its proof: exact against another solver, and bounds that add up interval by interval."""

import numpy as np
import pytest
from scipy.optimize import linprog

from design.worst_case.channels import channels
from design.worst_case.kernel import samples_of
from design.worst_case.programme import Bounded, reach
from design.worst_case.refine import CLOSE, passes
from tests.design.worst_case.any_loops import random_system


def samples(seed, n=5):
    seen = channels(random_system(seed, 1, n).take(0), ("da", "dt", "T_a"))
    return samples_of(seen.A, seen.B[:, 0], seen.C), seen.D[:, 0]


@pytest.mark.parametrize("travel_time", [1e-4, 3e-3, 0.05, 2.0])
def test_dynamic_programming_solves_the_programme_on_its_mesh(travel_time):
    for seed in range(3):
        some, direct = samples(seed)
        problem = Bounded.on(some, direct + some.value[:, 0, 0], np.full(3, travel_time), some.nodes)
        found = reach(problem)
        assert np.all(np.abs(found.rho) <= 1.0)
        assert np.all(np.abs(np.diff(found.rho)) <= problem.travel + 1e-11)
        for o in range(3):
            k = problem.mean.shape[-1]
            D = np.diff(np.eye(k + 1), axis=0)
            cost = problem.mean[o] @ D
            cost[0] += problem.start[o]
            limit = np.concatenate([problem.travel[o], problem.travel[o]])
            solved = linprog(-cost, np.concatenate([D, -D]), limit, bounds=(-1.0, 1.0), method="highs")
            np.testing.assert_allclose(found.value[o], -solved.fun, rtol=1e-6)


@pytest.mark.parametrize("travel_time", [1e-5, 1e-3, 0.02, 0.3, 10.0])
def test_the_bounds_differ_by_what_the_intervals_say_and_close(travel_time):
    for seed in range(8):
        some, direct = samples(seed, 3 + seed % 4)
        last = {}
        for each in passes(some, direct, np.full(3, travel_time)):
            reached, proved = each.reached.value, each.proved.value
            ends = np.abs(each.proved.last) * 2.0 + 1e-12 * proved  # u stops short of zero by this
            assert np.all(np.abs(proved - reached - each.proved.gap.sum(axis=-1)) <= ends)
            assert np.all(each.proved.gap >= -1e-9 * proved[:, None])  # every interval's part is a proof of its own
            last |= dict(zip(each.row, (proved - reached) / proved, strict=True))
        assert max(last.values()) < 10.0 * CLOSE
