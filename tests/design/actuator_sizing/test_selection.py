"""Candidates against requirements: reflections, headrooms by hand, and the best gear ratio by brute force."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.actuator_sizing.load_cases import system_torque
from design.actuator_sizing.requirement import SurfaceRequirement
from design.actuator_sizing.selection import (
    Candidate,
    Headroom,
    RatioRange,
    at_surface,
    best_ratio,
    fit,
    headroom,
    select,
)

MOTOR = Candidate("m", 2.0, 300.0, 0.8, 90.0, 1e-5, RatioRange(1.0, 200.0), 0.9)


def random_requirement(seed, grid=(3,), samples=40, loads=2):
    rng = np.random.default_rng(seed)
    torque, rate = 20.0 * rng.standard_normal((*grid, samples)), 4.0 * rng.standard_normal((*grid, samples))
    acceleration = 300.0 * rng.standard_normal((*grid, samples))
    weight = rng.uniform(0.1, 1.0, (*grid, samples))
    return SurfaceRequirement.of_samples(torque, rate, acceleration, weight, 15.0 * rng.standard_normal((*grid, loads)))


def test_a_gear_multiplies_torque_divides_rate_and_squares_on_inertia():
    seen = at_surface(MOTOR, 10.0)
    np.testing.assert_allclose(
        [seen.stall_torque, seen.continuous_torque, seen.no_load_rate, seen.inertia], [20.0, 8.0, 30.0, 1e-3]
    )


def test_headrooms_by_hand():
    required = SurfaceRequirement.of_samples(
        np.array([10.0, -5.0]), np.array([0.0, 6.0]), static_torque=np.array([-18.0])
    )
    found = headroom(replace(MOTOR, inertia=0.0), 10.0, required)  # 20 N m, 30 rad/s, 8 N m, 90 W at the surface
    np.testing.assert_allclose(found.torque, 1.0 - 10.0 / 0.9 / 20.0)
    np.testing.assert_allclose(found.static, 1.0 - 18.0 / 0.9 / 20.0)
    np.testing.assert_allclose(found.rate, 0.8)
    np.testing.assert_allclose(found.continuous, 1.0 - np.sqrt(62.5) / 0.9 / 8.0)
    np.testing.assert_allclose(found.power, 1.0 - 30.0 / 0.9 / 90.0)
    # held at rest 10 / 0.9 of 20; driven by the surface 5 * 0.9 of 20 at a fifth of the rate
    np.testing.assert_allclose(found.line, 1.0 - max(10.0 / 0.9 / 20.0, 4.5 / 20.0 + 0.2))
    np.testing.assert_allclose(found.least, found.continuous)


def test_the_rotor_is_accelerated_at_the_motor():
    """The line against the motor's own equations, sample by sample; peaks bound what the samples need."""
    required, ratio = random_requirement(1, (4,)), 12.0
    T, w, a = required.torque, required.rate, required.acceleration
    motor = T * np.where(T * w >= 0.0, 1.0 / 0.9, 0.9) / ratio + 1e-5 * ratio * a
    found = headroom(MOTOR, ratio, required)
    np.testing.assert_allclose(1.0 - found.line, (np.abs(motor) / 2.0 + np.abs(w) * ratio / 300.0).max(axis=-1))
    assert np.all(1.0 - found.torque >= np.abs(motor).max(axis=-1) / 2.0)
    assert np.all(1.0 - found.power >= np.abs(motor * w * ratio).max(axis=-1) / 90.0)


def brute(candidate, required, ratios):
    def least(ratio):
        found = headroom(candidate, ratio, required)
        return min(float(getattr(found, field.name).min()) for field in fields(Headroom))

    return max(least(ratio) for ratio in ratios)


@given(
    seed=st.integers(0, 10_000),
    log_inertia=st.floats(-7.0, -2.0),
    efficiency=st.floats(0.4, 1.0),
    log_rate=st.floats(1.0, 4.0),
    log_torque=st.floats(-2.0, 2.0),
)
@settings(max_examples=60, deadline=None)
def test_no_other_ratio_leaves_more(seed, log_inertia, efficiency, log_rate, log_torque):
    candidate = replace(
        MOTOR, inertia=10.0**log_inertia, efficiency=efficiency, no_load_rate=10.0**log_rate,
        stall_torque=10.0**log_torque, power=np.inf if seed % 2 else 90.0,
    )  # fmt: skip
    required = random_requirement(seed)
    chosen = best_ratio(candidate, required)
    assert 1.0 <= chosen <= 200.0
    assert brute(candidate, required, [chosen]) >= brute(candidate, required, np.geomspace(1.0, 200.0, 400)) - 1e-12


def test_the_best_ratio_of_one_load_is_where_torque_and_rate_are_alike():
    """Peak torque T and rate w at different times: headrooms 1 - T/(n T_s) and 1 - n w/w_0 meet."""
    required = SurfaceRequirement.of_samples(np.array([20.0, 0.0]), np.array([0.0, 5.0]))
    candidate = Candidate("m", 2.0, 300.0, gear_ratio=RatioRange(1.0, 1e3))
    np.testing.assert_allclose(best_ratio(candidate, required), np.sqrt(20.0 / 2.0 * 300.0 / 5.0), rtol=1e-9)


