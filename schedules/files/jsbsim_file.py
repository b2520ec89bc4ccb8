"""The schedule as a JSBSim system: a table per gain, looked up as the simulation flies.

Put it into ``aircraft/<name>/Systems/`` and add ``<system file="wind_tunnel_nf"/>`` to the aircraft. Its first channel
works out the grid's axes in SI from what JSBSim knows; the second looks up the gains, which are the properties
``gainfield/<controller>/<gain>``. JSBSim's tables are linear between the breakpoints and clipped outside: a
schedule of other rules is refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from design.gains import Gain
from model.arrays import FloatArray
from model.flight import GridAxis
from schedules.files.plain_text import in_xml_comment, number
from schedules.files.words import identifier, require_clip, require_multilinear, require_table, words
from schedules.fill import FilledSchedule
from schedules.wire_names import axis_name

ARRAY_ORDER = (
    "rows are the first axis, columns the second, slices the third; an axis of one breakpoint is left out: the gains "
    "are constant along it"
)

#: JSBSim has tables of at most so many dimensions.
MOST_AXES = 3

#: Radius of the Earth that goes with geopotential altitude in the standard atmosphere [m].
_EARTH_RADIUS = 6356766.0
_FOOT = 0.3048
#: One pound-force per square foot [Pa].
_PSF = 4.4482216152605 / _FOOT**2

_ALTITUDE = f"""\
<quotient><!-- geopotential: r h / (r + h) -->
     <product><value>{_EARTH_RADIUS!r}</value><value>{_FOOT!r}</value><property>position/h-sl-ft</property></product>
     <sum><value>{_EARTH_RADIUS!r}</value><product><value>{_FOOT!r}</value><property>position/h-sl-ft</property></product></sum>
    </quotient>"""

#: Axis of a grid in SI, from JSBSim's own properties.
INPUTS: dict[str, str] = {
    "altitude_m": _ALTITUDE,
    "dynamic_pressure_pa": f"<product><value>{_PSF!r}</value><property>aero/qbar-psf</property></product>",
    "airspeed_m_s": f"<product><value>{_FOOT!r}</value><property>velocities/vt-fps</property></product>",
    "mach": "<property>velocities/mach</property>",
}


def write_jsbsim(schedule: FilledSchedule) -> bytes:
    """The system, in ASCII.

    The property ``gainfield/<controller>/filled`` is there when points were filled: the weight of such points in the
    gains of this moment, 0 to 1.

    Raises
    ------
    ValueError : a schedule without axes or gains, of other rules than these, with more than three axes that vary, or
        with an axis that JSBSim does not know
    """
    require_table(schedule)
    require_multilinear(schedule, "JSBSim")
    require_clip(schedule, "JSBSim")
    designed = schedule.designed
    for axis in designed.axes:
        if axis_name(axis) not in INPUTS:
            raise ValueError(f"JSBSim knows no {axis_name(axis)}; it knows {', '.join(INPUTS)}")
    if sum(n > 1 for n in designed.shape) > MOST_AXES:
        raise ValueError(f"a table of JSBSim has at most {MOST_AXES} axes, this one {len(designed.axes)}")
    name = identifier(designed.controller)
    here = f"gainfield/{name}"
    lines = ['<?xml version="1.0" encoding="US-ASCII"?>', "<!--"]
    lines += [f"  {word}: {in_xml_comment(text)}" for word, text in words(schedule, ARRAY_ORDER)]
    lines += ["-->", f'<system name="{name}">', f' <channel name="{name} inputs">']
    for axis in designed.axes:
        lines.append(f'  <fcs_function name="{here}/{axis_name(axis)}">')
        lines.append(f"   <function>\n    {INPUTS[axis_name(axis)]}\n   </function>")
        lines.append("  </fcs_function>")
    lines += [" </channel>", f' <channel name="{name} gains">']
    gains = schedule.complete.gains
    if schedule.rule is not None:
        gains = (*gains, Gain("filled", "1", schedule.filled.astype(float)))
    for gain in gains:
        lines += _table(here, gain, designed.axes)
    lines += [" </channel>", "</system>"]
    return ("\n".join(lines) + "\n").encode("ascii")


def _table(here: str, gain: Gain, axes: Sequence[GridAxis]) -> Iterator[str]:
    """A gain's function of the axes that have more than one breakpoint; of the first when none has."""
    kept = [k for k, axis in enumerate(axes) if len(axis.values) > 1] or [0]
    values = gain.values.reshape([len(axes[k].values) for k in kept])
    yield f'  <fcs_function name="{here}/{gain.name}"> <!-- [{in_xml_comment(gain.unit)}] -->'
    yield "   <function><table>"
    for k, lookup in zip(kept, ("row", "column", "table"), strict=False):
        yield f'    <independentVar lookup="{lookup}">{here}/{axis_name(axes[k])}</independentVar>'
    points = [np.asarray(axes[k].values, dtype=float) for k in kept]
    if len(kept) == MOST_AXES:
        for at, slice_ in zip(points[2], np.moveaxis(values, 2, 0), strict=True):
            yield f'    <tableData breakPoint="{number(at)}">'
            yield from _rows(slice_, points[0], points[1])
            yield "    </tableData>"
    else:
        yield "    <tableData>"
        yield from _rows(values, points[0], points[1] if len(kept) > 1 else None)
        yield "    </tableData>"
    yield "   </table></function>"
    yield "  </fcs_function>"


def _rows(values: FloatArray, rows: FloatArray, columns: FloatArray | None) -> Iterator[str]:
    if columns is not None:
        yield " ".join(["     ", *map(number, columns)])
    for at, row in zip(rows, values.reshape(rows.size, -1), strict=True):
        yield " ".join(["     ", number(at), *map(number, row)])
