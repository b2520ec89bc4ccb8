"""The schedule as JSON: everything it holds, and read back without loss.

``gains[k].values[i][j]`` belongs to ``axes[0].values[i]`` and ``axes[1].values[j]``: nested lists,
row-major. A gain that does not exist is null, and ``outcomes`` and ``reasons`` of the same shape say
why. Numbers are the shortest that read back to the same double; nan and infinity do not occur.
"""

from __future__ import annotations

import json
from typing import Any, NoReturn

import numpy as np

from design.gains import Gain
from design.outcome import Outcome, Outcomes
from model.arrays import FloatArray
from model.flight import GridAxis
from schedules.files.header import header, object_array, require_format, schedule_from
from schedules.files.proof_words import proof_members
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name, inner_name

ARRAY_ORDER = "row-major nested lists: the first index counts the first axis, the last axis varies fastest"


def write_json(schedule: GainSchedule) -> bytes:
    """The schedule as a JSON document, one member a line, in ASCII."""
    members: dict[str, Any] = {
        **header(schedule),
        **proof_members(schedule),
        "array_order": ARRAY_ORDER,
        "axes": [{"name": axis_name(a), "unit": a.unit, "values": list(a.values)} for a in schedule.axes],
        "outcomes": np.vectorize(str, otypes=[object])(schedule.outcomes.codes).tolist(),
        "reasons": schedule.outcomes.reasons.tolist(),
        "gains": [{"name": g.name, "unit": g.unit, "values": _with_null(g.values)} for g in schedule.gains],
    }
    lines = (f"{json.dumps(name)}: {json.dumps(value, allow_nan=False)}" for name, value in members.items())
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode("ascii")


def read_json(content: bytes) -> GainSchedule:
    """The schedule of a file that `write_json` wrote, or that someone made in its image.

    Raises
    ------
    ValueError : not JSON, not a schedule of this schema version, or parts that do not fit together;
        the message begins with the place in the document
    """
    try:
        document = json.loads(content, parse_constant=_refuse_constant)
    except RecursionError:
        raise ValueError("not a schedule file: nested too deeply") from None
    if not isinstance(document, dict):
        raise ValueError("not a schedule file: not an object")
    require_format(document)
    axes = tuple(_axis(item, f"/axes/{i}") for i, item in enumerate(_list(document.get("axes"), "/axes")))
    shape = tuple(len(axis.values) for axis in axes)
    gains = tuple(_gain(item, shape, f"/gains/{i}") for i, item in enumerate(_list(document.get("gains"), "/gains")))
    return schedule_from(document, axes, gains, _outcomes(document, shape))


def _with_null(values: FloatArray) -> Any:
    objects = values.astype(object)
    objects[np.isnan(values)] = None
    return objects.tolist()


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not JSON")


def _axis(item: Any, place: str) -> GridAxis:
    unit = _text(item, "unit", place)
    values = _list(item.get("values"), f"{place}/values")
    numbers = tuple(_number(value, f"{place}/values/{i}") for i, value in enumerate(values))
    return GridAxis(inner_name(_text(item, "name", place), unit), unit, numbers)


def _gain(item: Any, shape: tuple[int, ...], place: str) -> Gain:
    name, unit = _text(item, "name", place), _text(item, "unit", place)
    flat = _flat(item.get("values"), shape, f"{place}/values")
    numbers = [np.nan if value is None else _number(value, f"{place}/values") for value in flat]
    return Gain(name, unit, np.array(numbers, dtype=float).reshape(shape))


def _outcomes(document: dict[str, Any], shape: tuple[int, ...]) -> Outcomes:
    codes = [Outcome(code) for code in _flat(document.get("outcomes"), shape, "/outcomes")]
    reasons = _flat(document.get("reasons"), shape, "/reasons")
    if any(reason is not None and not isinstance(reason, str) for reason in reasons):
        raise ValueError("/reasons: expected text or null")
    return Outcomes(object_array(codes, shape), object_array(reasons, shape))


def _flat(data: Any, shape: tuple[int, ...], place: str) -> list[Any]:
    """Leaves of nested lists in row-major order, once they are known to have this shape."""
    if not shape:
        return [data]
    if len(_list(data, place)) != shape[0]:
        raise ValueError(f"{place}: expected {shape[0]} entries, there are {len(data)}")
    return [leaf for i, part in enumerate(data) for leaf in _flat(part, shape[1:], f"{place}/{i}")]


def _list(value: Any, place: str) -> list[Any]:
    if not isinstance(value, list):
        raise ValueError(f"{place}: expected a list")
    return value


def _text(item: Any, name: str, place: str) -> str:
    if not isinstance(item, dict) or not isinstance(item.get(name), str):
        raise ValueError(f"{place}/{name}: expected text")
    return str(item[name])


def _number(value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{place}: expected a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{place}: too large for a number") from None
