"""Studies that the server makes jobs of: the page waits for their results, and cancels what nobody waits for."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from service.settings import Settings

pytestmark = pytest.mark.browser

GET = "path => import('./workbench/js/api.js').then((api) => api.get(path))"
ABORTED = """async path => {
    const api = await import('./workbench/js/api.js');
    const gone = new AbortController();
    window.setTimeout(() => gone.abort(), 400);
    return api.get(path, {signal: gone.signal}).then(() => "an answer", (problem) => problem.name);
}"""


@pytest.fixture
def address(tmp_path: Path, serve: Any) -> Iterator[str]:
    """A server that does hardly anything in line."""
    with serve(Settings(data_dir=tmp_path, max_flown_loops=1, job_work_factor=100_000)) as at:
        yield at


@pytest.fixture
def robust(tab: Any, address: str) -> str:
    """Address of a study of the first example."""
    tab.goto(f"{address}/")
    request = tab.request.get(f"{address}/v1/examples/wind_tunnel").json()
    made = tab.request.post(f"{address}/v1/designs", data=request).json()
    return f"/v1/designs/{made['id']}/controllers/lqr/robust-performance?method=monte_carlo"


def test_the_result_of_a_job_is_the_answer(tab: Any, address: str, robust: str) -> None:
    found = tab.evaluate(GET, f"{robust}&draws=20&seed=3")
    (job,) = tab.request.get(f"{address}/v1/jobs").json()["items"]
    assert job["state"] == "succeeded"
    assert found == tab.request.get(address + job["result"]).json()
    assert found["name"] == "lqr"


def test_what_fails_is_refused_in_words(tab: Any, watch: Any, robust: str) -> None:
    watch.refused.add(422)
    with pytest.raises(Exception, match="draws"):
        tab.evaluate(GET, f"{robust}&draws=100000000")


def test_a_job_that_nobody_waits_for_is_cancelled(tab: Any, address: str, robust: str) -> None:
    assert tab.evaluate(ABORTED, f"{robust}&draws=10000&margins=true") == "AbortError"
    deadline = time.monotonic() + 30
    while (job := tab.request.get(f"{address}/v1/jobs").json()["items"][0])["state"] != "cancelled":
        assert time.monotonic() < deadline, job
        time.sleep(0.1)
