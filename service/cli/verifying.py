"""``gainfield verify``: a certificate by its own matrices, a schedule by a new proof."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from service.cli.connected import connected
from service.cli.documents import check_directory, read_document, request_in, write_file
from service.cli.options import AsJson, Key, Server
from service.cli.refusing import REFUSED, Refused, refusals_told


def verify(
    file: Annotated[Path, typer.Argument(help="A certificate, or a gain schedule in JSON; - is stdin.")],
    design: Annotated[
        Path | None, typer.Option(help="Of a schedule: the design, or its request, with the plant and the law.")
    ] = None,
    table: Annotated[
        str | None, typer.Option(help="Of a certificate: SHA-256 of the table it must be of, as schedule files say.")
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option(help="Of a schedule: file for the certificate of its proof.")
    ] = None,
    server: Server = None,
    key: Key = None,
    as_json: AsJson = False,
) -> None:
    """Check that a table of gains holds everywhere between its points.

    A certificate is checked with numpy alone, its plant taken as given. A schedule is proved anew, with the plant of
    --design, or of its stored design on --server. Exit code 0 only when every cell is proved.
    """
    with refusals_told(as_json):
        if certificate is not None:
            check_directory(certificate)
        document = read_document(file)
        kind = document.get("format")
        if kind == _certificate_format():
            if design is not None or certificate is not None:
                raise typer.BadParameter("a certificate takes neither --design nor --certificate")
            proved = _check(document, table, as_json)
        elif "axes" in document and "gains" in document:
            if table is not None:
                raise typer.BadParameter("--table is of a certificate; a schedule is a table itself")
            proved = _prove(document, design, certificate, server, key, as_json)
        else:
            raise Refused("unreadable_file", f"{file}: neither a certificate nor a gain schedule: format {kind!r}")
        if not proved:
            raise typer.Exit(REFUSED)


def _certificate_format() -> str:
    from schedules.proof.certificate import FORMAT

    return FORMAT


def _check(document: dict[str, Any], table: str | None, as_json: bool) -> bool:
    """Say whether a certificate holds; whether it does, for every cell."""
    from schedules.verify import verify as checked

    try:
        words, holds = checked(document, table), True
    except ValueError as wrong:
        words, holds = f"refuted: {wrong}", False
    except (LookupError, TypeError, AttributeError, ArithmeticError) as wrong:
        raise Refused("unreadable_file", f"no certificate that can be read: {type(wrong).__name__}: {wrong}") from None
    said = {"holds": holds, "proved": document.get("proved"), "of": document.get("of"), "words": words}
    typer.echo(json.dumps(said) if as_json else words)
    return holds and said["proved"] == said["of"]


def _prove(
    schedule: dict[str, Any],
    design: Path | None,
    certificate: Path | None,
    server: str | None,
    key: str | None,
    as_json: bool,
) -> bool:
    """Say what is proved of a schedule; whether all of it is."""
    if design is None and server is None:
        raise typer.BadParameter("a schedule is proved with a plant: give --design, or the --server of its design")
    body = {"schedule": schedule, "certificate": certificate is not None}
    body |= _of_stored(schedule) if design is None else _of_request(request_in(read_document(design)), schedule)
    if server is None:
        from service.cli.proved_here import proved_here

        found = proved_here(body)
    else:
        with connected(server, key) as client:
            found = client.verify_schedule(body)
    if found["certificate"] is not None and certificate is not None:
        write_file(certificate, json.dumps(found["certificate"]).encode())
    elif certificate is not None:
        typer.echo(f"not written: {certificate}: no cell is proved, there is nothing to certify", err=True)
    ((name, proof),) = found["controllers"].items()
    if as_json:
        typer.echo(json.dumps(found))
    else:
        _say(name, proof)
    return all(cell["status"] == "proved" for cell in proof["cells"])


def _of_stored(schedule: dict[str, Any]) -> dict[str, Any]:
    """Plant and law by the ids that the file names."""
    missing = [name for name in ("design_id", "controller") if not schedule.get(name)]
    if missing:
        raise Refused("unreadable_file", f"the schedule names no {' and no '.join(missing)}: give --design")
    return {"design_id": schedule["design_id"], "controller": schedule["controller"]}


def _of_request(request: dict[str, Any], schedule: dict[str, Any]) -> dict[str, Any]:
    """Plant and law of a design request, the law by the name that the file gives its controller."""
    from service.cli.designed_here import read_request
    from service.schemas.verification_requests import FlownController, FlownPlant

    normalised = read_request(request).normalised()
    controllers = {one["name"]: one for one in normalised["controllers"]}
    name = schedule.get("controller")
    if name not in controllers:
        raise Refused("no_controller", f"the design has no controller {name!r}; there are {', '.join(controllers)}")
    law = {field: value for field, value in controllers[name].items() if field in FlownController.model_fields}
    return {"design": {field: normalised[field] for field in FlownPlant.model_fields}, "controller": law}


def _say(name: str, proof: dict[str, Any]) -> None:
    typer.echo(f"{name}: {proof['summary']['words']}")
    for cell in proof["cells"]:
        if cell["status"] != "proved":
            at = cell["counterexample"]
            where = "" if at is None else (
                f", unstable at {at['altitude_m']:g} m and {at['dynamic_pressure_pa']:g} Pa: "
                f"real part {at['largest_real_part']:.4g} 1/s"
            )  # fmt: skip
            typer.echo(f"  cell {cell['index']}: {cell['status']}{where}{_because(cell['reason'])}")


def _because(reason: str | None) -> str:
    return "" if reason is None else f"; {reason}"
