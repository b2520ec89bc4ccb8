"""How a command ends that cannot do what it was asked: the problem in words, or as JSON, and exit code 1."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import typer

from service.wire.refusals import Refusal

REFUSED = 1


class Refused(Exception):
    """What is not done, as a problem document has it: a code, a sentence, and the fields that it is about.

    Parameters
    ----------
    code : name of the kind of problem
    detail : what is wrong
    errors : of each field its `pointer`, `detail`, `unit` and `allowed`
    """

    def __init__(self, code: str, detail: str, errors: Sequence[Mapping[str, Any]] = ()) -> None:
        super().__init__(detail)
        self.document = {"code": code, "detail": detail, "errors": [dict(error) for error in errors]}

    @classmethod
    def of(cls, problem: Mapping[str, Any]) -> Refused:
        """The same from a problem document of the service."""
        return cls(str(problem["code"]), str(problem["detail"]), problem["errors"])


@contextmanager
def refusals_told(as_json: bool = False) -> Iterator[None]:
    """End the command with what was refused inside: in words on standard error, or as JSON on standard output.

    Raises
    ------
    typer.Exit
    """
    try:
        yield
    except Refused as refused:
        problem = refused.document
    except Refusal as refusal:
        problem = _of_the_service(refusal)
    except BrokenPipeError:  # who read our output has seen enough
        raise
    except OSError as error:
        problem = Refused("file_error", _words(error)).document
    else:
        return
    tell(problem, as_json)
    raise typer.Exit(REFUSED)


def tell(problem: Mapping[str, Any], as_json: bool) -> None:
    """Say what is wrong, and of each field its unit and what it takes."""
    if as_json:
        typer.echo(json.dumps(problem))
        return
    typer.echo(f"gainfield: {problem['code']}: {problem['detail']}", err=True)
    for field in problem["errors"]:
        unit = f" [{field['unit']}]" if field["unit"] else ""
        allowed = f" (allowed: {field['allowed']})" if field["allowed"] else ""
        typer.echo(f"  {field['pointer'] or '/'}{unit}: {field['detail']}{allowed}", err=True)


def _of_the_service(refusal: Refusal) -> dict[str, Any]:
    from service.wire.errors import STATUS, problem

    return Refused.of(problem(*STATUS[type(refusal)], refusal.detail, refusal.fields)).document


def _words(error: OSError) -> str:
    if error.strerror is None:
        return str(error)
    return error.strerror if error.filename is None else f"{error.filename}: {error.strerror}"
