"""The loop functions at the actuators' commands over frequency: L, S, T and what reaches the commands (KS)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.disturbance.closed_system import closed_system
from design.disturbance.frequency_response import FrequencyResponse, frequency_response, over_grid
from design.disturbance.open_parts import Matrices
from design.loop import Loop
from design.lqr.hamiltonian import solve_or_nan
from model.arrays import ComplexArray, FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class LoopResponses(GridArrays):
    """All loops opened at their commands u at once, and closed, each with its delay exactly, (*G, W, m, ...).

    Attributes
    ----------
    loop : ``L = K (jwI - A)^-1 B diag(exp(-jw delay))`` (*G, W, m, m): from a command round to what it is answered
        with, the sign of negative feedback left out; nan exactly at a pole of the open loop on the axis
    sensitivity : ``S = (I + L)^-1`` (*G, W, m, m): from a signal added to a command to the command
    complementary : ``T = L (I + L)^-1 = I - S`` (*G, W, m, m)
    command : (*G, W, m, p + q) from references and disturbances, sensor noise among them (KS), to the commands

    Entries of L, S and T between commands of different units are in the one's unit per the other's.
    """

    loop: FrequencyResponse
    sensitivity: FrequencyResponse
    complementary: FrequencyResponse
    command: FrequencyResponse


def loop_responses(loop: Loop, omega: FloatArray) -> LoopResponses:
    """Loop functions over frequency, from linear systems in the state matrices; see `LoopResponses`.

    Parameters
    ----------
    loop : over any grid; points that carry nan keep it
    omega : (W,) or (*G, W) frequencies [rad/s], at least 0

    Raises
    ------
    ValueError : a frequency is negative, or not finite, or their shape is wrong; or a delay is negative
    """
    frequencies = over_grid(omega, loop.A.shape[:-2])
    commands = frequency_response(closed_system(loop, (*loop.references, *loop.disturbances), loop.inputs), omega)
    turn = np.exp(-1j * frequencies[..., None] * np.array(loop.delay))[..., None, :]
    A, B, K = (M[..., None, :, :] for M in (loop.A, loop.B, loop.K))
    nothing, one = np.zeros((*K.shape[:-1], len(loop.inputs))), np.eye(len(loop.inputs))
    L = Matrices(A, B, K, nothing).response(frequencies) * turn
    S: ComplexArray = solve_or_nan(one + L, np.broadcast_to(one.astype(np.complex128), L.shape))
    T: ComplexArray = L @ S
    at_pole = np.isnan(L).any(axis=(-2, -1), keepdims=True)
    if at_pole.any():  # L is infinite there, S and T are not
        closed = Matrices(A - (B * turn) @ K, B * turn, K, nothing).response(frequencies)
        S, T = np.where(at_pole, one - closed, S), np.where(at_pole, closed, T)
    loops = [FrequencyResponse(frequencies, value, loop.inputs, loop.inputs) for value in (L, S, T)]
    return LoopResponses(loops[0], loops[1], loops[2], commands)
