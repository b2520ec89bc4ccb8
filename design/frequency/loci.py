"""Root loci: closed-loop poles against the gain of one loop, over the whole grid at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.landmarks import Landmarks, asymptotes, breakaways, crossings, stationary_points
from design.frequency.locus_angles import along_branches, arrivals, departures
from design.frequency.locus_nodes import stretches
from design.frequency.locus_points import finite_points, without
from design.frequency.locus_poles import poles_along
from design.frequency.locus_samples import sampled
from design.loop import SisoLoop
from model.arrays import ComplexArray, FloatArray, GridArrays
from model.branches import continuous_branches


@dataclass(frozen=True, eq=False)
class RootLocus(GridArrays):
    """Poles of ``A - sign k b c``, that is of ``1 + sign k L(s) = 0``, against the gain k.

    Lists are nan padded. Crossings, breakaways, asymptotes and angles are those of gains on the side of the chosen
    gain (positive ones, also when it is 0), not only of those within `gains`; crossings and breakaways are sorted by
    the size of the gain. A delay in the loop has no part in the locus, which is that of the state matrices. Where an
    entry of the loop is not finite, everything is nan.

    Attributes
    ----------
    gains : (*G, k) from 0 away
    branches : (*G, n, k) [rad/s] each continuous in the gain; the first column holds the open loop's poles
    chosen_gain : (*G,) the gain at which the design flies this loop
    crossing_gain, crossing_omega : (*G, n) where poles reach the imaginary axis, and at which frequency
        [rad/s], 0 included. A gain of 0 is none: the open loop's own poles on the axis are not listed
    breakaway_gain, breakaway_point : (*G, 2n-2) where two poles meet [rad/s]; complex ones come in pairs
    asymptote_centroid : (*G,) where the asymptotes meet [rad/s], nan when b does not reach c
    asymptote_angles : (*G, n) their directions [rad], in (-pi, pi], rising; as many as poles exceed zeros
    departure_angles : (*G, n) directions [rad], in (-pi, pi], in which the branches leave the open loop's poles, in
        the order of the branches; nan for poles that the loop does not move. With gains of the caller's that do not
        start at 0 the order is that of the open loop's poles in `pole_order`
    zeros : (*G, n) finite zeros of L [rad/s], without those that poles which do not move cancel
    arrival_angles : (*G, n) directions [rad], in (-pi, pi], as seen from the zeros, from which branches arrive there
    sign : +1 for negative feedback, -1 for positive feedback (the 0-degree locus)
    """

    gains: FloatArray
    branches: ComplexArray
    chosen_gain: FloatArray
    crossing_gain: FloatArray
    crossing_omega: FloatArray
    breakaway_gain: FloatArray
    breakaway_point: ComplexArray
    asymptote_centroid: FloatArray
    asymptote_angles: FloatArray
    departure_angles: FloatArray
    zeros: ComplexArray
    arrival_angles: FloatArray
    sign: int


def root_locus(loop: SisoLoop, gains: FloatArray | None = None, count: int = 300) -> RootLocus:
    """Root locus of `loop`.

    Parameters
    ----------
    gains : (k,) or (*G, k), strictly monotonic; at least two. Without them: 0, then `count` - 1 gains from a
        hundredth of the chosen gain to a hundred times it (where that is 0, of a gain that moves the poles fairly).
        They lie so that neighbouring samples are about equally far apart, in parts of the distance from the origin,
        and closer where branches turn; the chosen gain and all crossings and breakaways in between are among them
    count : number of gains when they are not given, 0 included; at least ``6 n + 6``

    Raises
    ------
    ValueError : `gains` not strictly monotonic, or `count` too small
    """
    finite = finite_points(loop)
    if not np.all(finite):
        return root_locus(without(loop, finite), gains, count).take(finite).spread(finite)
    n = loop.A.shape[-1]
    A, b, c = loop.A.reshape(-1, n, n), loop.b.reshape(-1, n), loop.c.reshape(-1, n)
    chosen = loop.gain.reshape(-1)
    # Toward negative gains a locus is the one of the other sign.
    side = np.where(chosen < 0.0, -1.0, 1.0)
    landmarks = Landmarks.of(A, b * (loop.sign * side)[:, None], c, np.abs(chosen))
    stationary = stationary_points(landmarks)
    crossing, breakaway = crossings(landmarks), breakaways(landmarks, stationary)
    if gains is None:
        if count < 6 * n + 6:
            raise ValueError(f"a root locus of this order needs at least {6 * n + 6} gains, not {count}")
        between = stretches(landmarks, crossing, breakaway, stationary, chosen != 0.0, count)
        samples = sampled(landmarks, between, count)
        k, poles = side[:, None] * samples.gains, samples.poles
    else:
        k = _checked(np.broadcast_to(gains, (*loop.gain.shape, np.shape(gains)[-1]))).reshape(len(A), -1)
        poles = poles_along(A, loop.sign * b[:, :, None] * c[:, None, :], k)
    branches = continuous_branches(poles)
    centroid, asymptote = asymptotes(landmarks)
    departure = departures(landmarks)
    arrival = arrivals(landmarks, np.isnan(departure.angle))
    from_zero = (k[:, 0] == 0.0) & (k[:, 1] * side > 0.0)
    leaving = along_branches(departure, branches[:, :, 0], branches[:, :, 1], from_zero)
    grid = loop.gain.shape
    return RootLocus(
        gains=k.reshape(*grid, -1),
        branches=branches.reshape(*grid, n, -1),
        chosen_gain=loop.gain,
        crossing_gain=(side[:, None] * crossing.gain).reshape(*grid, n),
        crossing_omega=crossing.point.imag.reshape(*grid, n),
        breakaway_gain=(side[:, None] * breakaway.gain).reshape(*grid, 2 * n - 2),
        breakaway_point=breakaway.point.reshape(*grid, 2 * n - 2),
        asymptote_centroid=centroid.reshape(grid),
        asymptote_angles=asymptote.reshape(*grid, n),
        departure_angles=leaving.reshape(*grid, n),
        zeros=arrival.zero.reshape(*grid, n),
        arrival_angles=arrival.angle.reshape(*grid, n),
        sign=loop.sign,
    )


def _checked(gains: FloatArray) -> FloatArray:
    steps = np.diff(np.asarray(gains, dtype=float), axis=-1)
    if gains.shape[-1] < 2 or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError("gains of a root locus must be strictly monotonic, two at least")
    return gains
