"""Power as a cross term that prices net work: what is admissible, what it lowers, and what it does not."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st

from design.lqr.cost import cost_of
from design.lqr.output_weights import OutputWeights
from design.lqr.power_comparison import power_comparison
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights, ReferenceStep, largest_price
from design.lqr.structures import Structure
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.tracking import augment_with_integral
from design.lqr.weights import ExplicitWeights, WeightsRefused, weight_matrices
from design.outcome import Outcome
from model.actuators import Actuator
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, example

STEP = ReferenceStep(np.deg2rad(10.0), 1.0)
BASE = weight_matrices(WIND_TUNNEL_WEIGHTS)
#: Largest admissible prices of Bryson's rule: the square roots of what they are between, twice.
LARGEST = 2.0 * np.sqrt(np.diag(BASE.Q)[[1, 3]] * np.diag(BASE.R))


def test_the_cross_term_is_half_the_price_between_torque_and_rate():
    model, _ = example("wind_tunnel")
    plant = augment_with_integral(model)
    cost = cost_of(NetWorkWeights(WIND_TUNNEL_WEIGHTS, 0.02, 0.2), plant)
    expected = np.zeros((5, 2))
    expected[1, 0], expected[3, 1] = 0.01, 0.1
    np.testing.assert_array_equal(cost.N, expected)
    np.testing.assert_array_equal(cost.Q, BASE.Q)
    # x'Qx + u'Ru + 2 x'Nu: what is added is the price times the power.
    x, u = np.random.default_rng(1).normal(size=5), np.array([0.4, -2.0])
    assert 2.0 * x @ cost.N @ u == pytest.approx(0.02 * u[0] * x[1] + 0.2 * u[1] * x[3])
    # An explicit cross term stays under it.
    own = np.full((5, 2), 1e-4)
    there = cost_of(NetWorkWeights(ExplicitWeights(BASE.Q, BASE.R, own), 0.02, 0.2), plant)
    np.testing.assert_allclose(there.N, expected + own, rtol=1e-14)


@pytest.mark.parametrize("i", [0, 1])
def test_prices_up_to_the_largest_are_admissible_and_no_others(i):
    """Of one actuator alone: w^2 <= 4 Q_rate R, in closed form."""
    model, _ = example("wind_tunnel")
    prices = np.zeros(2)
    prices[i] = LARGEST[i]
    assert design_lqr(model, LqrController("n", NetWorkWeights(WIND_TUNNEL_WEIGHTS, *prices))).outcomes.ok.all()
    with pytest.raises(WeightsRefused, match=r"Q - N R.-1 N' is not positive semidefinite") as refused:
        design_lqr(model, LqrController("n", NetWorkWeights(WIND_TUNNEL_WEIGHTS, *(1.1 * prices))))
    assert refused.value.matrix == "N"
    rate = np.diag(BASE.Q)[[1, 3][i]]
    assert refused.value.eigenvalue == pytest.approx(rate * (1.0 - 1.1**2), rel=1e-9)
    assert f"at most {1 / 1.1:.6g} times" in refused.value.reason


def test_a_part_of_the_largest_prices():
    """In the proportion that is given; at 1 the reduced weight loses rank, and the design still stands."""
    model, _ = example("wind_tunnel")
    plant = augment_with_integral(model)
    for part in (0.3, 1.0):
        cost = cost_of(NetWorkWeights(WIND_TUNNEL_WEIGHTS, 1.0, 40.0, part), plant)
        assert cost.N[3, 1] / cost.N[1, 0] == pytest.approx(40.0)
        binding = np.argmax([1.0 / LARGEST[0], 40.0 / LARGEST[1]])
        w = 2.0 * cost.N[[1, 3], [0, 1]]
        assert w[binding] == pytest.approx(part * LARGEST[binding], rel=1e-9)
        reduced = cost.Q - cost.N @ np.linalg.solve(cost.R, cost.N.T)
        assert np.linalg.eigvalsh(reduced)[0] >= -1e-12 * np.linalg.norm(reduced)
    assert design_lqr(model, LqrController("n", NetWorkWeights(WIND_TUNNEL_WEIGHTS, 1.0, 40.0, 1.0))).outcomes.ok.all()


def test_a_price_on_a_rate_without_a_weight_is_never_admissible():
    model, _ = example("wind_tunnel")
    Q = np.diag([30.0, 0.0, 800.0, 0.08, 3e5])
    for part in (None, 0.5):
        with pytest.raises(WeightsRefused) as refused:
            design_lqr(model, LqrController("n", NetWorkWeights(ExplicitWeights(Q, BASE.R), 1e-3, 0.0, part)))
        assert refused.value.matrix == "N"
    assert design_lqr(
        model, LqrController("n", NetWorkWeights(ExplicitWeights(Q, BASE.R), 0.0, 1e-3))
    ).outcomes.ok.all()


@given(st.integers(0, 2**32 - 1))
def test_the_largest_price_of_any_cost(seed):
    """On the edge the smallest eigenvalue vanishes, by numpy; within it is positive, beyond negative."""
    random = np.random.default_rng(seed)
    root, price = random.normal(size=(6, 6)), random.normal(size=(6, 6))
    unit = 10.0 ** random.uniform(-3, 3, 6)
    cost = root @ root.T * np.outer(unit, unit)
    price = (price + price.T) * np.outer(unit, unit)
    price[0, 0] = -abs(price[0, 0]) - 0.1 * unit[0] ** 2
    edge = largest_price(cost, price)
    for factor, sign in ((0.99, 1), (1.01, -1)):
        assert sign * np.linalg.eigvalsh((cost + factor * edge * price) / np.outer(unit, unit))[0] > 0


def test_a_dearer_price_lowers_net_work_from_any_state():
    """The work of both actuators over the whole decay, by a Lyapunov equation: never more at a higher price."""
    model, _ = example("wind_tunnel_23012")
    model = model.take((0, 2))
    plant = augment_with_integral(model)
    starts = np.random.default_rng(3).normal(size=(30, 5)) * [0.1, 5.0, 0.1, 3.0, 0.003]
    before = np.full(30, np.inf)
    for part in (1e-9, 0.2, 0.4, 0.7, 0.95):
        design = design_lqr(model, LqrController("n", NetWorkWeights(WIND_TUNNEL_WEIGHTS, 1.0, 1.0, part)))
        closed = plant.A - plant.B @ design.K
        power = np.zeros((5, 5))
        power[[1, 3]] = -0.5 * design.K
        worth = scipy.linalg.solve_continuous_lyapunov(closed.T, -(power + power.T))
        work = np.einsum("si,ij,sj->s", starts, worth, starts)
        assert np.all(work < before)
        before = work


def test_net_work_is_not_peak_power():
    """At equal settling a price on net work lowers peaks where the air is slow and raises them where it is fast.

    This is why the other form exists, and what the comparison is for.
    """
    model, controller = example("wind_tunnel")
    found = power_comparison(
        model, replace(controller, weights=NetWorkWeights(WIND_TUNNEL_WEIGHTS, 1.0, 1.0, 0.5, STEP))
    )
    assert found.outcomes.ok.all()
    before, after = found.before.figures, found.after.figures
    np.testing.assert_allclose(after.settling_time, before.settling_time, rtol=1e-5)
    assert np.all(found.total_ratio[:, :3] < 0.99)
    assert np.all(found.total_ratio[:, 3] > 1.2)


def test_prices_that_differ_in_admissibility_from_point_to_point():
    """Weights of accelerations differ over the grid, and so does what may be priced: points fail by themselves."""
    model, controller = example("wind_tunnel")
    outputs = ("dt", "da", "int_a", "da_acceleration", "dt_acceleration")
    base = OutputWeights(outputs, np.diag([30.0, 800.0, 3e5, 1e-6, 1e-8]), np.diag([4.0, 0.25]))
    plant = augment_with_integral(model)
    largest = cost_of(NetWorkWeights(base, 0.0, 1.0, 1.0), plant).N[..., 3, 1] - cost_of(base, plant).N[..., 3, 1]
    price = 2.0 * float(np.median(largest))
    design = design_lqr(model, replace(controller, weights=NetWorkWeights(base, 0.0, price)))
    allowed = price <= 2.0 * largest
    assert 0 < np.count_nonzero(allowed) < 8
    np.testing.assert_array_equal(design.outcomes.ok, allowed)
    for index in np.argwhere(~allowed):
        assert design.outcomes.codes[tuple(index)] == Outcome.INFEASIBLE
        assert "positive semidefinite" in design.outcomes.reasons[tuple(index)]
    with pytest.raises(WeightsRefused, match="at most"):
        design_lqr(model, replace(controller, weights=NetWorkWeights(base, 0.0, 10.0 * 2.0 * float(largest.max()))))


def test_the_price_is_on_the_commanded_torque():
    """Behind a lag too: a price between two states without a weight could never be admissible."""
    model, _ = example("wind_tunnel")
    lagged = Structure("aileron", Actuator(torque_loop_bandwidth=200.0))
    cost = cost_of(NetWorkWeights(WIND_TUNNEL_WEIGHTS, 0.02, 0.0), augment_with_integral(model, lagged))
    assert cost.N.shape == (6, 2)
    assert np.count_nonzero(cost.N) == 1
    assert cost.N[1, 0] == 0.01


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: NetWorkWeights(WIND_TUNNEL_WEIGHTS, -1.0, 1.0), "at least 0"),
        (lambda: NetWorkWeights(WIND_TUNNEL_WEIGHTS, 0.0, 0.0), "one of them positive"),
        (lambda: NetWorkWeights(WIND_TUNNEL_WEIGHTS, np.inf, 0.0), "at least 0"),
        (lambda: NetWorkWeights(WIND_TUNNEL_WEIGHTS, 1.0, 1.0, 1.5), "in .0, 1."),
        (lambda: PowerBalancedWeights(WIND_TUNNEL_WEIGHTS, None, None, STEP), "one of them given"),
        (lambda: PowerBalancedWeights(WIND_TUNNEL_WEIGHTS, 1.0, -2.0, STEP), "positive"),
        (lambda: ReferenceStep(0.0, 1.0), "must move the aileron"),
        (lambda: ReferenceStep(0.1, 0.0), "duration"),
    ],
)
def test_what_is_no_weighting_of_power(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_a_comparison_needs_something_to_compare():
    model, controller = example("wind_tunnel")
    for weights in (WIND_TUNNEL_WEIGHTS, NetWorkWeights(WIND_TUNNEL_WEIGHTS, 0.01, 0.01)):
        with pytest.raises(ValueError, match="a comparison needs"):
            power_comparison(model, replace(controller, weights=weights))
    balanced = PowerBalancedWeights(replace(WIND_TUNNEL_WEIGHTS, aileron_integral=None), 1.0, 20.0, STEP)
    with pytest.raises(WeightsRefused, match="a regulator follows no reference"):
        design_lqr(model, LqrController("n", balanced, reference="none"))
