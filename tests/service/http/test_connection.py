"""Connections of clients that are slow, silent, or do not speak HTTP."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator

import pytest

from tests.service.http.running import Running, heard, problem_in, server

#: Patience of the server under test [s].
HEAD, BODY, IDLE, STALLED = 1.0, 1.0, 1.5, 1.5
HOST = b"Host: x\r\n"
GET = b"GET /healthz HTTP/1.1\r\n" + HOST + b"\r\n"
POST = b"POST /v1/linear-models HTTP/1.1\r\n" + HOST + b"Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n"


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with server(
        tmp_path_factory.mktemp("connections"),
        head_timeout_s=HEAD,
        body_timeout_s=BODY,
        min_body_rate_b_s=1000,
        idle_timeout_s=IDLE,
        stalled_answer_timeout_s=STALLED,
        max_connections=40,
    ) as started:
        yield started


@pytest.mark.parametrize(
    ("said", "status"),
    [
        (b"GARBAGE\r\n\r\n", 400),
        (b"GET /healthz HTTP/1.1\r\n\r\n", 400),
        (b"GET /healthz HTTP/1.1\r\nHost : x\r\n\r\n", 400),
        (b"GET /healthz HTTP/1.1\r\n" + HOST + b"Content-Length: 1\r\nContent-Length: 2\r\n\r\n", 400),
        (b"GET /healthz HTTP/1.1\r\n" + HOST + b"Transfer-Encoding: gzip\r\n\r\n", 501),
        (b"GET /" + b"a" * 70_000, 414),
        (b"GET / HTTP/1.1\r\n" + HOST + b"X: " + b"a" * 70_000, 431),
        (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\x00" * 32 + b"\r\n\r\n", 400),
        (b"POST /v1/designs HTTP/1.1\r\n" + HOST + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n", 400),
    ],
)
def test_what_is_not_http_is_a_problem(running: Running, said: bytes, status: int) -> None:
    assert problem_in(running.say(said))["status"] == status


def test_a_silent_client(running: Running) -> None:
    began = time.monotonic()
    assert running.say() == b""
    assert HEAD - 0.2 < time.monotonic() - began < HEAD + 2.0


def test_a_slow_head(running: Running) -> None:
    began = time.monotonic()
    with running.connect() as sock:
        sock.sendall(b"GET /healthz HTTP/1.1\r\n")
        sock.settimeout(0.1)
        answer, number = b"", 0
        while time.monotonic() < began + 10.0:
            try:
                sock.sendall(b"X-%d: x\r\n" % number)
                answer += sock.recv(4096)
                break
            except TimeoutError:
                number += 1
        sock.settimeout(5.0)
        answer += heard(sock)
    assert problem_in(answer)["code"] == "request_timeout"
    assert number >= 3
    assert time.monotonic() - began < HEAD + 2.0


def test_a_slow_second_head(running: Running) -> None:
    began = time.monotonic()
    with running.connect() as sock:
        sock.sendall(GET)
        assert b"200 OK" in sock.recv(4096)
        sock.sendall(b"GET /heal")
        assert problem_in(heard(sock))["status"] == 408
    assert time.monotonic() - began < HEAD + 2.0


def test_an_idle_connection(running: Running) -> None:
    began = time.monotonic()
    assert running.say(GET).count(b"HTTP/1.1 200") == 1
    assert IDLE - 0.2 < time.monotonic() - began < IDLE + 2.0


@pytest.mark.parametrize("sent", [b"", b"{"])
def test_a_body_that_does_not_come(running: Running, sent: bytes) -> None:
    began = time.monotonic()
    assert problem_in(running.say(POST + sent))["status"] == 408
    assert BODY - 0.2 < time.monotonic() - began < BODY + 2.0


def test_a_body_that_drips(running: Running) -> None:
    began = time.monotonic()
    with running.connect() as sock:
        sock.sendall(POST)
        sock.settimeout(0.05)
        answer = b""
        while not answer and time.monotonic() < began + 10.0:
            sock.sendall(b" ")
            try:
                answer = sock.recv(4096)
            except TimeoutError:
                continue
        answer += heard(sock)
    assert problem_in(answer)["status"] == 408
    assert time.monotonic() - began < BODY + 2.0


def test_a_body_that_comes_steadily_is_waited_for(running: Running) -> None:
    """Longer than the patience, and faster than the least rate."""
    pieces = [b" " * 500] * 8
    head = POST.replace(b"1000", b"4000").replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n")
    answer = running.say(head, *pieces, pause=0.2)
    assert b"400 Bad Request" in answer.split(b"\r\n")[0]
    assert b"unreadable_body" in answer


def test_a_body_that_nobody_reads_does_not_stay(running: Running) -> None:
    began = time.monotonic()
    head = b"POST /nowhere HTTP/1.1\r\n" + HOST + b"Content-Length: 500\r\n\r\n"
    answer = running.say(head + b"x")
    assert answer.startswith(b"HTTP/1.1 404")
    assert time.monotonic() - began < IDLE + BODY + 2.0


def test_one_who_reads_nothing_is_dropped(running: Running) -> None:
    """However many answers it asked for: the first that does not fit the buffers is the last."""
    sock = socket.socket()
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    sock.settimeout(20.0)
    sock.connect(("127.0.0.1", running.port))
    asked = 60
    with sock:
        sock.sendall((b"GET /openapi.json HTTP/1.1\r\n" + HOST + b"\r\n") * asked)
        time.sleep(STALLED * 2 + 2.0)
        got = heard(sock)
    assert got.count(b"HTTP/1.1 200") < asked
    assert running.get("/healthz")[0] == 200


def test_one_who_reads_slowly_is_not(running: Running) -> None:
    """An answer larger than the buffers, taken in pieces for longer than a client may stand still."""
    sock = socket.socket()
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
    sock.settimeout(20.0)
    sock.connect(("127.0.0.1", running.port))
    with sock:
        sock.sendall(b"GET /openapi.json HTTP/1.1\r\n" + HOST + b"Connection: close\r\n\r\n")
        got, began = b"", time.monotonic()
        while piece := sock.recv(16384 if time.monotonic() < began + 2 * STALLED else 1 << 20):
            got += piece
            if time.monotonic() < began + 2 * STALLED:
                time.sleep(0.1)
    head, _, body = got.partition(b"\r\n\r\n")
    length = next(
        int(line.split(b":")[1]) for line in head.split(b"\r\n") if line.lower().startswith(b"content-length")
    )
    assert len(body) == length


def test_pipelined_requests_are_answered_in_turn(running: Running) -> None:
    last = GET.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n")
    answer = running.say(GET * 3 + GET[:10], GET[10:] + last)
    assert answer.count(b"HTTP/1.1 200") == 5


def test_too_many_connections_make_room(running: Running) -> None:
    """Those that wait longest for their client go first; who asks is answered."""
    began = time.monotonic()
    silent = [running.connect() for _ in range(120)]
    assert running.get("/healthz", timeout=3.0)[0] == 200
    assert time.monotonic() - began < 3.0
    silent[0].settimeout(0.5)
    assert heard(silent[0]) == b""
    for sock in silent:
        sock.close()


def test_the_log_tells_of_it(running: Running) -> None:
    running.say(b"GARBAGE\r\n\r\n")
    lines = running.log.read_text().splitlines()
    assert all(line.startswith('{"time": "') for line in lines), lines
    assert not [line for line in lines if "traceback" in line], lines
