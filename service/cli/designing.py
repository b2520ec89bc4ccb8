"""``gainfield design``: from a request to a design and its schedule files, in this process or on a server."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.connected import connected
from service.cli.documents import check_directory, read_document, request_in, write_file
from service.cli.options import AsJson, Key, Server
from service.cli.progress import bar
from service.cli.refusing import refusals_told

if TYPE_CHECKING:
    from service.cli.schedule_files import WantedFiles

#: The bytes of a design, and of its schedule files by path.
Made = tuple[bytes, dict[Path, bytes]]


def design(
    file: Annotated[Path, typer.Argument(help="A design request, or a design, whose request is taken; - is stdin.")],
    out: Annotated[Path | None, typer.Option(help="File for the design, JSON.")] = None,
    schedule: Annotated[Path | None, typer.Option(help="Directory for the gain schedules of all controllers.")] = None,
    formats: Annotated[str, typer.Option(help="Formats of these: json,csv,mat,npz,h5,h,c,m,xml,dml")] = "json",
    fill: Annotated[
        str | None,
        typer.Option(help="nearest_ok or hold_neighbour: gains for points without, in files that need all numbers."),
    ] = None,
    server: Server = None,
    key: Key = None,
    as_json: AsJson = False,
) -> None:
    """Design every controller of a request over its grid.

    Without --server in this process, by the code that serves, with no limit on the work. A summary is printed; with
    --json the design itself.
    """
    with refusals_told(as_json):
        from service.cli.schedule_files import wanted_files

        wanted = None if schedule is None else wanted_files(schedule, formats, fill)
        if out is not None:
            check_directory(out)
        request = request_in(read_document(file))
        content, files = _here(request, wanted) if server is None else _there(request, wanted, server, key)
        if out is not None:
            files = {out: content, **files}
        for path, written in files.items():
            write_file(path, written)
        if as_json:
            typer.echo(content)
        else:
            _summarise(content, list(files))


def _here(request: dict[str, Any], wanted: WantedFiles | None) -> Made:
    from service.cli.designed_here import designed_here
    from service.cli.schedule_files import written_here

    with bar("designing") as reached:
        made = designed_here(request, reached)
    return made.stored.answer, {} if wanted is None else written_here(made.schedules(), wanted)


def _there(request: dict[str, Any], wanted: WantedFiles | None, server: str, key: str | None) -> Made:
    import orjson

    from service.cli.schedule_files import written_there
    from service.client import Job

    with connected(server, key) as client, bar("designing") as reached:
        answer = client.start_design(request)
        if isinstance(answer, Job):
            answer = client.wait(answer, lambda job: reached(job.done, job.total))
        return orjson.dumps(answer), {} if wanted is None else written_there(client, answer, wanted)


def _summarise(content: bytes, written: list[Path]) -> None:
    """What became of each controller, and where it is written."""
    import orjson

    document = orjson.loads(content)
    altitudes, speeds = document["grid"]["shape"]
    typer.echo(f"design {document['id']} {document['name']}: {altitudes} by {speeds} points")
    for controller in document["controllers"]:
        outcomes = Counter(code for row in controller["outcomes"] for code in row)
        counts = ", ".join(f"{count} {code}" for code, count in outcomes.most_common())
        typer.echo(f"  {controller['name']} ({controller['kind']}): {counts}")
        for verdict in controller["verdicts"]:
            if verdict["passed"] is False:
                typer.echo(f"    {verdict['spec']} is missed, worst at point {verdict['worst_point']}")
    for warning in document["warnings"]:
        typer.echo(f"  warning: {warning['detail']}")
    for path in written:
        typer.echo(f"written: {path}")
