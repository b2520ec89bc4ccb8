"""Designs of single points: each is what it would be alone, and is made once."""

from dataclasses import replace

import numpy as np
import pytest

from schedules.analysis import analyse
from schedules.refine.flown import Meshes
from schedules.refine.lines import Lines
from schedules.refine.losses import Criterion, References, criteria, gain_errors, losses, references
from schedules.refine.point_designs import OwnDesigns, PointDesigns
from schedules.refine.request import RefineRequest
from schedules.refine.study_on import study_on
from schedules.run import design

FEW = Lines((0.0, 3000.0), (245.0, 700.0, 1531.25))
FIGURES = ("damping_ratio", "settling_time", "phase_margin")


@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_design_does_not_depend_on_what_it_is_made_with(wind_tunnel_study, which):
    request = wind_tunnel_study.controllers[which]
    designs = PointDesigns(wind_tunnel_study, request, FIGURES)
    designs.on(FEW)
    mesh = FEW.mesh(3)
    found = designs.on(mesh)
    assert designs.count == mesh.points
    for i, j in ((0, 0), (1, 4), (3, 6), (2, 1)):
        point = Lines((mesh.altitude[i],), (mesh.speed[j],))
        study = study_on(wind_tunnel_study, request, point)
        alone = design(study, analyse(study), study.controllers[0])
        expected = np.array([gain.values[0, 0] for gain in alone.gains])
        np.testing.assert_allclose(found.gains[i, j], expected, rtol=1e-10)
        np.testing.assert_allclose(
            found.figures["damping_ratio"][i, j], alone.assessment.damping_ratio[0, 0], rtol=1e-10
        )


def test_points_are_made_once(wind_tunnel_study):
    designs = PointDesigns(wind_tunnel_study, wind_tunnel_study.controllers[2], FIGURES)
    one = designs.on(FEW)
    finer = designs.on(FEW.mesh(4))
    again = designs.on(FEW)
    assert one.gains.tobytes() == again.gains.tobytes()
    assert finer.gains[::4, ::4].tobytes() == one.gains.tobytes()


def test_a_smoothed_controller_is_designed_point_by_point_without_that(wind_tunnel_study):
    nf = wind_tunnel_study.controllers[0]
    smooth = PointDesigns(wind_tunnel_study, replace(nf, smoothness=0.2), FIGURES).on(FEW)
    plain = PointDesigns(wind_tunnel_study, nf, FIGURES).on(FEW)
    assert smooth.gains.tobytes() == plain.gains.tobytes()


@pytest.mark.parametrize("which", [0, 1, 2])
def test_own_gains_flown_have_the_designs_figures(wind_tunnel_study, which):
    request = wind_tunnel_study.controllers[which]
    quantities = (*FIGURES, "overshoot", "gain_margin", "tab_rate") if which != 1 else ("damping_ratio", "overshoot")
    designs = PointDesigns(wind_tunnel_study, request, quantities)
    own, mesh = designs.on(FEW), FEW
    flown = Meshes(wind_tunnel_study, request).figures(mesh, designs.names, own.gains, quantities)
    for name in flown:
        np.testing.assert_allclose(flown[name], own.figures[name], rtol=1e-8, atol=1e-10, err_msg=name)


def test_gains_that_do_not_exist_are_not_flown(wind_tunnel_study):
    request = wind_tunnel_study.controllers[1]
    designs = PointDesigns(wind_tunnel_study, request, ("damping_ratio",))
    gains = designs.on(FEW).gains.copy()
    gains[1, 2] = np.nan
    flown = Meshes(wind_tunnel_study, request).figures(FEW, designs.names, gains, ("damping_ratio",))["damping_ratio"]
    assert np.isnan(flown[1, 2])
    assert np.isfinite(np.delete(flown.ravel(), 5)).all()
    gains[...] = np.nan
    assert Meshes(wind_tunnel_study, request).figures(FEW, designs.names, gains, ("damping_ratio",)) == {}


def test_a_spec_is_held_against_its_limit_or_the_point_s_own_design(wind_tunnel_study):
    spec = wind_tunnel_study.controllers[0].specs[0]  # damping ratio at least 0.5
    mesh = Lines((0.0,), (1.0, 2.0, 3.0, 4.0))
    own = OwnDesigns(
        np.ones((1, 4, 1)),
        np.array([[True, True, True, False]]),
        {"damping_ratio": np.array([[0.8, 0.4, np.nan, 0.9]])},
    )
    held = Criterion("damping_ratio", "min", spec)
    against = references(wind_tunnel_study, held, own, mesh)
    np.testing.assert_array_equal(against.values, [[0.5, 0.4, np.nan, np.nan]])
    np.testing.assert_array_equal(against.limits, [[True, False, False, False]])
    relative = references(wind_tunnel_study, Criterion("damping_ratio", "min", None), own, mesh)
    np.testing.assert_array_equal(relative.values, [[0.8, 0.4, np.nan, np.nan]])


def test_losses_are_parts_of_what_a_figure_is_held_against():
    against = References(np.array([[2.0, 2.0, 2.0, 2.0, np.nan]]), np.ones((1, 5), dtype=bool))
    values = np.array([[1.5, 2.5, np.nan, np.nan, 1.0]])
    flown = np.array([[True, True, True, False, True]])
    least, most = (losses(Criterion("", sense, None), against, values, flown) for sense in ("min", "max"))
    np.testing.assert_array_equal(least, [[0.25, -0.25, np.inf, np.nan, np.nan]])
    np.testing.assert_array_equal(most, [[-0.25, 0.25, np.inf, np.nan, np.nan]])


def test_gain_errors_are_parts_of_each_gains_largest_size():
    own = OwnDesigns(np.array([[[4.0, 0.0], [-8.0, 0.0], [np.nan, np.nan]]]), np.array([[True, True, False]]), {})
    errors = gain_errors(np.array([[[4.4, 0.0], [-7.2, 0.0], [1.0, 1.0]]]), own)
    np.testing.assert_allclose(errors[0, :2], [[0.05, 0.0], [0.1, 0.0]])
    assert np.isnan(errors[0, 2]).all()


def test_what_is_held(wind_tunnel_study):
    nf, pf, lqr = wind_tunnel_study.controllers
    assert [each.quantity for each in criteria(wind_tunnel_study, nf, RefineRequest())] == [
        spec.quantity for spec in nf.specs
    ]
    pack = [spec.quantity for spec in wind_tunnel_study.spec_pack]
    held = criteria(wind_tunnel_study, lqr, RefineRequest())
    assert [each.quantity for each in held] == [*pack, "damping_ratio", "settling_time"]
    assert [each.spec is None for each in held] == [False] * len(pack) + [True, True]
    bare = replace(pf, specs=(), gains={"K_f": 0.3, "K_i": 1.0})
    assert [each.quantity for each in criteria(wind_tunnel_study, bare, RefineRequest())] == pack
    asked = criteria(wind_tunnel_study, pf, RefineRequest(relative=("bandwidth",)))
    assert (asked[-1].quantity, asked[-1].sense, asked[-1].spec) == ("bandwidth", "min", None)
