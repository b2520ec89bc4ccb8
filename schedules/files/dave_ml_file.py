"""The schedule as DAVE-ML (ANSI/AIAA S-119, function DTD 2.0): gridded tables with check cases.

Variables keep the schedule's names and SI units in DAVE-ML's spelling (``N m/rad`` is ``Nm_rad``). Interpolation is
linear and the end value is held outside, which are DAVE-ML's defaults: a schedule of other rules is refused. The
static shots at the end are conditions with the gains that belong to them, so that any reader can check its own
interpolation.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.sax.saxutils import escape, quoteattr

from design.gains import Gain
from schedules.files.check_points import CheckPoint, check_points, magnitudes
from schedules.files.plain_text import number, plain, wrapped
from schedules.files.words import require_clip, require_multilinear, require_table, words
from schedules.fill import FilledSchedule
from schedules.wire_names import axis_name

ARRAY_ORDER = "row-major: the last breakpoint reference varies fastest"

_HEAD = """\
<?xml version="1.0" encoding="US-ASCII"?>
<!DOCTYPE DAVEfunc PUBLIC "-//AIAA//DTD for Flight Dynamic Models - Functions 2.0//EN" "http://www.daveml.org/DTDs/2p0/DAVEfunc.dtd">
<DAVEfunc xmlns="http://daveml.org/2010/DAVEML">"""

_FILLED = "weight of points that were not designed but filled, 0 to 1"

#: Rounding errors that a check case allows, in parts of what they are in proportion to.
_ROUNDING = 1e-13


def write_dave_ml(schedule: FilledSchedule) -> bytes:
    """The document, in ASCII.

    The output ``filled`` is there when points were filled: the weight of such points in the gains, 0 to 1.

    Raises
    ------
    ValueError : a schedule without axes or gains, of other rules than these, or names that would stand twice in the
        document
    """
    require_table(schedule)
    require_multilinear(schedule, "a linear gridded table of DAVE-ML")
    require_clip(schedule, "a linear gridded table of DAVE-ML")
    designed = schedule.designed
    gains = list(schedule.complete.gains)
    if schedule.rule is not None:
        gains.append(Gain("filled", "1", schedule.filled.astype(float)))
    axes = [axis_name(axis) for axis in designed.axes]
    identifiers = [*axes, *(f"bp_{name}" for name in axes), *(g.name for g in gains), *(f"gt_{g.name}" for g in gains)]
    for name in identifiers:
        if identifiers.count(name) > 1 or name.lower().startswith("xml"):
            raise ValueError(f"{name!r} cannot be an identifier of a DAVE-ML document, or stands twice in it")
    lines = [_HEAD, *_file_header(schedule)]
    for axis in designed.axes:
        lines += _variable(axis_name(axis), axis.unit, "isInput", "axis of the grid")
    for gain in gains:
        lines += _variable(gain.name, gain.unit, "isOutput", "gain" if gain.name != "filled" else _FILLED)
    for axis in designed.axes:
        lines.append(f' <breakpointDef bpID="bp_{axis_name(axis)}" units={quoteattr(dave_unit(axis.unit))}>')
        lines += _values("bpVals", [number(x) for x in axis.values])
        lines.append(" </breakpointDef>")
    for gain in gains:
        lines += _table(gain, axes)
    for gain in gains:
        lines += _function(gain, axes)
    lines += [" <checkData>", *_shots(schedule), " </checkData>", "</DAVEfunc>"]
    return ("\n".join(lines) + "\n").encode("ascii")


def dave_unit(unit: str) -> str:
    """Unit as DAVE-ML spells it: ``nd`` for none, products run together, ``_`` for per, powers as digits."""
    if unit == "1":
        return "nd"
    return re.sub(r"[() ^]", "", unit).replace("/", "_")


def _text(text: str) -> str:
    return escape(plain(text))


def _file_header(schedule: FilledSchedule) -> Iterator[str]:
    provenance = schedule.designed.provenance
    date = re.match(r"\d{4}-\d{2}-\d{2}", provenance.created_at)
    yield f" <fileHeader name={quoteattr(plain(provenance.design_name))}>"
    author = quoteattr(plain(f"Gainfield {provenance.version}"))
    yield f'  <author name={author} org="Gainfield"/>'
    yield f'  <creationDate date="{date[0] if date else ""}"/>'
    yield "  <description>"
    for name, text in words(schedule, ARRAY_ORDER):
        yield f"   {name}: {_text(text)}"
    yield "  </description>"
    yield " </fileHeader>"


def _variable(name: str, unit: str, role: str, what: str) -> Iterator[str]:
    yield f' <variableDef name="{name}" varID="{name}" units={quoteattr(dave_unit(unit))}>'
    yield f"  <description>{what} [{_text(unit)}]</description>"
    yield f"  <{role}/>"
    yield " </variableDef>"


def _table(gain: Gain, axes: list[str]) -> Iterator[str]:
    yield f' <griddedTableDef gtID="gt_{gain.name}" units={quoteattr(dave_unit(gain.unit))}>'
    references = "".join(f'<bpRef bpID="bp_{name}"/>' for name in axes)
    yield f"  <breakpointRefs>{references}</breakpointRefs>"
    yield from _values("dataTable", [number(x) for x in gain.values.ravel()])
    yield " </griddedTableDef>"


def _function(gain: Gain, axes: list[str]) -> Iterator[str]:
    yield f' <function name="{gain.name} schedule">'
    for name in axes:
        yield f'  <independentVarRef varID="{name}"/>'
    yield f'  <dependentVarRef varID="{gain.name}"/>'
    yield f'  <functionDefn><griddedTableRef gtID="gt_{gain.name}"/></functionDefn>'
    yield " </function>"


def _values(element: str, items: list[str]) -> Iterator[str]:
    yield f"  <{element}>"
    yield from wrapped(items, ", ", "   ")
    yield f"  </{element}>"


def _shots(schedule: FilledSchedule) -> Iterator[str]:
    tolerances = [_ROUNDING * x for x in magnitudes(schedule.complete)]
    for check in check_points(schedule.complete):
        yield from _shot(schedule, check, tolerances)


def _shot(schedule: FilledSchedule, check: CheckPoint, tolerances: list[float]) -> Iterator[str]:
    yield f'  <staticShot name="{check.name}">'
    yield "   <checkInputs>"
    for axis, value in zip(schedule.designed.axes, check.coordinates, strict=True):
        yield f"    {_signal(axis_name(axis), axis.unit, value)}</signal>"
    yield "   </checkInputs>"
    yield "   <checkOutputs>"
    for gain, value, tolerance in zip(schedule.designed.gains, check.gains, tolerances, strict=True):
        yield f"    {_signal(gain.name, gain.unit, value)}<tol>{number(tolerance)}</tol></signal>"
    yield "   </checkOutputs>"
    yield "  </staticShot>"


def _signal(name: str, unit: str, value: float) -> str:
    return (
        f"<signal><signalName>{name}</signalName><signalUnits>{escape(dave_unit(unit))}</signalUnits>"
        f"<signalValue>{number(value)}</signalValue>"
    )
