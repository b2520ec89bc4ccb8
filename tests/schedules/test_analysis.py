"""The plant over the grid: what is inside the model and what is not."""

from dataclasses import replace

import numpy as np
import pytest

from design.outcome import Outcome
from model.examples import WIND_TUNNEL_TRIM, airliner_aileron, wind_tunnel, wind_tunnel_23012
from model.hinge_moments.interpolant import fit_interpolant
from model.hinge_moments.table import table_of_rows
from model.hinge_moments.taylor import fit_taylor
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
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


def _with_source(source):
    system = wind_tunnel_23012()
    return replace(system, aerodynamics=replace(system.aerodynamics, source=source))


@pytest.mark.parametrize("fit", [fit_taylor, fit_interpolant])
def test_trims_outside_the_table_are_outside_the_model(fit):
    system = _with_source(fit(xfoil_naca23012()))
    inside = analyse(_study(system, GRID, TrimRequest(np.deg2rad(5.0), np.deg2rad(20.0), np.deg2rad(-20.0))))
    assert inside.outcomes.ok.all()
    for trim in (TrimRequest(np.deg2rad(5.5)), TrimRequest(0.0, np.deg2rad(21.0)), TrimRequest(0.0, 0.0, -0.4)):
        plant = analyse(_study(system, GRID, trim))
        assert plant.outcomes.codes.tolist() == [[Outcome.OUTSIDE_MODEL] * 4] * 2
        assert "outside the hinge-moment data: alpha 0 to 5, tab -20 to 20" in plant.outcomes.reasons[1, 3]
    assert "alpha 0, tab -22.92, aileron 0 deg" in plant.outcomes.reasons[0, 0]


@pytest.mark.parametrize("fit", [fit_taylor, fit_interpolant])
def test_tab_angle_sought_beyond_the_table_is_outside_the_model(fit):
    whole = xfoil_naca23012()
    (alpha, dt, da), (tab, aileron) = whole.angles.T, whole.coefficients.T
    kept = np.abs(dt) < np.deg2rad(6.0)
    table = table_of_rows(alpha=alpha[kept], dt=dt[kept], da=da[kept], C_Ht=tab[kept], C_Ha=aileron[kept])
    request = TrimRequest(0.0, np.deg2rad(-15.0), "zero_aileron_torque")
    found = analyse(_study(_with_source(fit(whole)), GRID, request))
    assert found.outcomes.ok.all()
    assert np.all(found.trim.state[..., 0] > np.deg2rad(6.0))
    lost = analyse(_study(_with_source(fit(table)), GRID, request))
    assert lost.outcomes.codes.tolist() == [[Outcome.OUTSIDE_MODEL] * 4] * 2


def test_supersonic_points_keep_their_own_reason_beside_a_table():
    system = _with_source(fit_interpolant(xfoil_naca23012()))
    plant = analyse(_study(system, GridRequest((0.0,), "airspeed", (50.0, 345.0)), TrimRequest(0.2)))
    assert "Mach" in plant.outcomes.reasons[0, 1]
    assert "hinge-moment data" in plant.outcomes.reasons[0, 0]
