"""The schedule as a numpy archive: ``numpy.load("schedule.npz")`` gives its arrays by name, no pickle among them.

Members: every axis by its name with unit, every gain by its name, ``ok``, ``outcome`` (text), and ``gainfield``, a JSON
document of the words, units, axes, gains and reasons. Arrays have one dimension an axis, in the order of the axes.
"""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
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

ARRAY_ORDER = "dimension k of every array belongs to axis k of axes"

#: What numpy and its parts raise of archives that are damaged, besides ValueError.
_NOT_READ = (
    OSError, EOFError, zipfile.BadZipFile, AttributeError, TypeError, NotImplementedError, SyntaxError,
    tokenize.TokenError,
)  # fmt: skip

#: Time of every member: the earliest that the format knows. The usual one would be the time of writing.
_TIME = (1980, 1, 1, 0, 0, 0)


def write_npz(schedule: GainSchedule) -> bytes:
    """The schedule as an archive without compression: the bytes depend on the schedule alone."""
    arrays: dict[str, Any] = {axis_name(a): np.asarray(a.values, dtype="<f8") for a in schedule.axes}
    arrays |= {gain.name: np.asarray(gain.values, dtype="<f8") for gain in schedule.gains}
    arrays["ok"] = schedule.outcomes.ok
    arrays["outcome"] = np.vectorize(str, otypes=["<U16"])(schedule.outcomes.codes)
    arrays["gainfield"] = np.array(_about(schedule), dtype="<U")
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            member = zipfile.ZipInfo(f"{name}.npy", _TIME)
            member.create_system = 3
            member.external_attr = 0o644 << 16
            data = io.BytesIO()
            np.lib.format.write_array(data, np.ascontiguousarray(array).reshape(array.shape), allow_pickle=False)
            archive.writestr(member, data.getvalue())
    return content.getvalue()


def read_npz(content: bytes) -> GainSchedule:
    """The schedule of a file that `write_npz` wrote.

    Raises
    ------
    ValueError : no such archive, a member missing or not what it should be, another schema version, or parts that do
        not fit together
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {name: np.asarray(archive[name]) for name in archive.files}
    except _NOT_READ as error:
        raise ValueError(f"not a numpy archive: {error}") from None
    try:
        about = json.loads(str(member(arrays, "gainfield")))
    except RecursionError:
        raise ValueError("not a schedule file: nested too deeply") from None
    if not isinstance(about, dict):
        raise ValueError("not a schedule file: not an object")
    require_format(about)
    unit: Any = about.get("units")
    axes = tuple(
        GridAxis(inner_name(name, unit[name]), unit[name], tuple(numbers(arrays, name).ravel().tolist()))
        for name in _names(about, "axes", unit)
    )
    gains = tuple(Gain(name, unit[name], numbers(arrays, name)) for name in _names(about, "gains", unit))
    return schedule_from(about, axes, gains, _outcomes(arrays, about.get("reasons")))


def _about(schedule: GainSchedule) -> str:
    words: dict[str, Any] = {
        **header(schedule),
        **proof_members(schedule),
        "array_order": ARRAY_ORDER,
        "axes": [axis_name(axis) for axis in schedule.axes],
        "gains": [gain.name for gain in schedule.gains],
        "units": units(schedule),
        "reasons": schedule.outcomes.reasons.ravel().tolist(),
    }
    return json.dumps(words)


def _names(about: dict[str, Any], which: str, unit: Any) -> list[str]:
    """Names of the axes or of the gains, once each is known to have a unit."""
    listed = about.get(which)
    if not isinstance(listed, list) or not isinstance(unit, dict):
        raise ValueError(f"{which} must be a list, and units an object")
    if any(not isinstance(name, str) or not isinstance(unit.get(name), str) for name in listed):
        raise ValueError(f"{which} must be names that have a unit")
    return listed


def _outcomes(arrays: dict[str, Any], reasons: Any) -> Outcomes:
    codes = member(arrays, "outcome")
    if not isinstance(reasons, list) or len(reasons) != codes.size:
        raise ValueError(f"reasons must be a list of {codes.size}, row-major")
    if any(reason is not None and not isinstance(reason, str) for reason in reasons):
        raise ValueError("a reason must be text or null")
    outcomes = [Outcome(str(code)) for code in codes.ravel().tolist()]
    return Outcomes(object_array(outcomes, codes.shape), object_array(reasons, codes.shape))
