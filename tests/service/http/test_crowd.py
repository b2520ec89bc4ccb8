"""Many clients at once, slow ones among them: nobody well-behaved notices, and the memory comes back."""

from __future__ import annotations

import asyncio
import resource
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from tests.service.http.running import Running, server

MANY, SLOW = 2000, 400
REQUESTS = 10_000
GET = b"GET %s HTTP/1.1\r\nHost: x\r\n\r\n"
SLOW_HEAD = b"GET /v1/version HTTP/1.1\r\nX-Slow: "
SLOW_BODY = b"POST /v1/designs HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 100000\r\n\r\n{"


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = MANY + SLOW + 200
    if hard != resource.RLIM_INFINITY and hard < needed:
        pytest.skip(f"this system lets a process open {hard} files")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, needed), hard))
    with server(tmp_path_factory.mktemp("crowd"), idle_timeout_s=60, head_timeout_s=60, body_timeout_s=60) as started:
        yield started
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def ask(streams: Streams, path: bytes) -> tuple[int, bytes]:
    reader, writer = streams
    writer.write(GET % path)
    head = await reader.readuntil(b"\r\n\r\n")
    (length,) = (int(line[15:]) for line in head.lower().split(b"\r\n") if line.startswith(b"content-length:"))
    return int(head[9:12]), await reader.readexactly(length)


async def connected(port: int, count: int, say: bytes = b"") -> list[Streams]:
    made: list[Streams] = []
    while len(made) < count:
        wanted = min(200, count - len(made))
        made += await asyncio.gather(*(asyncio.open_connection("127.0.0.1", port) for _ in range(wanted)))
        for _, writer in made[-wanted:]:
            writer.write(say)
    return made


async def crowd(running: Running, path: bytes) -> tuple[set[int], list[float]]:
    """Statuses that the well-behaved were answered with, and how long health took while they asked [s]."""
    slow = await connected(running.port, SLOW // 2, SLOW_HEAD) + await connected(running.port, SLOW // 2, SLOW_BODY)
    good = await connected(running.port, MANY)
    done = threading.Event()
    watching = asyncio.get_running_loop().run_in_executor(None, watch, running, done)
    answers = await asyncio.gather(*(ask(one, path) for one in good))
    done.set()
    took = await watching
    for _, writer in slow:
        writer.write(b"x")
    for _, writer in (*slow, *good):
        writer.close()
    return {status for status, _ in answers}, took


def watch(running: Running, done: threading.Event) -> list[float]:
    """How long `/healthz` takes, again and again [s]."""
    took = []
    while not done.is_set():
        began = time.perf_counter()
        assert running.get("/healthz")[0] == 200
        took.append(time.perf_counter() - began)
        done.wait(0.05)
    return took


def test_a_crowd_with_slow_ones_in_it(running: Running, quick: Any) -> None:
    _, body = running.post("/v1/designs", quick)
    path = b"/v1/designs/" + body.split(b'"')[3]
    asyncio.run(crowd(running, path))  # buffers and pools have their size after the first crowd
    before = running.memory()
    statuses, took = asyncio.run(crowd(running, path))
    assert statuses == {200}
    assert max(took) < 3.0, max(took)
    deadline = time.monotonic() + 5.0
    while running.memory() > before + 50.0 and time.monotonic() < deadline:
        time.sleep(0.1)
    assert running.memory() < before + 50.0
    assert running.memory() < 1000.0


def test_many_requests_leave_no_memory_behind(running: Running, quick: Any) -> None:
    _, body = running.post("/v1/designs", quick)
    paths = [b"/v1/designs/" + body.split(b'"')[3], b"/healthz", b"/v1/designs?limit=1", b"/nowhere/%d"]

    async def one(count: int) -> None:
        streams = await asyncio.open_connection("127.0.0.1", running.port)
        for number in range(count):
            path = paths[number % 4]
            await ask(streams, path % number if b"%d" in path else path)
        streams[1].close()

    async def asked(count: int) -> None:
        await asyncio.gather(*(one(count // 8) for _ in range(8)))

    asyncio.run(asked(REQUESTS // 5))
    before = running.memory()
    asyncio.run(asked(REQUESTS))
    assert running.memory() < before + 10.0
