"""Both kinds of loop around the six-state plant: lag states in their place, torques and feed-forward right."""

from dataclasses import replace

import numpy as np
import pytest

from design.classical.controller import ClassicalController
from design.classical.normal_form import NormalForm
from design.classical.steering import StepReference
from design.classical.synthesis import design_classical, gain_values
from design.classical.tab_drive import tab_drive
from design.classical.tab_loop import tab_loop
from design.gains import Gain
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import lqr_loop
from design.lqr.tracking import augment_with_integral, feed_forward, steady_state
from design.lqr.weights import BrysonWeights, ExplicitWeights, WeightsRefused, weight_matrices
from design.outcome import Outcomes
from design.response.step_response import step_response
from design.specs import Spec
from model.motion import required_torque

STATES = ("dt", "dt_rate", "da", "da_rate", "int_a", "lag_1", "lag_2")
BRYSON = BrysonWeights(
    aileron=0.035, aileron_rate=3.5, tab=0.17, tab_rate=7.0, aileron_integral=0.0017, tab_torque=0.5, aileron_torque=2.0
)
CONTROLLERS = {
    "nf": ClassicalController("nf", "negative_feedback", rate_filter=600.0),
    "nf_measured": ClassicalController("nf", "negative_feedback"),
    "pf": ClassicalController("pf", "positive_feedback"),
}
NAMES = {"negative_feedback": ("K_d", "K_p", "K_i"), "positive_feedback": ("K_f", "K_i")}
GAINS = {"K_d": 0.02, "K_p": 0.6, "K_i": 30.0, "K_f": 0.4}


@pytest.fixture(scope="module")
def lqr(unsteady_a):
    return design_lqr(unsteady_a.model, LqrController("lqr", BRYSON))


def _tab_loop(plant, actuator, controller):
    gains = {name: np.full(plant.grid.shape, GAINS[name]) for name in NAMES[controller.kind]}
    return tab_loop(plant.model, plant.servo, actuator, controller, gains)


def test_integral_stands_before_the_lags(unsteady_a):
    plant = augment_with_integral(unsteady_a.model)
    assert plant.states == STATES
    model = unsteady_a.model
    i = (1, 2)
    own = [STATES.index(name) for name in model.states]
    np.testing.assert_array_equal(plant.A[i][np.ix_(own, own)], model.A[i])
    np.testing.assert_array_equal(plant.B[i][own], model.B[i])
    np.testing.assert_array_equal(plant.A[i][4], [0, 0, -1, 0, 0, 0, 0])
    np.testing.assert_array_equal(plant.A[i][:, 4], 0.0)
    np.testing.assert_array_equal(plant.E[i][:, 0], [0, 0, 0, 0, 1, 0, 0])


def test_bryson_does_not_weigh_the_lags():
    weights = weight_matrices(BRYSON, STATES)
    np.testing.assert_array_equal(weights.Q[:5, :5], weight_matrices(BRYSON).Q)
    np.testing.assert_array_equal(weights.Q[5:], 0.0)
    np.testing.assert_array_equal(weights.Q[:, 5:], 0.0)


def test_explicit_weights_are_over_all_seven_states_or_leave_the_lags_out(unsteady_a):
    with pytest.raises(WeightsRefused, match=r"expected .*\(7, 7\).*"):
        design_lqr(unsteady_a.model, LqrController("lqr", ExplicitWeights(np.eye(6), np.eye(2))))
    few = np.diag([1.0, 1e-4, 10.0, 1e-3, 1e4])
    small = design_lqr(unsteady_a.model, LqrController("lqr", ExplicitWeights(few, np.eye(2))))
    padded = design_lqr(
        unsteady_a.model, LqrController("lqr", ExplicitWeights(np.diag([*np.diag(few), 0.0, 0.0]), np.eye(2)))
    )
    np.testing.assert_allclose(small.K, padded.K, rtol=1e-12)
    Q = np.diag([1.0, 1e-4, 10.0, 1e-3, 1e4, 0.5, 0.5])
    design = design_lqr(unsteady_a.model, LqrController("lqr", ExplicitWeights(Q, np.diag([4.0, 0.25]))))
    assert design.outcomes.ok.all()


def test_lqr_is_the_one_that_scipy_finds(unsteady_a, lqr):
    from scipy.linalg import solve_continuous_are

    assert lqr.outcomes.ok.all()
    assert lqr.K.shape == (*unsteady_a.grid.shape, 2, 7)
    plant, weights = augment_with_integral(unsteady_a.model), weight_matrices(BRYSON, STATES)
    for index in np.ndindex(unsteady_a.grid.shape):
        A, B = plant.A[index], plant.B[index]
        X = solve_continuous_are(A, B, weights.Q, weights.R, balanced=True)
        expected = np.linalg.solve(weights.R, B.T @ X)
        np.testing.assert_allclose(lqr.K[index], expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())
    assert np.all(lqr.largest_real_part < 0)
    assert np.all(lqr.return_difference_min >= 1 - 1e-6)


