from dataclasses import replace

import numpy as np
import pytest

from design.lqr.flown import flown_loop
from design.lqr.power_figures import power_figures
from design.lqr.structures import Structure
from design.lqr.tracking import feed_forward, steady_state
from design.lqr.weight_search import search_weights
from design.lqr.weight_tradeoff import front_of, trade_off
from design.outcome import Outcome
from design.specs import Spec
from tests.design.lqr.weight_cases import MODEL, exact, met, request, scattered, unknowns

SPECS = (
    Spec("settling_time", "max", 0.2),
    Spec("overshoot", "max", 0.05),
    Spec("damping_ratio", "min", 0.5),
    Spec("tab_torque", "max", 0.3),
    Spec("aileron_torque", "max", 8.0),
)
TWO = MODEL.take((0, slice(0, 2)))


@pytest.fixture(scope="module")
def front():
    return trade_off(TWO, request(SPECS), count=4)


def test_a_front_is_strictly_monotone_and_meets_all_other_specs(front):
    assert front.outcomes.ok.all()
    search = front.search
    for p in range(2):
        kept = np.isfinite(front.settling_time[p])
        assert kept.sum() >= 3
        assert not kept[kept.sum() :].any()
        time, torque = front.settling_time[p, kept], front.aileron_torque[p, kept]
        assert (np.diff(time) > 0.0).all()
        assert (np.diff(torque) < 0.0).all()
        assert (time <= front.limit[p, kept] + 1e-9).all()
        values, least = exact(TWO.take(slice(p, p + 1)), search, unknowns(search, front.maxima[p, kept]))
        assert met(search, values).all()
        np.testing.assert_allclose(values[:, 0], time, rtol=1e-6)
        np.testing.assert_allclose(least, torque, rtol=1e-6)


def test_the_gains_of_a_front_are_those_of_its_weights(front):
    K, model = front.K[0, :1], TWO.take(slice(0, 1))
    loop = flown_loop(model, Structure(), K, feed_forward(K, steady_state(model)))
    figures = power_figures(loop, front.search.step)
    np.testing.assert_allclose(figures.settling_time, front.settling_time[0, 0], rtol=1e-6)


def test_each_place_is_the_search_for_its_limit(front):
    """An independent search for one of the limits, from all starts, does not do better by more than 5 %."""
    kept = int(np.isfinite(front.settling_time[1]).sum())
    for k in (0, kept - 1):
        specs = (replace(SPECS[0], limit=float(front.limit[1, k])), *SPECS[1:])
        alone = search_weights(TWO.take(slice(1, 2)), request(specs, minimised="peak_aileron_torque"))
        if alone.outcomes.ok[0]:
            assert front.aileron_torque[1, k] < 1.05 * alone.minimised[0]


def test_random_weights_are_behind_the_front(front):
    search, kept = front.search, np.isfinite(front.settling_time[0])
    time, torque = front.settling_time[0, kept], front.aileron_torque[0, kept]
    limit = front.limit[0, kept]
    random, about = np.random.default_rng(4), unknowns(search, front.maxima[0, kept])
    z = np.concatenate([scattered(random, 300), *(scattered(random, 100, about=a, spread=0.3) for a in about)])
    values, least = exact(TWO.take(slice(0, 1)), search, z)
    good = met(search, values)
    for t, T in zip(values[good, 0], least[good], strict=True):
        assert t > 0.95 * time[0]
        # The search for the next limit that this one meets too, or one for a faster place, found no more.
        nearest = np.argmin(np.where(limit >= t, limit, np.inf)) if (limit >= t).any() else -1
        assert 0.95 * torque[nearest] < T


def test_a_point_alone_is_the_point_on_its_grid(front):
    alone = trade_off(TWO.take(1), request(SPECS), count=4)
    np.testing.assert_array_equal(alone.maxima, front.maxima[1])
    np.testing.assert_array_equal(alone.K, front.K[1])
    np.testing.assert_allclose(alone.aileron_torque, front.aileron_torque[1], rtol=1e-9)


def test_points_out_of_reach_and_limits_out_of_reach():
    impossible = (SPECS[0], Spec("aileron_torque", "max", 0.3))
    found = trade_off(TWO.take(slice(1, 2)), request(impossible), count=2)
    assert list(found.outcomes.codes) == [Outcome.INFEASIBLE]
    assert "aileron torque" in found.outcomes.reasons[0]
    assert np.isnan(found.aileron_torque).all()
    part = trade_off(TWO.take(slice(1, 2)), request(SPECS), limits=(0.001, 0.2))
    assert part.outcomes.ok.all()
    assert list(np.isfinite(part.settling_time[0])) == [True, False]
    assert part.limit[0, 0] == 0.2


@pytest.mark.parametrize("limits", [(0.1,), (0.1, 0.0), (0.1, 0.3)])
def test_limits_that_cannot_be(limits):
    with pytest.raises(ValueError, match="two or more settling times"):
        trade_off(TWO, request(SPECS), limits=limits)
    with pytest.raises(ValueError, match="settling time needs"):
        trade_off(TWO, request(SPECS[1:]))


def test_what_is_dominated_is_left_out():
    time = np.array([[0.3, 0.1, 0.2, 0.2, np.nan, 0.4]])
    torque = np.array([[1.0, 3.0, 2.0, 2.5, 0.1, 1.0]])
    order, length = front_of(time, torque)
    assert list(order[0, : length[0]]) == [1, 2, 0]
    assert sorted(order[0]) == list(range(6))
