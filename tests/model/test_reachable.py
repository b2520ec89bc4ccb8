from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.actuators import ActuatorLimits
from model.flight import flight_condition
from model.hinge_moments.interpolant import fit_interpolant
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
from model.reachable import LIMITS, TAB_DEFLECTION, reachable_aileron
from model.steady_state import float_line

ALPHA = float(np.deg2rad(5.0))
DEGREES = float(np.deg2rad(1.0))
CASES = [
    (ActuatorLimits(), ActuatorLimits()),
    (ActuatorLimits(20 * DEGREES), ActuatorLimits()),
    (ActuatorLimits(20 * DEGREES, torque=0.07), ActuatorLimits()),
    (ActuatorLimits(20 * DEGREES, torque=0.07), ActuatorLimits(10 * DEGREES)),
    (ActuatorLimits(20 * DEGREES, torque=1e-5), ActuatorLimits(10 * DEGREES)),
    (ActuatorLimits(torque=0.02), ActuatorLimits(3 * DEGREES)),
    (ActuatorLimits(20 * DEGREES), ActuatorLimits(1e-5)),
    (ActuatorLimits(20 * DEGREES, torque=2e-3), ActuatorLimits(0.1 * DEGREES)),
]


def xfoil():
    tunnel = examples.wind_tunnel_23012()
    return replace(
        tunnel, aerodynamics=replace(tunnel.aerodynamics, source=fit_interpolant(xfoil_naca23012(), "cubic"))
    )


def linear_range(system, load, tab, aileron):
    """Tab angles allowed by each limit for one load, as an intersection of intervals: closed form."""
    source = system.aerodynamics.source
    (t0, a0), K = source.offset + source.gradient[:, 0] * ALPHA, source.gradient[:, 1:]
    # Along the float da = f0 + f dt and T_t = load (p0 + p dt).
    f0, f = -a0 / K[1, 1], -K[1, 0] / K[1, 1]
    p0, p = t0 + K[0, 1] * f0, K[0, 0] + K[0, 1] * f
    largest = np.pi / 2 if tab.deflection is None else tab.deflection
    spans = [(-largest, largest), (min((s - f0) / f for s in (-np.pi / 2, np.pi / 2)),
                                   max((s - f0) / f for s in (-np.pi / 2, np.pi / 2)))]  # fmt: skip
    for limit, start, slope in ((tab.torque, load * p0, load * p), (aileron.deflection, f0, f)):
        if limit is not None:
            ends = sorted([(-limit - start) / slope, (limit - start) / slope])
            spans.append((ends[0], ends[1]))
    low, high = max(s[0] for s in spans), min(s[1] for s in spans)
    return low, high, sorted([f0 + f * low, f0 + f * high])


@pytest.mark.parametrize("limits", CASES, ids=str)
def test_range_of_the_linear_source_is_its_closed_form(limits, grid):
    tab, aileron = limits
    system = examples.wind_tunnel_23012()
    found = reachable_aileron(system, grid.condition, ALPHA, tab, aileron)
    load = grid.condition.dynamic_pressure * 0.6**2 * 0.8
    for index in np.ndindex(grid.shape):
        low, high, ends = linear_range(system, load[index], tab, aileron)
        assert found.reached[index] == (low <= high)
        if low <= high:
            point = found.take(index)
            np.testing.assert_allclose([point.lower.aileron, point.upper.aileron], ends, atol=1e-11)
            np.testing.assert_allclose(sorted([point.lower.tab, point.upper.tab]), [low, high], atol=1e-11)
            assert found.reason[index] is None
        else:
            assert np.isnan(found.lower.aileron[index])
            assert found.lower.limit[index] is None
            assert "the limit of" in found.reason[index]


def test_some_of_the_closed_form_cases_are_reachable_and_some_are_not(grid):
    system = examples.wind_tunnel_23012()
    reached = [reachable_aileron(system, grid.condition, ALPHA, *limits).reached for limits in CASES]
    assert np.any(reached)
    assert not np.all(reached)


