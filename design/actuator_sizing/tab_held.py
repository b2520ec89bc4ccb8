"""What the aileron's actuator would need for the same motion if the tab did nothing (seed 5.7).

Held at its trim angle the tab neither moves nor helps. The torque that then moves the aileron as the loop moves it is
inverse dynamics on the linear model: with the surfaces' rows ``x_r' = A_r x + B_r u`` and J the inverse of B_r ::

    T_a = trim + J_aa da'' - (J A_r)_a [da, da', lag]          dt = dt' = dt'' = 0

Where the air has lag states they are those of the aileron's motion alone: the loop gets a second set of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.loop import Loop
from design.padded import padded
from model.lag_states import LAG_STATES
from model.linear_model import LinearModel

#: Output that `with_tab_held` adds.
TAB_HELD = "T_a_tab_held"


def with_tab_held(loop: Loop, model: LinearModel) -> Loop:
    """The loop with one more output, `TAB_HELD`: the aileron torque of the same motion, the tab held at trim [N m].

    Parameters
    ----------
    loop : closed loops over the grid, with the states ``da da_rate``
    model : the linear models that they are of
    """
    moving = [model.states.index(name) for name in ("da", "da_rate")]
    lags = [model.states.index(name) for name in model.states if name in LAG_STATES]
    rows = [model.states.index(f"{name}_rate") for name in ("dt", "da")]
    J = np.linalg.inv(model.B[..., rows, :])
    stiffness = J[..., 1:, :] @ model.A[..., rows, :]
    n, k = len(loop.states), len(lags)
    size, o = n + k, len(loop.outputs)
    of_loop = [loop.states.index(name) for name in ("da", "da_rate")]
    A = padded(loop.A, size, size)
    A[..., n:, of_loop] = model.A[..., lags, :][..., moving]
    A[..., n:, n:] = model.A[..., lags, :][..., lags]
    C, F = padded(loop.C, o + 1, size), padded(loop.F, o + 1, size)
    C[..., o, of_loop] = -stiffness[..., 0, moving]
    C[..., o, n:] = -stiffness[..., 0, lags]
    F[..., o, of_loop[1]] = J[..., 1, 1]
    m, p, q = len(loop.inputs), len(loop.references), loop.G.shape[-1]
    return replace(
        loop, A=A, B=padded(loop.B, size, m), E=padded(loop.E, size, p), G=padded(loop.G, size, q),
        K=padded(loop.K, m, size), C=C, F=F, D=padded(loop.D, o + 1, m), H=padded(loop.H, o + 1, m),
        offset=np.concatenate([loop.offset, model.input_offset[..., 1:]], axis=-1),
        states=(*loop.states, *(f"{name}_tab_held" for name in (model.states[i] for i in lags))),
        outputs=(*loop.outputs, TAB_HELD), stages=(),
    )  # fmt: skip
