"""Manoeuvres against python-control's `ct.forced_response`, point by point."""

from __future__ import annotations

from typing import Any

import control as ct
import numpy as np

from design.loop import Loop
from design.manoeuvre import Manoeuvre, rate_limited_step, recorded
from design.response.manoeuvre_response import manoeuvre_response
from model.arrays import FloatArray
from tests.benchmarks.cases import DURATION, SAMPLES, STEP, Case
from tests.benchmarks.measure import Row


def manoeuvre_rows(c: Case) -> list[Row]:
    """A rate-limited step with sampled and with refined peaks, and a recorded series.

    The peer takes its input as straight lines between the samples: both are exact for courses whose knots are samples.
    """
    ramped = rate_limited_step(np.array([STEP]), STEP / (0.2 * DURATION))
    knots = np.linspace(0.0, DURATION, SAMPLES)
    walk = np.cumsum(np.random.default_rng(1).normal(size=(SAMPLES, 1)), axis=0) * 0.01 * STEP
    series = recorded(knots, walk - walk[0])

    def sampled(manoeuvre: Manoeuvre) -> FloatArray:
        return np.max(np.abs(manoeuvre_response(c.loop, manoeuvre, DURATION, SAMPLES).outputs), axis=-2)

    def close(ours: Any, theirs: Any) -> None:
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.max(np.abs(theirs)))

    def no_lower(ours: Any, theirs: Any) -> None:
        assert np.all(ours >= theirs * (1 - 1e-12))
        np.testing.assert_allclose(ours, theirs, rtol=2e-2)  # the peer's samples miss up to that much of a peak

    return [
        Row(
            "rate-limited step, 501 samples, sampled peaks", "ct.forced_response loop", 50.0, lambda: sampled(ramped),
            lambda: control_forced(c.loop, ramped), close,
        ),
        Row(
            "rate-limited step, refined peaks", "the same, sampled peaks", 18.0,
            lambda: manoeuvre_response(c.loop, ramped, DURATION, SAMPLES).peaks,
            lambda: control_forced(c.loop, ramped), no_lower,
        ),
        Row(
            "recorded series of 501, sampled peaks", "ct.forced_response loop", 15.0, lambda: sampled(series),
            lambda: control_forced(c.loop, series), close,
        ),
    ]  # fmt: skip


def control_forced(loop: Loop, manoeuvre: Manoeuvre) -> FloatArray:
    """Largest magnitude of every output at the samples, at each point."""
    time = np.linspace(0.0, DURATION, SAMPLES)
    reference = manoeuvre.at(time)[:, 0]
    peaks = []
    for p in range(loop.A.shape[0]):
        system = ct.ss(loop.closed[p], loop.reference_input[p], loop.closed_outputs[p], loop.reference_feedthrough[p])
        outputs = ct.forced_response(system, time, reference).outputs + loop.offset[p][:, None]
        peaks.append(np.max(np.abs(outputs), axis=1))
    return np.array(peaks)
