"""Requests of concurrent actuation: every field in its place, every spelling one design, every structure's states."""

from __future__ import annotations

from itertools import product
from math import pi, radians
from typing import Any

import numpy as np
import pytest

from design.lqr.allocation import TabRatio
from design.lqr.controller import LqrController
from design.lqr.cost import cost_of
from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.lqr.output_weights import OutputWeights, output_map
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights, ReferenceStep
from design.lqr.tracking import TrackingPlant, augment_with_integral
from design.lqr.weights import BrysonWeights, ExplicitWeights, WeightsRefused
from design.sampling import Sampling
from schedules.study import Study
from service.designs import canonical, design_id
from service.examples import example
from service.schemas.requests import DesignRequest
from service.to_domain import study_of
from tests.service.lqr_bodies import (
    BALANCED,
    BRYSON,
    DELAY,
    EXPLICIT,
    KALMAN,
    LAGS,
    NET_WORK,
    OUTPUT,
    WITH_TAB,
    asked,
    eye,
    taken,
)


def study_for(document: Any) -> Study:
    return study_of.study(DesignRequest.model_validate(document))


def regulator(fields: Any, **more: Any) -> LqrController:
    (controller,) = study_for(asked(fields, **more)).controllers
    assert isinstance(controller, LqrController)
    return controller


def ids(*documents: Any) -> int:
    """How many designs the documents ask for; each is read again from its normalised form."""
    requests = [DesignRequest.model_validate(document) for document in documents]
    for request in requests:
        assert canonical(DesignRequest.model_validate_json(canonical(request))) == canonical(request)
    return len({design_id(request) for request in requests})


def test_every_field_of_a_regulator() -> None:
    document = asked(
        {
            "reference": "aileron_and_tab",
            "weights": WITH_TAB,
            "delay_states": 3,
        },
        tab={"torque_loop_bandwidth_hz": 50.0, "delay_s": 0.004},
        aileron={"torque_loop_bandwidth_hz": 60.0, "delay_s": 0.003},
    )
    document["reference"] |= {"aileron_deg": -20.0, "tab_deg": 5.0}
    study = study_for(document)
    assert (study.tab_actuator.torque_loop_bandwidth, study.tab_actuator.delay) == (pytest.approx(100 * pi), 0.004)
    found = study.aileron_actuator
    assert (found.torque_loop_bandwidth, found.delay) == (pytest.approx(120 * pi), 0.003)
    assert (study.reference.aileron, study.reference.tab) == pytest.approx((-pi / 9, pi / 36))
    # In the order of the controller's references: aileron, tab.
    np.testing.assert_allclose(study.reference.sizes(("r_a", "r_t")), [-pi / 9, pi / 36])
    expected = LqrController(
        name="lqr",
        weights=BrysonWeights(
            aileron=radians(2.0), aileron_rate=radians(200.0), tab=radians(10.0), tab_rate=radians(400.0),
            aileron_integral=radians(0.1), tab_torque=0.5, aileron_torque=2.0, tab_integral=radians(0.5),
        ),
        reference="aileron_and_tab",
        delay_states=3,
    )  # fmt: skip
    assert study.controllers == (expected,)


def test_a_digital_regulator_takes_one_sample_to_compute() -> None:
    assert regulator({}).sampling is None
    assert regulator({"sample_time_s": 0.002}).sampling == Sampling(0.002, 0.002)
    assert regulator({"sample_time_s": 0.002, "computational_delay_s": 0}).sampling == Sampling(0.002, 0.0)


@pytest.mark.parametrize("rule", ["zero_aileron_torque", "least_torque", "least_power"])
def test_rules_for_the_free_tab(rule: str) -> None:
    assert regulator({"tab_allocation": rule}).tab_allocation == rule
    assert regulator({"tab_allocation": {"tab_per_aileron": -1.5}}).tab_allocation == TabRatio(-1.5)


def test_measurements() -> None:
    assert regulator({}).measurement is None
    filters = regulator({"measurement": {"kind": "rate_filters", "cutoff_hz": 200.0}}).measurement
    assert isinstance(filters, RateFilters)
    assert filters.cutoff == pytest.approx(400.0 * pi)
    # White noise of 1 deg/sqrt(Hz) has the intensity (pi/180)^2 rad^2/Hz, which is rad^2 s.
    found = regulator({"measurement": KALMAN | {"recovery": 10.0}}).measurement
    assert found == KalmanMeasurement(0.002, 0.01, radians(0.001), radians(0.002), 10.0)
    assert ids(asked({"measurement": KALMAN}), asked({"measurement": KALMAN | {"recovery": 0.0}})) == 1


