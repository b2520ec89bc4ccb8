"""``gainfield keys``: made, listed, revoked."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.options import AsJson, DataDir
from service.cli.refusing import Refused, refusals_told
from service.cli.stores import opened_store

if TYPE_CHECKING:
    from service.store.keys import StoredKey

#: What the columns of limits hold.
_LARGEST_COUNT, _LARGEST_SIZE = 2**31 - 1, 2**63 - 1

commands = typer.Typer(help="API keys: add, list, revoke.", no_args_is_help=True, rich_markup_mode=None)


@commands.command()
def add(
    name: Annotated[str, typer.Argument(help="Owner of what is posted with it; keys of one name share their designs.")],
    scope: Annotated[str, typer.Option(help="read (GET), write (everything), admin (everybody's).")] = "write",
    requests_per_minute: Annotated[int | None, typer.Option(min=1, max=_LARGEST_COUNT, help="Default any.")] = None,
    max_stored_bytes: Annotated[int | None, typer.Option(min=1, max=_LARGEST_SIZE, help="Default any.")] = None,
    data_dir: DataDir = None,
    as_json: AsJson = False,
) -> None:
    """Make a key, and print it, once: only a digest is kept."""
    from service.access.keys import add_key

    with refusals_told(as_json), opened_store(data_dir, new=True) as store:
        try:
            made = add_key(store.keys, name, scope, requests_per_minute, max_stored_bytes)  # type: ignore[arg-type]
        except ValueError as wrong:
            raise typer.BadParameter(str(wrong)) from None
        if as_json:
            typer.echo(json.dumps(_document(made.key) | {"key": made.token}))
            return
        typer.echo(made.token)
        typer.echo(f"key {made.key.id} of {name}, scope {scope}; it is not shown again", err=True)


@commands.command("list")
def list_(data_dir: DataDir = None, as_json: AsJson = False) -> None:
    """All keys, oldest first, without their secrets."""
    from service.access.keys import list_keys

    with refusals_told(as_json), opened_store(data_dir) as store:
        found = [_document(key) for key in list_keys(store.keys)]
        if as_json:
            typer.echo(json.dumps(found))
            return
        for key in found:
            limits = [f"{key[name]} {name}" for name in ("requests_per_minute", "max_stored_bytes") if key[name]]
            state = "works" if key["revoked_at"] is None else f"revoked {key['revoked_at']}"
            typer.echo("  ".join([key["id"], key["name"], key["scope"], f"made {key['created_at']}", state, *limits]))


@commands.command()
def revoke(
    ident: Annotated[str, typer.Argument(metavar="ID", help="As `keys list` names it.")],
    data_dir: DataDir = None,
    as_json: AsJson = False,
) -> None:
    """Have a key open nothing any more, within five seconds."""
    from service.access.keys import revoke_key

    with refusals_told(as_json), opened_store(data_dir) as store:
        if not revoke_key(store.keys, ident):
            raise Refused("no_key", f"there is no key {ident[:80]!a} that works")
        typer.echo(json.dumps({"id": ident, "revoked": True}) if as_json else f"key {ident} is revoked")


def _document(key: StoredKey) -> dict[str, Any]:
    return {
        "id": key.id,
        "name": key.name,
        "scope": key.scope,
        "requests_per_minute": key.requests_per_minute,
        "max_stored_bytes": key.max_stored_bytes,
        "created_at": _moment(key.created_at),
        "revoked_at": None if key.revoked_at is None else _moment(key.revoked_at),
    }


def _moment(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
