"""Clouds of torque and rate against hulls of dense samples, and capabilities against brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from design.manoeuvre import doublet, recorded, sine, step
from design.response.manoeuvre_response import manoeuvre_response
from design.response.torque_speed import Capability, capability_used, torque_speed
from tests.design.step_loops import data_set_a, random_stable, second_order

SIZE = np.array([np.deg2rad(10.0)])
SERIES = recorded(np.arange(60) * 0.02, 0.1 * np.random.default_rng(1).normal(size=(60, 1)))
MANOEUVRES = {"step": step(SIZE), "doublet": doublet(SIZE, 0.2), "sine": sine(SIZE, 20.0), "series": SERIES}


def dense_pairs(response, letter):
    at = [response.index(f"T_{letter}"), response.index(f"d{letter}_rate")]
    return response.outputs[..., at].reshape(-1, 2)


def support(points, directions):
    return np.max(points @ directions.T, axis=0)


def _area(hull):
    """Of a polygon whose vertices run counter-clockwise."""
    ahead = np.roll(hull, -1, axis=0)
    return 0.5 * np.sum(hull[:, 0] * ahead[:, 1] - hull[:, 1] * ahead[:, 0])


@pytest.mark.parametrize("name", MANOEUVRES)
@pytest.mark.parametrize("loops", [data_set_a(np.array([[20.0, 30.0], [40.0, 50.0]])), random_stable(3, 4)])
def test_the_hull_is_that_of_dense_samples(loops, name: str) -> None:
    response = manoeuvre_response(loops, MANOEUVRES[name], 1.2, 20_001)
    for letter, actuator in zip("ta", ("tab", "aileron"), strict=True):
        found, dense = torque_speed(response, actuator), dense_pairs(response, letter)
        scale = np.abs(dense).max(axis=0)
        angle = np.linspace(0.0, 2.0 * np.pi, 721)
        directions = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        ours, theirs = (support(each / scale, directions) for each in (found.hull, dense))
        # No dense sample lies outside by more than the bulge between two samples of the mesh,
        assert np.all(ours >= theirs - 5e-4)
        # and none is invented: where nothing jumps, the dense hull is as large.
        if name == "sine":
            np.testing.assert_allclose(ours, theirs, atol=3e-4)
        hull = ConvexHull(found.hull / scale)
        np.testing.assert_allclose(hull.volume, _area(found.hull / scale), rtol=1e-9)
        np.testing.assert_array_equal(np.argmin(found.hull[:, 0]), 0)
        inside = support(found.cloud / scale, directions)
        assert np.all(inside <= ours + 3e-4)


def test_vertices_say_which_point_sets_them() -> None:
    loops = data_set_a(np.array([[20.0, 30.0], [40.0, 50.0]]))
    response = manoeuvre_response(loops, MANOEUVRES["sine"], 1.2, 20_001)
    found = torque_speed(response, "aileron")
    pairs = [dense_pairs(response.take(np.unravel_index(point, (2, 2))), "a") for point in range(4)]
    scale = np.abs(np.concatenate(pairs)).max(axis=0)
    for hull, points in ((found.hull, found.hull_points), (found.cloud, found.cloud_points)):
        for pair, point in zip(hull, points, strict=True):
            distances = [np.min(np.linalg.norm((each - pair) / scale, axis=-1)) for each in pairs]
            assert distances[point] < 1e-3


@pytest.mark.parametrize("name", MANOEUVRES)
def test_the_part_used_is_that_of_dense_samples(name: str) -> None:
    loops = data_set_a(np.array([20.0, 50.0]))
    response = manoeuvre_response(loops, MANOEUVRES[name], 1.2, 50_001)
    capability = Capability(torque=0.1, rate=3.0, stall_torque=0.15, no_load_rate=2.0)
    found = capability_used(response, "tab", capability)
    pairs = response.outputs[..., [response.index("T_t"), response.index("dt_rate")]]
    torque, rate = np.abs(np.moveaxis(pairs, -1, 0))
    expected = np.maximum(np.maximum(torque / 0.1, rate / 3.0), torque / 0.15 + rate / 2.0).max(axis=-1)
    assert np.all(found >= expected * (1.0 - 1e-9))
    np.testing.assert_allclose(found, expected, rtol=1e-4 if name != "series" else 1e-2)
    np.testing.assert_allclose(torque_speed(response, "tab").used(capability), found.max(), rtol=3e-4)


def test_second_order_in_closed_form() -> None:
    """With no damping torque and rate of a unit inertia run around an ellipse, whose line is touched where both are."""
    w = 20.0
    one = second_order(w, 0.0)
    response = manoeuvre_response(one, step(SIZE), 1.0)
    torque, rate = SIZE[0] * w**2, SIZE[0] * w
    assert capability_used(response, "aileron", Capability(torque=torque)) == pytest.approx(1.0, rel=1e-9)
    assert capability_used(response, "aileron", Capability(rate=rate)) == pytest.approx(1.0, rel=1e-8)
    line = Capability(stall_torque=torque, no_load_rate=rate)
    assert capability_used(response, "aileron", line) == pytest.approx(np.sqrt(2.0), rel=1e-8)
    np.testing.assert_allclose(np.hypot(*(torque_speed(response, "aileron").hull / [torque, rate]).T), 1.0, rtol=1e-8)


@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0))
def test_a_motor_scaled_by_what_is_used_would_just_do(stall: float, no_load: float) -> None:
    response = manoeuvre_response(second_order(15.0, 0.3), MANOEUVRES["doublet"], 0.5)
    used = float(capability_used(response, "aileron", Capability(stall_torque=stall, no_load_rate=no_load)))
    scaled = Capability(stall_torque=stall * used, no_load_rate=no_load * used)
    np.testing.assert_allclose(capability_used(response, "aileron", scaled), 1.0, rtol=1e-9)


def test_no_limit_is_never_used_up_and_nothing_moves_in_a_still_loop() -> None:
    one = second_order(10.0, 0.5)
    response = manoeuvre_response(one, step(0.0 * SIZE), 1.0)
    still = torque_speed(response, "aileron")
    np.testing.assert_array_equal(still.hull, [[0.0, 0.0]])
    assert still.used(Capability(torque=1.0)) == 0.0
    assert capability_used(response, "aileron", Capability()) == 0.0
    held = manoeuvre_response(second_order(10.0, 0.5, trim_torque=2.0), step(0.0 * SIZE), 1.0)
    np.testing.assert_allclose(torque_speed(held, "aileron").hull, [[2.0, 0.0]])


def test_points_that_overflow_are_left_out() -> None:
    loops = second_order(np.array([30.0, 30.0]), np.array([0.5, -0.9]))
    found = torque_speed(manoeuvre_response(loops, doublet(SIZE, 30.0), 100.0), "aileron")
    alone = torque_speed(manoeuvre_response(loops.take([0]), doublet(SIZE, 30.0), 100.0), "aileron")
    np.testing.assert_allclose(found.hull, alone.hull, rtol=1e-6, atol=1e-6)
    assert set(found.hull_points) == {0}
    lost = torque_speed(manoeuvre_response(loops.take([1]), doublet(SIZE, 30.0), 100.0), "aileron")
    assert len(lost.hull) == len(lost.cloud) == 0
    assert lost.used(Capability(torque=1.0)) == 0.0


def test_what_is_no_capability_and_no_torque_is_named() -> None:
    with pytest.raises(ValueError, match="positive"):
        Capability(torque=0.0)
    with pytest.raises(ValueError, match="stall torque and a rate"):
        Capability(stall_torque=1.0)
    loops = data_set_a(np.array([20.0]))
    kept = [i for i, name in enumerate(loops.outputs) if name != "T_t"]
    rows = {name: getattr(loops, name)[..., kept, :] for name in ("C", "F", "D", "H")}
    without = replace(loops, **rows, offset=loops.offset[..., kept], outputs=tuple(loops.outputs[i] for i in kept))
    with pytest.raises(ValueError, match="no output 'T_t'"):
        torque_speed(manoeuvre_response(without, MANOEUVRES["step"], 1.0), "tab")
