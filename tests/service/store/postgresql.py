"""A PostgreSQL server of Debian for the tests: in a temporary directory, on a loopback port, gone afterwards."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg


def binaries() -> Path | None:
    """Where `initdb` and `postgres` are; None when they are not installed."""
    found = shutil.which("initdb")
    debian = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda path: int(path.parent.name))
    places = [*reversed(debian), *([Path(found).parent] if found else [])]
    return next((place for place in places if (place / "initdb").exists() and (place / "postgres").exists()), None)


class Server:
    """A running server, which may be frozen, stopped and started again."""

    def __init__(self, programs: Path, data: Path) -> None:
        self._programs, self._data = programs, data
        with socket.socket() as sock:
            sock.bind(("127.0.0.1", 0))
            self.port = int(sock.getsockname()[1])
        self._run("initdb", "-D", str(data), "-A", "trust", "-U", "tests", "-E", "UTF8", "--no-locale", "--no-sync")
        self.start()

    def url(self, name: str) -> str:
        return f"postgresql+psycopg://tests@127.0.0.1:{self.port}/{name}"

    def execute(self, statement: str, name: str = "postgres") -> None:
        address = f"postgresql://tests@127.0.0.1:{self.port}/{name}"
        with psycopg.connect(address, autocommit=True, connect_timeout=5) as connection:
            connection.execute(statement.encode())

    def start(self) -> None:
        options = {"port": self.port, "listen_addresses": "127.0.0.1", "unix_socket_directories": "", "fsync": "off"}
        settings = [f"-c{name}={value}" for name, value in options.items()]
        self._process = subprocess.Popen(
            [self._programs / "postgres", "-D", self._data, *settings],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd="/",
            user=_user(),
            group=_user(),
            extra_groups=None if _user() is None else [],
        )
        deadline = time.monotonic() + 30
        while True:
            try:
                self.execute("SELECT 1")
                return
            except psycopg.OperationalError:
                assert self._process.poll() is None, "PostgreSQL stopped"
                assert time.monotonic() < deadline, "PostgreSQL does not answer"
                time.sleep(0.05)

    def stop(self) -> None:
        self._process.send_signal(signal.SIGQUIT)  # at once, as a crash does
        self._process.wait(30)

    @contextmanager
    def frozen(self) -> Iterator[None]:
        """Connections stay and new ones are accepted by the system, and nothing answers."""
        processes = [self._process.pid, *_children(self._process.pid)]
        for process in processes:
            os.kill(process, signal.SIGSTOP)
        try:
            yield
        finally:
            for process in processes:
                os.kill(process, signal.SIGCONT)

    def _run(self, program: str, *arguments: str) -> None:
        subprocess.run(
            [self._programs / program, *arguments],
            check=True,
            capture_output=True,
            cwd="/",
            user=_user(),
            group=_user(),
            extra_groups=None if _user() is None else [],
        )


@contextmanager
def running(programs: Path) -> Iterator[Server]:
    # Not below pytest's directory, which only root may enter.
    base = Path(tempfile.mkdtemp(prefix="gainfield-postgresql-"))
    try:
        if _user() is not None:
            shutil.chown(base, _user())
        server = Server(programs, base / "data")
        try:
            yield server
        finally:
            server.stop()
    finally:
        shutil.rmtree(base, ignore_errors=True)


def _user() -> str | None:
    """Who runs the server: it refuses to be run by root."""
    return "postgres" if os.geteuid() == 0 and pwd.getpwnam("postgres") else None


def _children(process: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
