"""What a file with a number at every point says about itself: the header, units, axis order, and what was filled."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator

import numpy as np

from schedules.files.csv_file import write_csv
from schedules.files.header import header, units
from schedules.files.proof_words import proof_in_words
from schedules.fill import FILL_RULES, FilledSchedule
from schedules.proof.table_proof import without_proof
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name


def words(schedule: FilledSchedule, array_order: str) -> Iterator[tuple[str, str]]:
    """Name and text of everything that the file says in words, in the order in which it is written."""
    designed = schedule.designed
    for name, word in header(designed).items():
        yield name, str(word)
    yield "axes", ", ".join(axis_name(axis) for axis in designed.axes)
    yield "units", "; ".join(f"{name} [{unit}]" for name, unit in units(designed).items())
    yield "array_order", array_order
    yield "outcomes", outcomes_in_words(schedule)
    yield "fill", fill_in_words(schedule)
    yield "proof", proof_in_words(designed)
    for point in np.argwhere(schedule.filled).tolist():
        yield f"filled_point {point}", _origin(schedule, tuple(point))


def outcomes_in_words(schedule: FilledSchedule) -> str:
    """How many points have each outcome."""
    codes = [str(code) for code in schedule.designed.outcomes.codes.flat]
    return ", ".join(f"{codes.count(code)} {code}" for code in dict.fromkeys(["ok", *codes]))


def fill_in_words(schedule: FilledSchedule) -> str:
    """The rule by which points were filled, or that none was."""
    if schedule.rule is None:
        return "none: every point of the grid is ok"
    return f"{schedule.rule}: {FILL_RULES[schedule.rule]}. Nothing was designed or proved at a filled point"


def _origin(schedule: FilledSchedule, point: tuple[int, ...]) -> str:
    outcomes, shape = schedule.designed.outcomes, schedule.designed.shape
    source = [int(i) for i in np.unravel_index(int(schedule.source[point]), shape)]
    reason = outcomes.reasons[point]
    return f"{outcomes.codes[point]}, gains of point {source}" + (f"; {reason}" if reason else "")


def require_table(schedule: FilledSchedule) -> None:
    """Refuse what is no table.

    Raises
    ------
    ValueError : a schedule without axes, or without gains
    """
    if not schedule.designed.axes or not schedule.designed.gains:
        raise ValueError("a schedule without axes or without gains is no table: there is nothing to look up")


def require_multilinear(schedule: FilledSchedule, program: str) -> None:
    """Refuse a rule between the points that the file's program would not follow.

    Raises
    ------
    ValueError : a schedule that is not multilinear
    """
    rule = schedule.designed.rules.interpolation
    if rule != "multilinear":
        raise ValueError(
            f"the schedule's interpolation is {rule} ({INTERPOLATIONS[rule]}), and {program} interpolates "
            "multilinearly: its gains between the points would be others"
        )


def require_clip(schedule: FilledSchedule, program: str) -> None:
    """Refuse a rule outside the points that the file's program would not follow.

    Raises
    ------
    ValueError : a schedule that is not clipped
    """
    rule = schedule.designed.rules.out_of_range
    if rule != "clip":
        raise ValueError(
            f"outside the grid the schedule's rule is {rule} ({OUTS_OF_RANGE[rule]}), and {program} takes the nearest "
            "edge"
        )


def identifier(text: str) -> str:
    """The text as a name in C, XML and MATLAB: letters, digits and underscores, a letter first."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    return name if re.match("[A-Za-z]", name) else f"s_{name}"


def fingerprint(schedule: FilledSchedule) -> str:
    """Sixteen hexadecimal digits that two different tables do not share, however they are named, proved or not."""
    content = write_csv(without_proof(schedule.designed)) + str(schedule.rule).encode()
    return hashlib.sha256(content).hexdigest()[:16]


def file_name_parts(schedule: GainSchedule, suffix: str) -> tuple[str, str]:
    """Design and controller as parts of a file's name that every file system takes.

    A MATLAB script is called by its name, which must then be an identifier. The C source includes its header by this
    name.
    """
    parts = _part(schedule.provenance.design_name), _part(schedule.controller)
    return (identifier(parts[0]), parts[1].replace("-", "_")) if suffix == "m" else parts


def _part(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "-", text).strip("-")[:64].strip("-") or "design"


def file_name(schedule: GainSchedule, suffix: str) -> str:
    """Name of the schedule's file of a format: ``wind_tunnel_nf.h``."""
    return f"{'_'.join(file_name_parts(schedule, suffix))}.{suffix}"