def test_feed_forward_meets_the_reference_with_the_integral_at_zero(unsteady_a, lqr):
    plant, rest = augment_with_integral(unsteady_a.model), steady_state(unsteady_a.model)
    closed = plant.A - plant.B @ lqr.K
    np.testing.assert_array_equal(feed_forward(lqr.K, rest), lqr.N)
    state = np.linalg.solve(closed, -(plant.E + plant.B @ lqr.N))[..., 0]
    np.testing.assert_allclose(state[..., 2], 1.0, rtol=1e-9)
    np.testing.assert_allclose(state[..., [1, 3, 4]], 0.0, atol=1e-9)
    # Both lags have settled at what the resting surfaces are worth to the circulation.
    tab, aileron = unsteady_a.system.circulatory_angles
    worth = tab * state[..., 0] + aileron * state[..., 2]
    np.testing.assert_allclose(state[..., 5], worth, rtol=1e-9)
    np.testing.assert_allclose(state[..., 6], worth, rtol=1e-9)
    torque = (-lqr.K @ state[..., None] + lqr.N)[..., 0]
    np.testing.assert_allclose(torque[..., 1], 0.0, atol=1e-9)
    # The static hinge moments are the quasi-steady ones, so the tab's rest angle is that of the plain model.
    np.testing.assert_allclose(state[..., 0], 1.0 / unsteady_a.servo.dc_gain, rtol=1e-9)


def test_lqr_loop_offsets_belong_to_their_states(unsteady_a, lqr):
    loop = lqr_loop(unsteady_a.model, lqr)
    assert loop.states == STATES
    model = unsteady_a.model
    shifted = replace(model, state_offset=np.broadcast_to(np.arange(1.0, 7.0), model.state_offset.shape))
    offset = lqr_loop(shifted, lqr).offset
    np.testing.assert_array_equal(offset[0, 0, :4], [3.0, 1.0, 4.0, 2.0])


@pytest.mark.parametrize("controller", CONTROLLERS.values(), ids=CONTROLLERS)
def test_normal_form_has_the_poles_of_the_tab_loop(unsteady_a, tab_actuator, controller):
    form = NormalForm.of(unsteady_a.servo, tab_drive(tab_actuator, "deflection"), controller)
    kappa = np.random.default_rng(4).uniform(0.1, 0.7, (*unsteady_a.grid.shape, form.numerators.shape[-2]))
    names = NAMES[controller.kind]
    gains = tuple(Gain(n, "", v) for n, v in zip(names, np.moveaxis(form.gains(kappa), -1, 0), strict=True))
    loop = tab_loop(unsteady_a.model, unsteady_a.servo, tab_actuator, controller, gain_values(gains))
    polynomial = form.denominator + np.einsum("...j,...jn->...n", kappa, form.numerators)
    assert loop.closed.shape[-1] == polynomial.shape[-1] - 1
    for index in np.ndindex(unsteady_a.grid.shape):
        expected = np.sort_complex(np.linalg.eigvals(loop.closed[index]))
        ours = np.sort_complex(np.roots(polynomial[index]) * form.frequency[index])
        np.testing.assert_allclose(ours, expected, rtol=1e-6)


