"""Pages of the views at a point, and what their plots hold."""

from __future__ import annotations

import json
import time
from typing import Any
from urllib.request import Request, urlopen

#: A plot that is drawn.
DRAWN = ".view .plot-canvas .main-svg"


def get(address: str, path: str) -> Any:
    """What a path of the service answers."""
    with urlopen(f"{address}/{path}", timeout=60.0) as answer:
        return json.load(answer)


def post(address: str, path: str, body: dict[str, Any]) -> Any:
    """What a path of the service answers to a document."""
    asked = Request(f"{address}/{path}", json.dumps(body).encode(), {"Content-Type": "application/json"})
    with urlopen(asked, timeout=60.0) as answer:
        return json.load(answer)


def made(address: str, request: dict[str, Any]) -> dict[str, Any]:
    """The design of a request."""
    document: dict[str, Any] = post(address, "v1/designs", request)
    return document


def ask(address: str, design: dict[str, Any], path: str) -> Any:
    """What a route of the design answers."""
    return get(address, f"v1/designs/{design['id']}/{path}")


def visit(tab: Any, address: str, design: dict[str, Any], view: str, **more: object) -> None:
    """Open a view of the design by its address, at point 3 unless another is given."""
    query = "&".join(f"{name}={value}" for name, value in ({"design": design["id"], "point": 3} | more).items())
    if tab.url.startswith(address):
        tab.evaluate("(hash) => { location.hash = hash; }", f"#/explore/{view}?{query}")
    else:
        tab.goto(f"{address}/#/explore/{view}?{query}")
    tab.locator(f'.view-list a[aria-current="true"][href="#/explore/{view}"]').wait_for()


def trace(tab: Any, name: str, place: int = 0) -> dict[str, Any]:
    """A trace of the plot at this place of the view, by its name or how that begins."""
    script = """([place, name]) => {
      const plot = document.querySelectorAll('.view .plot-canvas')[place];
      const found = plot.data.find((one) => one.name === name) ?? plot.data.find((one) => one.name.startsWith(name));
      return {x: [...found.x], y: [...found.y]};
    }"""
    found: dict[str, Any] = tab.evaluate(script, [place, name])
    return found


def until(tab: Any, script: str, arg: object = None) -> None:
    """Wait until a script is true of the page; its policy lets no script be evaluated from within."""
    deadline = time.monotonic() + 20.0
    while not tab.evaluate(script, arg):
        assert time.monotonic() < deadline, script
        tab.wait_for_timeout(30)
