"""The command as the installed script runs it: in a process of its own, or in this one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

from typer.testing import CliRunner, Result

from service.cli.main import app

ROOT = Path(__file__).resolve().parents[3]
ENTRY = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]["gainfield"]


def script(after: str = "pass") -> list[str]:
    """What the script `gainfield` of an environment runs, and code after it."""
    module, function = ENTRY.split(":")
    run_it = f"import sys\nfrom {module} import {function}\ntry:\n    sys.exit({function}())\n"
    return [sys.executable, "-c", f"{run_it}finally:\n    {after}"]


def process(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    return subprocess.run(
        [*script(), *map(str, arguments)],
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )


def run(*arguments: object, stdin: str | None = None, **environment: str) -> Result:
    """The command in this process; what is no exit of its own is a fault."""
    result = CliRunner().invoke(app, [str(one) for one in arguments], input=stdin, env=environment)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert "Traceback" not in result.output
    return result


def done(*arguments: object, stdin: str | None = None, **environment: str) -> str:
    """What a command says that must not be refused."""
    result = run(*arguments, stdin=stdin, **environment)
    assert result.exit_code == 0, result.output
    return result.stdout


def refused(*arguments: object, stdin: str | None = None, **environment: str) -> dict[str, Any]:
    """The problem of a command that must be refused, the same in words and as JSON."""
    result = run(*arguments, stdin=stdin, **environment)
    assert result.exit_code == 1, result.output
    assert result.stdout == ""
    as_json = run(*arguments, "--json", stdin=stdin, **environment)
    assert as_json.exit_code == 1
    problem: dict[str, Any] = json.loads(as_json.stdout)
    assert as_json.stderr == ""
    first, *fields = result.stderr.splitlines()
    assert first == f"gainfield: {problem['code']}: {problem['detail']}"
    for line, field in zip(fields, problem["errors"], strict=True):
        assert line.startswith(f"  {field['pointer'] or '/'}" + (f" [{field['unit']}]: " if field["unit"] else ": "))
        assert field["detail"] in line
        assert str(field["allowed"] or "") in line
    return problem


def misused(*arguments: object) -> str:
    """What is said of wrong use."""
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    return result.stderr


def timeless(content: bytes | str) -> dict[str, Any]:
    """A design or a schedule without the time at which it was made."""
    document = json.loads(content)
    document.pop("created_at", None)
    document.get("provenance", {}).pop("created_at", None)
    return document
