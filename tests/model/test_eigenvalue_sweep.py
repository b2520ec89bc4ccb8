from dataclasses import replace

import numpy as np
import pytest

from model import examples
from model.eigenvalue_sweep import eigenvalue_sweep, sweep_models, sweep_plant
from model.flight import flight_condition
from model.flutter import Mechanism
from model.hinge_moments.interpolant import fit_interpolant
from model.hinge_moments.xfoil_naca23012 import xfoil_naca23012
from model.linearise import linearise
from model.section import Geometry
from model.servo_tab import servo_tab
from model.swept_plant import SWEPT, SweptPlant, moving_through, swept_plant
from model.trim import HeldTorque, TrimRequest, trim

REQUEST = TrimRequest(0.08, aileron=0.05, tab=-0.02)
VALUES = {
    "tab": np.deg2rad(np.linspace(-25.0, 25.0, 7)),
    "aileron": np.deg2rad(np.linspace(-20.0, 20.0, 5)),
    "alpha": np.deg2rad(np.linspace(-5.0, 10.0, 4)),
    "airspeed": np.array([5.0, 20.0, 50.0, 90.0]),
    "density": np.array([0.3, 0.7, 1.0, 1.3]),
    "tab_chord_ratio": np.linspace(0.03, 0.47, 9),
}


def model_of(system, condition, request):
    return linearise(system, condition, trim(system, condition, request))


def one_by_one(system, condition, quantity, value):
    """The linear model at one swept value, put together by hand."""
    if quantity in ("tab", "aileron", "alpha"):
        return model_of(system, condition, replace(REQUEST, **{quantity: float(value)}))
    if quantity == "airspeed":
        return model_of(system, moving_through(condition.air, np.array(value)), REQUEST)
    if quantity == "density":
        q = 0.5 * value * condition.airspeed**2
        thin = replace(condition, air=replace(condition.air, density=np.array(value)), dynamic_pressure=np.array(q))
        return model_of(system, thin, REQUEST)
    hinge = 1.0 - value * (1.0 - system.geometry.aileron_hinge)
    source = replace(system.aerodynamics.source, tab_hinge=hinge)
    geometry = Geometry(system.geometry.chord, system.geometry.span, system.geometry.aileron_hinge, hinge)
    other = replace(system, geometry=geometry, aerodynamics=replace(system.aerodynamics, source=source))
    return model_of(other, condition, REQUEST)


@pytest.mark.parametrize("quantity", VALUES)
@pytest.mark.parametrize("name", ["wind_tunnel", "airliner_aileron"])
def test_eigenvalues_are_those_of_each_value_alone(name, quantity, tunnel_condition):
    system = getattr(examples, name)()
    found = eigenvalue_sweep(system, tunnel_condition, REQUEST, quantity, VALUES[quantity])
    assert found.values == tuple(VALUES[quantity])
    assert (found.quantity, found.unit) == (quantity, SWEPT[quantity])
    assert np.all(found.covered)
    for k, value in enumerate(VALUES[quantity]):
        model = one_by_one(system, tunnel_condition, quantity, value)
        for swept, A in ((found.coupled, model.A), (found.decoupled, servo_tab(model).F)):
            values = np.linalg.eigvals(A)
            close = np.abs(swept.modes.eigenvalues[k][:, None] - values).min(axis=-1)
            assert np.all(close < 1e-8 * np.abs(values).max())
            assert swept.growth[k] == pytest.approx(values.real.max(), rel=1e-7, abs=1e-8 * np.abs(values).max())


@pytest.mark.parametrize("quantity", VALUES)
def test_branches_are_continuous(quantity, tunnel_condition):
    system = examples.wind_tunnel_23012()
    ends = VALUES[quantity][[0, -1]]
    found = eigenvalue_sweep(system, tunnel_condition, REQUEST, quantity, np.linspace(*ends, 120))
    branches = found.coupled.modes.eigenvalues
    steps = np.abs(np.diff(branches, axis=0))
    # A swap between two of these branches would jump by several times the largest step.
    assert steps.max() < 0.12 * np.abs(branches).max()
    apart = np.abs(branches[1:, :, None] - branches[:-1, None, :]).min(axis=-1)
    assert np.all(steps <= apart + 0.05 * np.abs(branches).max())


def test_shapes_and_names(tunnel_condition):
    found = eigenvalue_sweep(examples.wind_tunnel(), tunnel_condition, REQUEST, "airspeed", VALUES["airspeed"])
    assert found.coupled.modes.eigenvalues.shape == (4, 4)
    assert found.coupled.modes.output.shape == (4, 2, 4)
    assert found.coupled.modes.participation.shape == (4, 4, 4)
    assert found.coupled.states == ("dt", "dt_rate", "da", "da_rate")
    assert found.coupled.outputs == ("dt", "da")
    assert found.decoupled.modes.eigenvalues.shape == (4, 2)
    assert found.decoupled.modes.output.shape == (4, 1, 2)
    assert found.decoupled.states == ("da", "da_rate")


