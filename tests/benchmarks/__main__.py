"""``make bench``: every comparison in one run, with the best ratio and its spread.

Each row first checks that both sides computed the same. Times are wall times on one BLAS thread; the ratio is the
peer's best time over our best, the spread that of the pairs run one after the other.
"""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse  # noqa: E402
import platform  # noqa: E402
import warnings  # noqa: E402
from importlib.metadata import version  # noqa: E402
from importlib.util import find_spec  # noqa: E402

from model.memory import keep_freed_memory  # noqa: E402
from tests.benchmarks.cases import case  # noqa: E402
from tests.benchmarks.http_load import (  # noqa: E402
    CONNECTIONS,
    MEDIAN_GOAL,
    RATE_GOAL,
    cached_load,
    cold_rows,
    served_here,
)
from tests.benchmarks.measure import Row, measure  # noqa: E402
from tests.benchmarks.rows import rows  # noqa: E402
from tests.benchmarks.slider_latency import GOAL, MOVES, latencies  # noqa: E402

#: Name of the rows that have no peer: what moves in the workbench.
SLIDERS = "slider"
#: Name of the rows of the running service.
HTTP = "over HTTP"


def main() -> None:
    """Print one line a comparison."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--repeats", type=int, default=5, help="timed pairs a row (default 5)")
    parser.add_argument("--only", default="", help="rows whose name contains this")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    keep_freed_memory()  # as the service does; it helps both sides
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "control"))
    slycot = "with slycot" if find_spec("slycot") else "without slycot"
    print(
        f"Python {platform.python_version()}, {versions} ({slycot}), one BLAS thread, {arguments.repeats} pairs a row"
    )
    print(f"{'job':<44} {'peer':<28} {'ours ms':>9} {'peer ms':>9} {'ratio':>7} {'spread':>15} {'goal':>6}")
    for row in rows():
        if arguments.only in row.job:
            _compare(row, arguments.repeats)
    if arguments.only in HTTP:
        _over_http(arguments.repeats)
    if arguments.only in SLIDERS:
        _sliders()


def _compare(row: Row, repeats: int) -> None:
    """Print the line of a comparison."""
    done = measure(row, repeats)
    low, high = done.spread
    verdict = "met" if done.ratio >= row.goal else "MISSED"
    print(
        f"{row.job:<44} {row.peer:<28} {1e3 * min(done.ours):>9.2f} {1e3 * min(done.theirs):>9.1f} "
        f"{done.ratio:>7.1f} {low:>7.1f}..{high:<6.1f} {row.goal:>6g} {verdict}",
        flush=True,
    )


def _over_http(repeats: int) -> None:
    """Print the lines of the running service: one has a peer, two have goals of their own."""
    with served_here() as served:
        for row in cold_rows(case(), served):
            _compare(row, repeats)
        load = cached_load(served)
    verdict = "met" if load.median < MEDIAN_GOAL else "MISSED"
    print(f"{'cached design over HTTP, median':<73} {1e3 * load.median:>9.2f} of {1e3 * MEDIAN_GOAL:g} ms {verdict}")
    verdict = "met" if load.rate > RATE_GOAL else "MISSED"
    words = f"the same from {CONNECTIONS} connections"
    print(f"{words:<73} {load.rate:>9.0f} of {RATE_GOAL:g} requests/s {verdict}", flush=True)


def _sliders() -> None:
    """Print one line a slider of the workbench: its median time against what a hand takes for at once."""
    found = latencies()
    if found is None:
        print(f"{SLIDERS}: not measured, there is no Chromium on this machine")
        return
    for slider in found:
        times = sorted(slider.seconds)
        verdict = "met" if slider.median < GOAL else "MISSED"
        print(
            f"{slider.job:<44} {f'{SLIDERS}, {MOVES} moves':<28} {1e3 * slider.median:>9.2f} {1e3 * GOAL:>9.1f} "
            f"{GOAL / slider.median:>7.1f} {GOAL / times[-1]:>7.1f}..{GOAL / times[0]:<6.1f} {1:>6g} {verdict}",
            flush=True,
        )


main()
