"""Responses to manoeuvres against python-control, an ODE solver, frequency responses and dense samples."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from itertools import pairwise

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from design.delay.step_response import delayed_step_response
from design.delay.with_pade import without_delay
from design.manoeuvre import Manoeuvre, doublet, ramp, rate_limited_step, recorded, sine, step
from design.response.manoeuvre_response import manoeuvre_response
from design.response.step_response import step_response
from design.response.stretches import Mesh, Stretches
from tests.design.delay.delayed_loops import tab_only
from tests.design.step_loops import data_set_a, loop, random_stable, second_order, servo_and_aileron

SIZE = np.array([np.deg2rad(10.0)])


def series(seed: int, count: int, spacing: float) -> Manoeuvre:
    values = np.cumsum(np.random.default_rng(seed).normal(size=(count, 1)), axis=0) * 0.01
    return recorded(np.arange(count) * spacing, values)


def with_rates_seen(seed: int, count: int):
    """Random loops with outputs that take v', by H, and a feed-forward to them."""
    loops = random_stable(seed, count)
    rng = np.random.default_rng(seed + 1)
    return replace(loops, H=0.01 * rng.standard_normal(loops.D.shape))


MANOEUVRES = {
    "step": step(SIZE),
    "rate-limited step": rate_limited_step(SIZE, 0.9),
    "ramp": ramp(SIZE),
    "doublet": doublet(SIZE, 0.13),
    "sine": sine(SIZE, 30.0),
    "series": series(1, 60, 0.01),
    "uneven series": recorded(
        np.cumsum(np.r_[0.0, np.random.default_rng(2).uniform(1e-3, 0.05, 29)]), np.linspace(0, 1, 30)[:, None] ** 2
    ),
    "series that jumps": recorded(np.array([0, 0.2, 0.2, 0.5, 0.5]), np.array([[0.1], [0.3], [0.0], [-0.2], [0.05]])),
}


@pytest.mark.parametrize("name", MANOEUVRES)
@pytest.mark.parametrize("loops", [data_set_a(np.array([20.0, 50.0])), with_rates_seen(5, 2)])
def test_an_ode_solver_finds_the_same(loops, name: str) -> None:
    manoeuvre, duration, samples = MANOEUVRES[name], 0.6, 37
    found = manoeuvre_response(loops, manoeuvre, duration, samples)
    of_rates = loops.H @ loops.N
    for i in range(2):
        x, A, b = np.zeros(loops.A.shape[-1]), loops.closed[i], loops.reference_input[i]
        knots = [*manoeuvre.times[manoeuvre.times < duration], duration]
        for k, (begin, end) in enumerate(pairwise(knots)):

            def r(t, k=k, begin=begin):
                straight = manoeuvre.values[k] + manoeuvre.slopes[k] * (t - begin)
                return straight + manoeuvre.amplitude * np.sin(manoeuvre.omega * t)

            inside = found.time[i][(found.time[i] >= begin - 1e-12) & (found.time[i] < end - 1e-12)]
            inside = np.append(inside, end)

            def slope(t, y, r=r, A=A, b=b):
                return A @ y + b @ r(t)

            run = solve_ivp(slope, (begin, end), x, "DOP853", np.maximum(inside, begin), rtol=1e-12, atol=1e-15)
            for t, state in zip(inside[:-1], run.y.T, strict=False):
                sample = np.argmin(np.abs(found.time[i] - t))
                rate = manoeuvre.slopes[k] + manoeuvre.amplitude * manoeuvre.omega * np.cos(manoeuvre.omega * t)
                y = loops.closed_outputs[i] @ state + loops.reference_feedthrough[i] @ r(t) + of_rates[i] @ rate
                np.testing.assert_allclose(found.states[i, sample], state, atol=1e-10 * np.abs(run.y).max())
                np.testing.assert_allclose(
                    found.outputs[i, sample], y + loops.offset[i], atol=1e-9 * np.abs(found.outputs[i]).max(), rtol=1e-9
                )
            x = run.y[:, -1]


