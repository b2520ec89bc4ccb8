import numpy as np
import pytest

from design.lqr.cost import cost_of
from design.lqr.structures import Structure
from design.lqr.tracking import augment_with_integral, steady_state
from design.lqr.weight_candidates import Candidates
from design.lqr.weight_figures import HIGHEST, block_peaks
from design.specs import Spec
from model.actuators import Actuator
from tests.design.lqr.weight_cases import MODEL, exact, request, scattered

#: Every quantity that a search can steer by, with limits that lie among the values of random weights.
EVERY = (
    Spec("settling_time", "max", 0.3),
    Spec("overshoot", "max", 0.1),
    Spec("damping_ratio", "min", 0.5),
    *(
        Spec(f"{name}_{what}", "max", limit)
        for name, limits in (("tab", (0.2, 40.0, 2.0, 5.0)), ("aileron", (0.2, 5.0, 6.0, 10.0)))
        for what, limit in zip(("deflection", "rate", "torque", "power"), limits, strict=True)
    ),
)
IDEAL = Actuator()
MODELS = MODEL.take((0, slice(1, 3)))


def candidates(search, tab=IDEAL, aileron=IDEAL):
    structure = search.controller.structure(tab, aileron)
    plant = augment_with_integral(MODELS, structure)
    rest = steady_state(MODELS, "zero_aileron_torque", structure)
    return Candidates(search, MODELS, plant, rest, cost_of(search.start, plant))


def limits(search, count):
    return np.tile([float(spec.limit) for spec in search.specs], (count, 1))


@pytest.mark.parametrize("minimised", ["total_rms_power", "peak_aileron_torque", "peak_total_power", "energy_out"])
@pytest.mark.parametrize("drives", [(IDEAL, IDEAL), (Actuator(torque_loop_bandwidth=300.0), IDEAL)])
def test_numbers_are_those_of_the_exact_judgement(minimised, drives):
    search = request(EVERY, minimised=minimised)
    z = scattered(np.random.default_rng(8), 60, span=8.0)
    here = candidates(search, *drives)
    numbers = here.numbers(z, np.zeros(60, dtype=int), limits(search, 60))
    values, least = exact(MODELS.take(slice(0, 1)), search, z, Structure("aileron", *drives))
    group = here.columns.group
    some = (numbers < HIGHEST).all(axis=-1) & np.isfinite(least)
    assert some.sum() > 40
    np.testing.assert_allclose(np.exp(numbers[some][:, group == -1].max(axis=-1)), least[some], rtol=5e-3)
    for k, spec in enumerate(search.specs):
        found = numbers[some][:, (group == k) & ~here.columns.time].max(axis=-1)
        part = values[some, k] / spec.limit - 1.0
        if spec.quantity == "settling_time":  # the number says whether, not by how much; the band is a little narrower
            clear = np.abs(np.nan_to_num(part, nan=1.0)) > 0.02
            agree = (found > 0.0) == ~(part <= 0.0)
            assert agree[clear & (np.abs(found) > 0.01)].all()
            continue
        expected = np.clip(np.where(part > 0.0, np.log1p(np.abs(part)), part), -3.0, 20.0)
        if spec.quantity == "overshoot":  # below zero the number goes on where the overshoot stays at none
            kept = values[some, k] > 1e-6
            found, expected = found[kept], expected[kept]
        if spec.sense == "max":
            np.testing.assert_allclose(found, expected, atol=1e-2)
        else:
            assert ((found > 1e-6) == (part < -1e-6)).all()


def test_numbers_do_not_depend_on_what_else_is_judged():
    search = request(EVERY)
    here, z = candidates(search), scattered(np.random.default_rng(1), 300)
    points = np.arange(300) % 2
    whole = here.numbers(z, points, limits(search, 300))
    for rows in (np.array([7]), np.arange(100, 290, 3), np.arange(300)[::-1]):
        np.testing.assert_array_equal(here.numbers(z[rows], points[rows], limits(search, rows.size)), whole[rows])


def test_the_time_to_have_settled_by_may_be_an_unknown():
    search = request(EVERY)
    here, z = candidates(search), scattered(np.random.default_rng(1), 20)
    asked, sooner = limits(search, 20), limits(search, 20)
    sooner[:, 0] *= 0.5
    timed = here.numbers(np.concatenate([z, np.full((20, 1), np.log(0.5))], axis=1), np.zeros(20, dtype=int), asked)
    plain = here.numbers(z, np.zeros(20, dtype=int), sooner)
    time = here.columns.time
    np.testing.assert_allclose(timed[:, ~time], plain[:, ~time], rtol=1e-12)
    stable = (timed < HIGHEST).all(axis=-1)
    np.testing.assert_allclose(timed[stable][:, time], np.log(0.5), rtol=1e-12)


def test_peaks_of_blocks_lie_between_the_samples():
    t = np.linspace(0.0, 4.0 * np.pi, 4 * 32 + 1)
    blocks = np.stack([t[32 * s : 32 * s + 33] for s in range(4)])
    for phase in np.linspace(0.0, 6.0, 13):
        exact_peaks = [max(np.sin(np.linspace(b[0], b[-1], 20001) + phase)) for b in blocks]
        np.testing.assert_allclose(block_peaks(np.sin(blocks + phase)), exact_peaks, atol=2e-5)
