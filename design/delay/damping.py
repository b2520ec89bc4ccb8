"""Stability and damping of loops with transport delays: counted, and for the least damping ratio proved.

Those poles of a loop with a delay that lie to the right of a vertical line are finitely many. But the damping ratio of
the others tends to zero: along the endless chains that a delay makes, the real part falls with the logarithm of the
frequency only. (``x' = -a x(t - 1)`` has its k-th pair near ``-log(2 pi k / a) + 2 pi k j``.) So "the least damping
ratio of the loop" needs a bound on what counts, and has it here in how fast a pole decays: `DECAY_PER_DELAY`.
"""

from __future__ import annotations

import numpy as np

from design.delay.characteristic import SHORTEST, Characteristic, characteristic, finite_points
from design.delay.newton import rightmost_first
from design.delay.starts import dense_starts, starts
from design.delay.winding import inside, roots_inside
from design.frequency.poles import damping_ratio, poles
from design.loop import Loop
from model.arrays import ComplexArray, FloatArray

#: A pole counts in the damping ratio while it loses no more than ``1 - exp(-2)``, 86 %, within the longest delay. Such
#: are all the poles of a loop whose delay is short; of the poles that a delay makes itself, those where ``|L|`` without
#: its delay is at least 0.14 there. What decays faster is gone before the loop has answered it once. As any such bound
#: it lets the least damping ratio jump where a pole crosses it.
DECAY_PER_DELAY = 2.0
#: How many poles beyond the number of states are looked for to begin with.
MORE = 6
#: Where that is not enough, how many times as many branches of the chains of a long delay are searched.
DENSITIES = (3, 12)
#: Damping ratios closer than this are not parted by a ray.
PARTED = 1e-6


def least_damping_ratio_delayed(loop: Loop) -> FloatArray:
    """Smallest damping ratio (*G,) of the closed-loop poles with ``Re s > -DECAY_PER_DELAY / longest delay``.

    Without a delay, of all poles; 1 where there is no such pole. Proved: the number of poles that are damped less
    than halfway to the next one is counted on a contour (`design.delay.winding`), and is the number that was found.

    Parameters
    ----------
    loop : over any grid

    Returns
    -------
    (*G,), nan where it is not proved: a matrix that is not finite, or poles so close together that rounding hides them

    Raises
    ------
    ValueError : a delay is negative or not finite
    """
    points = finite_points(loop)
    least = np.full(points.shape, np.nan)
    if max(loop.delay) <= SHORTEST:
        least[points] = damping_ratio(poles(loop.closed[points])).min(axis=-1)
    elif points.any():
        f = characteristic(loop, points)
        least[points] = np.concatenate([_proved(f.take(part)) for part in f.parts])
    return least


def unstable_poles(loop: Loop) -> FloatArray:
    """How many closed-loop poles (*G,) are in the right half plane, its edge included; nan when not settled.

    Counted on a contour alone, without looking for the poles. The edge is 1e-9 of the loop's fastest mode wide.

    Raises
    ------
    ValueError : a delay is negative or not finite
    """
    return _counted(loop, 0.0, 1.0)


def poles_damped_less(loop: Loop, least: float) -> FloatArray:
    """How many of the closed-loop poles that count (`DECAY_PER_DELAY`) have a damping ratio below `least` (*G,).

    Counted on a contour alone, without looking for the poles; nan when not settled, because one is on its edge.

    Parameters
    ----------
    loop : over any grid
    least : damping ratio, more than -1 and less than 1

    Raises
    ------
    ValueError : a delay is negative or not finite, or `least` is out of range
    """
    if not -1.0 < least < 1.0:
        raise ValueError(f"a damping ratio to count below must be between -1 and 1, is {least}")
    return _counted(loop, DECAY_PER_DELAY, least)


def _counted(loop: Loop, decay_per_delay: float, damping: float) -> FloatArray:
    """Number of poles (*G,) in a region of `roots_inside`."""
    points = finite_points(loop)
    count = np.full(points.shape, np.nan)
    if points.any():
        f = characteristic(loop, points)
        decay = _slowest(f) * (decay_per_delay / DECAY_PER_DELAY)
        each = [roots_inside(f.take(part), decay[part], np.full(decay[part].shape, damping)) for part in f.parts]
        count[points] = np.concatenate(each)
    return count


def _slowest(f: Characteristic) -> FloatArray:
    """Decay (N,) up to which poles count, in units of the scale; without a delay, one that no pole exceeds."""
    longest = f.input_delays.max(axis=-1, initial=0.0)
    return np.where(longest > 0.0, DECAY_PER_DELAY / np.where(longest > 0.0, longest, 1.0), 4.0)


def _proved(f: Characteristic) -> FloatArray:
    """Smallest damping ratio (N,), nan where it is not proved, searched for more densely where it is not at first."""
    width = f.order + MORE
    found = _least_damping(f, rightmost_first(f, starts(f, width)))
    for density in DENSITIES:
        again = np.isnan(found)
        if again.any():
            rest = f.take(again)
            found[again] = _least_damping(rest, rightmost_first(rest, dense_starts(rest, density * width)))
    return found


def _least_damping(f: Characteristic, roots: ComplexArray) -> FloatArray:
    """Smallest damping ratio (N,) of the roots (N, M) that count; nan where the contour has another number of them."""
    decay = _slowest(f)
    with np.errstate(invalid="ignore"):
        counted = roots.real > -decay[:, None]
        # The contour goes between those that count and the next ones.
        beyond = np.where(roots.real <= -decay[:, None], -roots.real, np.inf).min(axis=-1)
    edge = 0.5 * (decay + np.minimum(beyond, 2.0 * decay))
    ratio = np.where(counted, damping_ratio(np.where(counted, roots, -1.0)), 1.0)
    least = ratio.min(axis=-1)
    following = np.where(ratio > least[:, None] + PARTED, ratio, 1.0).min(axis=-1)
    ray = np.where(following > least + PARTED, 0.5 * (least + following), 1.0)
    settled = roots_inside(f, edge, ray) == inside(roots, edge, ray).sum(axis=-1)
    return np.where(settled, least, np.nan)
