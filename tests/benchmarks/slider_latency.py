"""A slider of the workbench: from the hand to the plots, in a browser without a screen."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any
from urllib.request import Request, urlopen

import numpy as np

from service.examples import example
from service.settings import Settings
from tests.served import FLAGS, chromium, served

MOVES = 30
#: What a hand takes for at once [s].
GOAL = 0.1

#: What is open, and the slider that is moved: every view that has some.
SLIDERS = (
    ("gain: root locus, step and margins", "root-locus?controller=nf&loop=K_i", "K_i"),
    ("gain of an inner loop: the same", "root-locus?controller=nf&loop=K_i", "K_p"),
    ("weight: poles, step, torques and margins", "point-weights?controller=lqr", "aileron_deg"),
    ("weight: gains and demands of the whole grid", "weights?controller=lqr", "aileron_deg"),
    ("gain: Bode plot and margins", "bode?controller=nf", "K_p"),
    ("gain: Nichols chart and margins", "nichols?controller=nf", "K_p"),
)

#: Times [ms] from the input event to the last plot's after-draw, a list of one a move.
MOVE = """async ([knob, moves]) => {
  const slider = document.querySelector(`[data-knob="${knob}"]`);
  const plots = [...document.querySelectorAll(".view .js-plotly-plot")];
  const drawn = (plot) => new Promise((done) => {
    const once = () => { plot.removeListener("plotly_afterplot", once); done(); };
    plot.on("plotly_afterplot", once);
  });
  const times = [];
  for (let k = 0; k < moves; k += 1) {
    await new Promise((frame) => requestAnimationFrame(frame));
    const all = Promise.all(plots.map(drawn));
    slider.value = String((k % 2 ? 0.01 : -0.01) * (2 + (k % 7)));
    const start = performance.now();
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    await all;
    times.push(performance.now() - start);
  }
  return times;
}"""


@dataclass(frozen=True)
class Latency:
    """Times of the moves of one slider.

    Attributes
    ----------
    job : what follows the slider
    seconds : [s] from the input event to the after-draw of every plot, a number a move
    """

    job: str
    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """The median time [s]."""
        return median(self.seconds)


def latencies() -> list[Latency] | None:
    """Times of every slider on the example with 25 points; None where there is no Chromium."""
    path = chromium()
    if path is None:
        return None
    from playwright.sync_api import sync_playwright

    with (
        tempfile.TemporaryDirectory() as folder,
        served(Settings(data_dir=Path(folder))) as address,
        sync_playwright() as playwright,
    ):
        ident = _design(address)
        opened = playwright.chromium.launch(executable_path=path, args=FLAGS)
        try:
            tab = opened.new_page(viewport={"width": 1280, "height": 1000})
            page = f"{{}}/#/explore/{{}}&design={ident}&point=12"
            return [_moved(tab, page.format(address, view), job, knob) for job, view, knob in SLIDERS]
        finally:
            opened.close()


def _moved(tab: Any, page: str, job: str, knob: str) -> Latency:
    tab.goto("about:blank")
    tab.goto(page)
    tab.locator(".view .plot-canvas .main-svg").last.wait_for()
    tab.wait_for_timeout(500)
    tab.evaluate(MOVE, [knob, 5])  # the first moves compile the page's code
    times = tab.evaluate(MOVE, [knob, MOVES])
    return Latency(job, tuple(1e-3 * time for time in times))


def _design(address: str) -> str:
    """Id of the example over 5 by 5 flight conditions."""
    request = example("wind_tunnel")
    request["grid"] = {
        "altitude_m": np.linspace(0.0, 6000.0, 5).tolist(),
        "dynamic_pressure_pa": np.geomspace(245.0, 1531.25, 5).tolist(),
    }
    asked = Request(f"{address}/v1/designs", json.dumps(request).encode(), {"Content-Type": "application/json"})
    with urlopen(asked, timeout=60.0) as answer:
        return str(json.load(answer)["id"])