def test_lag_states_take_part(tunnel_condition, variant):
    system = variant(examples.wind_tunnel(), damping="unsteady")
    found = eigenvalue_sweep(system, tunnel_condition, REQUEST, "airspeed", VALUES["airspeed"])
    assert found.coupled.states == ("dt", "dt_rate", "da", "da_rate", "lag_1", "lag_2")
    assert found.decoupled.states == ("da", "da_rate", "lag_1", "lag_2")
    assert found.coupled.modes.eigenvalues.shape == (4, 6)
    assert found.decoupled.modes.output.shape == (4, 1, 4)
    np.testing.assert_allclose(found.coupled.modes.participation.sum(axis=-2), 1.0)
    scaled = found.coupled.modes.eigenvalues / VALUES["airspeed"][:, None]
    np.testing.assert_allclose(scaled, np.broadcast_to(scaled[0], scaled.shape), rtol=1e-9)
    # The criterion reads the stiffness of settled air, which is the one without lags.
    plain = eigenvalue_sweep(examples.wind_tunnel(), tunnel_condition, REQUEST, "airspeed", VALUES["airspeed"])
    np.testing.assert_allclose(found.criterion.discriminant, plain.criterion.discriminant, rtol=1e-9)
    assert all(word is Mechanism.UNDAMPED_FLUTTER for word in found.coupled.mechanism)
    assert all(word is Mechanism.STABLE for word in found.decoupled.mechanism)


def test_verdicts_of_both_examples(tunnel_condition):
    kinds = {"wind_tunnel": Mechanism.UNDAMPED_FLUTTER, "wind_tunnel_23012": Mechanism.DAMPING_DRIVEN}
    for name, kind in kinds.items():
        found = eigenvalue_sweep(getattr(examples, name)(), tunnel_condition, REQUEST, "airspeed", VALUES["airspeed"])
        assert all(word is kind for word in found.coupled.mechanism)
        assert all(word is Mechanism.STABLE for word in found.decoupled.mechanism)


def test_values_outside_the_model_are_marked_and_the_others_stay(tunnel_condition):
    speeds = np.array([50.0, 200.0, 340.0, 400.0])
    for system in (examples.wind_tunnel(), examples.airliner_aileron()):
        found = eigenvalue_sweep(system, tunnel_condition, REQUEST, "airspeed", speeds)
        np.testing.assert_array_equal(found.covered, [True, True, True, False])
        assert found.reason[3] == "outside the subsonic model (Mach < 1)"
        assert found.coupled.mechanism[3] is None
        assert np.all(np.isnan(found.coupled.modes.eigenvalues[3].real))
        assert np.isnan(found.criterion.discriminant[3])
        fewer = eigenvalue_sweep(system, tunnel_condition, REQUEST, "airspeed", speeds[:3])
        np.testing.assert_array_equal(found.coupled.modes.eigenvalues[:3], fewer.coupled.modes.eigenvalues)


def test_trims_that_are_not_reached_are_marked(tunnel_condition):
    request = replace(REQUEST, tab="zero_aileron_torque", tab_limit=0.1)
    found = eigenvalue_sweep(examples.wind_tunnel_23012(), tunnel_condition, request, "aileron", VALUES["aileron"])
    assert np.any(found.covered)
    assert not np.all(found.covered)
    for k in np.flatnonzero(~found.covered):
        assert found.reason[k].startswith("aileron torque of 0 N m: no tab angle within")


def test_trims_outside_the_data_are_marked(tunnel_condition):
    tunnel = examples.wind_tunnel_23012()
    table = replace(tunnel, aerodynamics=replace(tunnel.aerodynamics, source=fit_interpolant(xfoil_naca23012())))
    found = eigenvalue_sweep(table, tunnel_condition, REQUEST, "tab", np.deg2rad([-30.0, -10.0, 10.0, 30.0]))
    np.testing.assert_array_equal(found.covered, [False, True, True, False])
    assert found.reason[0].startswith("trim outside")
    assert found.reason[1] is None


def test_any_stack_may_be_swept(tunnel_condition):
    # The tab's mass balance, which has no name of its own: the bodies are arrays over the values.
    tunnel, offsets = examples.wind_tunnel_23012(), np.array([0.0, 0.005, 0.02])
    bodies = replace(tunnel.inertia, tab=replace(tunnel.inertia.tab, cg_offset=offsets))
    plant = SweptPlant(replace(tunnel, inertia=bodies), tunnel_condition.take((..., None)), REQUEST)
    found = sweep_plant(plant, offsets, "tab cg offset", "m")
    for k, offset in enumerate(offsets):
        body = replace(tunnel.inertia, tab=replace(tunnel.inertia.tab, cg_offset=float(offset)))
        values = np.linalg.eigvals(model_of(replace(tunnel, inertia=body), tunnel_condition, REQUEST).A)
        np.testing.assert_allclose(
            np.sort_complex(found.coupled.modes.eigenvalues[k]), np.sort_complex(values), rtol=1e-8
        )


