"""Loops with chains for delays: transfer functions against the delayed equations, and what responses are worth."""

from dataclasses import replace

import numpy as np
import pytest

from design.delay.delayed_poles import delayed_poles
from design.delay.with_pade import ORDER, without_delay
from design.loop import SisoLoop
from design.response.step_response import step_response
from tests.design.delay.delayed_loops import full_loop, loop
from tests.design.delay.method_of_steps import outputs


def _exact(loop, s, to_state, to_command):
    """Transfer (o, p) at s from an input that enters x' by `to_state` and u by `to_command`, with the delays."""
    x = np.exp(-s * np.array(loop.delay))
    B = loop.B * x
    state = np.linalg.solve(s * np.eye(loop.A.shape[-1]) - loop.A + B @ loop.K, to_state + B @ to_command)
    v = x[:, None] * (to_command - loop.K @ state)
    return (loop.C + s * loop.F) @ state + (loop.D + s * loop.H) @ v


def _chained(loop, s, to_state, to_command):
    """The same from a loop without delays, with its v = u."""
    state = np.linalg.solve(s * np.eye(loop.A.shape[-1]) - loop.closed, to_state + loop.B @ to_command)
    v = to_command - loop.K @ state
    return (loop.C + s * loop.F) @ state + (loop.D + s * loop.H) @ v


@pytest.mark.parametrize("delay", [(0.3,), (0.3, 0.7), (0.0, 0.5), (0.4, 0.0)])
def test_transfers_are_those_of_the_delayed_loop(delay):
    """From references and disturbances to every output, within the band of the approximant."""
    exact = full_loop(delay)
    chained = without_delay(exact)
    for s in (0.01, 0.4j, 1.0 + 2.0j, 5.0j):
        for a, b in (("E", "N"), ("G", "M")):
            ours = _chained(chained, s, getattr(chained, a), getattr(chained, b))
            np.testing.assert_allclose(ours, _exact(exact, s, getattr(exact, a), getattr(exact, b)), atol=1e-11)


def test_what_arrives_never_jumps():
    chained = without_delay(full_loop((0.3, 0.7)))
    assert np.all(chained.H == 0.0)
    mixed = without_delay(full_loop((0.3, 0.0)))
    assert np.all(mixed.H[:, 0] == 0.0)
    assert np.all(mixed.H[:, 1] != 0.0)
    plain = replace(full_loop((0.3,)), H=np.zeros((3, 1)))
    assert np.all(without_delay(plain).D == 0.0)


def test_names_and_stages():
    base = full_loop((0.3, 0.7))
    stage = SisoLoop("K", base.A, base.B[:, 0], base.K[0], np.array(1.0), +1, 0.3)
    base = replace(base, stages=(stage,))
    chained = without_delay(base, order=2)
    assert chained.states == (
        "x0",
        "x1",
        "x2",
        "x3",
        "delay_tab_1",
        "delay_tab_2",
        "delay_aileron_1",
        "delay_aileron_2",
    )
    assert chained.delay == (0.0, 0.0)
    assert chained.stages is base.stages
    assert (chained.inputs, chained.outputs, chained.references) == (base.inputs, base.outputs, base.references)
    assert len(without_delay(base).states) == 4 + 2 * ORDER


def test_a_loop_without_delay_stays_the_same():
    base = full_loop((0.0, 0.0))
    assert without_delay(base) is base
    with pytest.raises(ValueError, match="order"):
        without_delay(base, order=0)


def test_dominant_poles_are_near_the_exact_ones():
    base = full_loop((0.5,), seed=4)
    exact = delayed_poles(base).poles
    near = np.linalg.eigvals(without_delay(base).closed)
    for pole in exact[np.isfinite(exact)][-4:]:
        assert np.abs(near - pole).min() < 1e-9


def test_grid_equals_points():
    whole = full_loop((0.3, 0.7), grid=(2, 3))
    chained = without_delay(whole)
    for index in np.ndindex(2, 3):
        one = without_delay(whole.take(index))
        for name in ("A", "B", "E", "G", "K", "N", "M", "C", "F", "D", "H", "offset"):
            np.testing.assert_array_equal(getattr(chained, name)[index], getattr(one, name))


def test_error_of_a_chain_that_starts_empty_falls_as_the_corner_is_rounded():
    """``y = 1 / (s + 1)^p exp(-s) / s``: the error is that of order^-(p + 1/2) or so, worst where y itself jumps."""
    errors = []
    time = np.linspace(0.0, 3.0, 3001)[1:]
    for p in range(1, 4):
        A = np.diag(-np.ones(p)) + np.diag(np.ones(p - 1), 1)
        one = loop(A, np.eye(p)[:, p - 1 :], np.zeros((1, p)), (1.0,), N=[[1.0]], C=np.eye(p)[:1])
        exact = outputs(one, np.ones(1), time + 1e-9)[:, 0]
        found = [step_response(without_delay(one, order), np.ones(1), 3.0, 3001).outputs[1:, 0] for order in (6, 24)]
        errors.append([np.abs(y - exact).max() for y in found])
    errors = np.array(errors)
    assert np.all(errors[1:] < 0.3 * errors[:-1])
    assert np.all(errors[:, 1] < 0.5 * errors[:, 0])
    assert errors[0, 1] > 1e-3  # which is why the first delays are followed exactly