@pytest.mark.parametrize("name", ["ramp", "rate-limited step", "series", "series that jumps"])
def test_python_control_finds_the_same(name: str) -> None:
    """Its response is exact for straight lines between samples, so every knot is a sample and none may jump."""
    manoeuvre, duration, samples = MANOEUVRES[name], 0.6, 1201
    if name == "series that jumps":
        manoeuvre = recorded(np.array([0.0, 0.2, 0.5]), np.array([[0.0], [0.3], [-0.1]]))
    if name == "rate-limited step":
        manoeuvre = rate_limited_step(SIZE, SIZE[0] / 0.25)
    loops = data_set_a(np.array([20.0, 50.0]))
    found = manoeuvre_response(loops, manoeuvre, duration, samples)
    time = np.linspace(0.0, duration, samples)
    reference = manoeuvre.at(time)[:, 0]
    shift = reference[0]  # a first value is a jump, which python-control takes as we do
    assert shift == manoeuvre.values[0, 0]
    for i in range(2):
        system = ct.ss(
            loops.closed[i], loops.reference_input[i], loops.closed_outputs[i], loops.reference_feedthrough[i]
        )
        peer = ct.forced_response(system, time, reference).outputs.T + loops.offset[i]
        np.testing.assert_allclose(found.outputs[i], peer, atol=1e-9 * np.abs(peer).max())


def test_a_step_is_the_step_response() -> None:
    loops = random_stable(7, 3)
    found, peer = manoeuvre_response(loops, step(SIZE), 2.0, 301), step_response(loops, SIZE, 2.0, 301)
    for name in ("outputs", "states", "peaks", "final_outputs"):
        expected = getattr(peer, name)
        np.testing.assert_allclose(getattr(found, name), expected, atol=1e-11 * np.abs(expected).max())


def test_samples_at_knots_have_what_follows_them() -> None:
    loops = second_order(np.array([10.0, 20.0]), 0.5)
    found = manoeuvre_response(loops, doublet(SIZE, 0.1), 0.4, 5)
    torque = found.outputs[..., found.index("T_a")]
    omega = np.array([10.0, 20.0])
    np.testing.assert_allclose(found.references[0, :, 0], SIZE * [1, -1, 0, 0, 0], atol=1e-15)
    state = found.states
    expected = omega**2 * -SIZE - (omega**2 * state[:, 1, 0] + omega * state[:, 1, 1])
    np.testing.assert_allclose(torque[:, 1], expected, rtol=1e-12)


def test_a_sine_settles_to_the_frequency_response() -> None:
    loops, omega = with_rates_seen(11, 3), 13.0
    slowest = -np.linalg.eigvals(loops.closed).real.max()
    duration = 30.0 / slowest
    found = manoeuvre_response(loops, sine(SIZE, omega), duration, 2)
    jw = 1j * omega
    state = np.linalg.solve(jw * np.eye(5) - loops.closed, loops.reference_input.astype(complex))
    feed = loops.reference_feedthrough + jw * (loops.H @ loops.N)
    gain = (loops.closed_outputs @ state + feed)[..., 0] * SIZE
    expected = (gain * np.exp(jw * duration)).imag + loops.offset
    np.testing.assert_allclose(found.outputs[:, -1], expected, rtol=1e-9, atol=1e-9)
    assert np.isnan(found.final_outputs).all()


def test_a_series_is_the_sum_of_its_ramps() -> None:
    loops = replace(with_rates_seen(13, 2), offset=np.zeros((2, 6)))
    times, duration, samples = np.array([0.0, 0.1, 0.25, 0.4, 0.7]), 1.0, 101
    values = np.array([0.0, 0.3, -0.1, -0.1, 0.5])[:, None]
    found = manoeuvre_response(loops, recorded(times, values), duration, samples).outputs
    one = manoeuvre_response(loops, ramp(np.ones(1)), duration, samples).outputs
    slopes = np.append(np.diff(values[:, 0]) / np.diff(times), 0.0)
    total = np.zeros_like(one)
    for at, change in zip(times, np.diff(slopes, prepend=0.0), strict=True):
        begin = round(at * (samples - 1) / duration)
        total[:, begin:] += change * one[:, : samples - begin]
    np.testing.assert_allclose(found, total, atol=1e-11 * np.abs(total).max())


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_responses_add_up(seed: int, first: float, second: float) -> None:
    loops = replace(with_rates_seen(seed, 1), offset=np.zeros((1, 6)))
    a, b = (series(seed + k, 12, 0.03) for k in range(2))
    both = recorded(np.arange(12) * 0.03, first * a.values + second * b.values)
    each = [manoeuvre_response(loops, one, 0.5, 40).outputs for one in (a, b)]
    total = first * each[0] + second * each[1]
    found = manoeuvre_response(loops, both, 0.5, 40).outputs
    np.testing.assert_allclose(found, total, atol=1e-11 * (np.abs(each[0]).max() + np.abs(each[1]).max()))


