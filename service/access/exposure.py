"""Whether the server may listen where it is told to: beyond this machine only with keys, or when anybody may ask."""

from __future__ import annotations

from ipaddress import ip_address

from service.settings import Settings


class Exposed(Exception):
    """The server would listen beyond this machine, and anybody could ask; the message says what to set."""


def is_loopback(host: str) -> bool:
    """Whether a host is this machine alone."""
    try:
        return ip_address(host.strip("[]").partition("%")[0]).is_loopback
    except ValueError:
        return host.lower().rstrip(".") == "localhost"


def keys_required(settings: Settings) -> bool:
    """Whether every request must show a key: as set, otherwise where the server listens beyond this machine."""
    if settings.require_keys is not None:
        return settings.require_keys
    return not is_loopback(settings.host) and not settings.allow_anonymous


def check_exposure(settings: Settings, any_keys: bool) -> None:
    """Refuse to start where anybody could ask, or nobody.

    Raises
    ------
    Exposed
    """
    if keys_required(settings):
        if not any_keys:
            raise Exposed(
                "keys are required and there are none: make one with `gainfield keys add`, or let anybody ask with "
                "GAINFIELD_ALLOW_ANONYMOUS=true and GAINFIELD_REQUIRE_KEYS unset"
            )
    elif not is_loopback(settings.host) and not settings.allow_anonymous:
        raise Exposed(
            f"{settings.host!a} can be reached from other machines: require keys with GAINFIELD_REQUIRE_KEYS=true, or "
            "let anybody ask with GAINFIELD_ALLOW_ANONYMOUS=true"
        )
