"""The filter against scipy, python-control and closed forms; and what becomes of points that have none."""

from dataclasses import replace

import control as ct
import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st

from design.estimation.kalman_filter import kalman_filter
from design.estimation.noise_model import NoiseModel, StateNoise
from design.estimation.rate_filters import with_rate_filters
from design.loop import Loop
from design.outcome import Outcome, Outcomes
from tests.design.estimation.estimation_cases import (
    CASES,
    NOISE,
    double_integrators,
    full_state,
    made_loop,
    with_holes,
)

FULL_NOISE = replace(
    NOISE, states=(StateNoise("da_rate", 0.3), StateNoise("dt", 1e-6), StateNoise("da_rate", 0.2)), recovery=7.0
)


def noise_matrices(loop, noise, index):
    """A, C, Q and V of the plant at one point, written out state by state."""
    states = [name for name in loop.states if not name.startswith("int_") and "_delay_" not in name]
    rows = [loop.states.index(name) for name in states]
    A, B, G = loop.A[index][np.ix_(rows, rows)], loop.B[index][rows], loop.G[index][rows, :2]
    intensity = np.diag([noise.tab_torque, noise.aileron_torque])
    Q = G @ intensity @ G.T + noise.recovery * B @ intensity @ B.T
    for further in noise.states:
        Q[states.index(further.state), states.index(further.state)] += further.intensity
    C = np.array([[float(name == angle) for name in states] for angle in ("dt", "da")])
    return A, C, Q, np.diag([noise.tab_angle, noise.aileron_angle])


@pytest.mark.parametrize("noise", [NOISE, FULL_NOISE], ids=["torques", "all"])
@pytest.mark.parametrize("name", CASES)
def test_scipy_and_python_control_find_the_same_filter(name, noise):
    loop = full_state(name)
    found = kalman_filter(loop, noise)
    assert found.outcomes.ok.all()
    assert np.max(found.residual) < 1e-12
    for index in [(0, 0), (1, 2)]:
        A, C, Q, V = noise_matrices(loop, noise, index)
        # Neither of them scales its problem: they get milliradians, radians a second and unit noise of the sensors.
        unit = np.array([1.0 if name.endswith(("rate", "torque")) else 1e-3 for name in found.states])
        scaled = A * unit / unit[:, None], C * unit / np.sqrt(np.diag(V))[:, None], Q / np.outer(unit, unit)
        P = scipy.linalg.solve_continuous_are(scaled[0].T, scaled[1].T, scaled[2], np.eye(2))
        L, P_control, poles = ct.lqe(scaled[0], np.eye(len(A)), scaled[1], scaled[2], np.eye(2))
        ours = found.P[index] / np.outer(unit, unit)
        scale = np.sqrt(np.maximum(np.diag(P), 1e-12 * np.diag(P).max()))
        for expected in (P, P_control):
            np.testing.assert_allclose(ours / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-7)
        expected = unit[:, None] * L / np.sqrt(np.diag(V))
        np.testing.assert_allclose(found.L[index], expected, rtol=1e-7, atol=1e-9 * np.abs(expected).max())
        np.testing.assert_allclose(np.sort_complex(found.poles[index]), np.sort_complex(poles), rtol=1e-7)
        assert found.poles[index].real.max() < 0


