"""``make examples``: write the answers that the documentation shows, as this code gives them."""

from __future__ import annotations

from collections.abc import Iterator
from tempfile import TemporaryDirectory
from typing import Any

from fastapi.testclient import TestClient

from service.app import create_app, example_id
from service.documentation.answer_examples import ANSWERS, file_name, marked, trimmed
from service.documentation.design_examples import design_requests
from service.examples import NAMES
from service.jobs.example import EXAMPLE_PATH, example_body, example_job
from service.settings import Settings
from tests.service.openapi_examples import address, operations

#: Designs that the documentation is about, by the mark that stands for their id.
SHOWN = (NAMES[0], "lqr_power")


def ids() -> dict[str, str]:
    """The ids that answers hold, by the mark that stands for each."""
    return {f"design {name}": example_id(name) for name in SHOWN} | {"job": example_job()}


def prepare(client: TestClient) -> None:
    """Post what the examples are about: both designs, and the job, until it has ended."""
    for name in SHOWN:
        assert client.post("/v1/designs", json=design_requests()[name][1]).status_code in (200, 201)
    client.post(EXAMPLE_PATH, json=example_body(), headers={"Prefer": "respond-async"})
    with client.stream("GET", f"/v1/jobs/{example_job()}/events") as events:
        assert "event: succeeded" in list(events.iter_lines())


def live_answers(client: TestClient) -> Iterator[tuple[str, str, Any]]:
    """Method, path and JSON answer of every operation that gives one, asked as its examples say."""
    for path, method, operation in operations(client.get("/openapi.json").json()):
        content = [response.get("content", {}) for status, response in operation["responses"].items() if status < "202"]
        if method == "delete" or not any("application/json" in one for one in content):
            continue
        where, query = address(path, operation)
        if method == "post":
            (example, *_) = operation["requestBody"]["content"]["application/json"]["examples"].values()
            response = client.post(where, json=example["value"])
        else:
            response = client.get(where, params=query)
        assert response.status_code in (200, 201), (path, response.text)
        if response.headers["content-type"] == "application/json":
            yield method, path, response.json()


def main() -> None:
    """Write the files, and take away those of operations that are no more."""
    ANSWERS.mkdir(exist_ok=True)
    with TemporaryDirectory() as folder, TestClient(create_app(Settings(data_dir=folder))) as client:
        prepare(client)
        texts = {
            file_name(method, path): marked(trimmed(answer), ids()) for method, path, answer in live_answers(client)
        }
    for file in ANSWERS.glob("*.json"):
        if file.name not in texts:
            file.unlink()
    for name, text in texts.items():
        (ANSWERS / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
