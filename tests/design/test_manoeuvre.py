"""Manoeuvres against their own definition in time, and against the free system that is to give the same course."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from design.manoeuvre import Manoeuvre, doublet, ramp, rate_limited_step, recorded, sine, step

TIMES = np.linspace(0.0, 2.0, 41)


def some() -> list[Manoeuvre]:
    size = np.array([0.2, -0.1])
    return [
        step(size),
        rate_limited_step(size, 0.3),
        ramp(size),
        doublet(size, 0.4),
        sine(size, 7.0),
        recorded(np.array([0.0, 0.5, 0.5, 1.0]), np.array([[0.1, 0], [0.3, 1], [0, 1], [-0.2, 0.5]])),
    ]


@pytest.mark.parametrize("manoeuvre", some())
def test_the_free_system_runs_through_the_manoeuvre(manoeuvre: Manoeuvre) -> None:
    for k, begin in enumerate(manoeuvre.times):
        end = manoeuvre.times[k + 1] if k + 1 < len(manoeuvre.times) else begin + 1.0
        S, W, z = manoeuvre.free(k)
        for t in np.linspace(begin, end, 7)[:-1]:
            np.testing.assert_allclose(W @ expm(S * (t - begin)) @ z, manoeuvre.at(t), atol=1e-12)


@pytest.mark.parametrize("manoeuvre", some())
def test_ends_are_what_is_there_just_before_the_next_knot(manoeuvre: Manoeuvre) -> None:
    for k, knot in enumerate(manoeuvre.times[1:]):
        just_before = manoeuvre.at(knot - 1e-9) - manoeuvre.amplitude * np.sin(manoeuvre.omega * knot)
        np.testing.assert_allclose(manoeuvre.ends[k], just_before, atol=1e-7)
    np.testing.assert_allclose(manoeuvre.at(manoeuvre.times - 1e-12)[0], 0.0)
    after = manoeuvre.at(manoeuvre.times)
    before = manoeuvre.at(np.nextafter(manoeuvre.times, -1.0))
    np.testing.assert_allclose(manoeuvre.jumps, after - before, atol=1e-9)


def test_a_rate_limited_step_is_a_step_held_back_by_its_rate() -> None:
    size, rate = np.array([0.2, -0.1, 0.0]), 0.3
    course = rate_limited_step(size, rate).at(TIMES)
    np.testing.assert_allclose(course, np.clip(np.sign(size) * rate * TIMES[:, None], -np.abs(size), np.abs(size)))


def test_a_recorded_series_is_interpolated_and_held() -> None:
    times, series = np.array([0.0, 0.3, 1.1]), np.array([[0.0], [0.4], [-0.2]])
    np.testing.assert_allclose(recorded(times, series).at(TIMES)[:, 0], np.interp(TIMES, times, series[:, 0]))


def test_a_doublet_comes_back_to_trim() -> None:
    course = doublet(np.array([0.1]), 0.4)
    np.testing.assert_array_equal(
        course.at(np.array([0.0, 0.39, 0.4, 0.79, 0.8, 9.0]))[:, 0], [0.1, 0.1, -0.1, -0.1, 0, 0]
    )


@given(st.lists(st.floats(-1, 1), min_size=2, max_size=9))
def test_a_recorded_series_passes_through_its_points(series: list[float]) -> None:
    times = np.arange(len(series)) * 0.1
    np.testing.assert_allclose(recorded(times, np.array(series)[:, None]).at(times)[:, 0], series, atol=1e-15)


@pytest.mark.parametrize(
    "build",
    [
        lambda: rate_limited_step(np.ones(1), 0.0),
        lambda: doublet(np.ones(1), np.inf),
        lambda: sine(np.ones(1), -1.0),
        lambda: recorded(np.array([0.0, 1.0, 0.5]), np.zeros((3, 1))),
        lambda: recorded(np.array([0.0, 1.0, 1.0, 1.0]), np.zeros((4, 1))),
        lambda: recorded(np.array([0.1, 1.0]), np.zeros((2, 1))),
        lambda: recorded(np.array([0.0, 1.0]), np.array([[0.0], [np.nan]])),
        lambda: recorded(np.zeros(0), np.zeros((0, 1))),
        lambda: Manoeuvre(np.zeros(1), np.zeros((1, 1)), np.zeros((1, 2)), np.zeros(1)),
        lambda: Manoeuvre(np.zeros(1), np.zeros((1, 1)), np.zeros((1, 1)), np.ones(1), 0.0),
    ],
)
def test_what_is_no_manoeuvre_is_refused(build: object) -> None:
    with pytest.raises(ValueError, match=r"manoeuvre|series|sine|knots"):
        build()  # type: ignore[operator]
