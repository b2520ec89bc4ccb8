"""The way back from a MAT-file to the schedule."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
from scipy.io import loadmat

from design.gains import Gain
from design.outcome import Outcome, Outcomes
from model.arrays import FloatArray
from model.flight import GridAxis
from schedules.files.header import object_array, require_format, schedule_from
from schedules.schedule import GainSchedule
from schedules.wire_names import inner_name


def read_matlab(content: bytes) -> GainSchedule:
    """The schedule of a file that `write_matlab` wrote: axes, gains and outcomes to the last bit.

    Texts come back as the file has them, in ASCII with escapes; an empty reason is none.

    Raises
    ------
    ValueError : no such file, a variable missing or not what it should be, another schema version, or parts that do not
        fit together
    """
    try:
        # The stubs know of paths only; loadmat reads open files as well.
        variables = loadmat(io.BytesIO(content), simplify_cells=True)  # type: ignore[arg-type]
    except Exception as error:  # of damaged files the reader raises whatever its parts raise, zlib's error among them
        raise ValueError(f"not a MAT-file of version 5: {error}") from None
    about = variables.get("gainfield")
    if not isinstance(about, dict):
        raise ValueError("not a schedule file: it has no struct gainfield")
    words = {name: _word(value) for name, value in about.items()}
    require_format(words)
    words["proof"] = _proof(words.get("proof"))
    units = about.get("units")
    if not isinstance(units, dict):
        raise ValueError("units must be a struct")
    names = [str(name) for name in np.ravel(about.get("axes", []))]
    axes = tuple(_axis(variables, name, str(units.get(name))) for name in names)
    shape = tuple(len(axis.values) for axis in axes)
    gains = tuple(
        Gain(name, str(unit), _over_grid(variables, name, shape)) for name, unit in units.items() if name not in names
    )
    codes = [Outcome(str(code)) for code in _cells(about, "outcomes", shape)]
    reasons = [str(reason) if np.size(reason) else None for reason in _cells(about, "reasons", shape)]
    reasons = [reason or None for reason in reasons]
    return schedule_from(words, axes, gains, Outcomes(object_array(codes, shape), object_array(reasons, shape)))


def _word(value: Any) -> Any:
    """A text or number of the struct; an empty text arrives as an empty array."""
    if isinstance(value, np.ndarray) and value.size == 0:
        return ""
    return value


def _proof(word: Any) -> Any:
    """The summary of a proof, which stands in the struct as a text of JSON; files of before there was one have none."""
    try:
        return None if word is None else json.loads(str(word))
    except RecursionError:
        raise ValueError("proof is nested too deeply") from None


def _axis(variables: dict[str, Any], name: str, unit: str) -> GridAxis:
    return GridAxis(inner_name(name, unit), unit, tuple(_numbers(variables, name).ravel().tolist()))


def _numbers(variables: dict[str, Any], name: str) -> FloatArray:
    try:
        return np.asarray(variables[name], dtype=float)
    except KeyError:
        raise ValueError(f"not a schedule file: it has no {name}") from None
    except (TypeError, ValueError):
        raise ValueError(f"{name} must hold numbers") from None


def _over_grid(variables: dict[str, Any], name: str, shape: tuple[int, ...]) -> FloatArray:
    """The array in the grid's shape, which a file of MATLAB may have dropped or added dimensions of length 1 to."""
    values, size = _numbers(variables, name), int(np.prod(shape))
    if values.size != size:
        raise ValueError(f"{name} has {values.size} numbers, the grid {size}")
    return values.reshape(shape)


def _cells(about: dict[str, Any], name: str, shape: tuple[int, ...]) -> list[Any]:
    cells = about.get(name)
    # One cell arrives as what it holds, many as an array of objects or of texts.
    flat = list(cells.ravel()) if isinstance(cells, np.ndarray) and cells.size else [cells]
    if len(flat) != int(np.prod(shape)):
        raise ValueError(f"{name} must be {int(np.prod(shape))} cells")
    return flat
