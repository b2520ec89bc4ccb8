import numpy as np
import pytest

from model import examples
from model.linearise import linearise
from model.servo_tab import servo_tab
from model.trim import trim


@pytest.mark.parametrize("name", ["wind_tunnel", "wind_tunnel_23012"])
def test_wind_tunnel_models_have_the_inertia_ratio_of_the_seed(name):
    bodies = getattr(examples, name)().inertia
    assert bodies.aileron.inertia / bodies.tab.inertia == pytest.approx(20.0)
    assert abs(bodies.tab.cg_offset) < 1e-3


def test_trims_are_those_of_the_shipped_requests():
    assert np.rad2deg(examples.WIND_TUNNEL_TRIM.alpha) == pytest.approx(5.0)
    assert np.rad2deg(examples.AIRLINER_TRIM.alpha) == pytest.approx(3.0)
    for request in (examples.WIND_TUNNEL_TRIM, examples.AIRLINER_TRIM):
        assert (request.aileron, request.tab) == (0.0, 0.0)


def test_every_example_runs_the_whole_way_in_python(example, grid):
    result = trim(example, grid.condition, examples.WIND_TUNNEL_TRIM)
    servo = servo_tab(linearise(example, grid.condition, result))
    assert np.all(np.isfinite(servo.dc_gain))
