"""Array types of the whole product, and the base of every result that carries the grid's axes."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
ObjectArray = NDArray[np.object_]
#: A number, or an array of them that broadcasts against the grid.
Floats = float | FloatArray


class GridArrays:
    """Base of the frozen result dataclasses: every array field begins with the grid's axes ``*G``.

    The arrays become read-only views when the result is made, so that no room of the product can
    change what another one computed. Fields that are not arrays (names, labels, scalars) belong to
    the whole grid.
    """

    def __post_init__(self) -> None:
        for field in fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                view = value.view()
                view.flags.writeable = False
                object.__setattr__(self, field.name, view)

    def take(self, index: Any) -> Self:
        """Same result at some grid points: `index` is applied to the leading axes of every array.

        Parameters
        ----------
        index : anything numpy accepts: an integer, a tuple, a boolean mask of shape ``G``
        """
        values = {f.name: _take(getattr(self, f.name), index) for f in fields(self)}  # type: ignore[arg-type]
        return type(self)(**values)

    def spread(self, mask: BoolArray) -> Self:
        """Undo ``take(mask)``: back over the whole grid, with nan, False or None where the mask is False."""
        values = {f.name: _spread(getattr(self, f.name), mask) for f in fields(self)}  # type: ignore[arg-type]
        return type(self)(**values)


def _take(value: Any, index: Any) -> Any:
    if isinstance(value, np.ndarray):
        return np.asarray(value[index], dtype=value.dtype)  # one point of G = () is an array too
    if isinstance(value, GridArrays):
        return value.take(index)
    if isinstance(value, tuple) and value and all(is_dataclass(v) for v in value):
        return tuple(_take(v, index) for v in value)
    return value


def _spread(value: Any, mask: BoolArray) -> Any:
    if isinstance(value, np.ndarray):
        empty = {"f": np.nan, "c": np.nan, "b": False, "O": None, "i": -1}[value.dtype.kind]
        whole = np.full((*mask.shape, *value.shape[1:]), empty, dtype=value.dtype)
        whole[mask] = value
        return whole
    if isinstance(value, GridArrays):
        return value.spread(mask)
    if isinstance(value, tuple) and value and all(is_dataclass(v) for v in value):
        return tuple(_spread(v, mask) for v in value)
    return value
