"""From the wire to the domain: units, defaults, every field in its place."""

from __future__ import annotations

import dataclasses
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from design.classical.controller import ClassicalController
from design.classical.steering import STEERABLE
from design.classical.tab_drive import tab_drive
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights
from design.lqr.synthesis import LqrController
from design.lqr.weights import BrysonWeights, ExplicitWeights, weight_matrices
from design.sampling import Sampling
from design.specs import QUANTITIES, SPEC_PACKS, Spec
from model import examples as sections
from model.actuators import ActuatorLimits
from model.system import TabAileron
from schedules.study import Study
from service.designs import design_id
from service.documentation.body_examples import BODIES
from service.examples import NAMES, example
from service.schemas.controller_requests import NegativeFeedback, PositiveFeedback
from service.schemas.flight import Grid
from service.schemas.requests import DesignRequest
from service.schemas.specs import PackSpecs, Specs
from service.to_domain import study_of
from service.wire.spec_names import SPEC_FIELDS
from service.wire.units import unit_of


def request_of(document: Any) -> DesignRequest:
    return DesignRequest.model_validate(document)


@pytest.mark.parametrize("name", NAMES)
def test_examples_are_the_shipped_sections(name: str) -> None:
    """The JSON examples and the Python ones of the model are the same sections and trims."""
    study = study_of.study(request_of(example(name)))
    assert TabAileron(study.geometry, study.inertia, study.aerodynamics) == getattr(sections, name)()
    trim = sections.AIRLINER_TRIM if name == "airliner_aileron" else sections.WIND_TUNNEL_TRIM
    assert study.trim.alpha == pytest.approx(trim.alpha, rel=1e-15)
    assert (study.trim.aileron, study.trim.tab) == (0.0, 0.0)


def test_wind_tunnel_by_hand(wanted: Any) -> None:
    study = study_of.study(request_of(wanted))
    assert study.grid.altitude == (0.0, 3000.0)
    assert (study.grid.speed_axis, study.grid.speed) == ("dynamic_pressure", (245.0, 551.25, 980.0, 1531.25))
    tab, aileron = study.tab_actuator, study.aileron_actuator
    assert tab.servo_bandwidth == pytest.approx(80 * np.pi)
    assert tab.servo_damping_ratio == 0.7
    assert tab.rate_loop_bandwidth == pytest.approx(160 * np.pi)
    assert (tab.torque_loop_bandwidth, tab.delay) == (None, 0.0)
    assert dataclasses.astuple(tab.limits) == pytest.approx((0.4363323129985824, 6.981317007977318, 2.0, None))
    assert aileron.limits == ActuatorLimits(np.deg2rad(25.0), None, 10.0, None)
    assert study.reference.aileron == pytest.approx(0.17453292519943295)
    assert study.reference.duration == 1.0
    nf, pf, lqr = study.controllers
    assert isinstance(nf, ClassicalController)
    assert nf.rate_filter == pytest.approx(200 * np.pi)
    assert set(nf.specs) == {
        Spec("damping_ratio", "min", 0.5),
        Spec("gain_margin", "min", 6.0),
        Spec("phase_margin", "min", np.deg2rad(1.0) * 45.0),
        Spec("settling_time", "max", 0.6),
        Spec("overshoot", "max", 0.2),
    }
    assert pf == ClassicalController("pf", "positive_feedback", (Spec("damping_ratio", "min", 0.4),))
    assert study.spec_pack == SPEC_PACKS["default"]
    assert isinstance(lqr, LqrController)
    assert (lqr.reference, lqr.tab_allocation, lqr.delay_states) == ("aileron", "zero_aileron_torque", 0)
    assert (lqr.sampling, lqr.measurement, study.reference.tab) == (None, None, 0.0)
    assert isinstance(lqr.weights, BrysonWeights)
    # Bryson's rule in radians: 2 deg of aileron weighs (180 / 2 pi)^2, 0.5 N m of tab torque 4.
    matrices = weight_matrices(lqr.weights)
    np.testing.assert_allclose(np.diag(matrices.Q)[2], (90 / np.pi) ** 2)
    np.testing.assert_allclose(np.diag(matrices.Q)[[0, 4]], [(18 / np.pi) ** 2, (1800 / np.pi) ** 2])
    np.testing.assert_allclose(np.diag(matrices.R), [4.0, 0.25])


