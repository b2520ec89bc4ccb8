"""A loop under a digital controller: as it is sampled, and the continuous loop that lags as much."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.estimation.readings import is_controllers
from design.frequency.sampled_loop import Realisation, SampledLoop, sampled_loop, tustin
from design.loop import Loop


@dataclass(frozen=True)
class Sampling:
    """A digital controller: measured and commanded at once every `time` [s], through a zero-order hold.

    `delay` is the time from a measurement to the command that is computed from it [s]. Integrators and rate filters
    are discretised by Tustin's rule.
    """

    time: float
    delay: float

    @property
    def mean_delay(self) -> float:
        """The delay [s] by which a continuous controller lags as much: half a sample for the hold, and its own."""
        return 0.5 * self.time + self.delay


def digital_loop(loop: Loop, sampling: Sampling) -> SampledLoop:
    """The loop from sample to sample, exact: plant, actuators and their delays continuous, the controller digital.

    Parameters
    ----------
    loop : with the delays of its actuators; which states are the controller's, `design.estimation.readings` says

    Raises
    ------
    ValueError : commands drive a state of the controller, or the plant does
    """
    inside = [i for i, name in enumerate(loop.states) if is_controllers(name)]
    outside = [i for i in range(len(loop.states)) if i not in inside]
    if np.any(loop.B[..., inside, :]) or np.any(loop.A[..., outside, :][..., inside]):
        raise ValueError("a controller's own states act on the plant through the commands only")
    controller = Realisation(
        A=loop.A[..., inside, :][..., inside],
        B=loop.A[..., inside, :][..., outside],
        C=loop.K[..., inside],
        D=loop.K[..., outside],
    )
    A, B = loop.A[..., outside, :][..., outside], loop.B[..., outside, :]
    sampled = tustin(controller, sampling.time)
    measured = np.eye(len(outside))
    computation = sampling.delay / sampling.time
    return sampled_loop(A, B, measured, sampled, sampling.time, loop.delay, loop.inputs, computation)


def as_if_continuous(loop: Loop, sampling: Sampling | None) -> Loop:
    """The loop of a continuous controller that lags as much as the digital one; the loop itself without sampling.

    Good to the second order of the sample time: responses in time are taken of it.
    """
    if sampling is None:
        return loop
    later = tuple(delay + sampling.mean_delay for delay in loop.delay)
    stages = tuple(replace(stage, delay=stage.delay + sampling.mean_delay) for stage in loop.stages)
    return replace(loop, delay=later, stages=stages)
