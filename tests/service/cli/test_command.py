"""The command as a whole: quick to say what it does, and what it says about itself."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest
import typer

from service.cli.main import app
from service.version import code_version
from tests.service.cli.command import ROOT, done, misused, process, run, script

HEAVY = ("numpy", "pydantic", "fastapi", "sqlalchemy", "rich", "httpx2", "service.settings")


def test_help_is_quick_and_loads_nothing_heavy() -> None:
    check = f"print('loaded', [one for one in {HEAVY!r} if one in sys.modules])"
    with open(os.devnull, "wb") as nothing:
        before = os.times()
        said = subprocess.run(
            [*script(after=check), "--help"], cwd=ROOT, stdout=subprocess.PIPE, stderr=nothing, timeout=60, text=True
        )
        after = os.times()
    assert said.returncode == 0
    assert "loaded []" in said.stdout
    # Of the processor, as the machine may have other work.
    assert after.children_user + after.children_system - before.children_user - before.children_system < 0.5


def test_every_command_says_what_it_does() -> None:
    group = typer.main.get_command(app)
    names = set(group.commands)  # type: ignore[attr-defined]
    assert names == {"serve", "design", "verify", "export", "backup", "migrate", "check", "keys", "version"}
    for name in (*names - {"keys"}, "keys add", "keys list", "keys revoke"):
        assert "Usage: " in done(*name.split(), "--help")


def test_version_is_that_of_the_code() -> None:
    known = json.loads(done("version", "--json"))
    assert known["code_version"] == code_version()
    assert f"code_version: {code_version()}" in process("version").stdout.splitlines()


@pytest.mark.parametrize("arguments", [["nonsense"], ["design"], ["keys"], ["check", "--nonsense"], ["keys", "add"]])
def test_wrong_use(arguments: list[str]) -> None:
    assert run(*arguments).exit_code == 2


def test_a_wrong_setting_of_the_environment_is_named() -> None:
    said = run("check", GAINFIELD_PORT="x")
    assert said.exit_code == 1
    assert "gainfield: settings: port: " in said.stderr
    said = run("check", GAINFIELD_SECRETS_DIR="/nonsense")
    assert said.exit_code == 1
    assert "GAINFIELD_SECRETS_DIR" in said.stderr
    assert "wrong" not in misused("check", "--nonsense")


def test_a_reader_that_has_seen_enough_gets_no_traceback(request_file: Path) -> None:
    command = " ".join(shlex.quote(word) for word in [*script(), "design", str(request_file), "--json"])
    ended = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command} | true"], cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert "Traceback" not in ended.stderr
    assert "Error" not in ended.stderr


_LINE = re.compile(r"(?:^| )(gainfield (?:serve|design|verify|backup|export|check|keys|migrate)\b.*)", re.M)


def _in_pages() -> list[tuple[str, str]]:
    """Every line of the command that a page shows."""
    return [
        (page, line)
        for page in ("README.md", "service/deploy/README.md")
        for block in re.findall(r"```sh\n(.*?)```", (ROOT / page).read_text(), re.S)
        for line in _LINE.findall(block)
    ]


@pytest.mark.parametrize(("page", "line"), _in_pages())
def test_what_the_pages_show_is_what_the_command_takes(page: str, line: str) -> None:
    taken_by_the_command(shlex.split(line))


def test_the_pages_show_the_command() -> None:
    assert len(_in_pages()) > 8


def taken_by_the_command(words: list[str]) -> None:
    """Refuse a line that the command would call wrong use, without running it."""
    assert words[0] == "gainfield"
    command, rest = typer.main.get_command(app), words[1:]
    while hasattr(command, "commands"):
        command, rest = command.commands[rest[0]], rest[1:]
    command.make_context("gainfield", list(rest)).close()