@pytest.mark.parametrize(
    ("name", "value"), [("tab_angle_noise", 0.0), ("recovery", -1.0), ("tab_torque_noise", np.nan)]
)
def test_noises_that_make_no_filter(name: str, value: float) -> None:
    noises: dict[str, float] = {
        "tab_torque_noise": 0.0, "aileron_torque_noise": 0.0, "tab_angle_noise": 1e-9, "aileron_angle_noise": 1e-9,
    }  # fmt: skip
    KalmanMeasurement(**noises)
    with pytest.raises(ValueError, match=name):
        KalmanMeasurement(**noises | {name: value})
    with pytest.raises(ValueError, match="cutoff"):
        RateFilters(0.0)


def test_explicit_and_output_weights() -> None:
    explicit = regulator({"weights": EXPLICIT | {"Q": np.diag([1.0, 2, 3, 4, 5]).tolist(), "N": [[0.1, 0.2]] * 5}})
    assert isinstance(explicit.weights, ExplicitWeights)
    np.testing.assert_array_equal(explicit.weights.Q, np.diag([1.0, 2, 3, 4, 5]))
    np.testing.assert_array_equal(explicit.weights.N, [[0.1, 0.2]] * 5)
    output = regulator({"weights": OUTPUT | {"W_y": [[2, 1], [1, 3]], "W_u": [[4, 0], [0, 5]]}}).weights
    assert isinstance(output, OutputWeights)
    assert output.outputs == ("da_error", "int_a")
    np.testing.assert_array_equal(output.W_y, [[2.0, 1.0], [1.0, 3.0]])
    np.testing.assert_array_equal(output.W_u, np.diag([4.0, 5.0]))


def test_power_is_weighed_on_the_step_of_the_request() -> None:
    step = ReferenceStep(radians(10.0), 1.0)
    base = regulator({}).weights
    assert isinstance(base, BrysonWeights)
    assert regulator({"weights": BALANCED}).weights == PowerBalancedWeights(base, 1.2, None, step)
    both = BALANCED | {"tab_power_w": None, "aileron_power_w": 20, "keep_settling": False}
    assert regulator({"weights": both}).weights == PowerBalancedWeights(base, None, 20.0, step, False)
    assert regulator({"weights": NET_WORK}).weights == NetWorkWeights(base, 0.5, 0.0)
    work = {"rule": "power", "form": "net_work", "base": BRYSON, "aileron_price": 2, "part": 0.25}
    assert regulator({"weights": work}).weights == NetWorkWeights(base, 0.0, 2.0, 0.25)
    kept = work | {"keep_settling": True}
    assert regulator({"weights": kept}).weights == NetWorkWeights(base, 0.0, 2.0, 0.25, retuned_on=step)
    # The tab's step counts only of a controller that follows it.
    document = asked({"reference": "aileron_and_tab", "weights": BALANCED | {"base": WITH_TAB}})
    document["reference"]["tab_deg"] = 4.0
    document["controllers"].append({"name": "other", "kind": "lqr", "weights": BALANCED})
    steps = [wanted.weights.step.tab for wanted in study_for(document).controllers]  # type: ignore[union-attr]
    assert steps == [radians(4.0), 0.0]


def test_every_spelling_is_one_design() -> None:
    assert ids(
        asked({}),
        asked({"reference": "aileron", "tab_allocation": "zero_aileron_torque", "delay_states": 0}),
        asked({"measurement": None, "sample_time_s": None, "computational_delay_s": None}),
        asked({"weights": BRYSON | {"tab_integral_deg_s": None, "tab_deg": 10}}),
        asked({}, tab={"delay_s": 0, "torque_loop_bandwidth_hz": None}, aileron={"delay_s": 9.9e-10}),
    ) == 1  # fmt: skip
    # The integral of an error that nothing has weighs nothing.
    without = {name: value for name, value in BRYSON.items() if name != "aileron_integral_deg_s"}
    assert ids(*(asked({"reference": "none", "weights": weights}) for weights in (without, BRYSON))) == 1
    base = BALANCED | {"base": without, "form": "net_work", "tab_power_w": None, "tab_price": 1}
    assert ids(*(asked({"reference": "none", "weights": base | {"base": w}}) for w in (without, BRYSON))) == 1
    assert ids(asked({"sample_time_s": 0.01}), asked({"sample_time_s": 0.01, "computational_delay_s": 0.01})) == 1
    assert ids(
        asked({"weights": NET_WORK}),
        asked({"weights": NET_WORK | {"aileron_price": 0, "keep_settling": False, "tab_power_w": None}}),
    ) == 1  # fmt: skip
    assert ids(asked({"weights": BALANCED}), asked({"weights": BALANCED | {"keep_settling": True, "part": None}})) == 1
    different = [{}, {"reference": "none"}, {"weights": NET_WORK}, {"weights": BALANCED}, {"delay_states": 1}]
    different += [{"measurement": KALMAN}, {"sample_time_s": 0.01}, {"tab_allocation": "least_power"}]
    different += [{"weights": NET_WORK | {"keep_settling": True}}, {"tab_allocation": {"tab_per_aileron": 0.0}}]
    assert ids(*map(asked, different)) == len(different)


