"""Grid points of a loop that has no entries there: a design that failed gives no gains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from design.loop import SisoLoop
from model.arrays import BoolArray


def finite_points(loop: SisoLoop) -> BoolArray:
    """Mask of the grid points (*G,) at which all entries of `loop` are finite."""
    finite = np.isfinite(loop.A).all(axis=(-2, -1)) & np.isfinite(loop.b).all(axis=-1)
    return np.asarray(finite & np.isfinite(loop.c).all(axis=-1) & np.isfinite(loop.gain))


def without(loop: SisoLoop, finite: BoolArray) -> SisoLoop:
    """The loop with nothing at all in the points that are not `finite` (*G,)."""
    A = np.where(finite[..., None, None], loop.A, 0.0)
    b, c = (np.where(finite[..., None], v, 0.0) for v in (loop.b, loop.c))
    return replace(loop, A=A, b=b, c=c, gain=np.where(finite, loop.gain, 1.0))
