"""Smoothed gains: smoother, still inside every limit at every point, and as smooth as a general optimiser finds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.gains import Gain
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from schedules import point_limits
from schedules.analysis import analyse
from schedules.judging import judged
from schedules.point_limits import PointLimits
from schedules.roughness import Stencils, roughness
from schedules.run import design
from schedules.smoothing import smooth
from schedules.study import GridRequest

ALTITUDES, PRESSURES = tuple(np.linspace(0.0, 6000.0, 5)), tuple(np.linspace(245.0, 1531.25, 5))


def _case(study, altitudes, pressures, request):
    study = replace(study, grid=GridRequest(altitudes, "dynamic_pressure", pressures), controllers=(request,))
    plant = analyse(study)
    return study, plant, design(study, plant, request)


@pytest.fixture(scope="module")
def table(wind_tunnel_study):
    """The example's negative feedback on a grid of five by five: study, plant, design."""
    return _case(wind_tunnel_study, ALTITUDES, PRESSURES, wind_tunnel_study.controllers[0])


@pytest.fixture(scope="module")
def line(wind_tunnel_study):
    """The same at one altitude and five dynamic pressures."""
    return _case(wind_tunnel_study, (0.0,), PRESSURES, wind_tunnel_study.controllers[0])


def _smooth(case, part):
    study, plant, designed = case
    return smooth(study, plant, replace(designed, request=replace(designed.request, smoothness=part)))


def _values(gains, ok=...):
    return np.stack([gain.values[ok] for gain in gains], axis=-1)


def _rms(found):
    return np.sqrt(np.mean([each.rms**2 for each in found]))


@pytest.fixture(scope="module")
def smoothed(table):
    return {part: _smooth(table, part) for part in (0.01, 0.2)}


@pytest.mark.parametrize(("part", "rms", "worst"), [(0.01, 0.8, 0.8), (0.2, 0.35, 0.35)])
def test_the_table_becomes_smoother(smoothed, part, rms, worst):
    found = smoothed[part]
    assert _rms(found.after) < rms * _rms(found.before)
    assert max(r.worst for r in found.after) < worst * max(r.worst for r in found.before)


def test_roughness_is_that_of_the_gains(table, smoothed):
    _, plant, designed = table
    for found in smoothed.values():
        for gains, said in ((designed.gains, found.before), (found.gains, found.after)):
            assert [r.rms for r in said] == [roughness(g.values, plant.grid.axes).rms for g in gains]


@pytest.mark.parametrize("part", [0.01, 0.2])
def test_every_point_judged_again_meets_its_specs_and_keeps_its_bandwidth(table, smoothed, part):
    study, plant, designed = table
    found = smoothed[part]
    gains = {g.name: g.values for g in found.gains}
    loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, designed.request, gains)
    again = judged(study, plant, designed.request, designed.outcomes, found.gains, loop)
    assert again.outcomes.ok.all()
    asked = [v for v in again.verdicts if v.spec.source == "request"]
    assert len(asked) == 5
    distance = np.min([v.spec.distance(v.values) / v.spec.scale for v in asked], axis=0)
    assert np.all(distance >= 0.99e-4)
    np.testing.assert_allclose(found.cost.distance_after, distance, atol=1e-9)
    lost = 1.0 - again.assessment.step.bandwidth / designed.assessment.step.bandwidth
    assert np.all(lost <= part + 1e-12)
    np.testing.assert_allclose(found.cost.bandwidth_lost, lost, atol=1e-9)


def test_another_route_to_damping_and_bandwidth_agrees(table, smoothed):
    """Polynomials of transfer functions and a dense sweep instead of state space and eigenvalues."""
    study, plant, designed = table
    found, request = smoothed[0.2], designed.request
    K = {g.name: g.values for g in found.gains}
    w, z, f = study.tab_actuator.servo_bandwidth, study.tab_actuator.servo_damping_ratio, request.rate_filter
    for i in np.ndindex(plant.grid.shape):
        P, D = plant.servo_tab.numerator[i], plant.servo_tab.denominator[i]
        fixed = np.polymul(np.polymul(D, [1.0, 2.0 * z * w, w**2]), np.polymul([1.0, f], [1.0, 0.0]))
        # dt_cmd = -(K_i int(r - da) - K_p da - K_d f s/(s + f) da)
        law = np.polyadd(np.polymul([K["K_p"][i], K["K_i"][i]], [1.0, f]), K["K_d"][i] * f * np.array([1.0, 0.0, 0.0]))
        closed = np.polysub(fixed, np.polymul(P * w**2, law))
        poles = np.roots(closed)
        assert np.min(-poles.real / np.abs(poles)) >= 0.5
        omega = np.linspace(1.0, 400.0, 40_000)
        top = -np.polymul(np.polymul(P * w**2, [K["K_i"][i]]), [1.0, f])
        size = np.abs(np.polyval(top, 1j * omega) / np.polyval(closed, 1j * omega))
        bandwidth = omega[np.argmax(size < np.sqrt(0.5))]
        assert bandwidth >= 0.8 * designed.assessment.step.bandwidth[i] - 0.02


