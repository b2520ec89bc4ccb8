"""Loops that have a delay already: margins with it, against a search over frequency and the argument principle."""

from dataclasses import fields, replace

import numpy as np
import pytest

from design.frequency.margins import margins
from tests.design.siso_loops import of_transfer, same, stabilised


def ratio_of(decibels):
    return 10.0 ** (decibels / 20.0)


def right_half_plane_poles(loop, delay):
    """Poles of a single loop with its delay in the right half-plane, by the argument principle."""
    n = len(loop.b)
    w = np.concatenate([[0.0], np.geomspace(1e-4, 1e5, 200001)])
    b = loop.sign * loop.gain * loop.b
    pole, closed = np.linalg.eigvals(loop.A), np.linalg.eigvals(loop.A - np.outer(b, loop.c))
    s = 1j * w[:, None]
    denominator, both = (np.prod((s - p) / (s + 1.0), axis=-1) for p in (pole, closed))
    F = denominator + (both - denominator) * np.exp(-1j * w * delay)
    angle = np.unwrap(np.angle(F))
    assert np.abs(np.diff(angle)).max() < 1.0, "the contour is too coarse"
    assert n == len(pole)
    return round(-(angle[-1] - angle[0]) / np.pi)


@pytest.mark.parametrize("order", [2, 4])
def test_delay_margin_is_the_edge_of_stability(order):
    loop = stabilised(12, order, seed=40 + order)
    found = margins(loop)
    for i in np.flatnonzero(np.isfinite(found.delay_margin)):
        point, margin = loop.take(i), float(found.delay_margin[i])
        assert right_half_plane_poles(point, 0.999 * margin) == 0
        assert right_half_plane_poles(point, 1.001 * margin) == 2
        for part in (0.3, 0.7):
            assert right_half_plane_poles(point, part * margin) == 0


def test_integrator_with_delay_in_closed_form():
    """``k exp(-s h) / s``: phase pi/2 - k h, gain pi / (2 k h), delay pi / (2 k) - h."""
    k, h = 4.0, 0.15
    found = margins(of_transfer([1.0], [1.0, 0.0], gain=k, delay=h))
    np.testing.assert_allclose(found.phase_margin, np.pi / 2 - k * h, rtol=1e-12)
    np.testing.assert_allclose(found.crossover, k, rtol=1e-12)
    np.testing.assert_allclose(ratio_of(found.gain_margin_up_db), np.pi / (2 * k * h), rtol=1e-9)
    np.testing.assert_allclose(found.delay_margin, np.pi / (2 * k) - h, rtol=1e-12)
    assert found.gain_margin_down_db == -np.inf
    # All later turns: ratio (2 i + 1/2) pi / (k h) at (2 i + 1/2) pi / h.
    i = np.arange(16)
    np.testing.assert_allclose(found.gain_omega, (2 * i + 0.5) * np.pi / h, rtol=1e-9)
    np.testing.assert_allclose(found.gain_ratio, (2 * i + 0.5) * np.pi / (k * h), rtol=1e-9)


@pytest.mark.parametrize("delay", [0.02, 0.3, 1.5])
def test_delayed_loops_equal_a_search_over_frequency(delay):
    loop = stabilised(25, 4, seed=100, delay=delay)
    found = margins(loop)
    plain = margins(replace(loop, delay=0.0))
    w = np.geomspace(1e-4, 1e4, 100001)
    for i in range(25):
        point = loop.take(i)
        stable = right_half_plane_poles(point, delay) == 0
        assert stable == (not np.isnan(found.disk_margin[i]))
        if not stable:
            continue
        pole, V = np.linalg.eig(point.closed())
        T = ((point.c @ V) * np.linalg.solve(V, point.b.astype(complex)) / (1j * w[:, None] - pole)).sum(-1)
        L = T / (1.0 - T) * np.exp(-1j * w * delay)
        k = np.flatnonzero((L.imag[1:] * L.imag[:-1] < 0.0) & (L.real[1:] < 0.0))
        part = L.imag[k] / (L.imag[k] - L.imag[k + 1])
        ratio = -1.0 / (L.real[k] + part * (L.real[k + 1] - L.real[k]))
        ratio = np.append(ratio, 1.0 - (1.0 / T[0]).real)
        for ours, edge in (
            (ratio_of(found.gain_margin_up_db[i]), np.min(ratio[ratio > 1.0], initial=np.inf)),
            (ratio_of(found.gain_margin_down_db[i]), np.max(ratio[(ratio > 0.0) & (ratio < 1.0)], initial=0.0)),
        ):
            if 2e-3 < edge < 500.0 or 2e-3 < ours < 500.0:
                np.testing.assert_allclose(ours, edge, rtol=1e-3)
        np.testing.assert_allclose(found.sensitivity_peak[i], np.abs(1.0 / (1.0 + L)).max(), rtol=2e-3)
        assert found.sensitivity_peak[i] >= np.abs(1.0 / (1.0 + L)).max() * (1.0 - 1e-9)
        np.testing.assert_allclose(2.0 / found.disk_margin[i], np.abs((1.0 - L) / (1.0 + L)).max(), rtol=2e-3)
        if np.isfinite(plain.delay_margin[i]) and plain.delay_margin[i] > delay:
            np.testing.assert_allclose(found.delay_margin[i], plain.delay_margin[i] - delay, rtol=1e-9)


