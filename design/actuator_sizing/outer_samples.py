"""Torque, rate and acceleration that a manoeuvre asks for at the same time: the outermost of them, point by point.

Behind a gear a motor is asked for a part of its torque-speed line that is, with weights that are never negative, ::

    |a T + b w'| + c |w|            T torque, w rate, w' acceleration of the surface

(`design.actuator_sizing.selection`), where the gear's loss gives samples at which the motor drives and at which it
brakes weights of their own. So of each of the two kinds the samples that are farthest in directions (a, b, c) spread
over an octant stand for the whole response: the largest part that they ask for is within 0.3 % of that of the response,
and no sample asks for more than the response does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.response.actuator_signals import ACCELERATION, RATE, TORQUE, linear_rows, output_indices, torque_name
from design.response.driven import SampledSignals
from design.response.interpolant import Polynomials, windows
from design.response.manoeuvre_response import ManoeuvreResponse
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: Directions along an edge of the octant; with so many steps there are (STEPS + 1)(STEPS + 2) / 2 of them.
STEPS = 12
#: A stretch of curve may reach this part of the scale beyond its samples.
_BULGE = 0.01
#: How often an interval between two samples is halved where driving becomes braking.
_BISECTIONS = 30
#: Of so many samples one is looked at first.
_FEW = 8
#: Numbers that are worked on at a time.
LARGEST_PART = 1 << 20


@dataclass(frozen=True, eq=False)
class OuterSamples(GridArrays):
    """Samples (*G, S) of one actuator, zero where a point has fewer.

    Attributes
    ----------
    torque : total [N m]
    rate : of the surface [rad/s]
    acceleration : of the surface [rad/s^2]
    """

    torque: FloatArray
    rate: FloatArray
    acceleration: FloatArray


def outer_samples(response: ManoeuvreResponse, actuator: str, scale: FloatArray) -> OuterSamples:
    """The outermost torques, rates and accelerations of a response, between its samples too.

    Parameters
    ----------
    response : of loops that are finite at every point
    actuator : ``tab`` or ``aileron``
    scale : (*G, 3) torque, rate and acceleration that count as much as each other: the peaks. What is not positive and
        finite counts as 1

    Raises
    ------
    ValueError : no such actuator, or the loop lacks its torque, its rate or its deflection among the outputs
    """
    at = output_indices(response, (actuator,))
    response.index(torque_name(actuator))
    rows = linear_rows(response.rows, response.generator, at)[..., [TORQUE, RATE, ACCELERATION], :]
    size = np.where(np.isfinite(scale) & (scale > 0.0), scale, 1.0)
    outermost = _Outermost(max(1, int(np.prod(size.shape[:-1]))))
    with np.errstate(over="ignore", invalid="ignore"):
        for part in response.driven.signals(rows / size[..., None]):
            outermost.widen(part)
    grid = response.rows.shape[:-2]
    return OuterSamples(*(outermost.found[i].reshape(*grid, -1) * size[..., i, None] for i in range(3)))


def octant(steps: int) -> FloatArray:
    """(D, 3) unit directions spread over the octant where nothing is negative, its edges included."""
    i, j = np.divmod(np.arange((steps + 1) ** 2), steps + 1)
    inside = i + j <= steps
    corners = np.stack([i, j, steps - i - j], axis=-1)[inside]
    return np.asarray(corners / np.linalg.norm(corners, axis=-1, keepdims=True))


class _Outermost:
    """The outermost samples so far, of P points in D directions, driving and braking: found (3, P, 2, D), scaled."""

    def __init__(self, points: int) -> None:
        self.directions = octant(STEPS)
        self.reach = np.full((points, 2, len(self.directions)), -np.inf)
        self.found = np.zeros((3, *self.reach.shape))

    def widen(self, part: SampledSignals) -> None:
        """Take in more of the response."""
        points, samples = len(self.reach), part.values.shape[-1]
        signals = np.ascontiguousarray(np.moveaxis(part.values.reshape(points, 3, -1), 1, 0))
        braking = signals[0] * signals[1] < 0.0
        if np.any(np.isinf(self.reach)):  # some samples first, so that most of the others need not be looked at
            few = np.zeros(braking.shape, dtype=bool)
            few[:, ::_FEW] = True
            self._look(signals, braking, few, samples)
        # No direction is widened by a sample that is nearer than the nearest of all, but for what curves between.
        least = np.min(self.reach, axis=-1)
        floor = np.where(braking, least[:, 1:], least[:, :1]) - _BULGE
        near = np.sum(signals**2, axis=0) <= np.sign(floor) * floor**2
        self._look(signals, braking, ~near, samples)

    def _look(self, signals: FloatArray, braking: BoolArray, where: BoolArray, samples: int) -> None:
        """Look at some samples, a mask (P, n), of signals (3, P, n) in blocks of so many samples."""
        point, sample = np.nonzero(where)
        if not point.size:
            return
        group = 2 * point + braking[point, sample]
        order = np.argsort(group, kind="stable")
        place = (point * where.shape[-1] + sample)[order]
        group, begins, which = np.unique(group[order], return_index=True, return_inverse=True)
        flat = signals.reshape(3, -1)
        values = flat[:, place]
        several = max(1, LARGEST_PART // place.size)
        for low in range(0, len(self.directions), several):
            d = np.arange(low, min(low + several, len(self.directions)))
            a, c, b = self.directions[d].T[..., None]
            along = np.abs(a * values[0] + b * values[2]) + c * np.abs(values[1])
            best = np.maximum.reduceat(along, begins, axis=-1)
            first = np.where(along >= best[:, which], np.arange(place.size), place.size)
            first = np.minimum.reduceat(first, begins, axis=-1)
            ahead = best > self.reach.reshape(-1, len(self.directions))[group][:, d].T - _BULGE
            row, column = np.nonzero(ahead)
            if row.size:
                self._keep(d[row], group[column], place[first[row, column]], flat, samples)

    def _keep(self, d: IntArray, group: IntArray, place: IntArray, signals: FloatArray, samples: int) -> None:
        """Refine samples (E,) of directions and groups, and keep what goes farther than what is known."""
        row, at = np.divmod(place, samples)
        near = at.astype(float)
        curves = [windows(signal.reshape(-1, samples), row, near) for signal in signals]
        torque, rate, bend = signals[:, place]
        a, c, b = self.directions[d].T
        push = np.sign(a * torque + b * bend)
        factors = (a * push, c * np.sign(rate), b * push)
        smooth = sum(curve.coefficients * factor for curve, factor in zip(curves, factors, strict=True))
        whole = Polynomials(np.asarray(smooth), curves[0].origin)
        point, kind = np.divmod(group, 2)
        low, high = np.maximum(near - 1.0, 0.0), np.minimum(near + 1.0, samples - 1.0)
        summit = near
        for other in (low, high, whole.derivative().root(low, high, near)):
            summit = np.where(whole.value(other) > whole.value(summit), other, summit)
        summit = _of_kind(curves[0], curves[1], kind, near, summit)
        value = whole.value(summit)
        farther = np.flatnonzero(value > self.reach[point, kind, d])
        kept = point[farther], kind[farther], d[farther]
        self.reach[kept] = value[farther]
        for i, curve in enumerate(curves):
            self.found[(i, *kept)] = curve.value(summit)[farther]


def _of_kind(
    torque: Polynomials, rate: Polynomials, kind: IntArray, inside: FloatArray, wanted: FloatArray
) -> FloatArray:
    """(E,) places as near to the wanted ones as the motor goes on driving (0) or braking (1), as it does `inside`."""

    def other(place: FloatArray) -> BoolArray:
        return np.asarray((torque.value(place) * rate.value(place) < 0.0) != (kind == 1))

    left = other(wanted)
    if not np.any(left):
        return wanted
    near, far = np.where(left, inside, wanted), wanted
    for _ in range(_BISECTIONS):
        middle = 0.5 * (near + far)
        beyond = other(middle)
        near, far = np.where(beyond, near, middle), np.where(beyond, middle, far)
    return near