@pytest.mark.parametrize(
    ("axis", "name", "values"),
    [
        ({"mach": {"from": 0.1, "to": 0.7, "count": 4}}, "mach", (0.1, 0.3, 0.5, 0.7)),
        ({"airspeed_m_s": {"from": 1, "to": 1000, "count": 4, "spacing": "log"}}, "airspeed", (1, 10, 100, 1000)),
        ({"dynamic_pressure_pa": [1, 2.5]}, "dynamic_pressure", (1.0, 2.5)),
    ],
)
def test_axes(axis: Any, name: str, values: tuple[float, ...]) -> None:
    wire = Grid.model_validate({"altitude_m": {"from": -100, "to": 900, "count": 2}} | axis)
    grid = study_of.grid(wire, study_of.flight.Atmosphere(temperature_offset_k=-7.0))
    assert (grid.altitude, grid.speed_axis, grid.temperature_offset) == ((-100.0, 900.0), name, -7.0)
    assert grid.speed == pytest.approx(values, rel=1e-14)
    assert (grid.speed[0], grid.speed[-1]) == (values[0], values[-1])
    assert set(wire.normalised()) == {"altitude_m", *axis}


def test_defaults_are_those_of_the_contract(wanted: Any) -> None:
    for part in ("atmosphere", "trim", "spec_pack"):
        del wanted[part]
    wanted["aerodynamics"] = {"source": "thin_aerofoil"}
    normalised = request_of(wanted).normalised()
    assert normalised["atmosphere"] == {"temperature_offset_k": 0.0}
    assert normalised["trim"] == {"alpha_deg": 0.0, "aileron_deg": 0.0, "tab_deg": 0.0}
    assert normalised["spec_pack"] == "default"
    assert normalised["aerodynamics"] == {
        "source": "thin_aerofoil",
        "section": "symmetric",
        "damping": "thesis",
        "virtual_inertia": False,
        "compressibility": "none",
    }


def test_trim_word_and_explicit_weights(wanted: Any) -> None:
    wanted["trim"]["tab_deg"] = "zero_aileron_torque"
    eye = [[float(i == j) for j in range(5)] for i in range(5)]
    wanted["controllers"][2]["weights"] = {"rule": "explicit", "Q": eye, "R": [[2, 0], [0, 3]], "N": [[0.1, 0]] * 5}
    study = study_of.study(request_of(wanted))
    assert study.trim.tab == "zero_aileron_torque"
    weights = study.controllers[2].weights  # type: ignore[union-attr]
    assert isinstance(weights, ExplicitWeights)
    np.testing.assert_array_equal(weights.Q, np.eye(5))
    np.testing.assert_array_equal(weights.R, np.diag([2.0, 3.0]))
    np.testing.assert_array_equal(weights.N, [[0.1, 0.0]] * 5)


def classical(wanted: Any, **fields: Any) -> ClassicalController:
    """The domain's controller from the example's first one with these fields, alone on its grid of 2 by 4."""
    wanted["controllers"] = [wanted["controllers"][0] | fields]
    (controller,) = study_of.study(request_of(wanted)).controllers
    assert isinstance(controller, ClassicalController)
    return controller