@pytest.mark.parametrize("name", ["polynomial", "xfoil"])
@pytest.mark.parametrize("torque", [0.03, 0.1])
def test_range_of_a_nonlinear_source_by_brute_force(name, torque, tunnel_condition, polynomial_system):
    system = polynomial_system if name == "polynomial" else xfoil()
    tab, aileron = ActuatorLimits(18 * DEGREES, torque=torque), ActuatorLimits(15 * DEGREES)
    found = reachable_aileron(system, tunnel_condition, ALPHA, tab, aileron)
    angles = np.linspace(-18, 18, 1801) * DEGREES
    line = float_line(system, tunnel_condition, ALPHA, angles)
    allowed = line.trim.reached & (np.abs(line.trim.torque[:, 0]) <= torque)
    allowed &= np.abs(line.trim.state[:, 2]) <= 15 * DEGREES
    start = np.argmin(np.where(allowed, np.abs(angles), np.inf))
    low = high = int(start)
    while low > 0 and allowed[low - 1]:
        low -= 1
    while high < len(angles) - 1 and allowed[high + 1]:
        high += 1
    ends = np.sort(line.trim.state[[low, high], 2])
    assert found.reached
    np.testing.assert_allclose([found.lower.aileron, found.upper.aileron], ends, atol=1e-3)
    assert float(found.lower.aileron) <= ends[0] + 1e-12
    assert float(found.upper.aileron) >= ends[1] - 1e-12


def test_ends_name_their_limit_and_lie_on_it(grid):
    system = examples.wind_tunnel_23012()
    tab, aileron = ActuatorLimits(15 * DEGREES, torque=0.1), ActuatorLimits(20 * DEGREES)
    found = reachable_aileron(system, grid.condition, ALPHA, tab, aileron)
    seen = set()
    for end in (found.lower, found.upper):
        for index in np.ndindex(grid.shape):
            size = {
                LIMITS[0]: abs(end.torque[index]) / 0.1,
                LIMITS[1]: abs(end.aileron[index]) / (20 * DEGREES),
                TAB_DEFLECTION: abs(end.tab[index]) / (15 * DEGREES),
            }
            assert max(size.values()) == pytest.approx(1.0, abs=1e-12)
            assert size[end.limit[index]] == pytest.approx(1.0, abs=1e-12)
            seen.add(end.limit[index])
    assert {LIMITS[0], TAB_DEFLECTION} <= seen


def test_more_dynamic_pressure_never_reaches_further():
    system = examples.wind_tunnel_23012()
    condition = flight_condition(0.0, "dynamic_pressure", np.linspace(200.0, 4000.0, 30))
    found = reachable_aileron(system, condition, ALPHA, ActuatorLimits(25 * DEGREES, torque=0.1))
    width = found.upper.aileron - found.lower.aileron
    assert np.all(np.diff(width) <= 1e-12)
    assert width[-1] < width[0]


def test_where_the_data_end_the_aileron_has_no_floating_angle(tunnel_condition):
    found = reachable_aileron(xfoil(), tunnel_condition, ALPHA, ActuatorLimits(20 * DEGREES))
    assert found.reached
    assert LIMITS[2] in (found.lower.limit.item(), found.upper.limit.item())
    assert max(abs(found.lower.aileron), abs(found.upper.aileron)) == pytest.approx(20 * DEGREES, abs=2e-6)


def test_an_incidence_outside_the_data_reaches_nothing(tunnel_condition):
    found = reachable_aileron(xfoil(), tunnel_condition, 0.4, ActuatorLimits(20 * DEGREES))
    assert not found.reached
    assert "no floating angle" in found.reason.item()


@pytest.mark.parametrize("limits", CASES, ids=str)
def test_batched_equals_single(limits, grid, polynomial_system):
    alpha = np.linspace(0.02, 0.1, 4)
    found = reachable_aileron(polynomial_system, grid.condition, alpha, *limits)
    for index in ((0, 0), (1, 3), (4, 2)):
        point = found.take(index)
        single = reachable_aileron(polynomial_system, grid.condition.take(index), alpha[index[1]], *limits)
        assert point.reached == single.reached
        assert (point.lower.limit, point.upper.limit) == (single.lower.limit.item(), single.upper.limit.item())
        for end in ("lower", "upper"):
            a, b = getattr(point, end), getattr(single, end)
            np.testing.assert_allclose([a.aileron, a.tab, a.torque], [b.aileron, b.tab, b.torque], rtol=1e-11)


@pytest.mark.parametrize("limits", [ActuatorLimits(0.0), ActuatorLimits(torque=-1.0), ActuatorLimits(np.nan)])
def test_impossible_limits_are_refused(limits, tunnel_condition):
    with pytest.raises(ValueError, match="limits must be positive"):
        reachable_aileron(examples.wind_tunnel(), tunnel_condition, ALPHA, limits)