def test_the_normalised_weights_name_the_fields_of_their_form() -> None:
    def normalised(weights: Any) -> set[str]:
        request = DesignRequest.model_validate(asked({"weights": weights}))
        return set(request.normalised()["controllers"][0]["weights"])

    assert normalised(NET_WORK) == {"rule", "form", "base", "tab_price", "aileron_price", "part", "keep_settling"}
    assert normalised(BALANCED) == {"rule", "form", "base", "tab_power_w", "aileron_power_w", "keep_settling"}


STRUCTURES = [
    (reference, actuators, states, damping)
    for reference, actuators, states, damping in product(
        ("none", "aileron", "aileron_and_tab"),
        (({}, {}), (LAGS, {}), ({}, LAGS | DELAY), (DELAY | LAGS, DELAY)),
        (0, 2),
        ("thesis", "unsteady"),
    )
]


@pytest.fixture(scope="module")
def models(plant_a: Any, unsteady_a: Any) -> dict[str, Any]:
    return {"thesis": plant_a.model.take((0, 2)), "unsteady": unsteady_a.model.take((0, 2))}


def plant_of(models: Any, fields: Any, tab: Any, aileron: Any, damping: str) -> TrackingPlant:
    """What the domain builds for a controller of the wire, with weights that fit every structure."""
    study = study_for(asked({"weights": WITH_TAB if fields["reference"] == "aileron_and_tab" else BRYSON} | fields,
                            tab, aileron))  # fmt: skip
    (controller,) = study.controllers
    assert isinstance(controller, LqrController)
    return augment_with_integral(models[damping], controller.structure(study.tab_actuator, study.aileron_actuator))


@pytest.mark.parametrize(("reference", "actuators", "states", "damping"), STRUCTURES)
def test_the_wire_takes_the_weights_that_the_domain_takes(
    models: Any, reference: str, actuators: Any, states: int, damping: str
) -> None:
    """Sizes of Q and N, and names of outputs: no more and no less, over every structure there can be."""
    fields = {"reference": reference, "delay_states": states}
    plant = plant_of(models, fields, *actuators, damping)
    air = example("wind_tunnel")["aerodynamics"] | {"damping": damping}

    def wire(weights: Any) -> bool:
        return taken(asked(fields | {"weights": weights}, *actuators, aerodynamics=air))

    def domain(weights: ExplicitWeights) -> bool:
        try:
            cost_of(weights, plant)
        except WeightsRefused as refused:
            return "has shape" not in refused.reason
        return True

    for n in range(1, len(plant.states) + 3):
        explicit = EXPLICIT | {"Q": eye(n)}
        assert wire(explicit) == domain(ExplicitWeights(np.eye(n), np.eye(2))), n
        whole = EXPLICIT | {"Q": eye(len(plant.states)), "N": [[0.0, 0.0]] * n}
        assert wire(whole) == domain(ExplicitWeights(np.eye(len(plant.states)), np.eye(2), np.zeros((n, 2)))), n
    every = {"int_a", "int_t", "tab_torque", "lag_2", "da_error", "dt_error", "r_a", "tab_delay_1", "aileron_delay_2"}
    every |= {"da_acceleration", "dt_acceleration", "T_t", "T_a", "T_t_command", "T_a_command", "x", *plant.states}
    for name in every:
        try:
            output_map((name,), plant)
            known = True
        except WeightsRefused:
            known = False
        assert wire(OUTPUT | {"outputs": [name], "W_y": [[1.0]]}) == known, name