def test_models_that_are_not_finite_are_marked(tunnel_condition):
    plant = swept_plant(examples.wind_tunnel(), tunnel_condition, REQUEST, "airspeed", VALUES["airspeed"])
    models = model_of(plant.system, plant.condition, REQUEST)
    mask = np.array([True, False, True, True])
    found = sweep_models(models.take(mask).spread(mask), VALUES["airspeed"], "airspeed")
    np.testing.assert_array_equal(found.covered, mask)
    assert found.reason[1] == "the linear model is not finite"
    whole = sweep_models(models, VALUES["airspeed"], "airspeed")
    np.testing.assert_allclose(found.coupled.growth[mask], whole.coupled.growth[mask], rtol=1e-12)


@pytest.mark.parametrize("quantity", VALUES)
def test_batched_equals_single(quantity, grid):
    system = examples.wind_tunnel()
    request = REQUEST if quantity != "tab_chord_ratio" else replace(REQUEST, tab=HeldTorque("aileron", 0.1))
    found = eigenvalue_sweep(system, grid.condition, request, quantity, VALUES[quantity])
    assert found.covered.shape == (*grid.shape, len(VALUES[quantity]))
    for index in ((0, 0), (2, 3), (4, 1)):
        single = eigenvalue_sweep(system, grid.condition.take(index), request, quantity, VALUES[quantity])
        point = found.take(index)
        np.testing.assert_allclose(
            point.coupled.modes.eigenvalues, single.coupled.modes.eigenvalues, rtol=1e-9, atol=1e-9
        )
        np.testing.assert_allclose(point.decoupled.growth, single.decoupled.growth, rtol=1e-9)
        np.testing.assert_allclose(point.criterion.discriminant, single.criterion.discriminant, rtol=1e-10)
        assert list(point.coupled.mechanism) == list(single.coupled.mechanism)


def test_trims_over_the_grid_keep_their_place(grid):
    request = TrimRequest(np.linspace(0.0, 0.1, 4), np.full((5, 1), 0.02), HeldTorque("tab", np.linspace(0, 0.01, 4)))
    found = eigenvalue_sweep(examples.wind_tunnel_23012(), grid.condition, request, "density", VALUES["density"])
    single = TrimRequest(0.1, 0.02, HeldTorque("tab", 0.01))
    alone = eigenvalue_sweep(
        examples.wind_tunnel_23012(), grid.condition.take((2, 3)), single, "density", VALUES["density"]
    )
    np.testing.assert_allclose(found.coupled.growth[2, 3], alone.coupled.growth, rtol=1e-9)


def test_density_is_swept_at_the_same_airspeed_and_temperature():
    base = flight_condition(3000.0, "airspeed", 60.0, 10.0)
    plant = swept_plant(examples.wind_tunnel(), base, REQUEST, "density", np.array([0.5, 1.0]))
    there = plant.condition
    np.testing.assert_array_equal(there.airspeed, 60.0)
    np.testing.assert_array_equal(there.dynamic_pressure, 0.5 * there.air.density * 3600.0)
    np.testing.assert_allclose(there.air.pressure / (there.air.density * there.air.temperature), 287.05287, rtol=1e-12)
    np.testing.assert_allclose(there.mach, base.mach, rtol=1e-15)


@pytest.mark.parametrize(
    ("quantity", "values"),
    [
        ("chord", [1.0]),
        ("airspeed", [0.0, 1.0]),
        ("density", [-1.0]),
        ("tab_chord_ratio", [1.0]),
        ("tab", []),
        ("tab", [np.nan]),
        ("tab", [[0.1]]),
    ],
)
def test_impossible_sweeps_are_refused(quantity, values, tunnel_condition):
    with pytest.raises(ValueError, match=r"quantity|positive|between 0 and 1|list of finite"):
        eigenvalue_sweep(examples.wind_tunnel(), tunnel_condition, REQUEST, quantity, np.array(values))


def test_the_tab_chord_of_a_table_cannot_be_varied(tunnel_condition, polynomial_system):
    with pytest.raises(ValueError, match="thin-aerofoil"):
        eigenvalue_sweep(polynomial_system, tunnel_condition, REQUEST, "tab_chord_ratio", np.array([0.2]))


def test_values_and_models_must_be_as_many(tunnel_condition):
    model = model_of(examples.wind_tunnel(), tunnel_condition, REQUEST)
    with pytest.raises(ValueError, match="one model for each value"):
        sweep_models(model, np.array([1.0]), "nothing")
