"""One BLAS thread before numpy is imported (small matrices are several times slower with more)."""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from types import SimpleNamespace  # noqa: E402

import numpy as np  # noqa: E402
import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

# How long an example takes says more about the machine's other work than about the code.
settings.register_profile("here", deadline=None)
settings.load_profile("here")
# On CI the same examples every time, so that a run says something about the change and not about the draw.
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
if os.environ.get("CI") == "true":
    settings.load_profile("ci")


def pytest_collection_modifyitems(items):
    """Tests of the service first: their files take longest, and a long one at the end would run alone."""
    items.sort(key=lambda item: "service" not in item.path.parts)


def _wind_tunnel_plant(system, trim_request):
    from model.flight import flight_grid
    from model.linearise import linearise
    from model.servo_tab import servo_tab
    from model.trim import trim

    grid = flight_grid(np.array([0.0, 3000.0]), "dynamic_pressure", np.array([245.0, 551.25, 980.0, 1531.25]))
    found = trim(system, grid.condition, trim_request)
    model = linearise(system, grid.condition, found)
    return SimpleNamespace(
        system=system, grid=grid, condition=grid.condition, trim=found, model=model, servo=servo_tab(model)
    )


@pytest.fixture(scope="session")
def plant_a():
    """Data set A (example wind_tunnel) over its grid of 2 x 4: system, grid, condition, trim, model, servo."""
    from model.examples import WIND_TUNNEL_TRIM, wind_tunnel

    return _wind_tunnel_plant(wind_tunnel(), WIND_TUNNEL_TRIM)


@pytest.fixture(scope="session")
def plant_b():
    """Data set B (example wind_tunnel_23012) over its grid of 2 x 4."""
    from model.examples import WIND_TUNNEL_TRIM, wind_tunnel_23012

    return _wind_tunnel_plant(wind_tunnel_23012(), WIND_TUNNEL_TRIM)


@pytest.fixture(scope="session")
def unsteady_a():
    """Data set A with unsteady damping and virtual inertia over the same grid: six states."""
    from dataclasses import replace

    from model.examples import WIND_TUNNEL_TRIM, wind_tunnel

    system = wind_tunnel()
    aerodynamics = replace(system.aerodynamics, damping="unsteady", virtual_inertia=True)
    return _wind_tunnel_plant(replace(system, aerodynamics=aerodynamics), WIND_TUNNEL_TRIM)


@pytest.fixture(scope="session")
def tab_actuator():
    """The tab actuator of the wind-tunnel examples: servo 40 Hz, damping 0.7, with its limits."""
    from model.actuators import Actuator, ActuatorLimits

    limits = ActuatorLimits(np.deg2rad(25.0), np.deg2rad(400.0), 2.0)
    return Actuator(2.0 * np.pi * 40.0, 0.7, 2.0 * np.pi * 80.0, limits=limits)


@pytest.fixture(scope="session")
def wind_tunnel_study():
    """The example wind_tunnel as a study: nf, pf and lqr over the grid of 2 x 4."""
    from design.classical.controller import ClassicalController
    from design.lqr.synthesis import LqrController
    from design.lqr.weights import BrysonWeights
    from design.specs import Spec
    from model.actuators import Actuator, ActuatorLimits
    from model.examples import WIND_TUNNEL_TRIM, wind_tunnel
    from schedules.study import GridRequest, Reference, Study

    system = wind_tunnel()
    rad = np.deg2rad
    tab = Actuator(2.0 * np.pi * 40.0, 0.7, 2.0 * np.pi * 80.0, limits=ActuatorLimits(rad(25.0), rad(400.0), 2.0))
    specs = (
        Spec("damping_ratio", "min", 0.5),
        Spec("gain_margin", "min", 6.0),
        Spec("phase_margin", "min", np.pi / 4),
        Spec("settling_time", "max", 0.6),
        Spec("overshoot", "max", 0.2),
    )
    bryson = BrysonWeights(
        aileron=rad(2.0), aileron_rate=rad(200.0), tab=rad(10.0), tab_rate=rad(400.0),
        aileron_integral=rad(0.1), tab_torque=0.5, aileron_torque=2.0,
    )  # fmt: skip
    return Study(
        geometry=system.geometry, inertia=system.inertia, aerodynamics=system.aerodynamics, trim=WIND_TUNNEL_TRIM,
        grid=GridRequest((0.0, 3000.0), "dynamic_pressure", (245.0, 551.25, 980.0, 1531.25)),
        name="wind_tunnel", tab_actuator=tab, aileron_actuator=Actuator(limits=ActuatorLimits(rad(25.0), None, 10.0)),
        reference=Reference(rad(10.0), 1.0),
        controllers=(
            ClassicalController("nf", "negative_feedback", specs, 2.0 * np.pi * 100.0),
            ClassicalController("pf", "positive_feedback", (Spec("damping_ratio", "min", 0.4),)),
            LqrController("lqr", bryson),
        ),
    )  # fmt: skip


@pytest.fixture(scope="session")
def wind_tunnel_envelope(wind_tunnel_study):
    """The example wind_tunnel, designed."""
    from schedules.run import run

    return run(wind_tunnel_study)


@pytest.fixture(scope="session")
def running_service(tmp_path_factory):
    """Address of a service in a process of its own."""
    import socket
    import subprocess
    import sys
    import time
    import urllib.request
    from pathlib import Path

    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        port = sock.getsockname()[1]
    command = [sys.executable, "-m", "service", "--port", str(port)]
    command += ["--data-dir", str(tmp_path_factory.mktemp("data"))]
    base = f"http://127.0.0.1:{port}"
    with subprocess.Popen(command, cwd=Path(__file__).parents[1], stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while True:
            try:
                urllib.request.urlopen(f"{base}/healthz", timeout=5).close()
                break
            except OSError:
                assert process.poll() is None, "the service stopped"
                assert time.monotonic() < deadline, "the service does not answer"
                time.sleep(0.1)
        yield base
        process.terminate()