def test_every_field_of_a_classical_controller(wanted: Any) -> None:
    del wanted["controllers"][0]["rate_filter_hz"]
    controller = classical(
        wanted,
        kind="positive_feedback",
        tab_command="rate",
        specs={
            "damping_ratio_min": 0.3,
            "gain_margin_db_min": 3,
            "phase_margin_deg_min": 30,
            "delay_margin_s_min": 0.02,
            "disk_margin_min": 0.5,
            "sensitivity_peak_max": 1.8,
            "settling_time_s_max": 0.5,
            "overshoot_percent_max": 10,
            "bandwidth_rad_s_min": 20,
            "noise_gain_max": 5,
            "tab_rate_deg_s_max": 180,
            "tab_deflection_deg_max": 20,
        },
        gains={"K_theta": 150, "K_f": 0.5},
        smoothing={"bandwidth_loss_percent_max": 15},
        sample_time_s=0.002,
        computational_delay_s=0.003,
    )
    assert (controller.kind, controller.tab_command, controller.rate_filter) == ("positive_feedback", "rate", None)
    found = {spec.quantity: (spec.sense, spec.limit, spec.source) for spec in controller.specs}
    expected = {
        "damping_ratio": ("min", 0.3),
        "gain_margin": ("min", 3.0),
        "phase_margin": ("min", np.pi / 6),
        "delay_margin": ("min", 0.02),
        "disk_margin": ("min", 0.5),
        "sensitivity_peak": ("max", 1.8),
        "settling_time": ("max", 0.5),
        "overshoot": ("max", 0.1),
        "bandwidth": ("min", 20.0),
        "noise_gain": ("max", 5.0),
        "tab_rate": ("max", np.pi),
        "tab_deflection": ("max", np.pi / 9),
    }
    assert found == {name: (sense, pytest.approx(limit), "request") for name, (sense, limit) in expected.items()}
    assert controller.gains == {"K_theta": 150.0, "K_f": 0.5}
    assert controller.sampling == Sampling(0.002, 0.003)
    assert controller.smoothness == pytest.approx(0.15)


def test_a_digital_controller_takes_one_sample_to_compute(wanted: Any) -> None:
    assert classical(wanted).sampling is None
    assert classical(wanted, sample_time_s=0.002).sampling == Sampling(0.002, 0.002)
    assert classical(wanted, sample_time_s=0.002, computational_delay_s=0).sampling == Sampling(0.002, 0.0)
    assert classical(wanted, sample_time_s=0.0007, computational_delay_s=0.007).sampling == Sampling(0.0007, 0.007)


@pytest.mark.parametrize("command", ["deflection", "rate"])
@pytest.mark.parametrize("wire", [NegativeFeedback, PositiveFeedback])
def test_gains_of_the_wire_are_those_of_the_law(wanted: Any, wire: Any, command: str) -> None:
    """Names in the order of closure, and the unit that the schema states for each, number or over the grid."""
    kind = {NegativeFeedback: "negative_feedback", PositiveFeedback: "positive_feedback"}[wire]
    units = ClassicalController("c", kind, tab_command=command).gain_units  # type: ignore[arg-type]
    given = {"name": "c", "kind": kind, "tab_command": command, "gains": dict.fromkeys(units, 1.0)}
    request = wire.model_validate(given)
    assert request.gain_names == tuple(units)
    assert request.all_gains_given
    for name in units:
        some = wire.model_validate(given | {"specs": {}, "gains": dict.fromkeys(set(units) - {name}, 1.0)})
        assert not some.all_gains_given
    definitions = wire.model_json_schema()["$defs"]
    properties = definitions[f"{wire.__name__}Gains"]["properties"]
    for name, unit in units.items():
        (numbers, _null) = properties[name]["anyOf"]
        over_grid = definitions[numbers["oneOf"][1]["$ref"].rsplit("/", 1)[-1]]
        assert properties[name]["unit"] == over_grid["properties"]["values"]["unit"] == unit


