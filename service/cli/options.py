"""Options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

DataDir = Annotated[
    Path | None,
    typer.Option("--data-dir", help="Directory of the store (GAINFIELD_DATA_DIR; default data).", show_default=False),
]
AsJson = Annotated[bool, typer.Option("--json", help="Answer in JSON, problems too, on standard output.")]
Server = Annotated[
    str | None,
    typer.Option("--server", envvar="GAINFIELD_SERVER", help="Address of a server, to be asked instead."),
]
Key = Annotated[
    str | None,
    typer.Option(
        "--key",
        envvar="GAINFIELD_KEY",
        show_envvar=True,
        help="Its API key; better by the variable, as others see arguments.",
    ),
]
