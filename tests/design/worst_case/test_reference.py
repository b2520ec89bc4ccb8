"""Worst references: admissible, and as bad as is proved, simulated by other routes."""

import control
import numpy as np
import pytest

from design.worst_case.peaks import guaranteed_peaks
from design.worst_case.reference import worst_reference
from tests.design.lqr_cases import example
from tests.design.worst_case.any_loops import at_knots, random_system, resonance, system

A = 0.2


def admissible(manoeuvre, amplitude, rate):
    assert np.all(np.abs(manoeuvre.values) <= amplitude * (1.0 + 1e-9))
    assert np.all(np.abs(manoeuvre.ends) <= amplitude * (1.0 + 1e-9))
    if np.isfinite(rate):
        assert np.all(np.abs(manoeuvre.slopes) <= rate * (1.0 + 1e-6))
        np.testing.assert_allclose(manoeuvre.jumps, 0.0, atol=1e-9 * amplitude)


@pytest.mark.parametrize("rate", [0.003, 0.1, 2.0, 40.0, 1e4, np.inf])
def test_it_reaches_what_is_proved(rate):
    loop = random_system(31, 4)
    found = guaranteed_peaks(loop, A, rate)
    for point in range(4):
        one = loop.take(point)
        for o, name in enumerate(loop.outputs):
            manoeuvre = worst_reference(one, name, A, rate)
            admissible(manoeuvre, A, rate)
            after, before = at_knots(one, manoeuvre)
            peak = max(np.abs(after[:, o]).max(), np.abs(before[:, o]).max())
            assert 0.999 * found.upper[point, o] <= peak <= found.upper[point, o]
            np.testing.assert_allclose(np.abs(after[-1, o]), peak, rtol=1e-9)
            assert peak >= found.lower[point, o] * (1.0 - 1e-6)


def test_python_control_agrees_on_the_shipped_example():
    """LQR of the wind-tunnel example: every torque, rate and deflection, and the tracking error, trim included."""
    from design.lqr.synthesis import design_lqr
    from design.lqr.torque_loop import lqr_loop

    model, request = example("wind_tunnel")
    loop = lqr_loop(model, design_lqr(model, request)).take((0, 2))
    names = (*loop.outputs, "da_error")
    amplitude, rate = np.deg2rad(10.0), np.deg2rad(120.0)
    found = guaranteed_peaks(loop, amplitude, rate, names)
    C, D, trim = loop.closed_outputs, loop.reference_feedthrough, loop.offset
    a = loop.outputs.index("da")
    C, D, trim = np.vstack([C, -C[a]]), np.vstack([D, 1.0 - D[a]]), np.append(trim, 0.0)
    model = control.ss(loop.closed, loop.reference_input, C, D)
    for o, name in enumerate(names):
        manoeuvre = worst_reference(loop, name, amplitude, rate)
        admissible(manoeuvre, amplitude, rate)
        times = np.linspace(0.0, manoeuvre.times[-1], 20_001)
        answer = control.forced_response(model, times, manoeuvre.at(times).T)
        peak = np.abs(answer.outputs[o] + trim[o]).max()
        assert 0.995 * found.upper[o] <= peak <= found.upper[o] * (1.0 + 1e-6), name


def test_a_resonance_is_driven_at_its_own_frequency():
    omega, zeta = 30.0, 0.05
    manoeuvre = worst_reference(resonance(omega, zeta), "da", A)
    gaps = np.diff(manoeuvre.times)[-5:]
    np.testing.assert_allclose(gaps, np.pi / (omega * np.sqrt(1.0 - zeta**2)), rtol=1e-6)
    np.testing.assert_allclose(np.abs(manoeuvre.values), A)


def test_two_references_strike_together():
    rng = np.random.default_rng(2)
    M, b, C, D = np.diag([-1.0, -40.0]), rng.standard_normal((2, 2)), rng.standard_normal((2, 2)), np.eye(2)
    size = np.array([0.1, 0.3])
    loop = system(M, b, C, D, trim=[0.0, -0.7], references=("r_a", "r_t"))
    for rate in (np.array([0.5, np.inf]), np.array([0.5, 3.0]), np.array([np.inf, np.inf])):
        found = guaranteed_peaks(loop, size, rate)
        for o, name in enumerate(loop.outputs):
            manoeuvre = worst_reference(loop, name, size, rate)
            for p in range(2):
                assert np.all(np.abs(manoeuvre.values[:, p]) <= size[p] * (1.0 + 1e-9))
                assert np.all(np.abs(manoeuvre.slopes[:, p]) <= rate[p] * (1.0 + 1e-6))
            peak = np.abs(at_knots(loop, manoeuvre)[0][-1, o])
            assert 0.999 * found.upper[o] <= peak <= found.upper[o]
    alone = worst_reference(loop, "da", np.array([0.1, 0.0]), 1.0)
    np.testing.assert_array_equal(alone.values[:, 1], 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_worst_sign_is_that_of_the_trim(sign):
    loop = system([[-7.0]], [[7.0]], [[-2.0]], trim=[0.4 * sign])
    manoeuvre = worst_reference(loop, "da", A, 1.0)
    y = at_knots(loop, manoeuvre)[0][:, 0]
    np.testing.assert_allclose(y[-1], sign * (0.4 + 2.0 * A), rtol=1e-3)


@pytest.mark.parametrize("of_rate", [0.5, -0.5])
def test_an_output_of_the_rate_is_largest_just_before_the_end(of_rate):
    M, b = [[-2.0, 9.0], [-9.0, -2.0]], [[1.0], [3.0]]
    loop = system(M, b, [[1.0, -2.0]], [[0.3]], R=[[of_rate]])
    found = guaranteed_peaks(loop, A, 3.0)
    manoeuvre = worst_reference(loop, "da", A, 3.0)
    admissible(manoeuvre, A, 3.0)
    peak = np.abs(at_knots(loop, manoeuvre)[1][-1, 0])
    assert 0.999 * found.upper[0] <= peak <= found.upper[0]


def test_where_there_is_none_it_says_why():
    with pytest.raises(ValueError, match="one point"):
        worst_reference(random_system(1, 2), "da", A)
    with pytest.raises(ValueError, match="not stable"):
        worst_reference(system([[1.0]], [[1.0]], [[1.0]]), "da", A)
    with pytest.raises(ValueError, match="may jump"):
        worst_reference(system([[-1.0]], [[1.0]], [[1.0]], R=[[1.0]]), "da", A)