def test_double_integrators_in_closed_form():
    """``x'' = w``, ``y = x + n``: the gain is ``[sqrt(2) a, a^2]`` with ``a^4 = W / V``, the damping 1/sqrt(2)."""
    inertia, noise = np.array([2.0, 5.0]), NoiseModel(3.0, 0.7, 1e-4, 2e-6)
    found = kalman_filter(double_integrators(inertia), noise)
    W, V = np.array([3.0, 0.7]) / inertia**2, np.array([1e-4, 2e-6])
    a = (W / V) ** 0.25
    expected = np.zeros((4, 2))
    expected[[0, 2], [0, 1]], expected[[1, 3], [0, 1]] = np.sqrt(2.0) * a, a**2
    np.testing.assert_allclose(found.L, expected, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(found.error_rms[::2] ** 2, np.sqrt(2.0) * a * V, rtol=1e-10)
    np.testing.assert_allclose(found.error_rms[1::2] ** 2, np.sqrt(2.0) * a**3 * V, rtol=1e-10)
    np.testing.assert_allclose(-found.poles.real / np.abs(found.poles), np.sqrt(0.5), rtol=1e-9)


def test_recovery_is_more_torque_noise_where_torques_are_the_commands():
    loop = full_state("ideal")
    one = kalman_filter(loop, replace(NOISE, recovery=24.0))
    other = kalman_filter(
        loop, replace(NOISE, tab_torque=25.0 * NOISE.tab_torque, aileron_torque=25.0 * NOISE.aileron_torque)
    )
    np.testing.assert_allclose(one.L, other.L, rtol=1e-10, atol=1e-9)


def test_recovery_enters_before_the_lag_of_a_torque():
    """A torque behind a lag has no noise of its own, and its estimate needs no correction until recovery says so."""
    loop = full_state("lagged")
    plain, recovered = (kalman_filter(loop, replace(NOISE, recovery=rho)) for rho in (0.0, 1e3))
    torque = slice(plain.states.index("tab_torque"), None)
    np.testing.assert_allclose(plain.L[..., torque, :], 0.0, atol=1e-12 * np.abs(plain.L).max())
    assert np.all(plain.error_rms[..., torque] <= 1e-9)
    assert np.all(np.abs(recovered.L[..., torque, :]).max(axis=(-2, -1)) > 1.0)


@settings(max_examples=30, deadline=None)
@given(st.floats(-6.0, 6.0), st.sampled_from(["ideal", "lagged", "unsteady"]), st.integers(0, 7))
def test_only_the_ratio_of_the_intensities_matters_to_the_gain(log_factor, name, flat):
    """Noise stronger by a factor throughout: the same gain, errors stronger by its root."""
    factor, loop = 10.0**log_factor, full_state(name).take(np.unravel_index(flat, (2, 4)))
    louder = NoiseModel(
        *(factor * x for x in (NOISE.tab_torque, NOISE.aileron_torque, NOISE.tab_angle, NOISE.aileron_angle))
    )
    one, other = kalman_filter(loop, NOISE), kalman_filter(loop, louder)
    np.testing.assert_allclose(other.L, one.L, rtol=1e-8, atol=1e-9 * np.abs(one.L).max())
    np.testing.assert_allclose(other.error_rms[:4], np.sqrt(factor) * one.error_rms[:4], rtol=1e-8)


@settings(max_examples=20, deadline=None)
@given(st.sampled_from(["tab_torque", "aileron_torque", "tab_angle", "aileron_angle"]), st.floats(1.01, 100.0))
def test_more_noise_never_makes_a_better_estimate(name, factor):
    """P grows with every intensity (the Riccati equation is monotone)."""
    loop = full_state("unsteady").take((0, 2))
    before, after = (
        kalman_filter(loop, NOISE),
        kalman_filter(loop, replace(NOISE, **{name: factor * getattr(NOISE, name)})),
    )
    scale = np.maximum(before.error_rms, 1e-12)
    gained = (after.P - before.P) / np.outer(scale, scale)
    assert np.linalg.eigvalsh(gained[:4, :4]).min() > -1e-7


def test_intensities_over_the_grid():
    loop, over = full_state("lagged"), np.geomspace(1e-6, 1e-3, 8).reshape(2, 4)
    noise = NoiseModel(over, 2.0 * over, 1e-10, 3e-10, (StateNoise("da", 1e-3 * over),), 10.0 * over)
    whole = kalman_filter(loop, noise)
    for index in [(0, 0), (1, 3)]:
        x = over[index]
        alone = kalman_filter(
            loop.take(index), NoiseModel(x, 2.0 * x, 1e-10, 3e-10, (StateNoise("da", 1e-3 * x),), 10.0 * x)
        )
        for field in ("L", "P", "residual"):
            ours, theirs = getattr(whole, field)[index], getattr(alone, field)
            np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12 * np.abs(theirs).max())
        np.testing.assert_allclose(whole.poles[index], alone.poles, rtol=1e-9)
    assert whole.states == ("dt", "dt_rate", "da", "da_rate", "tab_torque", "aileron_torque")


def test_points_without_a_loop_have_no_filter_and_keep_their_reason():
    loop, mask = with_holes(full_state("unsteady"))
    before = Outcomes.all_ok((2, 4))
    where = np.zeros((2, 4), dtype=bool)
    where[0, 1] = where[0, 2] = True
    before = before.failing(where, Outcome.EXCLUDED, lambda index: "left out")
    found = kalman_filter(loop, NOISE, before)
    assert found.outcomes.codes[0, 1] == found.outcomes.codes[0, 2] == Outcome.EXCLUDED
    assert found.outcomes.reasons[0, 1] == "left out"
    assert found.outcomes.codes[1, 3] == Outcome.NOT_CERTIFIED
    assert "not finite" in found.outcomes.reasons[1, 3]
    left = mask & ~where
    whole = kalman_filter(full_state("unsteady"), NOISE)
    for field in ("L", "P", "poles", "error_rms", "residual"):
        assert np.isnan(getattr(found, field)[~left]).all()
        np.testing.assert_array_equal(getattr(found, field)[left], getattr(whole, field)[left])


