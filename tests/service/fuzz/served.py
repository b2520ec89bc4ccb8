"""A server of its own process with every design that its documentation names, and what each of its answers must be."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2

from service.documentation.design_examples import design_requests
from service.schemas.problem import Problem
from tests.service.http.running import Running, server
from tests.service.openapi_examples import address, operations

#: Longest answer to anything hostile [s].
PATIENCE = 5.0
#: What tells of the inside of the server: tracebacks, files, libraries, statements.
LEAK = re.compile(
    r"Traceback|site-packages|\.py\b|/(?:home|usr|tmp|root|opt)/|pydantic|sqlalchemy|SELECT |gainfield\.db|object at 0x"
)


@dataclass(frozen=True)
class Served:
    """A running server, a client of it, and its OpenAPI document."""

    running: Running
    http: httpx2.Client
    openapi: dict[str, Any]

    def posts(self) -> Iterator[tuple[str, dict[str, str], Any]]:
        """Address, query and first example body of every operation that reads a body."""
        for path, method, operation in operations(self.openapi):
            if method == "post":
                where, query = address(path, operation)
                query.pop("Idempotency-Key", None)
                examples = operation["requestBody"]["content"]["application/json"]["examples"]
                yield where, query, next(iter(examples.values()))["value"]

    def refuses(
        self, method: str, url: str, what: object = "", patience: float = PATIENCE, **sent: Any
    ) -> dict[str, Any]:
        """The problem that a request is answered with: a 4xx, soon, in the one shape, with nothing of the inside."""
        began = time.perf_counter()
        response = self.http.request(method, url, **sent)
        took = time.perf_counter() - began
        where = (method, url[:200], what, response.status_code, response.text[:500])
        assert 400 <= response.status_code < 500, where
        assert took < patience, (took, *where)
        assert response.headers["content-type"] == "application/problem+json", where
        problem: dict[str, Any] = response.json()
        Problem.model_validate(problem, strict=True)
        assert not LEAK.search(response.text), where
        assert len(response.content) < 100_000, where
        return problem


@contextmanager
def served(data_dir: Path, **settings: object) -> Iterator[Served]:
    """A server that has every design of the examples; what it says in its log at the end has no traceback."""
    with server(data_dir, **settings) as running:
        base = f"http://127.0.0.1:{running.port}"
        with httpx2.Client(base_url=base, timeout=60.0, trust_env=False) as client:
            for _, body in design_requests().values():
                assert client.post("/v1/designs", json=body).status_code == 201
            yield Served(running, client, client.get("/openapi.json").json())
            assert client.get("/healthz").status_code == 200
        lines = [json.loads(line) for line in running.log.read_text().splitlines()]
        assert not [line for line in lines if line["level"] == "error"], lines
