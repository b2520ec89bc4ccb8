"""Root loci: closed-loop poles against the gain of one loop, over the whole grid at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.landmarks import Landmarks, asymptotes, breakaways, crossings
from design.frequency.locus_poles import poles_along
from design.loop import SisoLoop
from model.arrays import ComplexArray, FloatArray, GridArrays
from model.branches import continuous_branches

#: Without gains of the caller's, a locus runs from this part of the chosen gain to its inverse times it.
DECADES_EACH_WAY = 2.0


@dataclass(frozen=True, eq=False)
class RootLocus(GridArrays):
    """Poles of ``A - sign k b c``, that is of ``1 + sign k L(s) = 0``, against the gain k.

    Lists are nan padded. Crossings and breakaways are those at gains on the side of the chosen gain (positive
    ones, also when it is 0), not only those within `gains`, sorted by the size of the gain. A delay in the loop
    has no part in the locus, which is that of the state matrices.

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
    sign: int


def root_locus(loop: SisoLoop, gains: FloatArray | None = None, count: int = 300) -> RootLocus:
    """Root locus of `loop`.

    Parameters
    ----------
    loop : arrays finite
    gains : (k,) or (*G, k), strictly monotonic; at least two. Without them: 0, then `count` - 1 gains from
        a hundredth of the chosen gain to a hundred times it (where that is 0, of a gain that moves the poles
        fairly), in even ratios, with the chosen gain and all crossings and breakaways in between among them
    count : number of gains when they are not given, 0 included; at least ``6 n + 6``

    Raises
    ------
    ValueError : `gains` not strictly monotonic, or `count` too small
    numpy.linalg.LinAlgError : an entry is not finite
    """
    n = loop.A.shape[-1]
    A, b, c = loop.A.reshape(-1, n, n), loop.b.reshape(-1, n), loop.c.reshape(-1, n)
    chosen = loop.gain.reshape(-1)
    # Toward negative gains a locus is the one of the other sign.
    side = np.where(chosen < 0.0, -1.0, 1.0)
    landmarks = Landmarks.of(A, b * (loop.sign * side)[:, None], c, np.abs(chosen))
    crossing, breakaway = crossings(landmarks), breakaways(landmarks)
    centroid, angles = asymptotes(landmarks)
    if gains is None:
        special = np.concatenate([crossing.gain, breakaway.gain], axis=-1)
        sampled = side[:, None] * _samples(landmarks.reference, special, chosen != 0.0, count)
    else:
        sampled = _checked(np.broadcast_to(gains, (*loop.gain.shape, np.shape(gains)[-1]))).reshape(len(A), -1)
    branches = continuous_branches(poles_along(A, loop.sign * b[:, :, None] * c[:, None, :], sampled))
    grid = loop.gain.shape
    return RootLocus(
        gains=sampled.reshape(*grid, -1),
        branches=branches.reshape(*grid, n, -1),
        chosen_gain=loop.gain,
        crossing_gain=(side[:, None] * crossing.gain).reshape(*grid, -1),
        crossing_omega=crossing.point.imag.reshape(*grid, -1),
        breakaway_gain=(side[:, None] * breakaway.gain).reshape(*grid, 2 * n - 2),
        breakaway_point=breakaway.point.reshape(*grid, 2 * n - 2),
        asymptote_centroid=centroid.reshape(grid),
        asymptote_angles=angles.reshape(*grid, n),
        sign=loop.sign,
    )


def _checked(gains: FloatArray) -> FloatArray:
    steps = np.diff(np.asarray(gains, dtype=float), axis=-1)
    if gains.shape[-1] < 2 or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError("gains of a root locus must be strictly monotonic, two at least")
    return gains


def _samples(centre: FloatArray, special: FloatArray, include: FloatArray, count: int) -> FloatArray:
    """Gains (N, count), rising from 0: even ratios about `centre`, and the `special` ones (N, S) within.

    The number of special gains differs from point to point; places that are left over go to gains between
    the even ones.
    """
    places = special.shape[-1] + 1
    # An even number of even ratios, so that none of them falls on the centre.
    places += (count - 1 - places) % 2
    even = count - 1 - places
    if even < places:
        raise ValueError(f"a root locus of this order needs at least {2 * places + 2} gains, not {count}")
    lowest, span = centre * 10.0**-DECADES_EACH_WAY, 10.0 ** (2.0 * DECADES_EACH_WAY)
    spare = (np.floor((np.arange(places) + 0.5) / places * (even - 1)) + 1.0 / 3.0) / (even - 1)
    regular = lowest[:, None] * span ** np.linspace(0.0, 1.0, even)
    filling = lowest[:, None] * span**spare
    wanted = np.full_like(filling, np.nan)
    wanted[:, 0] = np.where(include, centre, np.nan)
    wanted[:, 1 : 1 + special.shape[-1]] = _distinct(centre, special, lowest, lowest * span)
    inserted = np.where(np.isnan(wanted), filling, wanted)
    zero = np.zeros((len(centre), 1))
    return np.sort(np.concatenate([zero, regular, inserted], axis=-1), axis=-1)


def _distinct(centre: FloatArray, special: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Special gains (N, S) inside the range, without repetitions; the others nan."""
    special = np.sort(special, axis=-1)
    before = np.concatenate([centre[:, None] * 0.0, special[:, :-1]], axis=-1)
    near = 1e-9 * special
    repeated = (np.abs(special - before) <= near) | (np.abs(special - centre[:, None]) <= near)
    inside = (special > low[:, None]) & (special < high[:, None])
    return np.where(inside & ~repeated, special, np.nan)
