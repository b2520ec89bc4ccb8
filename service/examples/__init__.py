"""The shipped requests, by name: the wind-tunnel sections A and B, and a full-scale aileron."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

NAMES = ("wind_tunnel", "wind_tunnel_23012", "airliner_aileron")


@cache
def example_text(name: str) -> str:
    """The request as it is shipped, JSON.

    Raises
    ------
    KeyError : there is no example of this name
    """
    if name not in NAMES:
        raise KeyError(name)
    return (Path(__file__).parent / f"{name}.json").read_text(encoding="utf-8")


def example(name: str) -> dict[str, Any]:
    """The request as a fresh document.

    Raises
    ------
    KeyError : there is no example of this name
    """
    document: dict[str, Any] = json.loads(example_text(name))
    return document
