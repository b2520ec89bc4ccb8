"""From the wire to the domain: units, defaults, every field in its place."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from design.classical.gain_search import STEERABLE
from design.classical.synthesis import ClassicalController
from design.lqr.synthesis import LqrController
from design.lqr.weights import BrysonWeights, ExplicitWeights, weight_matrices
from design.specs import QUANTITIES, Spec
from model import examples as sections
from model.actuators import ActuatorLimits
from model.system import TabAileron
from service import study_of
from service.examples import NAMES, example
from service.schemas.controller_requests import Specs
from service.schemas.flight import Grid
from service.schemas.requests import DesignRequest
from service.spec_names import SPEC_FIELDS


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
    assert pf == ClassicalController("pf", "positive_feedback", (Spec("damping_ratio", "min", 0.4),), None)
    assert isinstance(lqr, LqrController)
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


def test_specs_of_a_request_are_those_that_steer() -> None:
    fields = [SPEC_FIELDS[name] for name in Specs.model_fields]
    assert {field.quantity for field in fields} == set(STEERABLE)


def test_spec_names_and_units() -> None:
    assert set(QUANTITIES) == {field.quantity for field in SPEC_FIELDS.values()}
    phase = SPEC_FIELDS["phase_margin_deg_min"]
    assert (phase.quantity, phase.sense, phase.unit) == ("phase_margin", "min", "deg")
    for degrees in range(1, 91):
        assert phase.limit(phase.spec(degrees)) == degrees
        assert phase.limit(Spec("phase_margin", "min", float(np.deg2rad(degrees)))) == degrees
    assert SPEC_FIELDS["overshoot_percent_max"].spec(7.0).limit == pytest.approx(0.07)
    assert SPEC_FIELDS["tab_rate_deg_s_max"].value(np.pi) == pytest.approx(180.0)
