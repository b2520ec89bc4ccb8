"""The README's walk, run as printed against a running service."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


def _console_blocks():
    """Commands and the output printed below each, in the order of the page."""
    steps = []
    for block in re.findall(r"```console\n(.*?)```", (ROOT / "README.md").read_text(), re.S):
        for line in block.splitlines():
            if line.startswith("$ "):
                steps.append(([line[2:]], []))
            elif line.startswith("> "):
                steps[-1][0].append(line[2:])
            else:
                steps[-1][1].append(line)
    return [("\n".join(command), "\n".join(output)) for command, output in steps]


def _same(printed, shown):
    """Same words, and numbers equal to the digits that another machine's rounding may leave."""
    assert NUMBER.sub("#", printed) == NUMBER.sub("#", shown)
    for a, b in zip(NUMBER.findall(printed), NUMBER.findall(shown), strict=True):
        assert float(a) == pytest.approx(float(b), rel=2e-3, abs=2e-4)


def test_the_walk_prints_what_the_readme_shows(running_service, tmp_path):
    steps = _console_blocks()
    assert len(steps) >= 9
    if shutil.which("octave-cli") is None:
        assert os.environ.get("CI") != "true", "CI must have GNU Octave"
        steps = [step for step in steps if "octave" not in step[0]]
    script = "set -e\n" + "\n".join(f"{command}\necho '--- {i}'" for i, (command, _) in enumerate(steps))
    script = script.replace("http://127.0.0.1:8000", running_service).replace("python3 ", f"{sys.executable} ")
    done = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    printed = re.split(r"--- \d+\n", done.stdout)
    for (command, shown), got in zip(steps, printed, strict=False):
        _same(got.strip(), shown.strip())
        assert shown.strip() or "-o " in command or command.startswith("export")


def test_every_python_block_of_the_readmes_runs(tmp_path):
    pages = [ROOT / "README.md", *(ROOT / name / "README.md" for name in ("model", "design", "schedules", "service"))]
    ran = 0
    for page in pages:
        blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.S)
        if blocks:
            done = subprocess.run(
                [sys.executable, "-W", "error", "-c", "\n".join(blocks)],
                cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, timeout=60,
            )  # fmt: skip
            assert done.returncode == 0, f"{page.relative_to(ROOT)}: {done.stderr}"
            ran += 1
    assert ran >= 2
