"""Root mean squares of outputs under white noise: the H2 norm of every pair of input and output."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.disturbance.closed_system import ClosedSystem
from design.disturbance.delayed_variances import delayed_variances
from design.disturbance.lyapunov import variances
from model.arrays import FloatArray, GridArrays

#: A variance that rounding may have moved by more than this part of it is not given.
LARGEST_ERROR = 1e-4


@dataclass(frozen=True, eq=False)
class H2Norm(GridArrays):
    """H2 norms over the grid.

    White noise w of intensity W has ``E[w(t) w(s)] = W delta(t - s)``: a spectral density of W [unit^2 s] at every
    frequency, positive and negative, counted per hertz. A density that counts positive frequencies only, as data
    sheets do, is 2 W. The root mean square of the output is the norm times ``sqrt(W)``.

    Attributes
    ----------
    pairs : (*G, o, p) norm from each input to each output [unit of the output per unit of the input, 1/sqrt(s)];
        inf where the output takes the input at once, for white noise has no finite mean square. nan where the loop is
        not stable, not finite, or so ill-conditioned that the norm is not known to a part in ten thousand
    total : (*G,) root of the sum of the squares of all pairs; the norm of the whole, where units are alike
    """

    pairs: FloatArray
    total: FloatArray

    def rms(self, intensity: FloatArray) -> FloatArray:
        """Root mean squares (*G, o) of the outputs under independent white noises of intensity (p,) or (*G, p)."""
        intensity = np.asarray(intensity, dtype=float)[..., None, :]
        with np.errstate(invalid="ignore"):
            squares = np.where(intensity > 0.0, self.pairs**2 * intensity, 0.0 * intensity)
        return np.asarray(np.sqrt(np.sum(squares, axis=-1)))


def h2_norm(system: ClosedSystem) -> H2Norm:
    """H2 norms of a closed system, from the Lyapunov equation; with a delay by quadrature over frequency, to 1e-8.

    Parameters
    ----------
    system : over any grid (`design.disturbance.closed_system`)
    """
    points = system.stable_points
    found = variances(points.matrices) if points.parts is None else delayed_variances(points, points.parts)
    known = found.error <= LARGEST_ERROR * found.value
    square = np.where(points.linked, np.where(known, found.value, np.nan), 0.0)
    pairs = system.over_grid(np.where(points.direct, np.inf, np.sqrt(square)))
    return H2Norm(pairs, np.sqrt(np.sum(pairs**2, axis=(-2, -1))))
