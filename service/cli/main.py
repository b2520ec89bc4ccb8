"""The command ``gainfield``, and ``python -m service``, which is its ``serve`` alone."""

from __future__ import annotations

import logging
import os

#: On small matrices more BLAS threads are several times slower; numpy reads these when it is imported.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import typer  # noqa: E402

from service.cli import designing, keys, serving, stores, verifying, versions  # noqa: E402


def _plain(**about: str | bool) -> typer.Typer:
    """Commands whose help is plain text, and whose faults are Python's own tracebacks, which show no values."""
    return typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, **about)  # type: ignore[arg-type]


app = _plain(
    help="Gain-scheduled flight-envelope design for tab-aileron control. Exit codes: 0 done, 1 refused or not proved, "
    "2 wrong use.",
    no_args_is_help=True,
)
app.command("serve")(serving.serve)
app.command("design")(designing.design)
app.command("verify")(verifying.verify)
app.command("export")(stores.export)
app.command("backup")(stores.backup)
app.command("migrate")(stores.migrate)
app.command("check")(stores.check)
app.add_typer(keys.commands, name="keys")
app.command("version")(versions.version)

_serve_alone = _plain()
_serve_alone.command()(serving.serve)


def main() -> None:
    """Run the command that the arguments name."""
    _quiet()
    app(prog_name="gainfield")


def serve_alone() -> None:
    """Serve with the arguments of ``gainfield serve``."""
    _quiet()
    _serve_alone(prog_name="python -m service")


def _quiet() -> None:
    """Leave what the library logs about a refusal to the refusal itself; a server has a log of its own."""
    logging.getLogger("gainfield").addHandler(logging.NullHandler())