def test_values_over_the_grid_are_in_its_shape(wanted: Any) -> None:
    """Along either axis or in the whole shape: entry [i, j] belongs to altitude i and speed j."""
    first, second, whole = [30.0, 40.0], [0.1, 0.2, 0.3, 0.4], [[1.0, 2, 3, 4], [5, 6, 7, 8]]
    controller = classical(
        wanted,
        specs={
            "phase_margin_deg_min": {"axis": "altitude_m", "values": first},
            "damping_ratio_min": {"axis": "dynamic_pressure_pa", "values": second},
            "overshoot_percent_max": {"values": whole},
        },
        gains={"K_p": {"axis": "altitude_m", "values": first}, "K_i": {"values": whole}, "K_d": 0.1},
    )
    limits = {spec.quantity: spec.limit for spec in controller.specs}
    for i in range(2):
        for j in range(4):
            assert limits["phase_margin"][i, j] == pytest.approx(np.deg2rad(first[i]))  # type: ignore[index]
            assert limits["damping_ratio"][i, j] == second[j]  # type: ignore[index]
            assert limits["overshoot"][i, j] == pytest.approx(whole[i][j] / 100)  # type: ignore[index]
            assert controller.gains["K_p"][i, j] == first[i]  # type: ignore[index]
            assert controller.gains["K_i"][i, j] == whole[i][j]  # type: ignore[index]
    assert controller.gains["K_d"] == 0.1
    assert {limit.shape for limit in limits.values()} == {(2, 4)}  # type: ignore[union-attr]
    for array in (*limits.values(), controller.gains["K_p"]):
        assert array.flags.c_contiguous  # type: ignore[union-attr]


@given(
    shape=st.tuples(st.integers(1, 4), st.integers(1, 4)),
    numbers=st.lists(st.sampled_from([0.25, 0.5, 0.75]), min_size=16, max_size=16),
    along=st.sampled_from([None, 0, 1]),
)
def test_every_spelling_of_a_value_is_one_request(shape: tuple[int, int], numbers: list[float], along: Any) -> None:
    """The whole grid, an axis where it is enough, a number where that is: one id, one array."""
    sizes = (shape[0], 1) if along == 0 else (1, shape[1]) if along == 1 else shape
    drawn = np.array(numbers[: sizes[0] * sizes[1]]).reshape(sizes)
    values = np.broadcast_to(drawn, shape)
    spellings: list[Any] = [{"values": values.tolist()}, {"axis": None, "values": values.tolist()}]
    if np.all(values == values[:, :1]):
        spellings.append({"axis": "altitude_m", "values": values[:, 0].tolist()})
    if np.all(values == values[:1]):
        spellings.append({"values": values[0].tolist(), "axis": "mach"})
    if np.all(values == values[0, 0]):
        spellings.append(float(values[0, 0]))
    document = example("wind_tunnel")
    mach = {"from": 0.1, "to": 0.2, "count": shape[1]} if shape[1] > 1 else [0.1]
    document["grid"] = {"altitude_m": [100.0 * i for i in range(shape[0])], "mach": mach}
    ids = set()
    for spelling in spellings:
        document["controllers"][1] |= {"specs": {"damping_ratio_min": spelling}, "gains": {"K_f": spelling}}
        document["spec_pack"] = {"name": "p", "specs": {"disk_margin_min": spelling}}
        request = request_of(document)
        ids.add(design_id(request))
        assert request_of(request.normalised()).normalised() == request.normalised()
        study = study_of.study(request)
        pf = study.controllers[1]
        assert isinstance(pf, ClassicalController)
        for found in (pf.specs[0].limit, pf.gains["K_f"], study.spec_pack[0].limit):
            np.testing.assert_array_equal(np.broadcast_to(found, shape), values)
            assert np.ndim(found) in (0, 2)
    assert len(ids) == 1


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ({}, {"gains": None, "smoothing": None, "sample_time_s": None, "tab_command": "deflection"}),
        ({}, {"gains": {}}),
        ({}, {"gains": {"K_p": None}}),
        ({}, {"smoothing": {"bandwidth_loss_percent_max": 0}}),
        ({"gains": {"K_p": 1}}, {"gains": {"K_i": None, "K_p": 1.0}}),
        ({"specs": {"damping_ratio_min": 0.5}}, {"specs": {"damping_ratio_min": 0.5, "noise_gain_max": None}}),
        ({"sample_time_s": 0.01}, {"sample_time_s": 0.01, "computational_delay_s": 0.01}),
    ],
)
def test_defaults_of_a_classical_controller(wanted: Any, one: Any, other: Any) -> None:
    ids, plain = [], wanted["controllers"][0]
    for fields in (one, other):
        wanted["controllers"] = [plain | fields]
        ids.append(design_id(request_of(wanted)))
    assert ids[0] == ids[1]
    wanted["controllers"] = [plain | one | {"sample_time_s": 0.5}]
    assert design_id(request_of(wanted)) != ids[0]


