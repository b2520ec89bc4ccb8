"""The coded loop: against the code run line by line, and against the loop of emulated gains."""

from dataclasses import replace

import numpy as np
import pytest

from design.frequency.sampled import sampled_margins
from design.lqr.coded_loop import coded_loop
from design.lqr.sampled_design import design_lqr_sampled, emulated_lqr_loop, sampled_lqr_loop
from design.lqr.synthesis import design_lqr
from design.lqr.torque_loop import lqr_loop
from design.outcome import Outcome, Outcomes
from design.robustness.sampled import simultaneous_margins_sampled
from design.sampling import Sampling, digital_loop
from model.actuators import Actuator
from tests.design.coded_flight import fly
from tests.design.lqr_cases import example

INDEX = (0, 2)
STEP = np.deg2rad(10.0)


def case(sampling, tab=None, aileron=None, way="redesigned"):
    """Design and coded loop of one point, and its plant with torque lags written out by hand."""
    tab, aileron = tab or Actuator(), aileron or Actuator()
    model, controller = example("wind_tunnel")
    model = model.take(INDEX)
    if way == "redesigned":
        design = design_lqr_sampled(model, controller, sampling, None, tab, aileron)
        loop = sampled_lqr_loop(model, design)
    else:
        design = design_lqr(model, controller, None, tab, aileron)
        loop = emulated_lqr_loop(model, design, sampling)
    assert design.outcomes.ok.all()
    lags = [actuator.torque_loop_bandwidth for actuator in (tab, aileron)]
    n = 4 + sum(lag is not None for lag in lags)
    A, B, place = np.zeros((n, n)), np.zeros((n, 2)), 4
    A[:4, :4] = model.A
    for i, lag in enumerate(lags):
        if lag is None:
            B[:4, i] = model.B[:, i]
        else:
            A[:4, place], A[place, place], B[place, i] = model.B[:, i], -lag, lag
            place += 1
    return model, design, loop, A, B


CASES = [
    (Sampling(4e-3, 0.0), None, None, "redesigned"),
    (Sampling(4e-3, 4e-3), None, None, "redesigned"),
    (Sampling(4e-3, 1.4e-3), None, Actuator(delay=5e-3), "redesigned"),
    (Sampling(3e-3, 3e-3), Actuator(torque_loop_bandwidth=400.0, delay=1e-3), Actuator(), "redesigned"),
    (
        Sampling(2e-3, 2.6e-3),
        Actuator(torque_loop_bandwidth=700.0),
        Actuator(torque_loop_bandwidth=900.0, delay=1.4e-3),
        "redesigned",
    ),
    (Sampling(1e-3, 1.3e-3), None, Actuator(torque_loop_bandwidth=900.0), "emulated"),
]


@pytest.mark.parametrize(("sampling", "tab", "aileron", "way"), CASES)
def test_the_loop_at_its_samples_is_the_code(sampling, tab, aileron, way):
    _, design, loop, A, B = case(sampling, tab, aileron, way)
    start = np.random.default_rng(2).normal(size=len(A))
    samples, T = 25, sampling.time
    delays = [sampling.delay + (each.delay if each else 0.0) for each in (tab, aileron)]
    flown = fly(A, B, design, T, delays, STEP, samples, start, dense=2)
    s, states = np.zeros(loop.F.shape[-1]), []
    s[: len(A)] = start
    # The code reads this state at once; its integral begins with the error it reads.
    for _ in range(samples + 1):
        states.append(s[: len(A)])
        s = loop.closed @ s + loop.reference_input[:, 0] * STEP
    wanted = np.array(states)
    first = [int(np.flatnonzero(flown.time >= k * T - 1e-9)[0]) for k in range(samples)]
    size = np.abs(wanted).max(axis=0)
    assert np.max(np.abs(flown.states[first] - wanted[:-1]) / size) < 1e-7


