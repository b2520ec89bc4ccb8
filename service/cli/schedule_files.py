"""Gain schedules of all controllers of a design, in the formats that are wanted, by the names that downloads have."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import typer

from schedules.files import FILE_FORMATS, FillRule, LibraryMissing, MissingGains, file_name, read_json, write_schedule
from schedules.schedule import GainSchedule
from service.cli.refusing import Refused
from service.client import Client, Document


@dataclass(frozen=True)
class WantedFiles:
    """Which files are wanted, and where.

    Attributes
    ----------
    directory : of the files, which is there
    suffixes : keys of `FILE_FORMATS`
    fill : where points without gains get them, in formats that need a number everywhere; None: they are refused
    """

    directory: Path
    suffixes: tuple[str, ...]
    fill: FillRule | None

    def filled_by(self, suffix: str) -> FillRule | None:
        """The rule for a format: those that say where there is no gain take none."""
        return None if FILE_FORMATS[suffix].says_missing else self.fill


def wanted_files(directory: Path, formats: str, fill: str | None) -> WantedFiles:
    """What options ask for; the directory is made.

    Raises
    ------
    typer.BadParameter : there is no such format or rule
    OSError : the directory cannot be made
    """
    suffixes = tuple(dict.fromkeys(name.strip() for name in formats.split(",")))
    for name in suffixes:
        if name not in FILE_FORMATS:
            raise typer.BadParameter(
                f"{name!r} is no format; there are {', '.join(FILE_FORMATS)}", param_hint="--formats"
            )
    rule = next((known for known in get_args(FillRule) if known == fill), None)
    if fill is not None and rule is None:
        raise typer.BadParameter(f"{fill!r} is none of {', '.join(get_args(FillRule))}", param_hint="--fill")
    directory.mkdir(parents=True, exist_ok=True)
    return WantedFiles(directory, suffixes, rule)


def written_here(schedules: Iterable[GainSchedule], wanted: WantedFiles) -> dict[Path, bytes]:
    """Content of the files of these schedules, by path.

    Raises
    ------
    Refused : a format that is not installed, or needs a number everywhere where there is none
    """
    found: dict[Path, bytes] = {}
    for schedule in schedules:
        for suffix in wanted.suffixes:
            at = f"{schedule.controller}.{suffix}"
            try:
                content = write_schedule(schedule, suffix, wanted.filled_by(suffix))
            except (LibraryMissing, MissingGains) as missing:
                raise Refused("no_file", f"{at}: {missing}") from None
            found[wanted.directory / file_name(schedule, suffix)] = content
    return found


def written_there(client: Client, design: Document, wanted: WantedFiles) -> dict[Path, bytes]:
    """The same of a design on a server.

    Raises
    ------
    service.client.Problem : the server has no such file
    """
    found: dict[Path, bytes] = {}
    for controller in design["controllers"]:
        name = controller["name"]
        known = read_json(client.schedule(design, name, "json"))
        for suffix in wanted.suffixes:
            rule = wanted.filled_by(suffix)
            rules: dict[str, str] = {} if rule is None else {"fill": rule}
            found[wanted.directory / file_name(known, suffix)] = client.schedule(design, name, suffix, **rules)
    return found
