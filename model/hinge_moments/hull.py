"""The hull of a table: which angles its rows surround."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from model.arrays import BoolArray, FloatArray, Floats

#: Angles this far outside still count as inside: rounding on the way from degrees [rad].
SLACK = 1e-6
_NAMES = ("alpha", "tab", "aileron")
_BLOCK = 2**20


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex region of angles, order [alpha, dt, da]: a box, cut by planes unless it is all covered.

    Attributes
    ----------
    lower, upper : (3,) the box [rad]; an angle of which there is one value has no width
    normals, offsets : (m, 3), (m,) planes ``normal . angles + offset <= 0`` [-], [rad]; none for a box
    """

    lower: FloatArray
    upper: FloatArray
    normals: FloatArray
    offsets: FloatArray

    def contains(self, alpha: Floats, dt: Floats, da: Floats) -> BoolArray:
        """Mask (*G,) of the angles inside, `SLACK` included."""
        angles = np.stack(np.broadcast_arrays(*(np.asarray(x, float) for x in (alpha, dt, da))), axis=-1)
        inside = np.all((angles >= self.lower - SLACK) & (angles <= self.upper + SLACK), axis=-1)
        if len(self.offsets) == 0:
            return np.asarray(inside)
        flat, mask = angles.reshape(-1, 3), inside.reshape(-1).copy()
        size = max(1, _BLOCK // len(self.offsets))
        for start in range(0, len(flat), size):
            block = flat[start : start + size, None, :]
            mask[start : start + size] &= np.all(np.sum(block * self.normals, -1) + self.offsets <= SLACK, axis=-1)
        return np.asarray(mask.reshape(inside.shape))

    def __str__(self) -> str:
        low, high = np.rad2deg(self.lower), np.rad2deg(self.upper)
        spans = [
            f"{name} {a:.6g}" if a == b else f"{name} {a:.6g} to {b:.6g}"
            for name, a, b in zip(_NAMES, low, high, strict=True)
        ]
        return ", ".join(spans) + " deg" + (" (within the convex hull of the rows)" if len(self.offsets) else "")


def hull_of(angles: FloatArray) -> Hull:
    """Convex hull of rows (n, 3) of angles [rad]; an angle of one value gives it no width.

    Raises
    ------
    ValueError : the angles that vary do so in one plane or on one line only
    """
    lower, upper = angles.min(axis=0), angles.max(axis=0)
    box = Hull(lower, upper, np.zeros((0, 3)), np.zeros(0))
    wide = upper > lower
    if np.count_nonzero(wide) < 2 or _has_corners(angles, lower, upper):
        return box
    span = (upper - lower)[wide]
    try:
        hull = ConvexHull((angles[:, wide] - lower[wide]) / span)
    except QhullError:
        raise ValueError("the rows surround no angles: they lie in one plane or on one line") from None
    planes = np.unique(np.round(hull.equations, 12), axis=0)
    normals = np.zeros((len(planes), 3))
    normals[:, wide] = planes[:, :-1] / span
    size = np.linalg.norm(normals, axis=-1)
    offsets = (planes[:, -1] - np.sum(normals * lower, axis=-1)) / size
    return Hull(lower, upper, normals / size[:, None], offsets)


def _has_corners(angles: FloatArray, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether the rows hold every corner of their box: then the box is the hull."""
    ends = [np.unique([a, b]) for a, b in zip(lower, upper, strict=True)]
    return all(bool(np.any(np.all(angles == corner, axis=-1))) for corner in product(*ends))
