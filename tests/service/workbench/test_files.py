"""What the workbench is served as: types, entity tags, the content security policy, and no word to anybody else."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from service import workbench

STATIC = workbench.STATIC
MODULES = sorted(path.relative_to(STATIC).as_posix() for path in STATIC.rglob("*.js"))


def test_the_front_door_is_the_workbench(client: TestClient) -> None:
    page = client.get("/")
    assert page.status_code == 200
    assert page.headers["content-type"].startswith("text/html")
    assert client.head("/").status_code == 200
    again = client.get("/", headers={"If-None-Match": page.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    for asset in re.findall(r'(?:src|href|data-plotly)="([^"]+)"', page.text):
        if not asset.startswith("#"):
            assert client.get(f"/{asset}").status_code == 200, asset


@pytest.mark.parametrize("path", ["/", "/workbench/js/main.js", "/workbench/css/theme.css", f"/{workbench.SCRIPT_URL}"])
def test_the_policy_allows_no_script_but_ours(client: TestClient, path: str) -> None:
    headers = client.get(path).headers
    policy = dict(part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";"))
    assert policy["script-src"] == "'self'"
    assert policy["connect-src"] == "'self'"
    assert policy["default-src"] == "'none'"
    assert policy["frame-ancestors"] == "'none'"
    assert headers["x-content-type-options"] == "nosniff"


def test_the_page_holds_no_script_or_style_of_its_own(client: TestClient) -> None:
    html = client.get("/").text
    assert not re.search(r"<script(?![^>]*\bsrc=)", html)
    assert not re.search(r"\son\w+=|\sstyle=|<style", html)
    assert not re.search(r"(https?:)?//", html.replace("<!doctype html>", ""))


def test_files_are_asked_for_again_and_plotly_is_kept(client: TestClient) -> None:
    module = client.get("/workbench/js/main.js")
    assert module.headers["cache-control"] == "no-cache"
    assert "javascript" in module.headers["content-type"]
    again = client.get("/workbench/js/main.js", headers={"If-None-Match": module.headers["etag"]})
    assert again.status_code == 304
    assert "content-security-policy" in again.headers
    script = client.get(f"/{workbench.SCRIPT_URL}")
    assert "immutable" in script.headers["cache-control"]
    assert re.fullmatch(r"workbench/plotly-\d[\w.]*\.min\.js", workbench.SCRIPT_URL)
    assert b"plotly.js v" in script.content[:400]


@pytest.mark.parametrize("path", ["/workbench/../app.py", "/workbench/%2e%2e/app.py", "/workbench/js", "/workbench/"])
def test_nothing_beside_the_files_is_served(client: TestClient, path: str) -> None:
    assert client.get(path).status_code == 404


@pytest.mark.parametrize("module", MODULES)
def test_modules_are_small_and_import_what_exists(module: str) -> None:
    path = STATIC / module
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 250
    for imported in re.findall(r'^(?:import|export)[^;]*? from "([^"]+)";', text, flags=re.MULTILINE):
        assert imported.startswith("."), imported
        assert (path.parent / imported).is_file(), imported


@pytest.mark.parametrize(
    "forbidden", [r"\.innerHTML", r"\.outerHTML", r"insertAdjacentHTML", r"\beval\(", r"new Function", r"https?://"]
)
def test_modules_do_not_do_what_they_must_not(forbidden: str) -> None:
    found = [module for module in MODULES if re.search(forbidden, (STATIC / module).read_text(encoding="utf-8"))]
    assert found == (["js/dom.js"] if "http" in forbidden else [])  # the name of SVG is an address that nobody asks


def test_only_one_module_calls_plotly() -> None:
    assert [m for m in MODULES if "globalThis.Plotly" in (STATIC / m).read_text(encoding="utf-8")] == ["js/plot.js"]


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node on this machine")
def test_modules_are_javascript(tmp_path: Path) -> None:
    """Node reads every module as a module; it runs none."""
    program = (
        "import('node:vm').then(({SourceTextModule}) => process.argv.slice(1).forEach("
        "(f) => new SourceTextModule(require('fs').readFileSync(f, 'utf8'), {identifier: f})))"
    )
    files = [str(STATIC / module) for module in MODULES]
    done = subprocess.run(
        ["node", "--experimental-vm-modules", "-e", program, *files], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
