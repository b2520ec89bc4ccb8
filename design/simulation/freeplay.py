"""A tab that hangs on its actuator by a link with a dead band (seed 7.4.4, Fig 7.13, Fig 8.2).

::

    dt_actuator --> [ dead band, stiffness ] --> T_link --> J_tt dt'' + J_ta da'' = T_link + air

The drive moves ``dt_actuator``, what the controller measures of the tab is the actuator's angle, and the aileron and
the air see the tab's own angle ``dt``, which is free within the band. In the loop below the link is elastic without
band; `slack_torque` is what the band takes from it. At trim the link is stretched by what bears the trim torque.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.loop import Loop
from design.padded import padded
from design.simulation.request import Freeplay
from model.arrays import FloatArray
from model.linear_model import LinearModel

#: What the drive's states and outputs are called when the tab has its own.
ACTUATOR = {"dt": "dt_actuator", "dt_rate": "dt_actuator_rate"}


def with_link(loop: Loop, model: LinearModel, freeplay: Freeplay) -> Loop:
    """The loop whose tab hangs on an elastic link: the tab's ``dt dt_rate`` are two more states, the last ones.

    Parameters
    ----------
    loop, model : over the same grid; the loop commands deflections or rates of the tab
    """
    names = tuple(ACTUATOR.get(name, name) for name in loop.states)
    states, n = (*names, "dt", "dt_rate"), len(names)
    inertia, air, at = model.inertia, model.air_torque, states.index
    grid, size = loop.A.shape[:-2], n + 2
    A, B = padded(loop.A, size, size), padded(loop.B, size, 1)
    surfaces, aileron = [at(name) for name in model.states], at("da_rate")
    A[..., aileron, :], B[..., aileron, :] = 0.0, 0.0
    A[..., aileron, surfaces] = air[..., 1, :] / inertia[..., 1, 1, None]
    for row, name in enumerate(model.states[4:], start=4):
        A[..., at(name), :], B[..., at(name), :] = 0.0, 0.0
        A[..., at(name), surfaces] = model.A[..., row, :]
    A[..., n, n + 1] = 1.0
    A[..., n + 1, surfaces] = air[..., 0, :]
    # The rate of the actuator is a row of A and B, whether it is a state or not.
    drive = at("dt_actuator")
    A[..., n + 1, :] += freeplay.damping * A[..., drive, :]
    B[..., n + 1, :] += freeplay.damping * B[..., drive, :]
    A[..., n + 1, drive] += freeplay.stiffness
    A[..., n + 1, n] -= freeplay.stiffness
    A[..., n + 1, n + 1] -= freeplay.damping
    A[..., n + 1, :] -= inertia[..., 0, 1, None] * A[..., aileron, :]
    A[..., n + 1, :] /= inertia[..., 0, 0, None]
    B[..., n + 1, :] /= inertia[..., 0, 0, None]
    outputs, o = (*loop.outputs, *ACTUATOR.values()), len(loop.outputs)
    C, F = (padded(matrix, o + 2, size) for matrix in (loop.C, loop.F))
    D, H = (padded(matrix, o + 2, 1) for matrix in (loop.D, loop.H))
    offset = np.concatenate([loop.offset, np.zeros((*grid, 2))], axis=-1)
    for row, (own, moved) in enumerate(ACTUATOR.items(), start=o):
        source = loop.outputs.index(own)
        for matrix in (C, F, D, H):
            matrix[..., row, :], matrix[..., source, :] = matrix[..., source, :], 0.0
        C[..., source, at(own)] = 1.0
        offset[..., outputs.index(moved)] = loop.offset[..., source]
    return replace(
        loop, A=A, B=B, E=padded(loop.E, size, loop.E.shape[-1]), G=padded(loop.G, size, loop.G.shape[-1]),
        K=padded(loop.K, 1, size), C=C, F=F, D=D, H=H, offset=offset, states=states, outputs=outputs, stages=(),
    )  # fmt: skip


def trim_stretch(freeplay: Freeplay, torque: FloatArray) -> FloatArray:
    """Actuator's less tab's angle at trim (*G,) [rad], the link bearing the trim torque [N m]; 0 without torque."""
    return np.asarray(0.5 * freeplay.gap * np.sign(torque) + torque / freeplay.stiffness)


def link_torque(freeplay: Freeplay, stretch: FloatArray, rate: FloatArray) -> FloatArray:
    """Torque of the link on the tab [N m] at a stretch [rad] that grows at a rate [rad/s], all of one shape."""
    beyond = stretch - np.clip(stretch, -0.5 * freeplay.gap, 0.5 * freeplay.gap)
    bears = np.where(beyond != 0.0, freeplay.damping, 0.0) if freeplay.gap > 0.0 else freeplay.damping
    return np.asarray(freeplay.stiffness * beyond + bears * rate)
