"""Exact linear step responses of the closed loop, for the whole grid at once.

With the step ``r`` held from t = 0 the closed loop and its outputs are one system that nothing drives::

        d [x]   [Acl  b] [x]                       b = (E + B N) r
        --[ ] = [      ] [ ] = M z ,   y = R z ,
        dt[1]   [ 0   0] [1]                       R = [C + F Acl - D K,  (F (E + B N) + D N) r + y0]

so that ``z(t) = exp(M t) z(0)`` is exact at every sample, also where Acl is singular, and the feed-through
jump of the outputs is in the sample at t = 0 (which is 0+).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.loop import Loop
from design.response.extremes import largest_magnitudes
from design.response.final_value import final_values
from design.response.graded import GradedStates, graded_states
from design.response.transition import transition
from model.arrays import ComplexArray, FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class Response(GridArrays):
    """Response of a closed loop to a step of its references, from trim at t = 0.

    Attributes
    ----------
    time : (*G, T) sample times, evenly spaced from 0 [s]; a view that all points share
    states : (*G, T, n) deviations from trim
    outputs : (*G, T, o) totals, trim values included; the first sample is the value at t = 0+
    reference : (*G, p) size of the step of each reference [rad]
    generator : (*G, n+1, n+1) M of ``z' = M z``, ``z = [x, 1]`` [1/s]
    rows : (*G, o, n+1) R of ``y = R z``
    names : name of each output
    duration : time of the last sample [s]
    """

    time: FloatArray
    states: FloatArray
    outputs: FloatArray
    reference: FloatArray
    generator: FloatArray
    rows: FloatArray
    names: tuple[str, ...]
    duration: float

    def index(self, name: str) -> int:
        """Index of the named output; ValueError when there is none."""
        if name not in self.names:
            raise ValueError(f"the loop has no output {name!r}; it has {', '.join(self.names)}")
        return self.names.index(name)

    @cached_property
    def poles(self) -> ComplexArray:
        """(*G, n) poles of the closed loop [1/s]."""
        return np.linalg.eigvals(self.generator[..., :-1, :-1]).astype(np.complex128)

    @cached_property
    def final_outputs(self) -> FloatArray:
        """(*G, o) values the outputs settle to, from the DC gain; nan where they do not settle."""
        return final_values(self.generator, self.rows, self.poles)

    @cached_property
    def peaks(self) -> FloatArray:
        """(*G, o) largest magnitude of each output, trim included, between and at the samples."""
        with np.errstate(over="ignore", invalid="ignore"):
            return largest_magnitudes(self.graded.signals(self.rows))

    @cached_property
    def graded(self) -> GradedStates:
        """The same response on a mesh that follows its fastest mode: what peaks and integrals are taken of."""
        return graded_states(self.generator, self.poles, self.duration)


def step_response(loop: Loop, reference: FloatArray, duration: float, samples: int = 501) -> Response:
    """Response to a step of the references at t = 0, exact at the samples.

    Parameters
    ----------
    loop : closed loops over the grid; every number finite (leave failed points out with ``loop.take``)
    reference : (p,) or (*G, p) step of each reference [rad]
    duration : length of the response [s]
    samples : number of samples T, both ends included

    Transport delays (``loop.delay``) are left out; `design.delay.step_response` has them.

    Returns
    -------
    Response. A loop so unstable that it leaves the range of doubles gives inf or nan there, without warning.

    Raises
    ------
    ValueError : duration not positive and finite, fewer than two samples, or a reference of the wrong shape
    """
    if not 0.0 < duration < np.inf:
        raise ValueError(f"duration must be positive and finite, got {duration} s")
    if samples < 2:
        raise ValueError(f"a response needs at least two samples, got {samples}")
    grid, n = loop.A.shape[:-2], loop.A.shape[-1]
    step = np.broadcast_to(np.asarray(reference, dtype=float), (*grid, len(loop.references)))
    generator = _generator(loop, step)
    rows = _rows(loop, step)
    with np.errstate(over="ignore", invalid="ignore"):
        z = _powers_of(transition(generator, duration / (samples - 1)), samples)
        outputs = (rows @ z.swapaxes(-1, -2)).swapaxes(-1, -2)  # each signal contiguous in time
    time = np.broadcast_to(np.linspace(0.0, duration, samples), (*grid, samples))
    return Response(
        time=time,
        states=z[..., :n],
        outputs=outputs,
        reference=step,
        generator=generator,
        rows=rows,
        names=loop.outputs,
        duration=float(duration),
    )


def _generator(loop: Loop, step: FloatArray) -> FloatArray:
    """M (*G, n+1, n+1): closed loop and step in one matrix."""
    n = loop.A.shape[-1]
    M = np.zeros((*loop.A.shape[:-2], n + 1, n + 1))
    M[..., :n, :n] = loop.closed
    M[..., :n, n] = np.einsum("...np,...p->...n", loop.reference_input, step)
    return M


def _rows(loop: Loop, step: FloatArray) -> FloatArray:
    """R (*G, o, n+1): outputs with their trim value and feed-through."""
    jump = np.einsum("...op,...p->...o", loop.reference_feedthrough, step)
    return np.concatenate([loop.closed_outputs, (jump + loop.offset)[..., None]], axis=-1)


def _powers_of(transition: FloatArray, samples: int) -> FloatArray:
    """(*G, T, n+1) ``z_k = transition^k z_0``, each pass doubling the number of known samples."""
    size = transition.shape[-1]
    z = np.zeros((*transition.shape[:-2], samples, size))
    z[..., 0, -1] = 1.0
    known, power = 1, transition
    while known < samples:
        more = min(known, samples - known)
        np.matmul(z[..., :more, :], power.swapaxes(-1, -2), out=z[..., known : known + more, :])
        known += more
        if known < samples:
            power = power @ power
    return z
