"""A loop with its delays replaced by chains of states: for responses in time and their metrics, not for poles.

The chain is the Pade approximant with one zero less than poles. The one with as many zeros is about as accurate (at
5 ms and 8 states, errors in dt of 9e-6 and 1.0e-5 of its change), but passes a part of every jump on at once, with the
wrong sign for an odd order, and would ask for the derivative of the reference in outputs that take v'.

A chain that is empty when the command begins to move rings about the corner that arrives one delay later. After a step
of the aileron's reference, tab loops of the wind-tunnel example with a 40 Hz servo, the largest error of each output
over its largest change is, with 12 states:

===== ===== ===== =======
delay da    dt    T_t
===== ===== ===== =======
1 ms  4e-12 8e-9  0.008
5 ms  2e-10 1e-6  0.04
15 ms 3e-8  3e-5  0.1
50 ms 1e-5  1e-3  0.4
===== ===== ===== =======

With a servo of first order, or an ideal rate, T_t jumps there, and is wrong by up to half for any order.
`design.delay.step_response` starts the chains later, when they have something smooth to hold.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.delay.characteristic import SHORTEST
from design.delay.pade import delay_chain
from design.loop import Loop
from model.arrays import FloatArray

#: States of each delay.
ORDER = 12


def without_delay(loop: Loop, order: int = ORDER) -> Loop:
    """The same loop, each delayed input led through the approximant of its delay (`design.delay.pade`).

    The approximant has one zero less than poles. So what comes out never jumps, its rate ``v'`` is a combination of
    the states and of u even where u jumps, and no output needs the derivative of a reference.

    Parameters
    ----------
    loop : over any grid
    order : states of each delay, at least 1

    Returns
    -------
    Loop with the states ``delay_<input>_1 ..`` behind the others and all delays 0; `loop` itself where it has none.
    The stages stay as they are, with their own delays

    Raises
    ------
    ValueError : the order is less than 1
    """
    late = [i for i, delay in enumerate(loop.delay) if delay > SHORTEST]
    chain, n = delay_chain(order), loop.A.shape[-1]
    if not late:
        return loop
    size = n + order * len(late)
    A, B, C = _padded(loop.A, size, size), _padded(loop.B, size), _padded(loop.C, None, size)
    D, H = loop.D.copy(), loop.H.copy()
    for place, i in enumerate(late):
        at = slice(n + place * order, n + (place + 1) * order)
        rate = 1.0 / loop.delay[i]
        A[..., :n, at] = loop.B[..., :, i, None] * chain.c
        A[..., at, at] = chain.A * rate
        B[..., :, i] = 0.0
        B[..., at, i] = chain.b * rate
        # v = c z and v' = c z', with z' = (A z + b u) / delay
        C[..., :, at] = loop.D[..., :, i, None] * chain.c + loop.H[..., :, i, None] * (chain.c @ chain.A * rate)
        D[..., :, i] = loop.H[..., :, i] * (chain.c @ chain.b * rate)
        H[..., :, i] = 0.0
    names = tuple(f"delay_{loop.inputs[i]}_{k + 1}" for i in late for k in range(order))
    return replace(
        loop, A=A, B=B, E=_padded(loop.E, size), G=_padded(loop.G, size), K=_padded(loop.K, None, size), C=C,
        F=_padded(loop.F, None, size), D=D, H=H, states=(*loop.states, *names), delay=(0.0,) * len(loop.delay),
    )  # fmt: skip


def _padded(matrix: FloatArray, rows: int | None = None, columns: int | None = None) -> FloatArray:
    """`matrix` (*G, r, c) with rows and columns of zeros behind its own, up to these numbers."""
    *grid, r, c = matrix.shape
    made = np.zeros((*grid, rows or r, columns or c))
    made[..., :r, :c] = matrix
    return made
