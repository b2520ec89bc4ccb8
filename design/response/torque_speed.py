"""Torque and speed together: what a manoeuvre asks of an actuator over the envelope, and whether a motor has it.

A motor that gives the peak torque and the peak rate need not give both at once. So the pairs (torque, rate) of the
whole response at all points of the grid are looked at as a cloud in a plane, of which the convex hull matters: what a
motor can do is convex, and holds the cloud when it holds the hull.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from design.response.actuator_signals import RATE, TORQUE, output_indices, torque_name
from design.response.driven import SampledSignals
from design.response.interpolant import windows
from design.response.knot_peaks import largest_between_knots
from design.response.manoeuvre_response import ManoeuvreResponse
from model.arrays import BoolArray, FloatArray, IntArray

#: Directions in which the hull reaches as far as the continuous response does.
DIRECTIONS = 180
#: Sectors of the plane, of which the outermost sample is kept.
SECTORS = 360
#: A stretch of curve may reach this part of the largest torque and rate beyond its samples.
_BULGE = 0.01
#: Vertices nearer than this to each other, as parts of the largest torque and rate, are one: decimals.
_DECIMALS = 10


@dataclass(frozen=True)
class Capability:
    """What a motor can do, in both directions and driving as well as held back; None sets no limit.

    A rectangle has torque and rate; the line of a motor at full voltage leads from its stall torque, at rest, to its
    rate without load; all four are a trapezoid.

    Attributes
    ----------
    torque : largest torque [N m]
    rate : largest rate [rad/s]
    stall_torque : where the line meets the axis of torque [N m]
    no_load_rate : where it meets that of rate [rad/s]

    Raises
    ------
    ValueError : a value that is not positive, or a line with one end
    """

    torque: float | None = None
    rate: float | None = None
    stall_torque: float | None = None
    no_load_rate: float | None = None

    def __post_init__(self) -> None:
        given = [each for each in (self.torque, self.rate, self.stall_torque, self.no_load_rate) if each is not None]
        if not all(each > 0.0 for each in given):
            raise ValueError("what a motor can do must be positive")
        if (self.stall_torque is None) != (self.no_load_rate is None):
            raise ValueError("a line needs both a stall torque and a rate without load")

    @property
    def weights(self) -> FloatArray:
        """(k, 2) of torque and rate: they are within the capability when no ``|w T + v rate|`` exceeds 1."""
        found = []
        if self.torque is not None:
            found.append([1.0 / self.torque, 0.0])
        if self.rate is not None:
            found.append([0.0, 1.0 / self.rate])
        if self.stall_torque is not None and self.no_load_rate is not None:
            # |T| / stall + |rate| / no load is the larger magnitude of sum and difference.
            found += [[1.0 / self.stall_torque, sign / self.no_load_rate] for sign in (1.0, -1.0)]
        return np.array(found).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class TorqueSpeed:
    """The cloud of one actuator over the grid, as far as it lies outside.

    Attributes
    ----------
    hull : (h, 2) vertices of the convex hull, torque [N m] and rate [rad/s], counter-clockwise, the one of least torque
        first: of samples that resolve the response, and of the farthest points between them in each of `DIRECTIONS`;
        the hull of the continuous response lies beyond by no more than 5e-4 of the largest torque and rate
    hull_points : (h,) flat index of the grid point that sets each vertex
    cloud : (c, 2) the outermost sample of each of `SECTORS` about the origin, by angle
    cloud_points : (c,) their grid points
    """

    hull: FloatArray
    hull_points: IntArray
    cloud: FloatArray
    cloud_points: IntArray

    def used(self, capability: Capability) -> float:
        """Largest part of a capability that the hull asks for; more than 1 is more than there is."""
        return float(np.max(np.abs(self.hull @ capability.weights.T), initial=0.0))


def capability_used(response: ManoeuvreResponse, actuator: str, capability: Capability) -> FloatArray:
    """Largest part of a capability that the manoeuvre asks for, (*G,), between samples too: 1 is all there is.

    The headroom is what is left of 1; a motor scaled by this number in torque and rate alike would just do.

    Raises
    ------
    ValueError : no such actuator, or the loop lacks its torque, its rate or its deflection among the outputs
    """
    rows = capability.weights @ _rows(response, actuator)
    with np.errstate(over="ignore", invalid="ignore"):
        peaks = largest_between_knots(response.driven.signals(rows), rows.shape[:-1])
    return np.asarray(np.max(peaks, axis=-1, initial=0.0))


def torque_speed(response: ManoeuvreResponse, actuator: str) -> TorqueSpeed:
    """Cloud of torque and rate of an actuator over the response and the grid; points that are not finite are left out.

    Raises
    ------
    ValueError : no such actuator, or the loop lacks its torque, its rate or its deflection among the outputs
    """
    rows = _rows(response, actuator)
    with np.errstate(over="ignore", invalid="ignore"):
        peaks = largest_between_knots(response.driven.signals(rows), rows.shape[:-1])
    finite = np.asarray(np.isfinite(peaks).all(axis=-1))
    scale = np.max(peaks[finite], axis=0, initial=0.0) if np.any(finite) else np.zeros(2)
    scale = np.where(scale > 0.0, scale, 1.0)
    outline, sectors = _Outline(), _Sectors()
    for part in response.driven.signals(rows / scale[:, None]):
        curves = _Curves.of(part, finite)
        outline.widen(curves)
        sectors.widen(curves)
    hull = outline.hull
    cloud = np.flatnonzero(sectors.radius >= 0.0)
    return TorqueSpeed(
        hull[:, :2] * scale, hull[:, 2].astype(np.int64), sectors.pairs[cloud] * scale, sectors.points[cloud]
    )


def _rows(response: ManoeuvreResponse, actuator: str) -> FloatArray:
    """(*G, 2, N) of torque and rate."""
    at = output_indices(response, (actuator,))[0]
    response.index(torque_name(actuator))
    return response.rows[..., at[[TORQUE, RATE]], :]


@dataclass(frozen=True, eq=False)
class _Curves:
    """Blocks of even samples: torque and rate (R, m+1), scaled, of the grid points (R,)."""

    torque: FloatArray
    rate: FloatArray
    points: IntArray

    @classmethod
    def of(cls, part: SampledSignals, finite: BoolArray) -> _Curves:
        *_, signals, count, blocks, samples = part.values.shape
        values = part.values.reshape(-1, signals, count * blocks, samples)
        index = np.flatnonzero(finite)
        torque, rate = np.moveaxis(values[index], 1, 0).reshape(2, -1, samples)
        return cls(torque, rate, np.repeat(index, count * blocks))

    def take(self, rows: IntArray) -> _Curves:
        """Some of the blocks."""
        return _Curves(self.torque[rows], self.rate[rows], self.points[rows])


class _Outline:
    """The hull of the curves so far, vertices (torque, rate, grid point), and how far it reaches in some directions."""

    def __init__(self) -> None:
        angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
        self.directions = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        self.reach = np.full(DIRECTIONS, -np.inf)
        self.hull = np.zeros((0, 3))

    def widen(self, curves: _Curves) -> None:
        """Take in more curves."""
        radius = np.sqrt(np.max(curves.torque**2 + curves.rate**2, axis=-1, initial=0.0))
        # No direction is widened by a curve that stays within the nearest of all.
        curves = curves.take(np.flatnonzero(radius + _BULGE >= np.min(self.reach)))
        if not len(curves.points):
            return
        summits = [self._farthest(curves, i) for i in range(DIRECTIONS)]
        points = np.repeat(curves.points, curves.torque.shape[-1])
        samples = np.stack([curves.torque.reshape(-1), curves.rate.reshape(-1), points], axis=-1)
        outer = np.concatenate([self.hull, *summits])
        try:
            samples = samples[ConvexHull(samples[:, :2].astype(np.float64)).vertices]
        except (QhullError, ValueError):  # on a line, or fewer than three: its ends are the farthest in some direction
            samples = samples[:0]
        self.hull = _convex(np.concatenate([outer, samples]))

    def _farthest(self, curves: _Curves, i: int) -> FloatArray:
        """(1, 3) or, where these curves go no farther than others did in direction i, (0, 3)."""
        c, s = self.directions[i]
        along = c * curves.torque + s * curves.rate
        tops = np.max(along, axis=-1)
        rows = np.flatnonzero(tops >= max(float(np.max(tops)), self.reach[i]) - _BULGE)
        if not rows.size:
            return np.zeros((0, 3))
        at = np.argmax(along[rows], axis=-1).astype(float)
        place = _summit(along, rows, at)
        value = windows(along, rows, at).value(place)
        k = int(np.argmax(value))
        if value[k] <= self.reach[i]:
            return np.zeros((0, 3))
        self.reach[i] = value[k]
        one = rows[k : k + 1], at[k : k + 1]
        pair = [windows(each, *one).value(place[k : k + 1])[0] for each in (curves.torque, curves.rate)]
        return np.array([[*pair, curves.points[rows[k]]]])


def _summit(signal: FloatArray, row: IntArray, at: FloatArray) -> FloatArray:
    """(E,) places of the maxima near samples `at` of rows, within a sample and within the block."""
    low, high = np.maximum(at - 1.0, 0.0), np.minimum(at + 1.0, signal.shape[-1] - 1.0)
    curve = windows(signal, row, at)
    place = curve.derivative().root(low, high, at)
    return np.where(curve.value(place) > curve.value(at), place, at)


class _Sectors:
    """The outermost sample so far in each sector, by angle: its radius, pair and grid point."""

    def __init__(self) -> None:
        self.radius = np.full(SECTORS, -1.0)
        self.pairs = np.zeros((SECTORS, 2))
        self.points = np.zeros(SECTORS, dtype=np.int64)

    def widen(self, curves: _Curves) -> None:
        """Take in more curves."""
        torque, rate = curves.torque.reshape(-1), curves.rate.reshape(-1)
        radius = np.hypot(torque, rate)
        sector = np.floor((np.arctan2(rate, torque) / (2.0 * np.pi) % 1.0) * SECTORS).astype(np.int64) % SECTORS
        before = self.radius.copy()
        np.maximum.at(self.radius, sector, radius)
        new = np.flatnonzero((radius == self.radius[sector]) & (radius > before[sector]))
        self.pairs[sector[new]] = np.stack([torque[new], rate[new]], axis=-1)
        self.points[sector[new]] = curves.points[new // curves.torque.shape[-1]]


def _convex(points: FloatArray) -> FloatArray:
    """(h, 3) vertices of the convex hull of points (k, 3) by their first two columns (Andrew's monotone chain)."""
    _, first = np.unique(np.round(points[:, :2], _DECIMALS), axis=0, return_index=True)
    rising = list(points[first])
    if len(rising) < 3:
        return np.array(rising).reshape(-1, 3)
    half = [_lower_chain(rising), _lower_chain(rising[::-1])]
    return np.array([*half[0][:-1], *half[1][:-1]])


def _lower_chain(points: list[FloatArray]) -> list[FloatArray]:
    """The points that a string below them, from the first to the last, touches and turns at."""
    chain: list[FloatArray] = []
    for point in points:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0.0:
            chain.pop()
        chain.append(point)
    return chain


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