def test_the_ends_of_a_range_and_ratios_that_are_given():
    required = SurfaceRequirement.of_samples(np.array([20.0, 0.0]), np.array([0.0, 5.0]))
    motor = Candidate("m", 2.0, 300.0)
    best = np.sqrt(600.0)
    assert best_ratio(replace(motor, gear_ratio=RatioRange(1.0, 10.0)), required) == 10.0
    assert best_ratio(replace(motor, gear_ratio=RatioRange(50.0, 90.0)), required) == 50.0
    assert best_ratio(replace(motor, gear_ratio=(5.0, 0.9 * best, 1.2 * best, 80.0)), required) == 0.9 * best
    assert best_ratio(replace(motor, gear_ratio=7.0), required) == 7.0


def test_select_names_the_best_and_what_sets_it():
    required = SurfaceRequirement.of_samples(
        np.array([[1.0, -1.0], [8.0, 2.0]]), np.array([[2.0, 0.1], [0.2, 1.0]]),
        static_torque=system_torque(np.array([[2.0], [9.0]])),
    )  # fmt: skip
    weak, strong = Candidate("weak", 10.0, 20.0), Candidate("strong", 40.0, 20.0, continuous_torque=30.0)
    fits = select((weak, strong), required)
    assert [each.candidate.name for each in fits] == ["strong", "weak"]
    assert [each.enough for each in fits] == [True, False]
    assert (fits[1].capability, fits[1].point) == ("static", 1)
    np.testing.assert_allclose(fits[1].least, 1.0 - 11.25 / 10.0)


def test_points_that_are_unknown_ask_for_nothing_and_infinite_ones_for_too_much():
    required = random_requirement(5, (2, 2))
    unknown = SurfaceRequirement(
        *(np.where(np.arange(4).reshape((2, 2) + (1,) * (each.ndim - 2)) == 3, np.nan, each)
          for each in (getattr(required, field.name) for field in fields(required)))
    )  # fmt: skip
    flat = SurfaceRequirement(
        *(getattr(required, field.name).reshape(4, *getattr(required, field.name).shape[2:])[:3]
          for field in fields(required))
    )  # fmt: skip
    found, known = fit(MOTOR, unknown), fit(MOTOR, flat)
    assert (found.ratio, found.least, found.capability, found.point) == (
        known.ratio, known.least, known.capability, known.point,
    )  # fmt: skip
    assert np.isnan(found.headroom.least[1, 1])
    nothing = fit(MOTOR, unknown.take((slice(1, 2), slice(1, 2))))
    assert np.isnan(nothing.least)
    assert (nothing.capability, nothing.point, nothing.enough) == (None, None, False)
    endless = replace(flat, peak_torque=np.full(3, np.inf))
    assert fit(MOTOR, endless).least == -np.inf
    jumping = replace(flat, peak_acceleration=np.full(3, np.inf))
    assert fit(replace(MOTOR, inertia=0.0), jumping).least == fit(replace(MOTOR, inertia=0.0), flat).least
    order = select((replace(MOTOR, name="b", power=1e-3), MOTOR), flat)
    assert [each.candidate.name for each in order] == ["m", "b"]


def test_a_grid_gives_the_numbers_of_its_points():
    required = random_requirement(9, (2, 3))
    whole = headroom(MOTOR, 9.0, required)
    for index in np.ndindex(2, 3):
        one = headroom(MOTOR, 9.0, required.take(index))
        for field in fields(Headroom):
            np.testing.assert_allclose(getattr(one, field.name), getattr(whole, field.name)[index], rtol=1e-12)


def test_what_makes_no_sense_is_refused():
    for change, words in (
        ({"stall_torque": 0.0}, "stall_torque"), ({"no_load_rate": np.nan}, "no_load_rate"), ({"power": -1.0}, "power"),
        ({"inertia": -1.0}, "inertia"), ({"efficiency": 1.1}, "efficiency"), ({"gear_ratio": ()}, "gear ratios"),
        ({"gear_ratio": (2.0, 1.0)}, "gear ratios"), ({"gear_ratio": RatioRange(0.0, 1.0)}, "gear ratios"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=words):
            replace(MOTOR, **change)
    with pytest.raises(ValueError, match="must be"):
        SurfaceRequirement.of_samples(np.ones(3), np.ones(2))
    with pytest.raises(ValueError, match="must be"):
        SurfaceRequirement.of_samples(np.ones(3), np.ones(3), np.ones(2))
    with pytest.raises(ValueError, match="weights"):
        SurfaceRequirement.of_samples(np.ones(3), np.ones(3), weight=np.zeros(3))
    with pytest.raises(ValueError, match="over one grid"):
        replace(random_requirement(1), static_torque=np.zeros((2, 1)))
