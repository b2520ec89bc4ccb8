"""Arrays of a file by their names: what a reader of untrusted arrays takes of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.arrays import FloatArray


def member(arrays: dict[str, Any], name: str) -> Any:
    """The array of that name.

    Raises
    ------
    ValueError : there is none
    """
    if name not in arrays:
        raise ValueError(f"not a schedule file: it has no {name}")
    return arrays[name]


def numbers(arrays: dict[str, Any], name: str) -> FloatArray:
    """The array of that name, of numbers in double precision.

    Raises
    ------
    ValueError : there is none, or it holds something else
    """
    array = member(arrays, name)
    if array.dtype != np.float64:
        raise ValueError(f"{name} must hold numbers in double precision")
    return np.asarray(array, dtype=float)
