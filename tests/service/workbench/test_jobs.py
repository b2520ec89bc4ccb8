"""The Jobs panel against answers of the job routes: progress by events, cancelling, results, long designs."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

pytestmark = pytest.mark.browser


def job(ident: str, state: str, done: int = 0, **more: Any) -> dict[str, Any]:
    progress = {"done": done, "total": 40, "rate_1_s": 2.5 if done else None, "time_left_s": 95.0 if done else None}
    return {"id": ident, "kind": "design", "state": state, "progress": progress, "result": None, "error": None, **more}


class Jobs:
    """The job routes as the contract has them, played in the browser's network."""

    def __init__(self, *jobs: dict[str, Any]) -> None:
        self.jobs = {one["id"]: one for one in jobs}
        self.events: dict[str, list[dict[str, Any]]] = {}
        self.deleted: list[str] = []
        self.followed: list[str] = []

    def install(self, tab: Any) -> None:
        tab.route(
            "**/v1/jobs", lambda route: route.fulfill(json={"items": list(self.jobs.values()), "next_cursor": None})
        )
        tab.route("**/v1/jobs/*", self.one)
        tab.route("**/v1/jobs/*/events", self.stream)

    def one(self, route: Any) -> None:
        ident = route.request.url.rsplit("/", 1)[1]
        if route.request.method != "DELETE":
            return route.fulfill(json=self.jobs[ident])
        self.deleted.append(ident)
        if self.jobs[ident]["state"] in ("succeeded", "failed", "cancelled"):
            del self.jobs[ident]
            return route.fulfill(status=204)
        self.jobs[ident] = {**self.jobs[ident], "state": "cancelling"}
        return route.fulfill(status=202, json=self.jobs[ident])

    def stream(self, route: Any) -> None:
        ident = route.request.url.split("/")[-2]
        self.followed.append(ident)
        for event in self.events.get(ident, []):
            self.jobs[ident] = event
        events = enumerate(self.events.get(ident, []))
        body = "".join(f"event: {one['state']}\nid: {n}\ndata: {json.dumps(one)}\n\n" for n, one in events)
        route.fulfill(body=f"retry: 60000\n\n{body}", content_type="text/event-stream")


def row(tab: Any, ident: str) -> Any:
    return tab.locator(f'tr[data-job="{ident}"]')


def test_states_progress_and_reasons(tab: Any, address: str) -> None:
    failed = job("ccc", "failed", 3, error={"detail": "no gains at point 7"})
    Jobs(job("aaa", "queued"), job("bbb", "running", 10), failed).install(tab)
    tab.goto(f"{address}/#/jobs")
    row(tab, "bbb").wait_for()
    assert [one.split("\t")[1] for one in tab.locator("tr[data-job]").all_inner_texts()] == [
        "queued",
        "running",
        "failed",
    ]
    bar = row(tab, "bbb").locator("progress")
    assert (bar.get_attribute("max"), bar.evaluate("e => e.value")) == ("40", 10)
    text = row(tab, "bbb").inner_text()
    assert "10/40" in text
    assert "2.5 1/s" in text
    assert "2 min" in text
    assert "no gains at point 7" in row(tab, "ccc").inner_text()
    assert row(tab, "ccc").get_by_role("button", name="Cancel").count() == 0


def test_events_bring_a_design_that_can_be_opened(tab: Any, open_example: Callable[..., None], address: str) -> None:
    open_example(tab)
    design = tab.request.get(f"{address}/v1/designs").json()["items"][0]["id"]
    jobs = Jobs(job("aaa", "running", 10))
    jobs.events["aaa"] = [job("aaa", "running", 25), job("aaa", "succeeded", 40, result=f"/v1/designs/{design}")]
    jobs.install(tab)
    tab.get_by_role("link", name="Jobs").click()
    row(tab, "aaa").get_by_role("button", name="Open the design").click()
    tab.locator(".plot-canvas .main-svg").first.wait_for()
    assert f"design={design}" in tab.evaluate("location.href")
    assert jobs.followed == ["aaa"]


def test_cancel_and_remove(tab: Any, address: str) -> None:
    jobs = Jobs(job("aaa", "running", 10), job("bbb", "cancelled", 2))
    jobs.install(tab)
    tab.goto(f"{address}/#/jobs")
    row(tab, "aaa").get_by_role("button", name="Cancel").click()
    row(tab, "aaa").get_by_text("cancelling").wait_for()
    row(tab, "bbb").get_by_role("button", name="Remove").click()
    row(tab, "bbb").wait_for(state="detached")
    assert jobs.deleted == ["aaa", "bbb"]
    assert row(tab, "aaa").get_by_role("button").count() == 0


def test_one_job_at_a_time_takes_a_connection(tab: Any, address: str) -> None:
    jobs = Jobs(*(job(f"j{n}", "running", n + 1) for n in range(9)))
    jobs.install(tab)
    tab.goto(f"{address}/#/jobs?job=j4")
    row(tab, "j8").wait_for()
    tab.wait_for_timeout(300)
    assert jobs.followed == ["j4"]
    assert row(tab, "j4").get_attribute("aria-current") == "true"


def test_a_result_that_is_no_design_is_saved(tab: Any, address: str) -> None:
    done = job("aaa", "succeeded", 40, kind="answer", result="/v1/jobs/aaa/result")
    Jobs(done).install(tab)
    tab.route("**/v1/jobs/aaa/result", lambda route: route.fulfill(json={"verdict": 1}))
    tab.goto(f"{address}/#/jobs")
    with tab.expect_download() as saved:
        row(tab, "aaa").get_by_role("button", name="Save the result").click()
    assert saved.value.suggested_filename == "result.json"


def test_no_jobs_and_no_answer(tab: Any, watch: Any, address: str) -> None:
    Jobs().install(tab)
    tab.goto(f"{address}/#/jobs")
    tab.get_by_text("No jobs.").wait_for()
    tab.unroute("**/v1/jobs")
    watch.refused.add(503)
    problem = {"status": 503, "code": "unavailable", "detail": "the runner is starting", "errors": []}
    tab.route(
        "**/v1/jobs", lambda route: route.fulfill(status=503, json=problem, content_type="application/problem+json")
    )
    tab.get_by_role("button", name="Look again").click()
    tab.get_by_text("the runner is starting").wait_for()


def test_a_long_design_is_followed_as_a_job(tab: Any, address: str) -> None:
    queued = job("aaa", "queued")
    Jobs(queued, job("bbb", "queued")).install(tab)
    tab.route(
        "**/v1/designs",
        lambda route: route.fulfill(status=202, json=queued) if route.request.method == "POST" else route.fallback(),
    )
    tab.goto(f"{address}/")
    tab.get_by_role("button", name="Open wind_tunnel", exact=True).click()
    row(tab, "aaa").wait_for()
    assert "#/jobs?job=aaa" in tab.evaluate("location.href")
    assert row(tab, "aaa").get_attribute("aria-current") == "true"
    tab.get_by_role("link", name="Define").click()
    tab.get_by_role("button", name="Design", exact=True).click()
    row(tab, "aaa").wait_for()
