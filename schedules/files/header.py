"""What every schedule file says about itself, and the way back from it to a schedule.

One list of names for all formats: members of the JSON document, comment lines of the CSV, fields of
the MATLAB struct.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypeVar, get_args

import numpy as np

from design.gains import Gain
from design.outcome import Outcomes
from model.arrays import ObjectArray
from model.flight import GridAxis
from schedules.files.checks import require_writable
from schedules.files.proof_words import proof_from
from schedules.proof.table_proof import proved_schedule
from schedules.rules import INTEGRATOR_PLACEMENTS, INTERPOLATIONS, OUTS_OF_RANGE, ScheduleRules
from schedules.schedule import SCHEMA_VERSION, SIGN_CONVENTION, GainSchedule, Provenance
from schedules.wire_names import axis_name

#: Says which product and which thing a file holds.
FORMAT = "gainfield gain schedule"

RuleName = TypeVar("RuleName", bound=str)
Kind = Literal["negative_feedback", "positive_feedback", "lqr"]
_PROVENANCE = ("design_id", "design_name", "request_digest", "version", "created_at")


def header(schedule: GainSchedule) -> dict[str, str | int]:
    """The file's words about itself by name, in the order in which they are written."""
    provenance = {name: str(getattr(schedule.provenance, name)) for name in _PROVENANCE}
    return {
        "format": FORMAT,
        "schema_version": schedule.schema_version,
        **provenance,
        "controller": schedule.controller,
        "kind": schedule.kind,
        "law": schedule.law,
        "sign_convention": SIGN_CONVENTION,
        "interpolation": INTERPOLATIONS[schedule.rules.interpolation],
        "out_of_range": OUTS_OF_RANGE[schedule.rules.out_of_range],
        "integrator_placement": INTEGRATOR_PLACEMENTS[schedule.rules.integrator_placement],
    }


def units(schedule: GainSchedule) -> dict[str, str]:
    """Unit of every axis and gain by its name in the file; ``1`` for none."""
    axes = {axis_name(axis): axis.unit for axis in schedule.axes}
    return axes | {gain.name: gain.unit for gain in schedule.gains}


def schedule_from(
    header: Mapping[str, Any], axes: tuple[GridAxis, ...], gains: tuple[Gain, ...], outcomes: Outcomes
) -> GainSchedule:
    """Schedule from the parts of a file that was read, with the summary of its proof where the file holds one.

    Raises
    ------
    ValueError : not a schedule file, another schema version, a word missing or not text, a rule
        that this product does not have or that the file's version has not, parts that do not fit together, or a proof
        of another table
    """
    require_format(header)
    schedule = GainSchedule(
        controller=_text(header, "controller"),
        kind=_kind(_text(header, "kind")),
        axes=axes,
        gains=gains,
        outcomes=outcomes,
        law=_text(header, "law"),
        provenance=Provenance(**{name: _text(header, name) for name in _PROVENANCE}),
        rules=_rules(header),
    )
    if header["schema_version"] < schedule.schema_version:
        placement = header["integrator_placement"]
        raise ValueError(f"integrator_placement is {placement!r}, which schema_version 1 does not have")
    require_writable(schedule)
    proof = proof_from(header.get("proof"))
    return schedule if proof is None else proved_schedule(schedule, proof)


def require_format(header: Mapping[str, Any]) -> None:
    """Refuse what is no schedule file, or one of a schema version that this code does not know."""
    if header.get("format") != FORMAT:
        raise ValueError(f"not a schedule file: its format is not {FORMAT!r}")
    version = header.get("schema_version")
    if isinstance(version, bool) or version not in range(1, SCHEMA_VERSION + 1):
        raise ValueError(f"schema_version is {version!r}; this version reads 1 to {SCHEMA_VERSION}")


def object_array(items: list[Any], shape: tuple[int, ...]) -> ObjectArray:
    """Objects in row-major order as an array; numpy would try to look inside them."""
    array: ObjectArray = np.empty(len(items), dtype=object)
    array[:] = items
    return array.reshape(shape)


def _text(header: Mapping[str, Any], name: str) -> str:
    value = header.get(name)
    if not isinstance(value, str):
        raise ValueError(f"{name} must be text")
    return value


def _rules(header: Mapping[str, Any]) -> ScheduleRules:
    """The rules that the header's words stand for; older files say nothing of the integrators' place."""
    placement = "integrator_placement"
    given = header if placement in header else {**header, placement: INTEGRATOR_PLACEMENTS["before_gain"]}
    return ScheduleRules(
        _named(given, "interpolation", INTERPOLATIONS),
        _named(given, "out_of_range", OUTS_OF_RANGE),
        _named(given, placement, INTEGRATOR_PLACEMENTS),
    )


def _named(header: Mapping[str, Any], name: str, rules: Mapping[RuleName, str]) -> RuleName:
    """Name of the rule whose words the header has."""
    text = _text(header, name)
    for rule, words in rules.items():
        if words == text:
            return rule
    known = "; ".join(repr(words) for words in rules.values())
    raise ValueError(f"{name} is {text!r}; there are: {known}")


def _kind(text: str) -> Kind:
    kinds: tuple[Kind, ...] = get_args(Kind)
    for kind in kinds:
        if kind == text:
            return kind
    raise ValueError(f"kind is {text!r}; there are: {', '.join(kinds)}")
