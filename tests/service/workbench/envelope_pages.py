"""Pages of the views over the envelope, and what is done there."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import quote

SETTLED = ".plot-canvas .main-svg, .view table, .view .message:not(.loading), .view .primary"
PLOTTED = """el => el.data.map(({name, x, y, z, customdata}) => ({name, x, y, z, customdata}))"""


class Page:
    """A tab, and the service it looks at."""

    def __init__(self, tab: Any, address: str) -> None:
        self.tab, self.address = tab, address

    def get(self, path: str) -> Any:
        answer = self.tab.request.get(f"{self.address}/v1/{path}")
        assert answer.ok, answer.text()
        return answer.json()

    def post(self, path: str, body: Any) -> Any:
        answer = self.tab.request.post(f"{self.address}/v1/{path}", data=body)
        assert answer.ok, answer.text()
        return answer.json()

    def example(self, name: str = "wind_tunnel") -> Any:
        return copy.deepcopy(self.get("examples")[name])

    def design(self, name: str = "wind_tunnel") -> Any:
        return self.post("designs", self.example(name))

    def open(self, view: str, design: Any, **query: object) -> None:
        """Show a view and wait until nothing is under way."""
        text = "".join(f"&{name}={quote(str(value), safe='')}" for name, value in query.items())
        self.tab.goto(f"{self.address}/#/explore/{view}?design={design['id']}{text}")
        self.tab.locator(".view h3").wait_for()
        self.settled()

    def settled(self) -> None:
        self.tab.locator(SETTLED).first.wait_for()
        self.tab.locator("[aria-busy], .message.loading").first.wait_for(state="detached")

    def plotted(self, place: int = 0) -> Any:
        return self.tab.locator(".plot-canvas").nth(place).evaluate(PLOTTED)

    def eventually(self, found: Callable[[], object], wanted: object) -> None:
        deadline = time.monotonic() + 10
        while found() != wanted:
            assert time.monotonic() < deadline, f"{found()} is not {wanted}"
            time.sleep(0.05)

    def pick(self, point: str) -> None:
        """A click, as Plotly tells it."""
        self.tab.locator(".plot-canvas").first.evaluate(f"el => el.emit('plotly_click', {{points: [{point}]}})")

    def point(self) -> str:
        return str(self.parameter("point"))

    def parameter(self, name: str) -> Any:
        return self.tab.evaluate("name => new URLSearchParams(location.hash.split('?')[1]).get(name)", name)
