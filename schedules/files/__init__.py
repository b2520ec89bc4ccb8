"""Files of a gain schedule, one format a module: suffix -> media type and writer.

Every file is a function of the schedule alone: the same schedule gives the same bytes. Every file
carries the schema version, the design it came from, units, sign convention, control law,
outcomes, and the rule between and outside the grid points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from schedules.files.checks import require_writable
from schedules.files.csv_file import read_csv, write_csv
from schedules.files.json_file import read_json, write_json
from schedules.files.matlab_file import write_matlab
from schedules.schedule import GainSchedule

__all__ = ["FILE_FORMATS", "FileFormat", "read_csv", "read_json", "write_schedule"]


@dataclass(frozen=True)
class FileFormat:
    """One format: the ending of its files without the dot, its media type, and what writes it."""

    suffix: str
    media_type: str
    write: Callable[[GainSchedule], bytes]


#: The formats there are, by suffix.
FILE_FORMATS: dict[str, FileFormat] = {
    f.suffix: f
    for f in (
        FileFormat("json", "application/json", write_json),
        FileFormat("csv", "text/csv; charset=utf-8", write_csv),
        FileFormat("mat", "application/x-matlab-data", write_matlab),
    )
}


def write_schedule(schedule: GainSchedule, suffix: str) -> bytes:
    """The schedule as the content of a file of the format `suffix` (``json``, ``csv``, ``mat``).

    Raises
    ------
    ValueError : there is no such format (the message lists those there are), or the schedule breaks
        one of the promises of `schedules.files.checks.require_writable`
    """
    if suffix not in FILE_FORMATS:
        raise ValueError(f"no schedule file {suffix!r}; there are: {', '.join(FILE_FORMATS)}")
    require_writable(schedule)
    return FILE_FORMATS[suffix].write(schedule)