@pytest.mark.parametrize("name", MANOEUVRES)
def test_a_grid_is_its_points(name: str) -> None:
    loops = data_set_a(np.array([[20.0, 30.0, 40.0], [25.0, 35.0, 50.0]]))
    grid = manoeuvre_response(loops, MANOEUVRES[name], 0.6, 61)
    for index in np.ndindex(2, 3):
        point = manoeuvre_response(loops.take(index), MANOEUVRES[name], 0.6, 61)
        for field in ("outputs", "references", "final_outputs"):
            expected = getattr(point, field)
            size = np.nanmax(np.abs(expected), initial=0.0)
            np.testing.assert_allclose(getattr(grid, field)[index], expected, rtol=1e-12, atol=1e-12 * size)
        np.testing.assert_allclose(grid.peaks[index], point.peaks, rtol=1e-8)
        np.testing.assert_allclose(grid.take(index).peaks, point.peaks, rtol=1e-8)


@pytest.mark.parametrize("name", MANOEUVRES)
@pytest.mark.parametrize(
    "loops", [data_set_a(np.array([50.0])), random_stable(31, 1), servo_and_aileron(2e3, 0.7, 15.0, 0.02).take(None)]
)
def test_peaks_are_those_of_dense_samples(loops, name: str) -> None:
    manoeuvre, duration = MANOEUVRES[name], 0.6
    found = manoeuvre_response(loops, manoeuvre, duration, 2).peaks[0]
    dense = np.abs(manoeuvre_response(loops, manoeuvre, duration, 60_001).outputs[0]).max(axis=0)
    assert np.all(found >= dense * (1.0 - 1e-10))
    # Nothing is invented: a dense sample is 5 us from any peak, and a limit just before a jump is one step from one.
    before = [knot for knot in manoeuvre.times[1:] if knot < duration]
    limits = [np.abs(manoeuvre_response(loops, manoeuvre, knot, 2).outputs[0, -1]) for knot in before]
    dense = np.max([dense, *limits], axis=0)
    fastest = np.abs(np.linalg.eigvals(loops.closed)).max()
    np.testing.assert_allclose(found, dense, rtol=1e-6 + 2.0 * (5e-6 * fastest) ** 2)


def test_a_lightly_damped_mode_and_a_long_sine_are_cut_into_stretches() -> None:
    loops = servo_and_aileron(300.0, 0.001, 2.0, 0.5)
    for manoeuvre in (step(SIZE), sine(SIZE, 200.0)):
        found = manoeuvre_response(loops, manoeuvre, 12.0, 2)
        assert len(found.driven.stretches.lengths) > 1
        dense = np.abs(manoeuvre_response(loops, manoeuvre, 12.0, 400_001).outputs).max(axis=0)
        np.testing.assert_allclose(found.peaks, dense, rtol=2e-5)
        assert np.all(found.peaks >= dense * (1.0 - 1e-9))


def test_what_settles_is_what_follows_the_last_knot_that_is_flown() -> None:
    loops = data_set_a(np.array([30.0]))
    at = loops.outputs.index("da")
    for duration, wanted in ((0.1, 1.0), (0.2, -1.0), (0.27, 0.0)):
        found = manoeuvre_response(loops, doublet(SIZE, 0.13), duration, 11)
        np.testing.assert_allclose(found.final_outputs[0, at], wanted * SIZE[0], atol=1e-12)
    assert np.isnan(manoeuvre_response(loops, ramp(SIZE), 1.0).final_outputs).all()
    held = manoeuvre_response(loops, rate_limited_step(SIZE, 1.0), 1.0).final_outputs
    np.testing.assert_allclose(held, step_response(loops, SIZE, 1.0).final_outputs, rtol=1e-12, atol=1e-12)


