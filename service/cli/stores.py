"""``gainfield backup``, ``export``, ``migrate`` and ``check``: what is done to a store, be it in use or not."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.chosen_settings import chosen_settings
from service.cli.options import AsJson, DataDir
from service.cli.refusing import REFUSED, Refused, refusals_told

if TYPE_CHECKING:
    from service.store.integrity import Finding
    from service.store.store import Store

Target = Annotated[Path, typer.Argument(help="Where it goes; there must be nothing yet.")]


def backup(target: Target, data_dir: DataDir = None, as_json: AsJson = False) -> None:
    """Copy the store into a new directory while the server runs; to restore it, serve with --data-dir TARGET.

    Of PostgreSQL it takes the files: run pg_dump first, then this. Exit code 1 also where files were damaged already,
    which are not in the copy.
    """
    from service.store.backup import backup as copy

    with refusals_told(as_json), opened_store(data_dir) as store:
        done = copy(store, target)
        words = f"{done.files} files, {done.bytes} bytes, " + (
            "with the database" if done.database else "without the database: pg_dump takes it"
        )
        typer.echo(json.dumps(asdict(done)) if as_json else f"{target}: {words}")
        _end_with(done.findings, as_json)


def export(
    target: Target,
    owner: Annotated[str | None, typer.Option(help="Only the designs of this key name; default all.")] = None,
    data_dir: DataDir = None,
    as_json: AsJson = False,
) -> None:
    """Write requests and designs as plain files with an index into a new directory, or a TARGET that ends in .zip."""
    from service.store.export import export as write

    with refusals_told(as_json), opened_store(data_dir) as store:
        count = write(store, target, owner)
        typer.echo(json.dumps({"designs": count}) if as_json else f"{target}: {count} designs")


def migrate(data_dir: DataDir = None, as_json: AsJson = False) -> None:
    """Bring the database to the tables of this release; there is no harm in doing so twice."""
    from service.store.database import bring_up

    with refusals_told(as_json):
        settings = chosen_settings(data_dir=data_dir)
        url = settings.database_url
        tables = bring_up(settings.data_dir, None if url is None else url.get_secret_value())
        typer.echo(json.dumps({"tables": tables}) if as_json else f"the tables have version {tables}")


def check(
    quick: Annotated[bool, typer.Option("--quick", help="Only whether files are there, not what is in them.")] = False,
    data_dir: DataDir = None,
    as_json: AsJson = False,
) -> None:
    """Check the store: pages of its database, designs that nobody owns, every file against its digest.

    Exit code 1 when something is damaged; nothing is changed.
    """
    with refusals_told(as_json), opened_store(data_dir) as store:
        found = store.findings if quick else store.inspect(thorough=True)
        if as_json:
            typer.echo(json.dumps({"findings": [asdict(finding) for finding in found]}))
        elif not found:
            typer.echo("the store is whole")
        _end_with(found, as_json)


@contextmanager
def opened_store(data_dir: Path | None, new: bool = False) -> Iterator[Store]:
    """The store of the settings; `new`: also one that is made for it.

    Raises
    ------
    Refused : there is none
    StoreUnavailable : it cannot be opened
    """
    from service.store.database import FILE_NAME
    from service.store.store import FILES, Store

    settings = chosen_settings(data_dir=data_dir)
    url = settings.database_url
    held_by = FILE_NAME if url is None else FILES
    if not new and not (settings.data_dir / held_by).exists():
        raise Refused("no_store", f"there is no store in {settings.data_dir}: it has no {held_by}")
    store = Store(settings.data_dir, None if url is None else url.get_secret_value())
    try:
        yield store
    finally:
        store.close()


def _end_with(findings: Sequence[Finding], as_json: bool) -> None:
    """Say what is damaged, and end with that."""
    if not findings:
        return
    if not as_json:
        for finding in findings:
            typer.echo(f"damaged: {finding.subject} {finding.name}: {finding.detail}", err=True)
    raise typer.Exit(REFUSED)
