"""`gainfield design --server`: the design and the files that are made here, and servers that are none."""

from __future__ import annotations

import json
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from tests.service.cli.command import done, refused, timeless
from tests.service.http.running import server


def test_the_same_here_and_on_a_server(tmp_path: Path, wanted: dict[str, Any]) -> None:
    wanted["grid"]["altitude_m"] = [0.0]
    request = tmp_path / "request.json"
    request.write_text(json.dumps(wanted))
    here, there = tmp_path / "here", tmp_path / "there"
    files = ("--formats", "json,c,h,m")
    done("design", request, "--out", tmp_path / "here.json", "--schedule", here, *files)
    with server(tmp_path) as running:
        address = f"http://127.0.0.1:{running.port}"
        said = done(
            "design", request, "--out", tmp_path / "there.json", "--schedule", there, *files, "--server", address
        )
        assert done("verify", there / "wind_tunnel_nf.json", "--server", address).startswith("nf: every cell is proved")
        # The design is there already, and is answered at once.
        assert done("design", request, "--json", GAINFIELD_SERVER=address)
    assert "nf (negative_feedback): 4 ok" in said
    assert timeless((tmp_path / "here.json").read_bytes()) == timeless((tmp_path / "there.json").read_bytes())
    names = sorted(path.name for path in here.iterdir())
    assert names == sorted(path.name for path in there.iterdir())
    assert len(names) == 12
    for name in names:
        if name.endswith(".json"):
            assert timeless((here / name).read_bytes()) == timeless((there / name).read_bytes())


def test_servers_that_are_none(request_file: Path) -> None:
    assert refused("design", request_file, "--server", "http://127.0.0.1:1")["code"] == "server_unreachable"
    for address in ("nonsense", "ftp://127.0.0.1", "http://[::", "http://127.0.0.1:99999"):
        assert refused("design", request_file, "--server", address)["code"] == "server_unreachable"
    assert refused("design", request_file, "--server", "http://127.0.0.1:1", "--key", "é")["code"] == "unauthenticated"


@pytest.mark.parametrize("answer", [b"<html>", b"[]", b'{"name": "Other"}'])
def test_a_server_of_something_else(request_file: Path, answer: bytes) -> None:
    class Other(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *words: object) -> None:
            return None

    with HTTPServer(("127.0.0.1", 0), Other) as other:
        serving = threading.Thread(target=other.serve_forever)
        serving.start()
        try:
            address = f"http://127.0.0.1:{other.server_port}"
            assert refused("design", request_file, "--server", address)["code"] == "not_gainfield"
        finally:
            other.shutdown()
            serving.join()