def test_what_an_unused_integral_holds_is_not_in_the_way_of_settling() -> None:
    """Where a state that nothing reads never comes to rest, outputs settle all the same."""
    one = loop(
        A=[[-5.0, 0.0], [1.0, 0.0]], B=[[1.0], [0.0]], E=[[0.0], [0.0]], K=[[0.0, 0.0]], N=[[1.0]],
        C=[[1.0, 0.0], [0.0, 1.0]], F=np.zeros((2, 2)), D=np.zeros((2, 1)), offset=[0.5, 0.0], outputs=("da", "int"),
    )  # fmt: skip
    found = manoeuvre_response(one, rate_limited_step(SIZE, 1.0), 0.3).final_outputs
    np.testing.assert_allclose(found[0], 0.5 + SIZE[0] / 5.0, rtol=1e-12)
    assert np.isnan(found[1])


def test_a_long_series_over_a_large_grid_stays_small() -> None:
    loops = data_set_a(np.linspace(20.0, 50.0, 100))
    manoeuvre = series(3, 4000, 0.005)
    found = manoeuvre_response(loops, manoeuvre, 20.0, 201)
    tracemalloc.start()
    peaks = found.peaks
    used = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # All its samples would be 100 points x 4000 stretches x 10 samples x 6 outputs: 190 MB.
    assert used < 120e6
    one = manoeuvre_response(loops.take(37), manoeuvre, 20.0, 40_001)
    np.testing.assert_allclose(peaks[37], np.abs(one.outputs).max(axis=0), rtol=1e-3)
    assert np.all(peaks[37] >= np.abs(one.outputs).max(axis=0) * (1.0 - 1e-10))


