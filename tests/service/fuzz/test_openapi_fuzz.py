"""Requests made from the OpenAPI document by Schemathesis, good and bad ones, and what their answers must be.

All checks are on but one: what fits its schema may still be refused with 422, for schemas do not say what fields demand
of each other. With ``GAINFIELD_FUZZ_S`` it goes on for so many seconds, with another seed each time.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from service.jobs.example import EXAMPLE_PATH, example_body
from tests.service.fuzz.served import served

CONFIGURATION = Path(__file__).with_name("schemathesis.toml")
#: Seconds to go on for; None: a few examples of every operation.
LONG = os.environ.get("GAINFIELD_FUZZ_S")
#: Every route computes, but little: what is checked is what routes take and answer, not how fast they are.
SMALL = {
    "job_work_factor": 1,
    "max_refined_points": 4,
    "max_weight_searches": 1,
    "max_delayed_loops": 20,
    "max_simulated_steps": 50_000,
    "max_profile_steps": 20_000,
    "max_proof_pieces": 200,
    "max_cross_checks": 1,
    "max_compared_samples": 1_000_000,
    "max_tab_only_designs": 40,
    "max_flown_loops": 500,
    "max_compared_points": 2,
    "max_worst_case_rows": 2000,
}


@pytest.mark.parametrize(
    "options",
    [
        # Of bodies, lists of ten thousand items at the edges of their lengths would take hours.
        pytest.param(["--phases", "coverage", "--include-method", "GET", "--include-method", "DELETE"], id="edges"),
        pytest.param(["--phases", "fuzzing,stateful", "-n", "3"], id="draws"),
    ],
)
def test_every_operation_keeps_to_its_document(tmp_path: Path, options: list[str]) -> None:
    data = tmp_path / "data"
    data.mkdir()
    drawn = ["--seed", "20261123"] if LONG is None else ["--max-time", LONG]
    with served(data, **SMALL) as here:
        # The job that the routes of jobs are shown with.
        assert here.http.post(EXAMPLE_PATH, json=example_body(), headers={"Prefer": "respond-async"}).status_code == 202
        command = [str(Path(sys.executable).with_name("schemathesis")), "--config-file", str(CONFIGURATION), "run"]
        command += [f"http://127.0.0.1:{here.running.port}/openapi.json", *options, *drawn]
        command += ["--continue-on-failure", "--no-shrink", "--request-timeout", "60", "--warnings", "off"]
        run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=1200)
        assert run.returncode == 0, run.stdout[-20_000:] + run.stderr[-2000:]
        assert "No issues found" in run.stdout or "passed" in run.stdout
