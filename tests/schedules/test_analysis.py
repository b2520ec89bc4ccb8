"""The plant over the grid: what is inside the model and what is not."""

from dataclasses import replace

import numpy as np
import pytest

from design.outcome import Outcome
from model.examples import WIND_TUNNEL_TRIM, airliner_aileron, wind_tunnel
from model.trim import TrimRequest
from schedules.analysis import analyse
from schedules.study import GridRequest, PlantStudy


def _study(system, grid, trim=WIND_TUNNEL_TRIM):
    return PlantStudy(system.geometry, system.inertia, system.aerodynamics, trim, grid)


GRID = GridRequest((0.0, 3000.0), "dynamic_pressure", (245.0, 551.25, 980.0, 1531.25))


def test_point_by_point_equals_the_grid():
    whole = analyse(_study(wind_tunnel(), GRID))
    one = analyse(_study(wind_tunnel(), replace(GRID, altitude=(3000.0,), speed=(980.0,))))
    for field in ("A", "B", "stiffness", "input_offset"):
        np.testing.assert_allclose(
            getattr(one.model, field)[0, 0], getattr(whole.model, field)[1, 2], rtol=1e-13, atol=1e-13
        )
    assert whole.outcomes.ok.all()


def test_supersonic_points_are_outside_the_model_and_lose_no_others():
    plant = analyse(_study(airliner_aileron(), GridRequest((0.0, 9000.0), "airspeed", (200.0, 320.0, 345.0))))
    assert plant.outcomes.codes.tolist() == [["ok", "ok", "outside_model"], ["ok", "outside_model", "outside_model"]]
    assert "Mach 1.01" in plant.outcomes.reasons[0, 2]
    assert np.isnan(plant.model.A[0, 2]).all()
    assert np.isfinite(plant.model.A[0, 0]).all()


def test_nothing_inside_the_model():
    plant = analyse(_study(wind_tunnel(), GridRequest((0.0,), "airspeed", (400.0, 500.0))))
    assert not plant.outcomes.ok.any()
    assert plant.model.A.shape == (1, 2, 4, 4)


@pytest.mark.parametrize(("system", "limit"), [(wind_tunnel(), 0.3), (airliner_aileron(), 0.7)])
def test_warning_above_the_doubtful_mach_number(system, limit):
    grid = GridRequest((0.0,), "mach", (limit - 0.01, limit + 0.01, limit + 0.05))
    warnings = analyse(_study(system, grid)).warnings
    assert [w.code for w in warnings] == ["mach"]
    assert warnings[0].points == (1, 2)
    assert f"above Mach {limit}" in warnings[0].detail


def test_floating_aileron_needs_no_torque():
    trim = TrimRequest(alpha=np.deg2rad(5.0), aileron=np.deg2rad(4.0), tab="zero_aileron_torque")
    plant = analyse(_study(wind_tunnel(), GRID, trim))
    assert plant.outcomes.codes.tolist() == [[Outcome.OK] * 4] * 2
    np.testing.assert_array_equal(plant.trim.torque[..., 1], 0.0)
