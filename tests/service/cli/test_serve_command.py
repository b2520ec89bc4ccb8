"""`gainfield serve`: starts, ends, and says why it does not start."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
import urllib.request
from pathlib import Path

import pytest

from tests.service.cli.command import ROOT, process, run, script


def test_serves_until_it_is_told_to_stop(tmp_path: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with subprocess.Popen(
        [*script(), "serve", "--port", str(port), "--data-dir", str(tmp_path / "data")],
        cwd=ROOT, stderr=subprocess.DEVNULL,
    ) as serving:  # fmt: skip
        deadline = time.monotonic() + 60.0
        while True:
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/readyz", timeout=5) as answer:
                    assert answer.status == 200
                break
            except OSError:
                assert serving.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.1)
        taken = process("serve", "--port", port, "--data-dir", tmp_path / "other")
        serving.send_signal(signal.SIGTERM)
        assert serving.wait(30) in (0, -signal.SIGTERM)
    assert taken.returncode == 1
    assert taken.stderr == f"gainfield: not_started: cannot listen on 127.0.0.1 port {port}: Address already in use\n"
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize(
    ("options", "settings", "said"),
    [
        (["--port", "99999"], {}, "settings: port"),
        (["--workers", "0"], {}, "settings: workers"),
        (["--host", "0.0.0.0"], {}, "keys are required and there are none"),
        (["--host", "no.such.host.invalid"], {}, "cannot listen on no.such.host.invalid"),
        (["--host", "a" * 70], {"GAINFIELD_ALLOW_ANONYMOUS": "true"}, "not_started"),
        ([], {"GAINFIELD_DASK": "tcp://10.0.0.1:8786"}, "GAINFIELD_DASK_ALLOW_INSECURE"),
        ([], {"GAINFIELD_DATABASE_URL": "postgresql+psycopg://u:secret@127.0.0.1:1/x"}, "store_unavailable"),
    ],
)
def test_a_start_that_is_refused(tmp_path: Path, options: list[str], settings: dict[str, str], said: str) -> None:
    result = run("serve", "--port", "0", "--data-dir", tmp_path, *options, **settings)
    assert result.exit_code == 1
    assert said in result.stderr
    assert "secret" not in result.stderr


def test_a_data_directory_that_is_none(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("x")
    result = run("serve", "--port", "0", "--data-dir", file)
    assert result.exit_code == 1
    assert result.stderr.startswith("gainfield: store_unavailable: ")


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_a_data_directory_that_may_not_be_written(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    result = run("serve", "--port", "0", "--data-dir", tmp_path / "data")
    tmp_path.chmod(0o700)
    assert result.exit_code == 1
    assert "Permission denied" in result.stderr


def test_the_options_of_the_module() -> None:
    module = subprocess.run(
        [script()[0], "-m", "service", "--help"], cwd=ROOT, capture_output=True, text=True, timeout=60
    ).stdout
    for option in ("--host", "--port", "--data-dir", "--workers"):
        assert option in module
        assert option in run("serve", "--help").stdout