@pytest.mark.parametrize("sampling", [Sampling(1e-3, 0.0), Sampling(1e-3, 1e-3), Sampling(8e-4, 1.5e-3)])
def test_emulated_gains_are_those_of_the_digital_loop(sampling):
    model, controller = example("wind_tunnel")
    aileron = Actuator(torque_loop_bandwidth=800.0, delay=1e-3)
    design = design_lqr(model, controller, aileron=aileron)
    ours, theirs = emulated_lqr_loop(model, design, sampling), digital_loop(lqr_loop(model, design), sampling)
    opened = ours.opened()
    for field in ("A", "B", "K"):
        np.testing.assert_allclose(getattr(opened, field), getattr(theirs, field), rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(ours.closed, opened.closed)


def test_a_delay_next_to_whole_samples_is_whole():
    model, controller = example("wind_tunnel")
    for delay in (3e-3 * (1 + 1e-11), 3e-3 * (1 - 3e-10), 0.1 * 0.03):
        loop = sampled_lqr_loop(model, design_lqr_sampled(model, controller, Sampling(1e-3, delay)))
        assert loop.waiting == (3, 3)
    for delay in (3.00001e-3, 2.99999e-3, 3e-3 * (1 + 1e-9), 3e-3 * (1 - 1e-9)):
        near = sampled_lqr_loop(model, design_lqr_sampled(model, controller, Sampling(1e-3, delay)))
        assert near.waiting == ((4, 4) if delay > 3e-3 else (3, 3))
    whole = design_lqr_sampled(model, controller, Sampling(1e-3, 3e-3))
    below = design_lqr_sampled(model, controller, Sampling(1e-3, 2.99999e-3))
    np.testing.assert_allclose(below.K, whole.K, rtol=0.01, atol=1e-3 * np.abs(whole.K).max())


@pytest.mark.parametrize("cut", [0, 1])
@pytest.mark.parametrize("sampling", [Sampling(3e-3, 3e-3), Sampling(3e-3, 4.5e-3)])
def test_margins_are_of_a_gain_that_the_code_does_not_know(sampling, cut):
    """Between the code and the plant a factor just inside the margin dies out, one just outside grows."""
    _, design, loop, A, B = case(sampling)
    found = sampled_margins(loop.opened().cuts())
    start = np.random.default_rng(3).normal(size=4)
    for margin in (found.gain_margin_up_db[cut], found.gain_margin_down_db[cut]):
        assert np.isfinite(margin)
        sizes = []
        for part in (0.85, 1.15):
            factor = [1.0, 1.0]
            factor[cut] = 10 ** (part * margin / 20)
            flown = fly(A, B, design, sampling.time, [sampling.delay] * 2, 0.0, 240, start, factor, dense=2)
            size = np.abs(flown.states[:, 2])
            sizes.append(size[-120:].max() / size[240:360].max())
        assert sizes[0] < 0.95
        assert sizes[1] > 1.05


def test_kalmans_inequality_does_not_hold():
    """A sampled regulator of the same cost comes nearer to -1 than any continuous one, the more so the slower it is."""
    model, controller = example("wind_tunnel")
    smallest = []
    for T in (1e-4, 1e-3, 5e-3):
        loop = sampled_lqr_loop(model, design_lqr_sampled(model, controller, Sampling(T, T)))
        opened = loop.opened()
        each = 1.0 / sampled_margins(opened.cuts()).sensitivity_peak
        both = simultaneous_margins_sampled(opened.A, opened.B, opened.K, T)
        assert np.all(both.return_difference <= each.min(axis=0) * (1 + 1e-9))
        smallest.append(each.max())
        z = np.exp(1j * np.linspace(1e-3, np.pi, 4000))
        cut = opened.cut("aileron").take(INDEX)
        pencil = z[:, None, None] * np.eye(len(cut.A)) - cut.A
        L = np.linalg.solve(pencil, np.broadcast_to(cut.b, (len(z), len(cut.b)))[..., None])[..., 0] @ cut.c
        at = np.abs(1.0 + L).min()
        assert each[1][INDEX] == pytest.approx(at, rel=2e-3)
    assert 1.0 > smallest[0] > smallest[1] > smallest[2]
    assert design_lqr(model, controller).return_difference_min.min() >= 1 - 1e-6
    assert smallest[2] < 0.51


def test_grid_equals_points():
    model, controller = example("wind_tunnel")
    design = design_lqr_sampled(model, controller, Sampling(3e-3, 4e-3))
    grid = sampled_lqr_loop(model, design)
    for index in [(0, 0), (1, 3)]:
        point = sampled_lqr_loop(model.take(index), design.take(index))
        for field in ("A", "B", "C", "D", "F", "G", "E", "K", "N"):
            np.testing.assert_allclose(getattr(grid.take(index), field), getattr(point, field), rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(grid.take(index).opened().closed, point.opened().closed, rtol=1e-12, atol=1e-12)


def test_opened_and_closed_have_the_same_modes():
    """The memory that stands apart when the loop is opened adds modes that are over at once, and no others."""
    _, _, loop, _, _ = case(Sampling(3e-3, 4.5e-3))
    opened, closed = loop.opened(), loop.closed
    more = len(opened.A) - len(closed)
    assert more == sum(loop.waiting) == 4
    wanted = np.concatenate([np.poly(closed), np.zeros(more)])
    np.testing.assert_allclose(np.poly(opened.closed), wanted, atol=1e-10)


def test_points_without_a_design_have_no_loop():
    model, controller = example("wind_tunnel")
    outcomes = Outcomes.all_ok((2, 4)).failing(np.eye(2, 4, dtype=bool), Outcome.EXCLUDED, lambda index: "mine")
    for loop in (
        sampled_lqr_loop(model, design_lqr_sampled(model, controller, Sampling(1e-3, 1e-3), outcomes)),
        emulated_lqr_loop(model, design_lqr(model, controller, outcomes), Sampling(1e-3, 1e-3)),
    ):
        ok = np.isfinite(loop.closed).all(axis=(-2, -1))
        np.testing.assert_array_equal(ok, outcomes.ok)
        assert np.isnan(loop.continuous.offset[~outcomes.ok]).all()


def test_what_is_no_coded_loop_is_refused():
    model, controller = example("wind_tunnel")
    loop, sampling = lqr_loop(model, design_lqr(model, controller)), Sampling(1e-3, 1e-3)
    integral = loop.states.index("int_a")

    def with_entry(field, *place):
        matrix = getattr(loop, field).copy()
        matrix[(..., *place)] = 1.0
        return replace(loop, **{field: matrix})

    for wrong, what in (
        (with_entry("B", integral, 0), "through the commands"),
        (with_entry("A", 1, integral), "through the commands"),
        (with_entry("E", 1, 0), "references act"),
        (with_entry("C", 0, integral), "between its samples"),
        (with_entry("F", 0, integral), "between its samples"),
        (with_entry("H", 0, 0), "rate of a command"),
    ):
        with pytest.raises(ValueError, match=what):
            coded_loop(wrong, sampling)
    with pytest.raises(ValueError, match="2 commands under way"):
        coded_loop(loop, sampling, np.zeros((2, 4, 2, 3)))
    late = design_lqr(model, replace(controller, delay_states=2), aileron=Actuator(delay=1e-3))
    with pytest.raises(ValueError, match="delay_states 0"):
        emulated_lqr_loop(model, late, sampling)


def test_outputs_that_are_rates_of_states():
    """``y = F x'`` is ``F (A x + B v)``: the accelerations, given as outputs."""
    model, controller = example("wind_tunnel")
    loop = lqr_loop(model, design_lqr(model, controller))
    F = np.zeros_like(loop.F)
    F[..., 0, 3] = 1.0
    coded = coded_loop(replace(loop, C=np.zeros_like(loop.C), F=F), Sampling(1e-3, 1e-3))
    np.testing.assert_array_equal(coded.C[..., 0, :], model.A[..., 3, :])
    np.testing.assert_array_equal(coded.D[..., 0, :], model.B[..., 3, :])
