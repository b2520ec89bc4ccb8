"""Frequency responses of a loop that is run as code, from sample to sample: loop functions, and what references do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.disturbance.frequency_response import FrequencyResponse, over_grid
from design.lqr.coded_loop import CodedLoop
from design.lqr.hamiltonian import solve_or_nan
from model.arrays import ComplexArray, FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class CodedResponses(GridArrays):
    """Responses at the samples, (*G, W, ..), ``z = exp(jw T)``, delays and what the code remembers included.

    Attributes
    ----------
    loop : L, opened between the code and the plant at all commands at once, the sign of negative feedback left out
    sensitivity : ``S = (I + L)^-1``
    complementary : ``T = I - S``
    command : from the references to the commands
    reference : from the references to the states of the plant
    """

    loop: FrequencyResponse
    sensitivity: FrequencyResponse
    complementary: FrequencyResponse
    command: FrequencyResponse
    reference: FrequencyResponse


def coded_responses(loop: CodedLoop, omega: FloatArray) -> CodedResponses:
    """Responses over frequency, by a linear system at each.

    Parameters
    ----------
    loop : over any grid
    omega : (W,) or (*G, W) frequencies from 0 to half the sampling rate, ``pi / T`` [rad/s]

    Raises
    ------
    ValueError : a frequency is out of this range or not finite, or their shape is wrong
    """
    frequencies = over_grid(omega, loop.A.shape[:-2])
    if np.any(frequencies * loop.sampling.time > np.pi * (1.0 + 1e-12)):
        raise ValueError(f"frequencies must be at most pi / T = {np.pi / loop.sampling.time:.6g} rad/s")
    z, inputs = np.exp(1j * frequencies * loop.sampling.time), loop.inputs
    opened, one = loop.opened(), np.eye(len(inputs), dtype=complex)
    L: ComplexArray = opened.K[..., None, :, :] @ _resolved(opened.A, opened.B, z)
    S: ComplexArray = solve_or_nan(one + L, np.broadcast_to(one, L.shape))
    states = _resolved(loop.closed, loop.reference_input, z)
    command: ComplexArray = loop.N[..., None, :, :] - loop.K[..., None, :, :] @ states
    n = len(loop.states)
    return CodedResponses(
        FrequencyResponse(frequencies, L, inputs, inputs),
        FrequencyResponse(frequencies, S, inputs, inputs),
        FrequencyResponse(frequencies, one - S, inputs, inputs),
        FrequencyResponse(frequencies, command, loop.references, inputs),
        FrequencyResponse(frequencies, states[..., :n, :], loop.references, loop.states),
    )


def _resolved(A: FloatArray, B: FloatArray, z: ComplexArray) -> ComplexArray:
    """``(zI - A)^-1 B`` (*G, W, n, p)."""
    pencil: ComplexArray = z[..., None, None] * np.eye(A.shape[-1]) - A[..., None, :, :]
    right: ComplexArray = np.broadcast_to(B[..., None, :, :], (*pencil.shape[:-1], B.shape[-1])).astype(complex)
    return solve_or_nan(pencil, right)