def test_more_bandwidth_buys_more_smoothness(smoothed):
    found = [_rms(smoothed[part].after) for part in sorted(smoothed)]
    assert found == sorted(found, reverse=True)


def test_nothing_given_up_gives_the_design_back(table):
    designed = table[2]
    found = _smooth(table, 0.0)
    np.testing.assert_array_equal(_values(found.gains), _values(designed.gains))
    assert np.all(found.cost.bandwidth_lost == 0.0)
    np.testing.assert_array_equal(found.cost.distance_before, found.cost.distance_after)


@pytest.mark.parametrize("part", [0.03, 0.2])
def test_a_general_optimiser_finds_nothing_much_smoother(line, part):
    """Sequential quadratic programming on all gains at once, from the design and from what was found."""
    study, plant, designed = line
    designed = replace(designed, request=replace(designed.request, smoothness=part))
    ok = designed.outcomes.ok
    start, found = _values(designed.gains, ok), _values(smooth(study, plant, designed).gains, ok)
    limits, stencils = PointLimits.of(study, plant, designed, start), Stencils.of(plant.grid.axes, ok)
    (P, J), every = start.shape, np.arange(len(start))

    def gains(x):
        return start * np.exp(x.reshape(P, J))

    def cost(x):
        return 100.0 * np.mean(stencils.errors(gains(x).T) ** 2)

    def room(x):
        return np.maximum(limits.room(gains(x), every), -1.0)

    def slope(x):
        rows = np.zeros((P, len(limits.specs) + 1, P, J))
        for j in range(J):
            step = np.tile(1e-5 * (np.arange(J) == j), P)
            rows[every, :, every, j] = np.clip((room(x + step) - room(x)) / 1e-5, -50.0, 50.0)
        return rows.reshape(-1, P * J)

    inside = {"type": "ineq", "fun": lambda x: room(x).ravel(), "jac": slope}
    for first in (start, found):
        best = minimize(
            cost, np.log(first / start).ravel(), method="SLSQP", bounds=[(-0.8, 0.8)] * (P * J), constraints=[inside],
            options={"maxiter": 40, "ftol": 1e-6},
        )  # fmt: skip
        assert np.sqrt(cost(np.log(found / start).ravel())) < 1.05 * np.sqrt(best.fun)


def test_the_same_design_gives_the_same_bits(line):
    one, other = (_smooth(line, 0.1) for _ in range(2))
    np.testing.assert_array_equal(_values(one.gains), _values(other.gains))


def test_a_failed_point_has_no_gains_and_bends_no_table(line):
    """Whatever number stands where the outcome is not ok, the others go where they go without it."""
    study, plant, designed = line
    where = np.array([[False, False, False, True, False]])
    outcomes = designed.outcomes.failing(where, Outcome.INFEASIBLE, lambda index: "for the test")
    found = []
    for number in (np.nan, 1e6):
        gains = tuple(Gain(g.name, g.unit, np.where(where, number, g.values)) for g in designed.gains)
        found.append(_smooth((study, plant, replace(designed, outcomes=outcomes, gains=gains)), 0.1))
        values = _values(found[-1].gains)
        assert np.isnan(values[where]).all()
        assert np.isnan(found[-1].cost.bandwidth_lost[where]).all()
        # Only the first three are neighbours without it: the last one belongs to no triple.
        np.testing.assert_array_equal(values[0, 4], _values(designed.gains)[0, 4])
        assert _rms(found[-1].after) < 0.7 * _rms(found[-1].before)
    np.testing.assert_array_equal(_values(found[0].gains), _values(found[1].gains))


def test_a_loop_that_cannot_be_judged_counts_as_outside_and_loses_no_other(line, monkeypatch):
    study, plant, designed = line
    start = _values(designed.gains, designed.outcomes.ok)
    limits = PointLimits.of(study, plant, designed, start)
    whole = limits.room(start, np.arange(5))
    real, stiffest = point_limits.assess, plant.servo_tab.static_stiffness.max()

    def gives_up(loop, *arguments, **options):
        if np.any(np.isclose(-loop.A[..., 3, 2], stiffest)):
            raise np.linalg.LinAlgError("Eigenvalues did not converge")
        return real(loop, *arguments, **options)

    monkeypatch.setattr(point_limits, "assess", gives_up)
    room = limits.room(start, np.arange(5))
    assert np.all(room[4] == -np.inf)
    np.testing.assert_allclose(room[:4], whole[:4], atol=1e-10)