def test_specs_that_are_left_out_are_none(wanted: Any) -> None:
    gains = {"K_d": 0.01, "K_p": 0.5, "K_i": 40}
    given = wanted["controllers"][0] | {"specs": {}, "gains": gains}
    wanted["controllers"] = [given]
    with_none = request_of(wanted)
    del given["specs"]
    assert request_of(wanted).normalised() == with_none.normalised()
    assert with_none.normalised()["controllers"][0]["gains"] == gains | {"K_theta": None}
    (controller,) = study_of.study(with_none).controllers
    assert isinstance(controller, ClassicalController)
    assert controller.all_gains_given
    assert controller.specs == ()


@pytest.mark.parametrize(
    ("fields", "tab"),
    [
        ({"gains": {"K_d": 0.01, "K_p": 0.5, "K_i": 40}}, {}),
        ({}, {"servo_bandwidth_hz": 20.0}),
        ({"tab_command": "rate"}, {"delay_s": 0.004}),
        ({"tab_command": "rate", "gains": {"K_theta": 100}}, {}),
        ({"tab_command": "rate"}, {"rate_loop_bandwidth_hz": 50.0}),
    ],
)
def test_tab_actuators_that_take_the_commands(wanted: Any, fields: Any, tab: Any) -> None:
    """Ideal, of first order or delayed, wherever gains that are chosen keep a bound."""
    wanted["actuators"]["tab"] = tab
    assert classical(wanted, **fields).rate_filter is not None
    actuator = study_of.study(request_of(wanted)).tab_actuator
    assert actuator.delay == tab.get("delay_s", 0.0)
    assert (actuator.servo_bandwidth is None) == ("servo_bandwidth_hz" not in tab)
    assert actuator.servo_damping_ratio is None
    tab_drive(actuator, fields.get("tab_command", "deflection"))


def test_examples_of_design_requests_are_read() -> None:
    """Every example of the documentation is a request, and says what its summary promises."""
    studies = {}
    for name, shown in BODIES["/v1/designs"]().items():
        request = request_of(shown["value"])
        assert design_id(request_of(request.normalised())) == design_id(request)
        studies[name] = study_of.study(request)
        assert studies[name].name == name
    four = [(c.kind, c.tab_command) for c in classical_of(studies["four_classical_controllers"])]
    assert sorted(four) == sorted(product(("negative_feedback", "positive_feedback"), ("deflection", "rate")))
    judged, digital, some = classical_of(studies["given_gains"])
    assert [set(c.gains) for c in (judged, digital, some)] == [{"K_d", "K_p", "K_i"}, {"K_d", "K_p", "K_i"}, {"K_f"}]
    assert digital.sampling == Sampling(0.001, 0.0005)
    (nf,) = classical_of(studies["specs_over_the_grid"])
    assert {spec.quantity for spec in nf.specs if np.ndim(spec.limit) == 2} == {"damping_ratio", "settling_time"}
    assert [np.ndim(spec.limit) for spec in studies["specs_over_the_grid"].spec_pack] == [0, 2]
    structures = regulators_of(studies["lqr_structures"])
    assert [c.reference for c in structures] == ["none", "aileron", "aileron_and_tab"]
    assert structures[1].tab_allocation == "least_torque"
    before, after, net_work = regulators_of(studies["lqr_power"])
    assert isinstance(after.weights, PowerBalancedWeights)
    assert after.weights.base == before.weights
    assert isinstance(net_work.weights, NetWorkWeights)


