"""Nyquist's criterion, the phase of ``1 + L`` followed along the axis, against eigenvalues and against the margins."""

from dataclasses import replace

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from design.frequency.feedback import closed_loop
from design.frequency.margins import margins
from tests.design.siso_loops import stabilised

#: The contour runs this far to the right of the axis, past the poles of the open loop that are on it.
INDENT = 1e-4


def encirclements(loop):
    """How often ``1 + L`` goes clockwise round the origin, its phase unwrapped on ever finer steps."""
    n = loop.A.shape[-1]
    b = loop.sign * loop.gain * loop.b

    def angle(w):
        s = INDENT + 1j * w
        return np.angle(1.0 + np.linalg.solve(s[:, None, None] * np.eye(n) - loop.A, b[:, None])[..., 0] @ loop.c)

    w = np.concatenate([[0.0], np.geomspace(1e-5, 1e6, 401)])
    phase = angle(w)
    for _ in range(40):
        step = (np.diff(phase) + np.pi) % (2 * np.pi) - np.pi
        coarse = np.flatnonzero(np.abs(step) > 0.2)
        if coarse.size == 0:
            break
        between = 0.5 * (w[coarse] + w[coarse + 1])
        w, phase = np.insert(w, coarse + 1, between), np.insert(phase, coarse + 1, angle(between))
    # Twice the upper half; at infinity the phase is 0.
    return -step.sum() / np.pi


def beyond(A):
    """Poles to the right of the contour."""
    return int((np.linalg.eigvals(A).real > INDENT).sum())


def clear(*matrices):
    """Whether no pole is so near to the contour that its side is a matter of rounding."""
    return all(np.abs(np.linalg.eigvals(A).real - INDENT).min() > 0.2 * INDENT for A in matrices)


def with_integrator(loop):
    """The loop with an integral and a proportional path in front of it."""
    n = loop.A.shape[-1]
    A = np.zeros((n + 1, n + 1))
    A[:n, :n], A[:n, n] = loop.A, loop.b
    return replace(loop, A=A, b=np.append(0.5 * loop.b, 1.0), c=np.append(loop.c, 0.0))


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 100_000),
    order=st.integers(2, 6),
    sign=st.sampled_from([1, -1]),
    gain=st.floats(0.05, 20.0),
    integrator=st.booleans(),
)
def test_encirclements_are_closed_loop_poles_less_open_loop_poles(seed, order, sign, gain, integrator):
    loop = stabilised(1, order - integrator, seed, sign=sign).take(0)
    loop = replace(loop, gain=np.array(gain))
    if integrator:
        loop = with_integrator(loop)
    assume(clear(loop.A, loop.closed()))
    turns = encirclements(loop)
    assert abs(turns - round(turns)) < 0.05
    unstable = beyond(loop.A) + round(turns)
    assert unstable == beyond(loop.closed())
    assume(np.abs(np.linalg.eigvals(loop.closed()).real).min() > INDENT)
    assert bool(closed_loop(loop).stable[0]) == (unstable == 0)
    assert np.isfinite(margins(loop).disk_margin) == (unstable == 0)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 100_000), order=st.integers(1, 6), sign=st.sampled_from([1, -1]))
def test_poles_cross_the_axis_at_every_gain_of_the_list_and_nowhere_else(seed, order, sign):
    """One pole through the origin, or a pair through the axis, at each; between them none."""
    loop = stabilised(1, order, seed, sign=sign, gain=1.5).take(0)
    found = margins(loop)
    there = ~np.isnan(found.gain_ratio)
    ratio, omega = (v[there][np.argsort(found.gain_ratio[there])] for v in (found.gain_ratio, found.gain_omega))
    assume(np.all(np.diff(np.log(ratio)) > 1e-5))

    def right(factor):
        return (np.linalg.eigvals(loop.closed(loop.gain * factor)).real > 0.0).sum()

    before = [right(r * (1 - 1e-6)) for r in ratio]
    after = [right(r * (1 + 1e-6)) for r in ratio]
    for a, b, w in zip(before, after, omega, strict=True):
        assert abs(b - a) == (2 if w > 0.0 else 1)
    assert before[1:] == after[:-1]
    if ratio.size:
        assert after[-1] == right(1e6)
        assert before[0] == right(1e-6)
    np.testing.assert_allclose(10 ** (found.gain_margin_up_db / 20), np.min(ratio[ratio > 1.0], initial=np.inf))
    np.testing.assert_allclose(10 ** (found.gain_margin_down_db / 20), np.max(ratio[ratio < 1.0], initial=0.0))


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 100_000), order=st.integers(1, 6), sign=st.sampled_from([1, -1]))
def test_a_pole_crosses_the_axis_at_every_phase_of_the_list_and_nowhere_else(seed, order, sign):
    """Of the upper half of the frequencies: what turns through ``phase`` at w turns through ``-phase`` at -w."""
    loop = stabilised(1, order, seed, sign=sign).take(0)
    found = margins(loop)
    phase = found.phase[~np.isnan(found.phase)]
    edges = np.sort(np.concatenate([phase, -phase]))
    assume(np.all(np.diff(edges) > 1e-5) and np.all(np.abs(edges) < np.pi - 1e-5))
    outer = loop.sign * loop.gain * np.outer(loop.b, loop.c)

    def right(turn):
        return (np.linalg.eigvals(loop.A - np.exp(-1j * turn) * outer).real > 0.0).sum()

    before, after = [right(p - 1e-6) for p in edges], [right(p + 1e-6) for p in edges]
    assert all(abs(b - a) == 1 for a, b in zip(before, after, strict=True))
    assert before[1:] == after[:-1]
    assert right(0.0) == 0
    if edges.size:
        assert before[0] == after[-1] == right(np.pi)