def _two_points(one: Loop, other: Loop) -> Loop:
    fields = ("A", "B", "E", "G", "K", "N", "M", "C", "F", "D", "H", "offset")
    return replace(one, **{name: np.stack([getattr(one, name), getattr(other, name)]) for name in fields})


def test_a_mode_that_no_angle_shows_is_named_and_its_neighbour_goes_on():
    A, B, K = (np.zeros(shape) for shape in ((5, 5), (5, 2), (2, 5)))
    plain = double_integrators()
    A[:4, :4], B[:4], K[:, :4] = plain.A, plain.B, plain.K
    seen, hidden = A.copy(), A.copy()
    seen[4, 4], hidden[4, 4] = -3.0, 2.5
    found = kalman_filter(_two_points(made_loop(seen, B, K), made_loop(hidden, B, K)), NOISE)
    assert found.outcomes.codes.tolist() == [Outcome.OK, Outcome.INFEASIBLE]
    assert "no measured angle sees the mode at 2.5" in found.outcomes.reasons[1]
    assert np.isnan(found.L[1]).all()
    assert np.isnan(found.poles[1]).all()
    assert np.isfinite(found.L[0]).all()


def test_a_mode_on_the_axis_that_no_noise_drives_is_named():
    """An inertia without torque noise: where it once is, it drifts, and the filter would stop listening."""
    quiet = kalman_filter(double_integrators(), NoiseModel(0.0, 1.0, 1e-4, 1e-4))
    assert quiet.outcomes.codes.item() == Outcome.INFEASIBLE
    assert "no noise drives the mode at 0 rad/s" in quiet.outcomes.reasons.item()
    cured = kalman_filter(double_integrators(), NoiseModel(0.0, 1.0, 1e-4, 1e-4, (StateNoise("dt_rate", 1e-3),)))
    assert cured.outcomes.ok.all()


def test_unstable_modes_need_no_noise():
    """Without any, the filter's poles are those of the plant, the unstable ones mirrored."""
    loop = full_state("ideal")
    found = kalman_filter(loop, NoiseModel(0.0, 0.0, 1e-9, 1e-9))
    assert found.outcomes.ok.all()
    plant = np.linalg.eigvals(loop.A[..., :4, :4])
    expected = -np.abs(plant.real) + 1j * plant.imag
    for ours, theirs in zip(found.poles.reshape(-1, 4), expected.reshape(-1, 4), strict=True):
        np.testing.assert_allclose(np.sort_complex(ours), np.sort_complex(theirs), rtol=1e-6)


def test_numbers_beyond_doubles_are_not_certified():
    found = kalman_filter(full_state("ideal"), replace(NOISE, tab_torque=1e308, recovery=1e10))
    assert all(code == Outcome.NOT_CERTIFIED for code in found.outcomes.codes.ravel())
    assert "Riccati" in found.outcomes.reasons[0, 0]
    assert np.isnan(found.L).all()


def test_what_is_refused():
    loop = full_state("ideal")
    with pytest.raises(ValueError, match="no state 'lag_1'"):
        kalman_filter(loop, replace(NOISE, states=(StateNoise("lag_1", 1.0),)))
    with pytest.raises(ValueError, match="no state 'int_a'"):
        kalman_filter(loop, replace(NOISE, states=(StateNoise("int_a", 1.0),)))
    with pytest.raises(ValueError, match="dt_filtered, da_filtered"):
        kalman_filter(with_rate_filters(loop, 100.0), NOISE)
    with pytest.raises(ValueError, match="there is no dt_rate"):
        kalman_filter(replace(loop, states=("dt", "x", "da", "da_rate", "int_a")), NOISE)
    with pytest.raises(ValueError, match="there is no T_a_disturbance"):
        kalman_filter(replace(loop, disturbances=("T_t_disturbance", "x", *loop.disturbances[2:])), NOISE)


@pytest.mark.parametrize(
    "change",
    [
        {"tab_torque": -1.0},
        {"aileron_torque": np.nan},
        {"tab_angle": 0.0},
        {"aileron_angle": np.array([1e-9, -1e-9])},
        {"recovery": -0.1},
        {"states": (StateNoise("dt", np.inf),)},
    ],
)
def test_intensities_that_do_not_exist(change):
    with pytest.raises(ValueError, match=next(iter(change)) if "states" not in change else "dt"):
        replace(NOISE, **change)
