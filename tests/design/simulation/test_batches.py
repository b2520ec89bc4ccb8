"""The whole grid is its points one by one; one that fails is a value and touches no other."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.lqr.structures import Structure
from design.lqr.synthesis import LqrController, design_lqr
from design.lqr.torque_loop import lqr_loop
from design.manoeuvre import doublet, recorded, sine, step
from design.simulation import simulate as module
from design.simulation.plant import NonlinearPlant
from design.simulation.request import Freeplay, Friction, SimulationRequest
from design.simulation.simulate import simulate
from model.actuators import Actuator, ActuatorLimits
from model.examples import wind_tunnel
from model.flight import flight_grid
from model.linearise import linearise
from model.trim import TrimRequest, trim
from tests.design.lqr_cases import WIND_TUNNEL_WEIGHTS
from tests.design.simulation.simulated_cases import SERVO, plant, tab_only, torque_loop

EVERYTHING = SimulationRequest(
    0.12, 61, 1e-4,
    limits={"tab": ActuatorLimits(0.05, 2.0, 0.2, 0.1), "aileron": ActuatorLimits(0.4, 4.0, 1.5, 2.0)},
    friction={"aileron": Friction(0.05, 0.03), "tab": Friction(0.002, 0.001)},
)  # fmt: skip
CASES = {
    "torques": (None, EVERYTHING),
    "late torques": (Structure(tab=Actuator(delay=0.003), aileron=Actuator(delay=0.005)), EVERYTHING),
    "tab": ("tab", EVERYTHING),
    "late tab": ("late", EVERYTHING),
    "freeplay": ("tab", SimulationRequest(0.12, 61, 1e-4, freeplay=Freeplay(0.004, 100.0, 0.02))),
}


def _loop(p, of):
    if isinstance(of, str):
        return tab_only(p, actuator=replace(SERVO, delay=0.004 if of == "late" else 0.0))
    return torque_loop(p, of)


def _same(whole, single, index, path=""):
    for f in fields(whole):
        a, b = getattr(whole, f.name), getattr(single, f.name)
        if isinstance(a, np.ndarray):
            if a.dtype == object or a.dtype.kind in "bi":
                assert np.all(a[index] == b), path + f.name
            else:
                scale = np.max(np.nan_to_num(np.abs(a[index])), initial=1e-300)
                np.testing.assert_allclose(a[index] / scale, b / scale, rtol=0.0, atol=1e-10, err_msg=path + f.name)
        elif f.name == "energy":
            _same(a, b, index, "energy.")
        elif f.name == "demand":
            for one, other in zip(a, b, strict=True):
                _same(one, other, index, "demand.")


@pytest.mark.parametrize("name", CASES)
def test_the_grid_is_its_points(name):
    p = plant()
    of, request = CASES[name]
    loop = _loop(p, of)
    manoeuvre = doublet(np.array([0.1]), 0.05)
    whole = simulate(p.nonlinear, loop, manoeuvre, request)
    for index in ((0, 0), (1, 2)):
        _same(whole, simulate(p.nonlinear.take(index), loop.take(index), manoeuvre, request), index)


def test_chunks_of_points_are_the_same(monkeypatch):
    p = plant()
    loop = torque_loop(p)
    # A faster point takes other steps than its neighbours.
    K = loop.K.copy()
    K[0, 1, 0, 1] += 0.6
    loop = replace(loop, K=K)
    whole = simulate(p.nonlinear, loop, step(np.array([0.1])), EVERYTHING)
    assert len(np.unique(whole.substeps)) > 1
    monkeypatch.setattr(module, "_NUMBERS", 1)
    _same(whole, simulate(p.nonlinear, loop, step(np.array([0.1])), EVERYTHING), (...,))


def test_points_that_fail_are_values():
    p = plant()
    loop = torque_loop(p)
    K = loop.K.copy()
    K[0, 0] = np.nan  # no design
    K[0, 1] = 0.0  # the bare plant is unstable
    K[1, 0, 0, 1] = 1e9  # far faster than any step
    unstable = replace(loop, K=K)
    request = SimulationRequest(1.0, 101)
    found = simulate(p.nonlinear, unstable, step(np.array([0.1])), request)
    assert found.codes.tolist() == [["no_loop", "diverged", "completed"], ["too_fast", "completed", "completed"]]
    assert "right angle" in found.reasons[0, 1]
    when = found.diverged_at[0, 1]
    assert 0.0 < when < 1.0
    before = found.time[0, 1] < when
    assert np.isfinite(found.outputs[0, 1, before]).all()
    assert np.isnan(found.outputs[0, 1, ~before]).all()
    assert np.isnan(found.demand[0].peak_torque[0, 1])
    ok = found.codes == "completed"
    good = simulate(p.nonlinear, loop, step(np.array([0.1])), request)
    np.testing.assert_allclose(found.outputs[ok], good.outputs[ok], rtol=1e-12, atol=1e-14)
    assert np.isnan(found.outputs[0, 0]).all()
    assert np.isnan(found.diverged_at[ok]).all()
    nothing = simulate(p.nonlinear, replace(loop, K=np.full_like(K, np.nan)), step(np.array([0.1])), request)
    assert np.all(nothing.codes == "no_loop")


def test_no_points_at_all_is_an_answer():
    p = plant()
    for loop in (tab_only(p), tab_only(p, "positive_feedback", "rate", Actuator())):
        none = replace(loop, K=np.full_like(loop.K, np.nan))
        found = simulate(p.nonlinear, none, step(np.array([0.1])), SimulationRequest(0.1, 11))
        assert np.all(found.codes == "no_loop")
        assert np.isnan(found.outputs).all()
        assert found.outputs.shape == (2, 3, 11, len(loop.outputs))


def test_points_outside_the_model_stay_outside():
    """Beyond Mach 1 there is neither model nor correction, and the others are simulated."""
    base = wind_tunnel()
    aerodynamics = replace(base.aerodynamics, compressibility="prandtl_glauert")
    system = replace(base, aerodynamics=aerodynamics)
    condition = flight_grid(np.array([0.0]), "mach", np.array([0.1, 1.2])).condition
    inside = np.array([[True, False]])
    found = trim(system, condition.take(inside), TrimRequest(0.0))
    model = linearise(system, condition.take(inside), found)
    points = NonlinearPlant.of(system, condition, found.spread(inside), model.spread(inside))
    loop = lqr_loop(model, design_lqr(model, LqrController("lqr", WIND_TUNNEL_WEIGHTS))).spread(inside)
    made = simulate(points, loop, step(np.array([0.1])), SimulationRequest(0.1, 11))
    assert made.codes.tolist() == [["completed", "no_loop"]]


@given(st.integers(0, 10**6))
@settings(max_examples=12, deadline=None)
def test_limits_of_any_size_leave_numbers(seed):
    rng = np.random.default_rng(seed)
    p = plant()

    def drawn(*scales):
        values = [None if rng.random() < 0.3 else float(s * 10.0 ** rng.uniform(-2, 0.5)) for s in scales]
        return ActuatorLimits(*values)

    limits = {"tab": drawn(0.1, 3.0, 0.05, 0.1), "aileron": drawn(0.1, 3.0, 2.0, 2.0)}
    friction = {"aileron": Friction(0.1, 0.05)} if rng.random() < 0.5 else {}
    late = Actuator(delay=0.003) if rng.random() < 0.3 else Actuator()
    loop = torque_loop(p, Structure(tab=late, aileron=late)) if rng.random() < 0.5 else tab_only(p, K_i=8.0)
    request = SimulationRequest(0.1, 51, 1e-3, limits=limits, friction=friction)
    found = simulate(p.nonlinear, loop, doublet(np.array([0.15]), 0.04), request)
    whole = found.codes == "completed"
    assert np.all(whole | (found.codes == "diverged"))
    assert np.isfinite(found.outputs[whole]).all()
    for i, name in enumerate(("tab", "aileron")):
        if limits[name].deflection is not None:
            angle = found.output(("dt", "da")[i])
            assert np.nanmax(np.abs(angle), initial=0.0) <= limits[name].deflection * (1.0 + 1e-12)
    torques = [("tab", "T_t")] + ([("aileron", "T_a")] if loop.inputs == ("tab", "aileron") else [])
    for i, (name, torque) in enumerate(torques):
        most = limits[name].torque
        if most is not None and whole.any():
            free = found.held[whole][..., i] == 0
            assert np.abs(found.output(torque)[whole][free]).max(initial=0.0) <= most * (1.0 + 1e-9)


def test_samples_stand_on_the_knots():
    p = plant()
    loop = tab_only(p)
    manoeuvre = recorded(np.array([0.0, 0.033, 0.033, 0.071, 0.2]), np.array([[0.0], [0.1], [0.05], [0.0], [0.1]]))
    found = simulate(p.nonlinear, loop, manoeuvre, SimulationRequest(0.1, 11))
    time = found.time[0, 0]
    for knot in (0.0, 0.033, 0.071, 0.1):
        assert knot in time
    assert np.all(np.diff(time) > 0.0)
    assert np.diff(time).max() <= 0.01 * (1 + 1e-12)
    np.testing.assert_allclose(found.reference[0, 0], manoeuvre.at(time))
    both = simulate(p.nonlinear, loop, sine(np.array([0.1]), 30.0), SimulationRequest(0.1, 11, substeps=3))
    assert np.all(both.substeps == 3)
    assert both.time.shape[-1] == 11


def test_a_table_says_when_the_surfaces_leave_it():
    p = plant("table")
    loop = torque_loop(p)
    found = simulate(p.nonlinear, loop, step(np.array([0.45])), SimulationRequest(0.1, 51, 1e-4))
    assert np.isfinite(found.left_data_at).any()
    inside = simulate(p.nonlinear, loop, step(np.array([0.05])), SimulationRequest(0.1, 51, 1e-4))
    assert np.isnan(inside.left_data_at).all()
