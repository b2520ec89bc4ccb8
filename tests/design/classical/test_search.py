"""The quick search against the thorough one, over plants, drives and specs drawn at random, and against brute force."""

import numpy as np
import pytest

from design.classical.found import Found, closer_look, taken
from design.classical.gain_search import fastest, quick
from design.classical.problem import Problem
from design.classical.thorough_search import every_start, thorough, tightened
from tests.design.classical.random_loops import POINTS, drawn_family

SEEDS = range(24)


@pytest.fixture(autouse=True)
def _as_in_the_search():
    with np.errstate(all="ignore"):
        yield


def _problem(seed):
    family, controller, reference = drawn_family(seed)
    return family, reference, tuple(spec.take(slice(None)) for spec in controller.specs)


@pytest.fixture(scope="module")
def both():
    """What the quick search is sure of, and what the thorough one finds, at every point of every draw."""
    found = {}
    with np.errstate(all="ignore"):
        for seed in SEEDS:
            problem = _problem(seed)
            first, sure = quick(*problem)
            at = np.flatnonzero(sure)
            met, edge = closer_look(*taken(*problem, at), first.z[at]) if at.size else (sure[at], sure[at])
            sure[at] = met & ~edge
            found[seed] = first, sure, thorough(*problem, first)
    return found


def test_where_the_quick_search_is_sure_the_thorough_one_finds_no_more(both):
    sure = 0
    for first, certain, second in both.values():
        assert np.all(second.met[certain])
        assert np.all(first.aim[certain] > second.aim[certain] + np.log(0.98))
        sure += np.count_nonzero(certain)
    assert sure > 0.2 * len(SEEDS) * POINTS


def test_brute_force_finds_nothing_faster_and_nothing_where_there_is_nothing(both):
    """Two thousand candidates a point, near and far, of which the feasible are looked at closely."""
    worst = 0.0
    for seed in list(SEEDS)[::4]:
        family, reference, specs = problem = _problem(seed)
        rng, (_, _, best) = np.random.default_rng(seed), both[seed]
        for p in range(POINTS):
            at = np.full(2000, p)
            spread = np.where(np.arange(2000) < 1000, 0.2, 1.5)[:, None]
            z = best.z[at] * np.exp(spread * rng.standard_normal((2000, best.z.shape[1])))
            judged = Problem.of(family, reference, specs, in_hand=0.0).take(at).judge(z).values
            met = np.flatnonzero(judged.stable & (judged.miss <= 0.0))
            if met.size:
                really, _ = closer_look(*taken(*problem, at[met]), z[met])
                met = met[really]
            assert best.met[p] or not met.size
            if met.size:
                worst = max(worst, float(np.max(judged.aim[met]) - best.aim[p]))
    assert worst < np.log(1.02)


def test_specs_tightened_by_what_is_found_can_be_met_and_by_more_cannot():
    for seed in (1, 2, 5):
        family, reference, specs = problem = _problem(seed)
        found = tightened(*problem, (True,) * len(specs), every_start(family))
        assert found.met.all()
        for more, possible in ((-0.005, True), (0.03, False)):
            stricter = tuple(spec.tightened(found.aim + more) for spec in specs)
            assert np.mean(fastest(family, reference, stricter).met == possible) > 0.8


def test_a_point_does_not_know_of_the_others(both):
    for seed in (0, 3):
        problem = _problem(seed)
        whole = fastest(*problem)
        for p in (0, POINTS - 1):
            one: Found = fastest(*taken(*problem, np.array([p])))
            assert one.met[0] == whole.met[p]
            np.testing.assert_allclose(one.aim[0], whole.aim[p], rtol=1e-6)
