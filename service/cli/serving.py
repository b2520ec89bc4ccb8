"""``gainfield serve``: the server, under settings that are safe to listen with."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.chosen_settings import chosen_settings
from service.cli.options import DataDir
from service.cli.refusing import REFUSED, Refused, refusals_told

if TYPE_CHECKING:
    from service.settings import Settings


def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on (default 127.0.0.1).")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on (default 8000).")] = None,
    data_dir: DataDir = None,
    workers: Annotated[int | None, typer.Option(help="Server processes (default 1).")] = None,
) -> None:
    """Serve the API and the workbench until interrupted.

    Options override the GAINFIELD_* environment, which overrides defaults; every setting has a variable.
    """
    with refusals_told():
        settings = chosen_settings(host=host, port=port, data_dir=data_dir, workers=workers)

        from service.access.exposure import Exposed
        from service.server import serve as listen

        try:
            _check_address(settings)
            _check_store(settings)
            listen(settings)
        except (Exposed, ValueError) as refused:
            raise Refused("not_started", str(refused)) from None
        except SystemExit as ended:  # what fails in the server after it began is in its log
            raise typer.Exit(REFUSED if ended.code else 0) from None


def _check_address(settings: Settings) -> None:
    """Refuse an address that nothing can listen on, before the store is opened for it.

    Raises
    ------
    Refused
    """
    host, port = settings.host, settings.port
    try:
        for family, kind, _, _, address in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM):
            with socket.socket(family, kind) as there:
                there.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                there.bind(address)
    except OSError as error:
        raise Refused("not_started", f"cannot listen on {host} port {port}: {error.strerror}") from None


def _check_store(settings: Settings) -> None:
    """Refuse a store that cannot be opened before any server process tries, and fails in its own words.

    Raises
    ------
    StoreUnavailable
    """
    from service.store.blobs import Blobs
    from service.store.database import Database
    from service.store.identity import same_store
    from service.store.store import FILES

    url = settings.database_url
    database = Database(settings.data_dir, None if url is None else url.get_secret_value())
    try:
        same_store(database, Blobs(settings.data_dir / FILES))
    finally:
        database.close()
