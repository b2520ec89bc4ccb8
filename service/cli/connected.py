"""A server that a command asks: reached, and a Gainfield; what it refuses is told as by the command itself."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from service.cli.refusing import Refused

if TYPE_CHECKING:
    from service.client import Client


@contextmanager
def connected(server: str, key: str | None) -> Iterator[Client]:
    """A client of the server at this address.

    Raises
    ------
    Refused : it cannot be reached, is no Gainfield, or refuses what it is asked inside
    """
    import httpx2

    from service.client import Client, JobEnded, Problem

    if key is not None and not (key.isascii() and key.isprintable()):
        raise Refused("unauthenticated", "the key holds characters that no key has")
    try:
        with Client(server, key) as client:
            _greet(client, server)
            yield client
    except Problem as problem:
        raise Refused(problem.code, f"{server}: {problem.detail}", problem.errors) from None
    except JobEnded as ended:
        raise Refused("job_ended", f"{server}: {ended}") from None
    except (httpx2.HTTPError, httpx2.InvalidURL) as error:
        raise Refused("server_unreachable", f"{server}: {str(error) or type(error).__name__}") from None


def _greet(client: Client, server: str) -> None:
    """Refuse what answers but is no Gainfield."""
    try:
        name = client.version()["name"]
    except (ValueError, KeyError, TypeError):
        name = None
    if name != "Gainfield":
        raise Refused("not_gainfield", f"{server}: there is a server, but it is no Gainfield")