def test_long_delays_are_searched_finely():
    """Many turns of the delay, narrow peaks: nothing on a fine grid is higher, or nearer, than what was found."""
    loop = stabilised(60, 5, seed=13, delay=5.0)
    found = margins(loop)
    stable = np.flatnonzero(~np.isnan(found.disk_margin))
    assert stable.size > 20
    w = np.unique(np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 20001), np.linspace(0.0, 60.0, 20001)]))
    for i in stable:
        pole, V = np.linalg.eig(loop.closed()[i])
        T = ((loop.c[i] @ V) * np.linalg.solve(V, loop.b[i].astype(complex)) / (1j * w[:, None] - pole)).sum(-1)
        turn = np.exp(-5.0j * w)
        T = turn * T / (1.0 + (turn - 1.0) * T)
        assert found.sensitivity_peak[i] > np.abs(1.0 - T).max() * (1.0 - 1e-8)
        assert 2.0 / found.disk_margin[i] > np.abs(1.0 - 2.0 * T).max() * (1.0 - 1e-8)
        k = np.flatnonzero((T.imag[1:] * T.imag[:-1] < 0.0) & (np.abs(np.diff(w)) < 0.01))
        low, high = ((1.0 - 1.0 / T[k + j]).real for j in (0, 1))
        nearest = np.minimum(np.abs(np.log(np.abs(low))), np.abs(np.log(np.abs(high))))
        nearest = np.min(nearest[(low > 0.0) & (high > 0.0)], initial=np.log(900.0))
        ours = np.log(10.0) / 20.0 * min(found.gain_margin_up_db[i], -found.gain_margin_down_db[i])
        assert ours < nearest + 0.02


def test_a_delay_may_stabilise():
    """``s^2 - 0.02 s + 1 - 0.2 exp(-s)`` is stable, without its delay it is not."""
    loop = of_transfer([-0.2], [1.0, -0.02, 1.0], delay=1.0)
    assert np.isnan(margins(replace(loop, delay=0.0)).phase_margin)
    assert right_half_plane_poles(loop, 1.0) == 0
    found = margins(loop)
    assert np.isfinite(found.phase_margin)
    margin = float(found.delay_margin)
    assert right_half_plane_poles(loop, 1.0 + 0.999 * margin) == 0
    assert right_half_plane_poles(loop, 1.0 + 1.001 * margin) == 2


def test_a_vanishing_delay_changes_nothing():
    loop = stabilised(20, 5, seed=110)
    plain, delayed = margins(loop), margins(replace(loop, delay=1e-9))
    near = np.abs(plain.gain_margin_up_db) < 59.0
    same(delayed.gain_margin_up_db[near], plain.gain_margin_up_db[near], 1e-5)
    near = np.abs(plain.gain_margin_down_db) < 119.0
    same(delayed.gain_margin_down_db[near], plain.gain_margin_down_db[near], 1e-5)
    for name in ("phase_margin", "crossover", "delay_margin", "disk_margin", "sensitivity_peak"):
        same(getattr(delayed, name), getattr(plain, name), 1e-6)


def test_many_points_with_a_delay_are_searched_in_blocks(monkeypatch):
    loop = stabilised(11, 4, seed=150, delay=0.2)
    whole = margins(loop)
    monkeypatch.setattr("design.frequency.margins.BLOCK", 4)
    parts = margins(loop)
    for field in fields(whole):
        same(getattr(parts, field.name), getattr(whole, field.name), 1e-12)