def test_a_point_without_room_stays_and_the_others_move(line):
    study, plant, designed = line
    start = _values(designed.gains)
    slow = start.copy()
    slow[0, 2, 2] = 0.0  # without integral action the loop does not follow, and has no bandwidth
    gains = tuple(Gain(g.name, g.unit, v) for g, v in zip(designed.gains, np.moveaxis(slow, -1, 0), strict=True))
    found = _values(_smooth((study, plant, replace(designed, gains=gains)), 0.1).gains)
    np.testing.assert_array_equal(found[0, 2], slow[0, 2])
    assert np.all(found[0, [1, 3]] != slow[0, [1, 3]])


def test_gains_that_are_given_stay(line, wind_tunnel_study):
    study, plant, designed = line
    given = {"K_p": designed.gains[1].values, "K_d": designed.gains[0].values}
    request = replace(designed.request, gains=given)
    found = _smooth((study, plant, replace(designed, request=request)), 0.1)
    for gain, before, after in zip(designed.gains, designed.gains, found.gains, strict=True):
        assert np.array_equal(before.values, after.values) == (gain.name in given)
    assert found.after[2].rms < found.before[2].rms
    everything = replace(request, gains={g.name: g.values for g in designed.gains})
    same = _smooth((study, plant, replace(designed, request=everything)), 0.1)
    np.testing.assert_array_equal(_values(same.gains), _values(designed.gains))


def test_positive_feedback_and_a_grid_without_inner_lines(wind_tunnel_study):
    request = ClassicalController("pf", "positive_feedback", (Spec("damping_ratio", "min", 0.4),))
    found = _smooth(_case(wind_tunnel_study, (0.0,), PRESSURES, request), 0.05)
    assert _rms(found.after) < 0.5 * _rms(found.before)
    study, plant, designed = _case(wind_tunnel_study, (0.0, 3000.0), PRESSURES[:2], request)
    same = _smooth((study, plant, designed), 0.05)
    np.testing.assert_array_equal(_values(same.gains), _values(designed.gains))
    assert [r.rms for r in same.after] == [None, None]


def test_four_gains_of_a_tab_commanded_by_its_rate(wind_tunnel_study):
    """Gains that would be smooth, each off by a few per cent at random: there is nothing to choose but smoothness."""
    study = replace(
        wind_tunnel_study,
        grid=GridRequest((0.0, 2000.0, 4000.0), "dynamic_pressure", (600.0, 700.0, 850.0, 1000.0)),
        tab_actuator=replace(wind_tunnel_study.tab_actuator, rate_loop_bandwidth=None),
    )
    plant = analyse(study)
    omega, steady = np.sqrt(plant.servo_tab.static_stiffness), np.abs(plant.servo_tab.dc_gain)
    rng = np.random.default_rng(5)
    gains = {"K_theta": 8.0 * omega, "K_d": 0.6 / (steady * omega), "K_p": 0.4 / steady, "K_i": 0.3 * omega / steady}
    gains = {name: values * rng.uniform(0.97, 1.03, values.shape) for name, values in gains.items()}
    specs = (Spec("damping_ratio", "min", 0.25), Spec("gain_margin", "min", 3.0), Spec("overshoot", "max", 0.3))
    request = ClassicalController("rate", "negative_feedback", specs, tab_command="rate")
    loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, gains)
    named = tuple(Gain(name, unit, gains[name]) for name, unit in request.gain_units.items())
    designed = judged(study, plant, request, Outcomes.all_ok(plant.grid.shape), named, loop)
    assert designed.outcomes.ok.all()
    found = _smooth((study, plant, designed), 0.1)
    assert _rms(found.after) < 0.1 * _rms(found.before)
    assert np.max(found.cost.bandwidth_lost) <= 0.1
    assert np.min(found.cost.distance_after) >= 0.0


def test_points_without_a_design_cost_nothing(wind_tunnel_study):
    request = ClassicalController("pf", "positive_feedback", (Spec("gain_margin", "min", 60.0),))
    found = _smooth(_case(wind_tunnel_study, (0.0,), PRESSURES[:3], request), 0.05)
    assert np.isnan(_values(found.gains)).all()
    assert np.isnan(found.cost.bandwidth_lost).all()


def test_what_makes_no_sense_is_refused(line, wind_tunnel_envelope, wind_tunnel_study):
    with pytest.raises(ValueError, match="lqr: smoothness is a preference of classical controllers"):
        smooth(wind_tunnel_study, wind_tunnel_envelope.plant, wind_tunnel_envelope.controller("lqr"))
    for part in (-0.1, 1.1, np.nan):
        with pytest.raises(ValueError, match="nf: smoothness is a part of the bandwidth"):
            _smooth(line, part)
