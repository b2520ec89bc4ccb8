"""Bodies over the limit: refused by their declared length or by their bytes, with a problem document."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from service.app import create_app
from service.settings import Settings

JSON = {"Content-Type": "application/json"}


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("small"), max_body_bytes=4096)
    with TestClient(create_app(settings), raise_server_exceptions=False) as client:
        yield client


def test_declared_length(small: TestClient, refused: Any) -> None:
    problem = refused(small.post("/v1/designs", content=b" " * 4097, headers=JSON), 413)
    assert problem["code"] == "body_too_large"
    assert "GAINFIELD_MAX_BODY_BYTES" in problem["detail"]
    assert problem["errors"] == [{"pointer": "", "detail": "too many bytes", "unit": "B", "allowed": "<= 4096"}]


@pytest.mark.parametrize("chunk", [100, 5000, 50_000])
def test_bytes_of_no_declared_length(small: TestClient, refused: Any, chunk: int) -> None:
    def chunks() -> Iterator[bytes]:
        for _ in range(100):
            yield b" " * chunk

    response = small.post("/v1/designs", content=chunks(), headers=JSON)
    assert "content-length" not in response.request.headers
    assert refused(response, 413)["code"] == "body_too_large"


def test_the_limit_itself_is_taken(small: TestClient, refused: Any) -> None:
    assert refused(small.post("/v1/designs", content=b"{}".ljust(4096), headers=JSON), 422)["errors"]
    assert refused(small.post("/v1/designs", content=b"{}".ljust(4097), headers=JSON), 413)


def test_wherever_it_is_sent(small: TestClient, refused: Any) -> None:
    for path in ("/v1/linear-models", "/v1/hinge-moments", "/nowhere"):
        refused(small.post(path, content=b" " * 4097, headers=JSON), 413)


def test_other_requests_go_on(small: TestClient, tmp_path: Path) -> None:
    assert small.get("/healthz").status_code == 200