def classical_of(study: Study) -> list[ClassicalController]:
    return [controller for controller in study.controllers if isinstance(controller, ClassicalController)]


def regulators_of(study: Study) -> list[LqrController]:
    return [controller for controller in study.controllers if isinstance(controller, LqrController)]


def test_specs_of_a_request_are_those_that_steer() -> None:
    fields = [SPEC_FIELDS[name] for name in Specs.model_fields]
    assert {field.quantity: field.sense for field in fields} == dict(STEERABLE)
    assert len(fields) == len(STEERABLE)


def test_a_pack_can_ask_for_every_quantity(wanted: Any) -> None:
    fields = [SPEC_FIELDS[name] for name in PackSpecs.model_fields]
    assert sorted(field.quantity for field in fields) == sorted(QUANTITIES)
    wanted["spec_pack"] = {"name": "all", "specs": {field.name: 1.0 for field in fields}}
    for spec, field in zip(study_of.study(request_of(wanted)).spec_pack, fields, strict=True):
        assert spec == Spec(field.quantity, field.sense, field.scale, "spec_pack")
    wanted["spec_pack"] = "limit_speed"
    assert study_of.study(request_of(wanted)).spec_pack is SPEC_PACKS["limit_speed"]


def test_schemas_state_the_units_of_specs_over_the_grid() -> None:
    schema = PackSpecs.model_json_schema()
    for name, node in schema["properties"].items():
        unit = SPEC_FIELDS[name].unit
        (numbers, _null) = node["anyOf"]
        over_grid = schema["$defs"][numbers["oneOf"][1]["$ref"].rsplit("/", 1)[-1]]["properties"]["values"]
        assert node["unit"] == over_grid["unit"] == unit
        # One range, however the value is written.
        number, row = over_grid["items"]["oneOf"]
        assert number == row["items"] == numbers["oneOf"][0]


def test_spec_names_and_units() -> None:
    assert set(QUANTITIES) == {field.quantity for field in SPEC_FIELDS.values()}
    phase = SPEC_FIELDS["phase_margin_deg_min"]
    assert (phase.quantity, phase.sense, phase.unit) == ("phase_margin", "min", "deg")
    for degrees in range(1, 91):
        assert phase.limit(phase.spec(degrees)) == degrees
        assert phase.limit(Spec("phase_margin", "min", float(np.deg2rad(degrees)))) == degrees
    assert SPEC_FIELDS["overshoot_percent_max"].spec(7.0).limit == pytest.approx(0.07)
    assert SPEC_FIELDS["tab_rate_deg_s_max"].value(np.pi) == pytest.approx(180.0)
    bandwidth = SPEC_FIELDS["bandwidth_rad_s_min"]
    assert (bandwidth.quantity, bandwidth.unit, bandwidth.scale) == ("bandwidth", "rad/s", 1.0)
    assert SPEC_FIELDS["delay_margin_s_min"].unit == "s"
    assert SPEC_FIELDS["noise_gain_max"].unit == "1"
    for name, field in SPEC_FIELDS.items():
        assert unit_of(name) == field.unit


def test_limits_that_vary_are_those_of_their_points() -> None:
    """Degrees as they were asked for, point by point; as a whole such a spec has no one limit."""
    phase = SPEC_FIELDS["phase_margin_deg_min"]
    asked = np.arange(1.0, 91.0).reshape(9, 10)
    spec = phase.spec(asked, "spec_pack")
    assert phase.limit(spec) is None
    assert spec.source == "spec_pack"
    for index in np.ndindex(9, 10):
        assert phase.limit_at(spec, index) == asked[index]
    assert phase.limit_at(phase.spec(30.0), (8, 9)) == phase.limit(phase.spec(30.0)) == 30.0