def test_times_that_are_even_but_for_rounding_are_even() -> None:
    loops = data_set_a(np.array([30.0]))
    times = np.arange(301) * 0.01
    values = np.sin(7.0 * times)[:, None]
    even, shaken = (recorded(t, values) for t in (times, np.round(times, 2) * (1.0 + 1e-16)))
    found = [manoeuvre_response(loops, one, 3.0, 100) for one in (even, shaken)]
    np.testing.assert_allclose(found[0].outputs, found[1].outputs, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(found[0].peaks, found[1].peaks, rtol=1e-10)


def test_a_delay_is_a_chain_of_states() -> None:
    loops = replace(data_set_a(np.array([20.0, 30.0])), delay=(0.004, 0.004))
    manoeuvre = MANOEUVRES["series"]
    found, chained = (manoeuvre_response(each, manoeuvre, 0.6) for each in (loops, without_delay(loops)))
    np.testing.assert_array_equal(found.outputs, chained.outputs)


def test_loops_with_delays_are_those_of_steps_one_after_the_other(plant_a) -> None:
    """A doublet of the exact delayed steps: angles far better than torques, and the largest torque too."""
    loops = tab_only(plant_a, "second_order", 0.005).take((0, slice(0, 3)))
    samples, at = 2001, 400
    one = delayed_step_response(loops, SIZE, 1.0, samples).outputs - loops.offset[..., None, :]
    expected = one.copy()
    expected[..., at:, :] -= 2.0 * one[..., : samples - at, :]
    expected[..., 2 * at :, :] += one[..., : samples - 2 * at, :]
    found = manoeuvre_response(loops, doublet(SIZE, 0.2), 1.0, samples).outputs - loops.offset[..., None, :]
    size = np.abs(expected).max(axis=-2)
    error = np.abs(found - expected).max(axis=-2)
    for name, limit in (("da", 1e-8), ("dt", 2e-5), ("dt_rate", 2e-3), ("T_t", 0.1)):
        k = loops.outputs.index(name)
        assert np.all(error[..., k] < limit * size[..., k]), name
    k = loops.outputs.index("T_t")
    np.testing.assert_allclose(np.abs(found[..., k]).max(axis=-1), size[..., k], rtol=1e-3)


def two_references(seed: int, count: int):
    """Random loops of two references, the second one ``r_t``."""
    loops = with_rates_seen(seed, count)
    rng = np.random.default_rng(seed + 2)
    return replace(
        loops,
        E=10.0 * rng.standard_normal((count, 5, 2)),
        N=rng.standard_normal((count, 2, 2)),
        references=("r_a", "r_t"),
    )


@pytest.mark.parametrize("sizes", [np.array([0.2, -0.1]), np.array([0.0, 0.3])])
def test_two_references_are_each_alone_and_added(sizes) -> None:
    loops = replace(two_references(17, 3), offset=np.zeros((3, 6)))
    courses = (rate_limited_step(sizes, 0.7), doublet(sizes, 0.1), sine(sizes, 9.0), ramp(sizes))
    for course in courses:
        found = manoeuvre_response(loops, course, 0.8, 81)
        total = np.zeros_like(found.outputs)
        for p in range(2):
            one = replace(loops, E=loops.E[..., p : p + 1], N=loops.N[..., p : p + 1], references=("r_a",))
            alone = Manoeuvre(
                course.times, course.values[:, p : p + 1], course.slopes[:, p : p + 1], course.amplitude[p : p + 1],
                course.omega,
            )  # fmt: skip
            response = manoeuvre_response(one, alone, 0.8, 81)
            total += response.outputs
            np.testing.assert_allclose(found.references[..., p], response.references[..., 0], atol=1e-13)
        np.testing.assert_allclose(found.outputs, total, atol=1e-11 * np.abs(total).max())


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from([1e-9, 0.01, 0.013, 0.2, 2.0]), st.integers(1, 40)), min_size=1, max_size=6))
def test_every_stretch_is_in_one_group_in_order(runs: list[tuple[float, int]]) -> None:
    knots = np.append(0.0, np.cumsum([length for length, count in runs for _ in range(count)]))
    poles = np.array([-3.0 + 40.0j, -3.0 - 40.0j, -900.0])
    stretches = Stretches.between(knots[:-1], float(knots[-1]), poles)
    groups = list(stretches.groups(poles, float(knots[-1])))
    assert [k for group in groups for k in range(group.first, group.last)] == list(range(len(stretches.lengths)))
    np.testing.assert_allclose(stretches.starts + stretches.lengths, np.append(stretches.starts[1:], knots[-1]))
    for group in groups:
        lengths = stretches.lengths[group.first : group.last]
        assert all(Mesh.resolving(poles, float(length)) == group.mesh for length in lengths)
        if group.alike:
            np.testing.assert_allclose(lengths, lengths[0], rtol=0.0, atol=1e-12 * knots[-1])


def test_unstable_loops_overflow_without_a_warning() -> None:
    loops = second_order(np.array([30.0, 30.0]), np.array([0.5, -0.9]))
    found = manoeuvre_response(loops, doublet(SIZE, 30.0), 100.0)
    assert np.isfinite(found.peaks[0]).all()
    assert not np.isfinite(found.peaks[1]).any()


def test_no_points_have_no_response() -> None:
    none = data_set_a(np.array([20.0, 30.0])).take(np.zeros(2, dtype=bool))
    found = manoeuvre_response(none, MANOEUVRES["series"], 0.5, 11)
    assert found.outputs.shape == (0, 11, 6)
    assert found.peaks.shape == (0, 6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"duration": 0.0}, "duration"),
        ({"duration": np.inf}, "duration"),
        ({"samples": 1}, "two samples"),
        ({"manoeuvre": step(np.ones(2))}, "1 references, the manoeuvre 2"),
    ],
)
def test_what_cannot_be_flown_is_refused(changes: dict, message: str) -> None:
    asked = {"manoeuvre": step(SIZE), "duration": 1.0, "samples": 11} | changes
    with pytest.raises(ValueError, match=message):
        manoeuvre_response(second_order(10.0, 0.5), **asked)
