"""Files of a gain schedule, one format a module: suffix -> media type and writer.

Every file is a function of the schedule and the fill rule alone: the same schedule gives the same bytes. Every file
carries the schema version, the design it came from, units, sign convention, control law,
outcomes, and the rule between and outside the grid points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from schedules.files.c_header import write_c_header
from schedules.files.c_source import write_c_source
from schedules.files.checks import require_writable
from schedules.files.csv_file import read_csv, write_csv
from schedules.files.dave_ml_file import write_dave_ml
from schedules.files.hdf5_file import LibraryMissing, read_hdf5, write_hdf5
from schedules.files.jsbsim_file import write_jsbsim
from schedules.files.json_file import read_json, write_json
from schedules.files.matlab_file import write_matlab
from schedules.files.matlab_reader import read_matlab
from schedules.files.matlab_script import write_matlab_script
from schedules.files.npz_file import read_npz, write_npz
from schedules.files.words import file_name, file_name_parts
from schedules.fill import FilledSchedule, FillRule, MissingGains, filled
from schedules.proof.table_proof import without_proof
from schedules.schedule import GainSchedule

__all__ = [
    "FILE_FORMATS",
    "FileFormat",
    "FillRule",
    "LibraryMissing",
    "MissingGains",
    "file_name",
    "file_name_parts",
    "read_csv",
    "read_hdf5",
    "read_json",
    "read_matlab",
    "read_npz",
    "write_schedule",
]


@dataclass(frozen=True)
class FileFormat:
    """One format: the ending of its files without the dot, its media type, and what writes it.

    A format either says where there is no gain, and holds the schedule as it was designed (`write`), or is a table
    that needs a number everywhere (`write_filled`). One of the two is None.
    """

    suffix: str
    media_type: str
    write: Callable[[GainSchedule], bytes] | None = None
    write_filled: Callable[[FilledSchedule], bytes] | None = None

    @property
    def says_missing(self) -> bool:
        """Whether a file of this format can say that there is no gain at a point."""
        return self.write is not None


#: The formats there are, by suffix.
FILE_FORMATS: dict[str, FileFormat] = {
    f.suffix: f
    for f in (
        FileFormat("json", "application/json", write_json),
        FileFormat("csv", "text/csv; charset=utf-8", write_csv),
        FileFormat("mat", "application/x-matlab-data", write_matlab),
        FileFormat("npz", "application/x-npz", write_npz),
        FileFormat("h5", "application/x-hdf5", write_hdf5),
        FileFormat("h", "text/x-chdr; charset=utf-8", write_filled=write_c_header),
        FileFormat("c", "text/x-csrc; charset=utf-8", write_filled=write_c_source),
        FileFormat("m", "text/x-matlab; charset=utf-8", write_filled=write_matlab_script),
        FileFormat("xml", "application/xml", write_filled=write_jsbsim),
        FileFormat("dml", "application/xml", write_filled=write_dave_ml),
    )
}


def write_schedule(schedule: GainSchedule, suffix: str, fill: FillRule | None = None) -> bytes:
    """The schedule as the content of a file of the format `suffix`, a key of `FILE_FORMATS`.

    Parameters
    ----------
    fill : where points that are not ok get gains from, in formats that need a number everywhere: a key of
        `schedules.fill.FILL_RULES`. The file names the rule and every point that it filled. The formats that can say
        that there is no gain take no rule

    Raises
    ------
    LibraryMissing : HDF5, and h5py is not installed
    MissingGains : a format that needs a number everywhere, points that are not ok, and no rule or none that fits
    ValueError : there is no such format or rule, the format takes no rule or cannot hold this schedule, or the schedule
        breaks one of the promises of `schedules.files.checks.require_writable`
    """
    if suffix not in FILE_FORMATS:
        raise ValueError(f"no schedule file {suffix!r}; there are: {', '.join(FILE_FORMATS)}")
    require_writable(schedule)
    form = FILE_FORMATS[suffix]
    if form.write_filled is not None:
        # What is filled is no longer the table that was proved; the designed one, which the file tells of, is.
        return form.write_filled(replace(filled(without_proof(schedule), fill), designed=schedule))
    if fill is not None:
        raise ValueError(f"a {suffix} file says where there is no gain: it takes no fill rule")
    assert form.write is not None
    return form.write(schedule)
