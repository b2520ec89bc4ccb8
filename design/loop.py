"""The loop, built once: everything that judges a controller reads this one object.

::

        r --> [ N ] --+
                      v
                 u = N r - K x  -->  x' = A x + B u + E r  -->  y = C x + F x' + D u + y0
                      ^                       |
                      +------- [ -K ] <-------+

States are the plant's (``dt dt_rate da da_rate``), then integrals (``int_a``), then the states of
actuators and filters: all of what is flown. Inputs are the commands of the actuators (``tab``,
``aileron``), references the wanted angles (``r_a``). Angles [rad], TE-up positive, deviations from trim.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from model.arrays import FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class SisoLoop(GridArrays):
    """One loop, opened at one place while all the others stay as they are.

    The closed loop with gain k is ``A - sign k b c``: the loop transfer is ``L(s) = c (sI - A)^-1 b``
    and the return difference ``1 + sign k L(s)``. `sign` is +1 for negative feedback (the usual root locus)
    and -1 for positive feedback (the 0-degree locus).

    Attributes
    ----------
    name : name of the loop: an actuator input (``tab``) or a gain (``K_p``)
    A : (*G, n, n), b : (*G, n), c : (*G, n)
    gain : (*G,) the gain at which the design flies this loop
    sign : +1 or -1
    delay : transport delay inside the loop [s]
    """

    name: str
    A: FloatArray
    b: FloatArray
    c: FloatArray
    gain: FloatArray
    sign: int
    delay: float = 0.0

    def closed(self, gain: FloatArray | float | None = None) -> FloatArray:
        """Closed-loop matrix ``A - sign k b c`` (*G, n, n) at `gain` (default: the one flown)."""
        k = np.asarray(self.gain if gain is None else gain, dtype=float)
        outer = self.b[..., :, None] * self.c[..., None, :]
        return self.A - self.sign * k[..., None, None] * outer


@dataclass(frozen=True, eq=False)
class Loop(GridArrays):
    """Plant, actuators, filters, integrators and gains, assembled over the grid.

    Attributes
    ----------
    A (*G, n, n), B (*G, n, m), E (*G, n, p) : ``x' = A x + B u + E r``
    K (*G, m, n), N (*G, m, p) : ``u = -K x + N r``
    C (*G, o, n), F (*G, o, n), D (*G, o, m), offset (*G, o) : ``y = C x + F x' + D u + offset``;
        `offset` holds the trim values (trim torques), so outputs are totals, not deviations
    states, inputs, references, outputs : names, one per row or column
    stages : the loops in the order in which they are closed, for root loci
    delay : transport delay of each input [s]
    """

    A: FloatArray
    B: FloatArray
    E: FloatArray
    K: FloatArray
    N: FloatArray
    C: FloatArray
    F: FloatArray
    D: FloatArray
    offset: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    references: tuple[str, ...]
    outputs: tuple[str, ...]
    stages: tuple[SisoLoop, ...]
    delay: tuple[float, ...]

    @cached_property
    def closed(self) -> FloatArray:
        """Closed-loop matrix ``A - B K`` (*G, n, n)."""
        return self.A - self.B @ self.K

    @cached_property
    def reference_input(self) -> FloatArray:
        """``E + B N`` (*G, n, p): how the reference drives the closed loop."""
        return self.E + self.B @ self.N

    @cached_property
    def closed_outputs(self) -> FloatArray:
        """(*G, o, n): outputs from states with the loop closed, ``C + F Acl - D K``."""
        return self.C + self.F @ self.closed - self.D @ self.K

    @cached_property
    def reference_feedthrough(self) -> FloatArray:
        """(*G, o, p): outputs from the reference with the loop closed, ``F (E + B N) + D N``."""
        return self.F @ self.reference_input + self.D @ self.N

    def cut(self, name: str) -> SisoLoop:
        """The loop opened at one actuator input, the others closed: where margins are taken."""
        i = self.inputs.index(name)
        others = [j for j in range(len(self.inputs)) if j != i]
        A = self.A - self.B[..., others] @ self.K[..., others, :]
        ones = np.ones(self.A.shape[:-2])
        return SisoLoop(name, A, self.B[..., i], self.K[..., i, :], ones, +1, self.delay[i])

    def cuts(self) -> SisoLoop:
        """All cuts in one stack (m, *G, ...), in the order of the inputs, for inputs of the same delay.

        Raises
        ------
        ValueError : the inputs have different delays
        """
        if len(set(self.delay)) != 1:
            raise ValueError("cuts of inputs with different delays cannot be stacked")
        each = [self.cut(name) for name in self.inputs]
        A, b, c, gain = (np.stack([getattr(cut, field) for cut in each]) for field in ("A", "b", "c", "gain"))
        return SisoLoop("cuts", A, b, c, gain, +1, self.delay[0])

    def stage(self, name: str) -> SisoLoop:
        """The named loop of `stages`; KeyError when there is none."""
        for stage in self.stages:
            if stage.name == name:
                return stage
        raise KeyError(name)
