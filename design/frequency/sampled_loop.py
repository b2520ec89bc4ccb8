"""A plant under a sampled controller, and where to cut it for its margins."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.frequency.sampled import DiscreteLoop
from design.frequency.sampled_plant import sampled_plant
from model.arrays import FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class Realisation(GridArrays):
    """A system ``x' = A x + B y, u = C x + D y``, or, sampled, ``x_(k+1) = A x_k + B y_k, u_k = C x_k + D y_k``.

    Attributes
    ----------
    A : (*G, n, n), B : (*G, n, p), C : (*G, m, n), D : (*G, m, p); n may be 0
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray


def tustin(system: Realisation, sample_time: float) -> Realisation:
    """The system by the trapezoidal rule, ``s = 2 (z - 1) / (T (z + 1))``: integrators and filters as they are coded.

    Parameters
    ----------
    sample_time : T [s]

    Raises
    ------
    ValueError : the sample time is not positive
    numpy.linalg.LinAlgError : a pole of the system is at ``2 / T``
    """
    if not sample_time > 0.0:
        raise ValueError(f"sample time must be positive, is {sample_time} s")
    half = 0.5 * sample_time * system.A
    identity = np.eye(half.shape[-1])
    solver = np.linalg.inv(identity - half)
    B = sample_time * (solver @ system.B)
    return Realisation(solver @ (identity + half), B, system.C @ solver, system.D + 0.5 * (system.C @ B))


@dataclass(frozen=True, eq=False)
class SampledLoop(GridArrays):
    """``x_(k+1) = A x_k + B v_k`` with the commands ``v_k = -K x_k``.

    States are the plant's, then the commands on their way to it, then the controller's.

    Attributes
    ----------
    A : (*G, n, n), B : (*G, n, m), K : (*G, m, n)
    inputs : names of the commands
    sample_time : [s]
    """

    A: FloatArray
    B: FloatArray
    K: FloatArray
    inputs: tuple[str, ...]
    sample_time: float

    @cached_property
    def closed(self) -> FloatArray:
        """Closed-loop matrix ``A - B K`` (*G, n, n)."""
        return self.A - self.B @ self.K

    def cut(self, name: str) -> DiscreteLoop:
        """The loop opened at one command, the others closed."""
        i = self.inputs.index(name)
        others = [j for j in range(len(self.inputs)) if j != i]
        A = self.A - self.B[..., others] @ self.K[..., others, :]
        return DiscreteLoop(name, A, self.B[..., i], self.K[..., i, :], np.ones(A.shape[:-2]), +1, self.sample_time)

    def cuts(self) -> DiscreteLoop:
        """All cuts in one stack (m, *G, ...), in the order of the inputs."""
        each = [self.cut(name) for name in self.inputs]
        A, b, c, gain = (np.stack([getattr(cut, field) for cut in each]) for field in ("A", "b", "c", "gain"))
        return DiscreteLoop("cuts", A, b, c, gain, +1, self.sample_time)


def sampled_loop(
    A: FloatArray,
    B: FloatArray,
    C: FloatArray,
    controller: Realisation,
    sample_time: float,
    delay: tuple[float, ...],
    inputs: tuple[str, ...],
    computation: float = 1.0,
) -> SampledLoop:
    """``x' = A x + B u, y = C x``, sampled, under ``v_k = -controller(y_k)``, each command held for one sample.

    Parameters
    ----------
    A : (*G, n, n), B : (*G, n, m) plant and actuators [rad/s]
    C : (*G, p, n) what is measured, or (p, n) where it is the same everywhere
    controller : sampled, from the p measurements to minus the m commands (``u = -K x`` is ``D = K``); over the grid,
        or one for all of it
    sample_time : [s]
    delay : transport delay of each input [s], any; exact
    inputs : names of the commands
    computation : samples from the measurement to the command, any fraction; 0 for a command in the same instant

    Raises
    ------
    ValueError : sample time, delay or computation are out of range, or there is not one delay and name for each input
    """
    if computation < 0.0:
        raise ValueError(f"the time of computation must not be negative, is {computation} samples")
    m = B.shape[-1]
    if len(inputs) != m:
        raise ValueError(f"{m} inputs need {m} names, there are {len(inputs)}")
    plant = sampled_plant(A, B, sample_time, tuple(each + computation * sample_time for each in delay))
    n, known, own = A.shape[-1], plant.A.shape[-1], controller.A.shape[-1]
    grid, size = A.shape[:-2], known + own
    F, G, K = np.zeros((*grid, size, size)), np.zeros((*grid, size, m)), np.zeros((*grid, m, size))
    F[..., :known, :known], F[..., known:, known:] = plant.A, controller.A
    F[..., known:, :n] = controller.B @ C
    G[..., :known, :] = plant.B
    K[..., :n], K[..., known:] = controller.D @ C, controller.C
    return SampledLoop(F, G, K, inputs, sample_time)
