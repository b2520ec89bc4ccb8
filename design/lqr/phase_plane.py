"""Trajectories in the phase planes of two surfaces: tab over aileron angle, torque over rate (seed Fig 5.8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.delay.step_response import delayed_step_response
from design.delay.with_pade import without_delay
from design.loop import Loop
from design.response.transition import transition
from model.arrays import FloatArray, GridArrays

_SIGNALS = ("da", "dt", "da_rate", "dt_rate", "T_a", "T_t")


@dataclass(frozen=True, eq=False)
class PhasePlane(GridArrays):
    """Trajectories, each (*G, T), totals with their trim values; the first sample is at t = 0+.

    Attributes
    ----------
    time : [s]
    aileron, tab : angles [rad]; the tab's over the aileron's is the trajectory of the surfaces
    aileron_rate, tab_rate : [rad/s]
    aileron_torque, tab_torque : [N m]; over the rate of the same surface, what its motor has to do
    """

    time: FloatArray
    aileron: FloatArray
    tab: FloatArray
    aileron_rate: FloatArray
    tab_rate: FloatArray
    aileron_torque: FloatArray
    tab_torque: FloatArray


def step_trajectory(loop: Loop, reference: FloatArray, duration: float, samples: int = 501) -> PhasePlane:
    """Trajectories after a step of the references, from trim; delays included.

    Parameters
    ----------
    loop : over any grid; every number finite (leave failed points out with ``loop.take``)
    reference : (p,) or (*G, p) [rad]
    duration : [s]
    samples : samples T, both ends included

    Raises
    ------
    ValueError : as `delayed_step_response`, or a loop without one of the signals
    """
    response = delayed_step_response(loop, reference, duration, samples)
    at = [response.index(name) for name in _SIGNALS]
    return PhasePlane(response.time, *np.moveaxis(response.outputs[..., at], -1, 0))


def free_trajectory(loop: Loop, state: FloatArray, duration: float, samples: int = 501) -> PhasePlane:
    """Trajectories from an initial state, references at zero, exact at the samples.

    A delay is its approximant here (`design.delay.with_pade`), and holds no command at t = 0.

    Parameters
    ----------
    loop : over any grid; every number finite
    state : (n,) or (*G, n) states at t = 0, from trim, in the order of ``loop.states``
    duration : [s]
    samples : samples T, both ends included

    Raises
    ------
    ValueError : a duration that is not positive and finite, fewer than two samples, or a state of the wrong shape
    """
    if not 0.0 < duration < np.inf:
        raise ValueError(f"duration must be positive and finite, got {duration} s")
    if samples < 2:
        raise ValueError(f"a trajectory needs at least two samples, got {samples}")
    chained, grid, n = without_delay(loop), loop.A.shape[:-2], len(loop.states)
    x = np.zeros((*grid, chained.A.shape[-1]))
    x[..., :n] = np.broadcast_to(np.asarray(state, dtype=float), (*grid, n))
    rows = chained.closed_outputs[..., [loop.outputs.index(name) for name in _SIGNALS], :]
    offset = loop.offset[..., [loop.outputs.index(name) for name in _SIGNALS]]
    with np.errstate(over="ignore", invalid="ignore"):
        step = transition(chained.closed, duration / (samples - 1))
        states = [x]
        for _ in range(samples - 1):
            states.append((step @ states[-1][..., None])[..., 0])
        signals = rows @ np.stack(states, axis=-1) + offset[..., None]
    time = np.broadcast_to(np.linspace(0.0, duration, samples), (*grid, samples))
    return PhasePlane(time, *np.moveaxis(signals, -2, 0))
