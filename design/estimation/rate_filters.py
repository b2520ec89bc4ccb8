"""Rates from filtered derivatives of the measured angles (seed 6.3, 7.3).

::

    dt --> [ w s / (s + w) ] --> in the place of dt_rate          dt_filtered' = w (dt - dt_filtered)
    da --> [ w s / (s + w) ] --> in the place of da_rate          da_filtered' = w (da - da_filtered)

Lag states of the circulation are not measured either. They obey ``lag' = pace (w(dt, dt', da, da') - lag)``
(`model.lag_states`), so the controller runs the same two first-order filters on the measured angles and the filtered
rates, and reads ``lag_1_filtered lag_2_filtered``. Torques behind a lag stay measured: a torque loop measures its own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.estimation.readings import (
    RATES,
    is_controllers,
    known_points,
    left_disturbances,
    refuse_unless_full_state,
)
from design.loop import Loop
from design.padded import padded
from model.arrays import FloatArray, Floats
from model.lag_states import LAG_STATES


def with_rate_filters(loop: Loop, cutoff: Floats) -> Loop:
    """The loop whose controller reads filtered derivatives ``w s / (s + w)`` of the angles instead of the rates.

    The filters' states stand behind all others: ``dt_filtered da_filtered`` and, with lag states,
    ``lag_1_filtered lag_2_filtered``. Noise of an angle now also enters as that of its rate, ``w`` times as large:
    white noise makes commands of infinite variance through it, as through the angle itself. Nothing makes sure that
    the loop is stable with the lag of the filters: judge it.

    Parameters
    ----------
    loop : full-state feedback, over any grid; points that carry nan have nan
    cutoff : w of both filters [rad/s], a number or (*G,)

    Raises
    ------
    ValueError : the cut-off is not positive and finite, or the loop is not a full-state feedback
    """
    refuse_unless_full_state(loop)
    speed = np.broadcast_to(np.asarray(cutoff, dtype=float), loop.A.shape[:-2])
    if not np.all((speed > 0.0) & np.isfinite(speed)):
        raise ValueError(f"the cut-off of the rate filters must be positive and finite, is {cutoff} rad/s")
    known = known_points(loop)
    if known.all():
        return _filtered(loop, speed)
    return _filtered(loop.take(known), speed[known]).spread(known)


def _filtered(loop: Loop, speed: FloatArray) -> Loop:
    """`with_rate_filters` of a loop that is finite everywhere, w (*G,)."""
    lags = [name for name in loop.states if name in LAG_STATES]
    states = (*loop.states, *(f"{name}_filtered" for name in (*RATES, *lags)))
    read, noise = _readings(loop, speed, states)
    rows = [i for i, name in enumerate(loop.states) if is_controllers(name)]
    behind = [loop.states.index(name) for name in lags]
    rates = [loop.states.index(name) for name in RATES.values()]
    n, size = len(loop.states), len(states)
    # How noise enters the filters, and all that read what noise falsifies.
    by_noise = _by_noise(loop, noise)
    A, G = padded(loop.A, size, size), padded(loop.G @ by_noise, size, by_noise.shape[-1])
    A[..., rows, :] = loop.A[..., rows, :] @ read
    # A filter's state moves at the rate that the filter tells: z' = w (angle - z).
    A[..., n : n + len(rates), :], G[..., n : n + len(rates), :] = read[..., rates, :], noise[..., rates, :]
    A[..., n + len(rates) :, :] = loop.A[..., behind, :] @ read
    G[..., n + len(rates) :, :] = loop.A[..., behind, :] @ noise
    outputs, inputs = len(loop.outputs), len(loop.inputs)
    filtered = replace(
        loop, A=A, B=padded(loop.B, size, inputs), E=padded(loop.E, size, len(loop.references)), G=G,
        K=loop.K @ read, M=loop.M @ by_noise, C=padded(loop.C, outputs, size), F=padded(loop.F, outputs, size),
        states=states, disturbances=left_disturbances(loop),
    )  # fmt: skip
    return replace(filtered, stages=tuple(filtered.cut(name) for name in loop.inputs))


def _readings(loop: Loop, speed: FloatArray, states: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """What the controller takes for the states: ``read x + noise w``, (*G, n, n') and (*G, n, q')."""
    names = left_disturbances(loop)
    n = len(loop.states)
    read = np.zeros((*speed.shape, n, len(states)))
    noise = np.zeros((*speed.shape, n, len(names)))
    read[..., np.arange(n), np.arange(n)] = 1.0
    for angle, rate in RATES.items():
        at, of_rate, column = loop.states.index(angle), loop.states.index(rate), names.index(f"{angle}_noise")
        noise[..., at, column], noise[..., of_rate, column] = 1.0, speed
        read[..., of_rate, of_rate] = 0.0
        read[..., of_rate, at], read[..., of_rate, states.index(f"{angle}_filtered")] = speed, -speed
    for lag in set(LAG_STATES) & set(loop.states):
        row = loop.states.index(lag)
        read[..., row, row], read[..., row, states.index(f"{lag}_filtered")] = 0.0, 1.0
    return read, noise


def _by_noise(loop: Loop, noise: FloatArray) -> FloatArray:
    """The loop's disturbances as those that are left make them (*G, q, q'): noise of a rate is that of its reading."""
    names = left_disturbances(loop)
    made = np.zeros((*noise.shape[:-2], len(loop.disturbances), len(names)))
    for row, name in enumerate(loop.disturbances):
        state = name.removesuffix("_noise")
        if state != name and state in loop.states:
            made[..., row, :] = noise[..., loop.states.index(state), :]
        else:
            made[..., row, names.index(name)] = 1.0
    return made
