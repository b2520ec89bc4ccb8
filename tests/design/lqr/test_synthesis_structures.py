"""Every structure: gains against python-control on a plant put together by hand, delays, and weights of all shapes."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest
import scipy.linalg

from design.delay.damping import unstable_poles
from design.delay.with_pade import without_delay
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.weights import ExplicitWeights, WeightsRefused, weight_matrices
from design.outcome import Outcome
from model.actuators import Actuator
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS, example

WEIGHTS = replace(WIND_TUNNEL_WEIGHTS, tab_integral=0.01)
REFERENCES = ("none", "aileron", "aileron_and_tab")
IDEAL, SLOW = Actuator(), Actuator(torque_loop_bandwidth=220.0)
NUMBERS = ("K", "N", "X", "residual", "largest_real_part", "return_difference_min")


def by_hand(A, B, reference, bandwidths):
    """A and B with integrals, then torque lags, behind the four states of the model."""
    integrals = {"none": [], "aileron": [2], "aileron_and_tab": [2, 0]}[reference]
    lags = [i for i, w in enumerate(bandwidths) if w is not None]
    n = 4 + len(integrals) + len(lags)
    whole, inputs = np.zeros((n, n)), np.zeros((n, 2))
    whole[:4, :4] = A
    for row, angle in enumerate(integrals, start=4):
        whole[row, angle] = -1.0
    for i in range(2):
        if i in lags:
            row = 4 + len(integrals) + lags.index(i)
            whole[:4, row], whole[row, row], inputs[row, i] = B[:, i], -bandwidths[i], bandwidths[i]
        else:
            inputs[:4, i] = B[:, i]
    return whole, inputs


@pytest.mark.parametrize("actuators", [(IDEAL, IDEAL), (SLOW, IDEAL), (SLOW, Actuator(torque_loop_bandwidth=90.0))])
@pytest.mark.parametrize("reference", REFERENCES)
def test_gains_by_python_control(reference, actuators):
    model, _ = example("wind_tunnel")
    design = design_lqr(model, LqrController("lqr", WEIGHTS, reference=reference), None, *actuators)
    assert design.outcomes.ok.all()
    bandwidths = [a.torque_loop_bandwidth for a in actuators]
    for index in [(0, 0), (1, 3)]:
        A, B = by_hand(model.A[index], model.B[index], reference, bandwidths)
        Q = np.zeros_like(A)
        k = {"none": 4, "aileron": 5, "aileron_and_tab": 6}[reference]
        largest = np.deg2rad([10.0, 400.0, 2.0, 200.0, 0.1, np.rad2deg(0.01)])[:k]
        Q[:k, :k] = np.diag(largest**-2)
        K, _, poles = ct.lqr(A, B, Q, np.diag([0.5**-2, 2.0**-2]), method="scipy")
        np.testing.assert_allclose(design.K[index], K, rtol=1e-6, atol=1e-7 * np.abs(K).max())
        assert design.largest_real_part[index] == pytest.approx(poles.real.max(), rel=1e-6)
    assert design.return_difference_min.min() >= 1.0 - 1e-6
    assert design.N.shape == (2, 4, 2, len(design.structure.references))


def test_unsteady_air_with_lagged_torques_and_two_references(unsteady_a):
    """Six states of the model, two integrals, two torques: what scipy finds, with both lags in their place."""
    model = unsteady_a.model
    design = design_lqr(model, LqrController("lqr", WEIGHTS, reference="aileron_and_tab"), None, SLOW, SLOW)
    assert design.outcomes.ok.all()
    assert design.states == (
        "dt", "dt_rate", "da", "da_rate", "int_a", "int_t", "tab_torque", "aileron_torque", "lag_1", "lag_2"
    )  # fmt: skip
    A, B, Q = np.zeros((10, 10)), np.zeros((10, 2)), np.zeros((10, 10))
    own, w = [0, 1, 2, 3, 8, 9], 220.0
    A[np.ix_(own, own)], A[4, 2], A[5, 0] = model.A[1, 2], -1.0, -1.0
    A[np.ix_(own, [6, 7])], A[6, 6], A[7, 7], B[6, 0], B[7, 1] = model.B[1, 2], -w, -w, w, w
    weights = weight_matrices(WEIGHTS, design.states[:6])
    Q[:6, :6] = weights.Q
    X = scipy.linalg.solve_continuous_are(A, B, Q, weights.R)
    K = np.linalg.solve(weights.R, B.T @ X)
    np.testing.assert_allclose(design.K[1, 2], K, rtol=1e-5, atol=1e-6 * np.abs(K).max())
    loop = lqr_loop(model, design)
    rest = np.linalg.solve(loop.closed, -loop.reference_input)
    np.testing.assert_allclose(rest[..., [2, 0], :], np.broadcast_to(np.eye(2), (2, 4, 2, 2)), atol=1e-9)
    np.testing.assert_allclose(rest[..., 4:6, :], 0.0, atol=1e-9)
    np.testing.assert_allclose(rest[..., 6:8, ::-1], -model.static_stiffness, rtol=1e-7)


def test_explicit_weights_over_the_named_states_or_over_all(unsteady_a):
    """What is left out has no weight; what is written out may have one, and then counts."""
    model, asked = unsteady_a.model, LqrController("lqr", WEIGHTS, reference="aileron_and_tab")
    Q = np.diag([30.0, 0.02, 800.0, 0.08, 3e5, 1e4])
    N = np.zeros((6, 2))
    N[3, 1] = 0.05
    R = np.diag([4.0, 0.25])
    whole_Q, whole_N = np.zeros((10, 10)), np.zeros((10, 2))
    whole_Q[:6, :6], whole_N[:6] = Q, N
    designs = [
        design_lqr(model, replace(asked, weights=ExplicitWeights(*weights)), None, SLOW, SLOW)
        for weights in ((Q, R, N), (whole_Q, R, whole_N), (whole_Q, R, N))
    ]
    assert designs[0].outcomes.ok.all()
    for other in designs[1:]:
        np.testing.assert_array_equal(other.K, designs[0].K)
    whole_Q[6, 6] = 5.0
    counted = design_lqr(model, replace(asked, weights=ExplicitWeights(whole_Q, R)), None, SLOW, SLOW)
    assert np.all(np.abs(counted.K[..., 0, 6] - designs[0].K[..., 0, 6]) > 1e-3 * np.abs(designs[0].K[..., 0, 6]))
    for size in (5, 7, 9):
        with pytest.raises(WeightsRefused, match=r"expected \(10, 10\) or \(6, 6\), .* or only dt .* int_t of the st"):
            design_lqr(model, replace(asked, weights=ExplicitWeights(np.eye(size), R)), None, SLOW, SLOW)


@pytest.mark.parametrize("name", ["aileron_integral", "tab_integral"])
def test_an_integral_without_a_weight_is_refused(name):
    model, _ = example("wind_tunnel")
    asked = LqrController("lqr", replace(WEIGHTS, **{name: None}), reference="aileron_and_tab")
    with pytest.raises(WeightsRefused, match=name):
        design_lqr(model, asked)
    assert design_lqr(model, replace(asked, reference="none")).outcomes.ok.all()


def test_a_delay_that_the_design_leaves_out_is_judged_exactly():
    """The gains are those without delay; the loop has it, and its margins lose exactly that much."""
    from design.frequency.margins import margins

    model, controller = example("wind_tunnel")
    late = Actuator(delay=0.0015)
    ideal, design = design_lqr(model, controller), design_lqr(model, controller, None, late, late)
    np.testing.assert_array_equal(design.K, ideal.K)
    assert design.outcomes.ok.all()
    loop = lqr_loop(model, design)
    assert loop.delay == (0.0015, 0.0015)
    for name in ("tab", "aileron"):
        # Only this cut's own delay, the other loop without: what is left of the margin.
        alone = replace(lqr_loop(model, ideal).cut(name), delay=0.0015)
        before, after = margins(lqr_loop(model, ideal).cut(name)), margins(alone)
        np.testing.assert_allclose(before.delay_margin - after.delay_margin, 0.0015, rtol=1e-6)


def test_a_delay_that_is_too_long_withdraws_the_gains_with_the_number_of_poles():
    """Against a Pade approximant of tenth order of python-control at every point, some stable, some not."""
    model, controller = example("wind_tunnel")
    late = Actuator(delay=0.0033)
    design = design_lqr(model, controller, None, Actuator(), late)
    ideal = lqr_loop(model, design_lqr(model, controller))
    slowed = design_lqr(model, controller, None, late, Actuator())
    assert design.outcomes.ok.any()
    for found, which in ((design, 1), (slowed, 0)):
        for index in np.ndindex(2, 4):
            A, B, K = ideal.A[index], ideal.B[index], ideal.K[index]
            drives = ct.append(
                *(ct.ss(ct.tf(*ct.pade(0.0033, 10))) if i == which else ct.ss([], [], [], [[1.0]]) for i in (0, 1))
            )
            closed = ct.feedback(ct.ss(A, B, K, 0) * drives, np.eye(2))
            unstable = int(np.sum(closed.poles().real > 0))
            assert found.outcomes.ok[index] == (unstable == 0)
            if unstable:
                assert found.outcomes.codes[index] == Outcome.NOT_CERTIFIED
                assert f"has {unstable} unstable poles; it is designed without them" in found.outcomes.reasons[index]
                assert np.isnan(found.K[index]).all()
                assert np.isnan(found.return_difference_min[index])
    assert not slowed.outcomes.ok.all()


@pytest.mark.parametrize("reference", REFERENCES)
@pytest.mark.parametrize("tab", [Actuator(delay=0.004), Actuator(torque_loop_bandwidth=220.0, delay=0.006)])
def test_a_design_that_knows_the_delay(reference, tab):
    """Poles are those that ct.lqr reaches on its own realisation of the Pade approximant: its states have no weight."""
    model, _ = example("wind_tunnel")
    aileron = Actuator(delay=0.003)
    asked = LqrController("lqr", WEIGHTS, reference=reference, delay_states=4)
    design = design_lqr(model, asked, None, tab, aileron)
    assert design.outcomes.ok.all()
    loop = lqr_loop(model, design)
    for index in [(0, 1), (1, 3)]:
        A, B = by_hand(model.A[index], model.B[index], reference, [tab.torque_loop_bandwidth, None])
        drives = ct.append(*(ct.ss(ct.tf(*ct.pade(a.delay, 4, 3))) for a in (tab, aileron)))
        series = ct.ss(A, B, np.eye(len(A)), 0) * drives
        k = len(design.structure.weighted_states())
        C = series.C[:k]
        Q = C.T @ weight_matrices(WEIGHTS, design.structure.weighted_states()).Q @ C
        _, _, poles = ct.lqr(series.A, series.B, Q, np.diag([0.5**-2, 2.0**-2]), method="scipy")
        assert design.largest_real_part[index] == pytest.approx(poles.real.max(), rel=1e-5)
        # Flown through the very approximants that it knows: these poles, and the delays' own beside them.
        chained = np.linalg.eigvals(without_delay(loop.take(index), order=4).closed)
        own = np.concatenate([np.linalg.eigvals(drives.A), poles])
        distance = np.abs(chained[:, None] - own)
        assert np.all(distance.min(axis=0) <= 1e-3 * np.abs(own))
        assert np.all(distance.min(axis=1) <= 1e-3 * np.abs(chained))
    assert np.all(unstable_poles(loop) == 0)
    # The same gains without their knowledge of what is under way are not even stable here.
    if reference == "aileron" and tab.torque_loop_bandwidth is None:
        assert not design_lqr(model, replace(asked, delay_states=0), None, tab, aileron).outcomes.ok.any()


def test_delay_states_without_a_delay_change_nothing():
    model, controller = example("wind_tunnel")
    np.testing.assert_array_equal(
        design_lqr(model, replace(controller, delay_states=5)).K, design_lqr(model, controller).K
    )


@pytest.mark.parametrize("reference", REFERENCES)
def test_grid_equals_points(reference):
    model, _ = example("wind_tunnel_23012")
    asked = LqrController("lqr", WEIGHTS, "least_torque", reference, delay_states=3)
    actuators = Actuator(torque_loop_bandwidth=220.0), Actuator(delay=0.003)
    A = model.A.copy()
    A[0, 2] = np.nan
    model = replace(model, A=A)
    grid = design_lqr(model, asked, None, *actuators)
    assert grid.outcomes.ok.sum() == 7
    for index in [(0, 0), (0, 2), (1, 3)]:
        point = design_lqr(model.take(index), asked, None, *actuators)
        assert point.outcomes.codes[()] == grid.outcomes.codes[index]
        for field in NUMBERS:
            ours = getattr(point, field)
            close = 1e-11 * np.abs(ours).max(initial=0.0) if np.isfinite(ours).all() else 0.0
            np.testing.assert_allclose(getattr(grid.take(index), field), ours, rtol=1e-9, atol=close)
