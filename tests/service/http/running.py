"""A server of its own process, and sockets to it that do what no HTTP client would."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class Running:
    """A server: its port, its process, and the file that its log goes to."""

    port: int
    process: subprocess.Popen[bytes]
    log: Path

    def get(self, path: str, timeout: float = 30.0, **headers: str) -> tuple[int, bytes]:
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", headers=headers)
        with urllib.request.urlopen(request, timeout=timeout) as answer:
            return answer.status, answer.read()

    def post(self, path: str, body: Any) -> tuple[int, bytes]:
        headers = {"Content-Type": "application/json"}
        data = json.dumps(body).encode()
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", data=data, headers=headers)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, answer.read()

    def connect(self, timeout: float = 20.0) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=timeout)

    def say(self, *pieces: bytes, pause: float = 0.0) -> bytes:
        """Everything that is answered to these bytes until the connection is closed."""
        with self.connect() as sock:
            for piece in pieces:
                sock.sendall(piece)
                time.sleep(pause)
            return heard(sock)

    def memory(self) -> float:
        """Resident memory [MiB]."""
        words = Path(f"/proc/{self.process.pid}/statm").read_text().split()
        return int(words[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def heard(sock: socket.socket) -> bytes:
    answer = b""
    try:
        while piece := sock.recv(65536):
            answer += piece
    except ConnectionResetError:
        pass
    return answer


def problem_in(answer: bytes) -> dict[str, Any]:
    """The problem document of one raw answer that closes its connection."""
    head, _, body = answer.partition(b"\r\n\r\n")
    lines = head.decode().lower().split("\r\n")
    assert "content-type: application/problem+json" in lines, answer[:300]
    assert "connection: close" in lines
    assert f"content-length: {len(body)}" in lines
    document: dict[str, Any] = json.loads(body)
    assert int(lines[0].split()[1]) == document["status"]
    assert document["type"] == f"urn:gainfield:problem:{document['code']}"
    return document


@contextmanager
def server(data_dir: Path, *options: str, **settings: object) -> Iterator[Running]:
    """A server with these settings, once it answers."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = int(free.getsockname()[1])
    log = data_dir / "log"
    with open(log, "wb") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "service", "--port", str(port), "--data-dir", str(data_dir), *options],
            cwd=ROOT,
            env=os.environ | {f"GAINFIELD_{name.upper()}": str(value) for name, value in settings.items()},
            stdout=file,
            stderr=file,
            start_new_session=True,
        )
    running = Running(port, process, log)
    try:
        deadline = time.monotonic() + 60
        while True:
            try:
                running.get("/healthz")
                break
            except OSError:
                assert process.poll() is None, log.read_text()
                assert time.monotonic() < deadline, "the server does not answer"
                time.sleep(0.05)
        yield running
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
