"""The loop, built once: everything that judges a controller reads this one object.

::

        r --> [ N ] ----------+   w (torque disturbances, sensor noise)
                              v   |
                 u = N r - K x + M w  -->  x' = A x + B v + E r + G w  -->  y = C x + F x' + D v + H v' + y0
                      ^                       |
                      +------- [ -K ] <-------+         v(t) = u(t - delay)

States are the plant's (``dt dt_rate da da_rate``), then integrals (``int_a``), then the states of
actuators and filters: all of what is flown. Inputs are the commands of the actuators (``tab``,
``aileron``), references the wanted angles (``r_a``). Angles [rad], TE-up positive, deviations from trim.
The closed-loop matrices below leave the delay out; `design.delay` has what is exact with it.
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
    A (*G, n, n), B (*G, n, m), E (*G, n, p), G (*G, n, q) : ``x' = A x + B v + E r + G w``
    K (*G, m, n), N (*G, m, p), M (*G, m, q) : ``u = -K x + N r + M w``, v being u after its delay
    C (*G, o, n), F (*G, o, n), D (*G, o, m), H (*G, o, m), offset (*G, o) :
        ``y = C x + F x' + D v + H v' + offset``; `offset` holds the trim values (trim torques), so outputs are
        totals, not deviations
    states, inputs, references, outputs : names, one per row or column
    disturbances : names of w: ``T_a_disturbance``, ``T_t_disturbance`` [N m], and noise on what is measured, by the
        name of the state: ``da_noise``, ``dt_noise`` [rad], ``da_rate_noise``, ``dt_rate_noise`` [rad/s]
    stages : the loops in the order in which they are closed, for root loci
    delay : transport delay of each input [s]
    """

    A: FloatArray
    B: FloatArray
    E: FloatArray
    G: FloatArray
    K: FloatArray
    N: FloatArray
    M: FloatArray
    C: FloatArray
    F: FloatArray
    D: FloatArray
    H: FloatArray
    offset: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    references: tuple[str, ...]
    outputs: tuple[str, ...]
    disturbances: tuple[str, ...]
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
        """(*G, o, n): outputs from states with the loop closed, ``C + (F - H K) Acl - D K``."""
        return self.C + self._of_rates @ self.closed - self.D @ self.K

    @cached_property
    def reference_feedthrough(self) -> FloatArray:
        """(*G, o, p): outputs from a resting reference with the loop closed, ``(F - H K) (E + B N) + D N``."""
        return self._of_rates @ self.reference_input + self.D @ self.N

    @cached_property
    def disturbance_input(self) -> FloatArray:
        """``G + B M`` (*G, n, q): how disturbances and noise drive the closed loop."""
        return self.G + self.B @ self.M

    @cached_property
    def _of_rates(self) -> FloatArray:
        """What outputs take of x': their own part, and that of v' = -K x'."""
        return self.F - self.H @ self.K

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
