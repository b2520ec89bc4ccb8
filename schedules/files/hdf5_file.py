r"""The schedule as HDF5: axes as dimension scales, a dataset a gain, words and units as attributes.

The library, h5py, is an extra (``pip install .[hdf5]``) and is imported when a file is written or read. Arrays have one
dimension an axis, in the order of the axes, as C and numpy count them; MATLAB and Octave show HDF5 with its dimensions
reversed. Texts are ASCII with the escapes of JSON (``\u00fc``), which HDF5 can hold whatever they are.
"""

from __future__ import annotations

import io
import json
from importlib import import_module
from typing import Any

import numpy as np

from design.gains import Gain
from design.outcome import Outcome, Outcomes
from model.flight import GridAxis
from schedules.files.array_members import member, numbers
from schedules.files.header import header, object_array, require_format, schedule_from, units
from schedules.files.proof_words import proof_members
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name, inner_name

ARRAY_ORDER = (
    "dimension k of every dataset belongs to axis k of axes, as C and numpy count; MATLAB and Octave show the "
    "dimensions of HDF5 in reverse order"
)
MISSING = "nan, and ok is 0 there; outcome and reason say why"

#: Longest outcome code in bytes.
_CODE = "S16"


class LibraryMissing(Exception):
    """h5py is not installed."""


def write_hdf5(schedule: GainSchedule) -> bytes:
    """The schedule as a file in memory; no time of writing is in it.

    Raises
    ------
    LibraryMissing
    """
    h5py = _library()
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        _write_words(h5py, file, schedule)
        axes = [axis_name(axis) for axis in schedule.axes]
        unit = units(schedule)
        for name, axis in zip(axes, schedule.axes, strict=True):
            _dataset(file, name, np.asarray(axis.values, dtype="<f8"), unit[name]).make_scale(name)
        for gain in schedule.gains:
            _dataset(file, gain.name, np.asarray(gain.values, dtype="<f8"), gain.unit)
        _dataset(file, "ok", schedule.outcomes.ok.astype("u1"), "1")
        _dataset(file, "outcome", np.vectorize(str, otypes=["U16"])(schedule.outcomes.codes).astype(_CODE), "1")
        reasons = np.vectorize(lambda why: _escaped(why or ""), otypes=[object])(schedule.outcomes.reasons)
        file.create_dataset("reason", data=reasons, dtype=h5py.string_dtype("ascii"), track_times=False)
        for name in [gain.name for gain in schedule.gains] + ["ok", "outcome", "reason"]:
            for k, axis_of in enumerate(axes):
                file[name].dims[k].attach_scale(file[axis_of])
    return content.getvalue()


def read_hdf5(content: bytes) -> GainSchedule:
    """The schedule of a file that `write_hdf5` wrote.

    Raises
    ------
    LibraryMissing
    ValueError : no such file, a dataset missing or not what it should be, another schema version, or parts that do not
        fit together
    """
    h5py = _library()
    try:
        words, arrays, unit = _read(h5py, content)
    except Exception as error:  # of damaged files the library raises whatever its parts raise
        raise ValueError(f"not a schedule file in HDF5: {error}") from None
    require_format(words)
    axes = tuple(
        GridAxis(inner_name(name, _unit(unit, name)), _unit(unit, name), tuple(numbers(arrays, name).ravel().tolist()))
        for name in _names(words, "axes")
    )
    shape = tuple(len(axis.values) for axis in axes)
    gains = tuple(Gain(name, _unit(unit, name), numbers(arrays, name)) for name in _names(words, "gains"))
    codes = [Outcome(_decoded(code)) for code in _over_grid(arrays, "outcome", shape)]
    reasons = [_unescaped(_decoded(why)) or None for why in _over_grid(arrays, "reason", shape)]
    return schedule_from(words, axes, gains, Outcomes(object_array(codes, shape), object_array(reasons, shape)))


def _library() -> Any:
    """h5py, which takes time to import and need not be there."""
    try:
        return import_module("h5py")
    except ImportError:
        raise LibraryMissing("HDF5 files need h5py, the extra hdf5 of this product: pip install .[hdf5]") from None


def _write_words(h5py: Any, file: Any, schedule: GainSchedule) -> None:
    text = h5py.string_dtype("ascii")
    words: dict[str, Any] = {**header(schedule), **proof_members(schedule)}
    words |= {"array_order": ARRAY_ORDER, "missing": MISSING}
    for name, word in words.items():
        if isinstance(word, int):
            file.attrs[name] = np.int64(word)
        else:
            file.attrs.create(name, _escaped(word) if isinstance(word, str) else json.dumps(word), dtype=text)
    for name, listed in (("axes", map(axis_name, schedule.axes)), ("gains", (gain.name for gain in schedule.gains))):
        file.attrs.create(name, json.dumps(list(listed)), dtype=text)


def _dataset(file: Any, name: str, values: Any, unit: str) -> Any:
    made = file.create_dataset(name, data=values, track_times=False)
    made.attrs["unit"] = _escaped(unit)
    return made


def _read(h5py: Any, content: bytes) -> tuple[dict[str, Any], dict[str, Any], dict[str, str]]:
    """Words of the root, arrays by name, and units by name."""
    with h5py.File(io.BytesIO(content), "r") as file:
        words = {name: _word(name, value) for name, value in file.attrs.items()}
        arrays = {name: np.asarray(dataset[()]) for name, dataset in file.items()}
        unit = {name: _unescaped(dataset.attrs["unit"]) for name, dataset in file.items() if "unit" in dataset.attrs}
    return words, arrays, unit


def _word(name: str, value: Any) -> Any:
    if not isinstance(value, str):
        return int(value)
    return json.loads(value) if name in ("axes", "gains", "proof") else _unescaped(value)


def _escaped(text: str) -> str:
    return json.dumps(text)[1:-1]


def _unescaped(text: str) -> str:
    return str(json.loads(f'"{text}"'))


def _decoded(text: Any) -> str:
    return text.decode("ascii") if isinstance(text, bytes) else str(text)


def _names(words: dict[str, Any], which: str) -> list[str]:
    listed = words.get(which)
    if not isinstance(listed, list) or any(not isinstance(name, str) for name in listed):
        raise ValueError(f"{which} must be a list of names")
    return listed


def _unit(units: dict[str, str], name: str) -> str:
    if name not in units:
        raise ValueError(f"not a schedule file: it has no {name} with a unit")
    return units[name]


def _over_grid(arrays: dict[str, Any], name: str, shape: tuple[int, ...]) -> list[Any]:
    array = member(arrays, name)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}, the grid has {shape}")
    flat: list[Any] = array.ravel().tolist()
    return flat
