"""``gainfield version``: which code this is."""

from __future__ import annotations

import json
import platform

import typer

from service.cli.options import AsJson


def version(as_json: AsJson = False) -> None:
    """Release, digest of the sources, and the libraries at work, as `GET /v1/version` answers."""
    from service.version import code_version, release, solver

    known = {
        "name": "Gainfield",
        "version": release(),
        "code_version": code_version(),
        "python": platform.python_version(),
        "solver": solver(),
    }
    typer.echo(json.dumps(known) if as_json else "\n".join(f"{name}: {value}" for name, value in known.items()))