@pytest.mark.parametrize("controller", CONTROLLERS.values(), ids=CONTROLLERS)
def test_stages_close_one_by_one_to_the_loop_that_is_flown(unsteady_a, tab_actuator, controller):
    loop = _tab_loop(unsteady_a, tab_actuator, controller)
    filtered = ("da_filtered",) if controller.rate_filter else ()
    assert loop.states == ("dt", "dt_rate", "da", "da_rate", "int_a", *filtered, "lag_1", "lag_2")
    np.testing.assert_allclose(loop.stages[-1].closed(), loop.closed, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(loop.cut("tab").closed(), loop.closed, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("controller", [CONTROLLERS["nf"], CONTROLLERS["pf"]], ids=["nf", "pf"])
def test_tab_torque_obeys_the_equations_of_motion(unsteady_a, tab_actuator, controller):
    """Inverse dynamics of the non-linear equations, lags included, along the linear response."""
    plant, size, k = unsteady_a, 1e-6, 17
    loop = _tab_loop(plant, tab_actuator, controller)
    response = step_response(loop, np.array([size]), 0.4, 41)
    x = response.states
    xdot = np.einsum("...ij,...tj->...ti", loop.closed, x) + loop.reference_input[..., None, :, 0] * size
    own = [loop.states.index(name) for name in plant.model.states]
    state = plant.model.state_offset + x[..., k, own]
    acceleration = np.stack([xdot[..., k, 1], xdot[..., k, 3]], axis=-1)
    needed = required_torque(plant.system, plant.condition, plant.trim.alpha, state, acceleration)[..., 0]
    still = plant.trim.torque[..., 0]
    ours = response.outputs[..., k, loop.outputs.index("T_t")]
    np.testing.assert_allclose(ours - still, needed - still, rtol=1e-4)
    settled = required_torque(plant.system, plant.condition, plant.trim.alpha, state[..., :4], acceleration)[..., 0]
    assert np.all(np.abs(settled - needed) > 1e-3 * np.abs(needed - still))


def _step(plant):
    """A step of 10 degrees, followed for a second."""
    return StepReference(np.deg2rad(10.0), 1.0, plant.trim.state[..., 0])


def test_classical_design_meets_its_specs_on_the_flown_loop(unsteady_a, tab_actuator):
    from design.assess import achieved, assess

    specs = (Spec("damping_ratio", "min", 0.5), Spec("gain_margin", "min", 6.0), Spec("phase_margin", "min", np.pi / 4))
    request = ClassicalController("nf", "negative_feedback", specs, 600.0)
    found = design_classical(
        unsteady_a.servo, tab_actuator, request, _step(unsteady_a), Outcomes.all_ok(unsteady_a.grid.shape)
    )
    assert found.outcomes.ok.all()
    loop = tab_loop(unsteady_a.model, unsteady_a.servo, tab_actuator, request, gain_values(found.gains))
    found = assess(loop, np.array([0.1]), 1.0)
    for spec in specs:
        assert np.all(spec.met(achieved(found, spec.quantity)))


@pytest.mark.parametrize("index", [(0, 3), (1, 0)])
def test_brute_force_finds_nothing_faster(unsteady_a, tab_actuator, index):
    """Positive feedback, damping 0.4: all pairs of gains on a mesh, from the transfer function alone."""
    servo, w, z = unsteady_a.servo, tab_actuator.servo_bandwidth, tab_actuator.servo_damping_ratio
    request = replace(CONTROLLERS["pf"], specs=(Spec("damping_ratio", "min", 0.4),))
    ok = Outcomes.all_ok(unsteady_a.grid.shape)
    design = design_classical(servo, tab_actuator, request, _step(unsteady_a), ok)
    assert design.outcomes.ok.all()
    K_f, K_i = (g.values[index] for g in design.gains)
    omega = np.geomspace(0.5, 200.0, 1500)
    top, bottom = -(w**2) * servo.numerator[index], np.polymul([1.0, 2.0 * z * w, w**2], servo.denominator[index])

    def bandwidth(k_f, k_i):
        closed = np.polyadd(np.polymul([1.0, 0.0], bottom), np.polymul(top, [-k_f, k_i]))
        poles = np.roots(closed)
        if np.min(-poles.real / np.abs(poles)) < 0.4:
            return 0.0
        size = np.abs(np.polyval(top * k_i, 1j * omega) / np.polyval(closed, 1j * omega))
        return omega[np.argmax(size < np.sqrt(0.5))]

    chosen = bandwidth(K_f, K_i)
    mesh = np.array([bandwidth(f, i) for f in np.linspace(0.0, 0.8, 33) for i in K_i * np.geomspace(0.2, 5.0, 33)])
    assert np.count_nonzero(mesh) > 100
    assert 0.9 < np.max(mesh) / chosen < 1.02


def test_batched_equals_single(unsteady_a, tab_actuator, lqr):
    index = (1, 2)
    plant = unsteady_a
    controller = CONTROLLERS["nf"]
    loop = _tab_loop(plant, tab_actuator, controller)
    gains = {name: np.array(GAINS[name]) for name in NAMES[controller.kind]}
    single = tab_loop(plant.model.take(index), plant.servo.take(index), tab_actuator, controller, gains)
    for name in ("A", "B", "E", "K", "C", "F", "D", "offset"):
        np.testing.assert_allclose(getattr(single, name), getattr(loop.take(index), name), rtol=1e-12)
    alone = design_lqr(plant.model.take(index), LqrController("lqr", BRYSON))
    np.testing.assert_allclose(alone.K, lqr.K[index], rtol=1e-9)
    np.testing.assert_allclose(alone.N, lqr.N[index], rtol=1e-9)
