from typing import get_args

import numpy as np
import pytest

from design.lqr.flown import flown_loop
from design.lqr.step_figures import step_figures
from design.lqr.structures import Structure
from design.lqr.synthesis import design_lqr
from design.lqr.weight_request import SENSES, Minimised
from design.response.step_response import step_response
from design.specs import Spec
from model.actuators import Actuator
from tests.design.lqr.weight_cases import MODEL, STEP, exact, request

SPECS = tuple(Spec(quantity, sense, 1.0) for quantity, sense in SENSES.items())
POINTS = MODEL.take((0,))


def loops(structure=None, model=POINTS):
    """Loops of the weights to start from."""
    structure = structure or Structure()
    design = design_lqr(model, request().controller, None, structure.tab, structure.aileron)
    return flown_loop(model, design.structure, design.K, design.N)


@pytest.mark.parametrize("minimised", get_args(Minimised))
def test_figures_are_those_that_searches_are_judged_by(minimised):
    """Of the search's own judgement in the tests, which solves and assesses each point by itself."""
    search = request(SPECS, minimised=minimised)
    structure = Structure("aileron", Actuator(torque_loop_bandwidth=400.0), Actuator(delay=0.001))
    for built in (Structure(), structure):
        values, least = step_figures(loops(built), SPECS, minimised, STEP)
        for p in range(4):
            ours, wanted = exact(POINTS.take(slice(p, p + 1)), search, np.zeros((1, 6)), built)
            np.testing.assert_allclose(values[p], ours[0], rtol=1e-7)
            np.testing.assert_allclose(least[p], wanted[0], rtol=1e-7)


def test_figures_are_those_of_a_finely_sampled_step():
    loop = loops()
    response = step_response(loop, np.array([STEP.aileron]), STEP.duration, 200_001)
    signal = {name: response.outputs[..., response.index(name)] for name in response.names}
    powers = [signal["T_t"] * signal["dt_rate"], signal["T_a"] * signal["da_rate"]]

    def area(values):
        return np.trapezoid(values, response.time, axis=-1)

    expected = {
        "total_rms_power": sum(np.sqrt(area(power**2) / STEP.duration) for power in powers),
        "peak_aileron_torque": np.abs(signal["T_a"]).max(axis=-1),
        "peak_total_power": (np.abs(powers[0]) + np.abs(powers[1])).max(axis=-1),
        "energy_out": sum(area(np.maximum(power, 0.0)) for power in powers),
    }
    for minimised, least in expected.items():
        values, found = step_figures(loop, SPECS, minimised, STEP)
        np.testing.assert_allclose(found, least, rtol=2e-4)
    rate = values[:, [spec.quantity for spec in SPECS].index("tab_rate")]
    np.testing.assert_allclose(rate, np.abs(signal["dt_rate"]).max(axis=-1), rtol=1e-5)


def test_a_point_alone_is_the_point_among_others():
    values, least = step_figures(loops(), SPECS, "energy_out", STEP)
    for p in range(4):
        alone, one = step_figures(loops().take(slice(p, p + 1)), SPECS, "energy_out", STEP)
        np.testing.assert_allclose(alone[0], values[p], rtol=1e-12)
        np.testing.assert_allclose(one[0], least[p], rtol=1e-12)


def test_a_value_that_does_not_exist_is_nan():
    hasty = STEP.__class__(STEP.aileron, 0.01)
    values, least = step_figures(loops(), SPECS[:2], "total_rms_power", hasty)
    assert [spec.quantity for spec in SPECS[:2]] == ["damping_ratio", "settling_time"]
    assert np.isnan(values[:, 1]).all()
    assert np.isfinite(values[:, 0]).all()
    assert np.isfinite(least).all()
