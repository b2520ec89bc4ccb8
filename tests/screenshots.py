"""``make screenshots``: every panel and view of the workbench with the shipped example, light and dark, as pictures."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.request import Request, urlopen

from playwright.sync_api import sync_playwright

from service.examples import NAMES, example
from service.settings import Settings
from tests.served import FLAGS, chromium, served

SCHEMES = ("light", "dark")
HEIGHT = 860
#: Views that are of a state feedback only.
OF_LQR = ("weights", "point-weights", "phase")
#: What is under way in a page, or awaits the reader.
BUSY = "[aria-busy], .message.loading"


def made(address: str, name: str) -> str:
    """Id of the design of a shipped example."""
    body = json.dumps(example(name)).encode()
    with urlopen(Request(f"{address}/v1/designs", body, {"Content-Type": "application/json"}), timeout=60.0) as answer:
        return str(json.load(answer)["id"])


def addresses(tab: Any, first: str, other: str) -> dict[str, str]:
    """What is behind ``#`` for every panel and view, by the name of its picture."""
    hashes = tab.locator(".view-list a").evaluate_all("all => all.map(one => one.getAttribute('href'))")
    views = {hash_.replace("#/", "").replace("/", "-"): f"{hash_}?design={first}&point=3" for hash_ in hashes}
    views |= {f"explore-{view}": f"{views[f'explore-{view}']}&controller=lqr" for view in OF_LQR}
    panels = {panel: f"#/{panel}?design={first}" for panel in ("define", "download", "jobs")}
    compared = f"#/compare?design={first}&with={other}&controller=nf&point=3&figure=figures.settling_time_s"
    return {"start": "#/explore", **panels, "compare": compared, **views}


def take(folder: Path, only: str, width: int, whole: bool) -> None:
    """Write the pictures whose name contains `only`."""
    folder.mkdir(parents=True, exist_ok=True)
    with (
        TemporaryDirectory() as kept,
        served(Settings(data_dir=Path(kept))) as address,
        sync_playwright() as playwright,
    ):
        first, other = made(address, NAMES[0]), made(address, NAMES[1])
        browser = playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
        for scheme in SCHEMES:
            page = browser.new_context(viewport={"width": width, "height": HEIGHT}, color_scheme=scheme)
            tab = page.new_page()
            tab.goto(f"{address}/#/explore?design={first}")
            tab.locator(".view-list a").first.wait_for()
            for name, hash_ in addresses(tab, first, other).items():
                if only not in name:
                    continue
                tab.goto("about:blank")
                tab.goto(f"{address}/{hash_}")
                tab.locator("main > *").first.wait_for()
                tab.wait_for_load_state("networkidle")
                tab.locator(BUSY).first.wait_for(state="detached")
                tab.wait_for_timeout(400)  # Plotly sets sizes once more
                tab.screenshot(path=folder / f"{name}-{scheme}.png", full_page=whole)
            page.close()
        browser.close()


def main() -> None:
    """Take the pictures that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m tests.screenshots", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", help="pictures whose name contains this")
    parser.add_argument("--width", type=int, default=1280, help="of the page (default 1280)")
    parser.add_argument("--window", action="store_true", help="what fits the window, not the whole page")
    arguments = parser.parse_args()
    take(arguments.folder, arguments.only, arguments.width, not arguments.window)


if __name__ == "__main__":
    main()
