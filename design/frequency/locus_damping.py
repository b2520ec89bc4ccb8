"""Gains that place closed-loop poles on a ray of constant damping ratio, and how far the gain may go before they do.

On the ray ``s = w e^(j phi)``, ``cos phi = -zeta``, the gain ``-1 / L(s)`` is real where ``Im(num(s) conj d(s))``, a
polynomial in w, is zero. What hidden poles have in common with zeros is cancelled first: an integral that the loop
does not feed back would make the polynomial vanish at the origin to rounding, with any gain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.landmarks import Landmarks, crossings, in_range, response_beside_poles, value_beside
from design.frequency.locus_angles import departures, finite_zeros, first_markov
from design.frequency.locus_points import finite_points, without
from design.frequency.poles import damping_ratio as damping_ratio_of
from design.frequency.polynomials import product, roots
from design.loop import SisoLoop
from model.arrays import BoolArray, ComplexArray, FloatArray, Floats, GridArrays

#: A root of the polynomial is worth a Newton step if its imaginary part is below this part of it.
PLAUSIBLE = 1e-3
#: Newton steps from there, and the largest last one in parts of the frequency.
STEPS, SETTLED = 3, 1e-7
#: A gain is kept if the closed loop has a pole this near to the point, in parts of the frequency, and with a damping
#: ratio this near to the one asked for.
NEAR, EXACT = 1e-6, 1e-7
#: Coefficients below this part of the terms that they are the difference of are rounding.
ROUNDING = 1e-13
#: Where between two edges the damping is looked at, in parts of the ratio of the gains; and of the lowest below it.
PLACES = np.array([0.1, 0.5, 0.9])
#: And beyond the highest edge, in multiples of it.
BEYOND = np.array([1.1, 3.0, 100.0])


@dataclass(frozen=True, eq=False)
class DampingGains(GridArrays):
    """Where poles of a locus have a damping ratio, on the side of the chosen gain (positive gains when it is 0).

    Poles that the loop does not move have no part in any of this. A delay in the loop has none either. Where an entry
    of the loop is not finite, everything is nan.

    Attributes
    ----------
    damping_ratio : (*G,) the one asked for
    gains : (*G, 2n-2) that put a pole on the ray, rising in size, nan padded
    natural_frequency : (*G, 2n-2) [rad/s] of that pole
    least_damping_ratio : (*G,) at the chosen gain; nan when no pole moves
    lowest_gain, largest_gain : (*G,) ends of the largest interval of gains about the chosen one in which no moving
        pole has less damping than asked for. Next to either end, beyond it, one has; at the end itself a pole lies on
        the ray, or at the origin. 0 and infinity where there is no end; nan where the chosen gain itself does not do
    """

    damping_ratio: FloatArray
    gains: FloatArray
    natural_frequency: FloatArray
    least_damping_ratio: FloatArray
    lowest_gain: FloatArray
    largest_gain: FloatArray


def gain_at_damping(loop: SisoLoop, damping_ratio: Floats) -> DampingGains:
    """Gains of `loop` at which a closed-loop pole has this damping ratio, each of them checked by eigenvalues.

    Parameters
    ----------
    damping_ratio : one, or (*G,), between -1 and 1; 0 is the imaginary axis

    Raises
    ------
    ValueError : `damping_ratio` not between -1 and 1
    """
    finite = finite_points(loop)
    if not np.all(finite):
        return gain_at_damping(without(loop, finite), damping_ratio).take(finite).spread(finite)
    n = loop.A.shape[-1]
    grid = loop.gain.shape
    zeta = np.broadcast_to(np.asarray(damping_ratio, dtype=float), grid).reshape(-1)
    if not np.all(np.abs(zeta) < 1.0):
        raise ValueError("a damping ratio of a root locus must lie between -1 and 1")
    A, b, c = loop.A.reshape(-1, n, n), loop.b.reshape(-1, n), loop.c.reshape(-1, n)
    chosen = loop.gain.reshape(-1)
    side = np.where(chosen < 0.0, -1.0, 1.0)
    landmarks = Landmarks.of(A, b * (loop.sign * side)[:, None], c, np.abs(chosen))
    hidden = np.isnan(departures(landmarks).angle)
    k, omega = _on_the_ray(landmarks, hidden, zeta)
    flown = np.abs(chosen)
    damping = _damping(_moving_poles(landmarks, hidden, flown[:, None])[:, 0])
    least = np.where(np.isnan(damping), np.inf, damping).min(axis=-1)
    lowest, largest = _interval(landmarks, hidden, zeta, k, flown)
    return DampingGains(
        damping_ratio=zeta.reshape(grid),
        gains=(side[:, None] * k).reshape(*grid, -1),
        natural_frequency=(landmarks.scale[:, None] * omega).reshape(*grid, -1),
        least_damping_ratio=np.where(np.isinf(least), np.nan, least).reshape(grid),
        lowest_gain=(side * lowest).reshape(grid),
        largest_gain=(side * largest).reshape(grid),
    )


def _on_the_ray(landmarks: Landmarks, hidden: BoolArray, zeta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gains > 0, rising, and frequencies (N, 2n-2) in units of the scale, nan padded."""
    n = landmarks.poles.shape[-1]
    direction = -zeta + 1j * np.sqrt(1.0 - zeta**2)
    omega = roots(_reality(landmarks, hidden, zeta))[:, : max(2 * n - 2, 0)]
    with np.errstate(invalid="ignore"):
        worth = (omega.real > landmarks.origin[:, None]) & (np.abs(omega.imag) <= PLAUSIBLE * omega.real)
    rows = np.nonzero(worth)[0]
    w, ray = omega[worth].real[:, None], direction[rows, None]
    A, b, c = landmarks.A[rows], landmarks.b[rows], landmarks.c[rows]
    for _ in range(STEPS):
        at = response_beside_poles(A, b, c, w * ray)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step = np.where(at.value.imag == 0.0, 0.0, at.value.imag / (at.slope * ray).imag)
            gain = (-1.0 / value_beside(at, -step * ray)).real
        near = np.abs(step) <= PLAUSIBLE * w
        w = np.where(near, w - step, w)
    k, frequency = (np.full(omega.shape, np.nan) for _ in range(2))
    k[worth] = np.where(np.abs(step) <= SETTLED * w, gain, np.nan)[:, 0]
    frequency[worth] = w[:, 0]
    k = np.where(in_range(k, landmarks), k, np.nan)
    # Proof: the closed loop has a pole there.
    poles = _moving_poles(landmarks, hidden, k)
    point = frequency * direction[:, None]
    with np.errstate(invalid="ignore"):
        close = np.abs(poles - point[..., None]) <= NEAR * frequency[..., None]
        right = np.abs(_damping(poles) - zeta[:, None, None]) <= EXACT
    k = np.where((close & right).any(axis=-1), k, np.nan)
    order = np.argsort(k, axis=-1, stable=True)
    k, frequency = (np.take_along_axis(v, order, axis=-1) for v in (k, frequency))
    # A root that comes twice is one.
    k[:, 1:][(np.diff(k) <= EXACT * k[:, 1:]) & (np.abs(np.diff(frequency)) <= NEAR * frequency[:, 1:])] = np.nan
    order = np.argsort(k, axis=-1, stable=True)
    k, frequency = (np.take_along_axis(v, order, axis=-1) for v in (k, frequency))
    return k, np.where(np.isnan(k), np.nan, frequency)


def _reality(landmarks: Landmarks, hidden: BoolArray, zeta: FloatArray) -> FloatArray:
    """Coefficients (N, 2n+1) of ``Im(num(s) conj d(s))`` in w, ``s = w e^(j phi)``, of what the loop moves."""
    n = landmarks.poles.shape[-1]
    numerator = first_markov(landmarks)[:, None] * _with_roots(finite_zeros(landmarks, hidden))
    denominator = _with_roots(np.where(hidden, np.nan, landmarks.poles))
    turn = np.arange(n, -1, -1) * np.arccos(-zeta)[:, None]
    across, along = np.sin(turn), np.cos(turn)
    value = product(numerator * across, denominator * along) - product(numerator * along, denominator * across)
    # Exactly zero where it is so but for rounding: an asymptote in the direction of the ray, for one.
    terms = product(np.abs(numerator), np.abs(denominator))
    return np.where(np.abs(value) <= ROUNDING * terms, 0.0, value)


def _with_roots(points: ComplexArray) -> FloatArray:
    """Monic polynomials (N, n+1) with the roots (N, n), as many as are not nan, in conjugate pairs."""
    there = ~np.isnan(points)
    result = np.zeros((points.shape[0], points.shape[1] + 1), dtype=complex)
    result[:, -1] = 1.0
    for root, is_one in zip(points.T, there.T, strict=True):
        longer = np.where(is_one, root, 0.0)[:, None] * -result
        longer[:, :-1] += result[:, 1:]
        result = np.where(is_one[:, None], longer, result)
    return result.real


def _moving_poles(landmarks: Landmarks, hidden: BoolArray, k: FloatArray) -> ComplexArray:
    """Closed-loop poles (N, M, n) at the gains (N, M); nan for those that do not move, and where the gain is nan."""
    N, M = k.shape
    poles = np.full((N, M, landmarks.poles.shape[-1]), complex(np.nan, np.nan))
    there = ~np.isnan(k)
    rows = np.nonzero(there)[0]
    closed = landmarks.A[rows] - k[there][:, None, None] * landmarks.b[rows][:, :, None] * landmarks.c[rows][:, None, :]
    values = np.linalg.eigvals(closed).astype(complex)
    for i in np.flatnonzero(hidden.any(axis=0)):
        distance = np.abs(values - landmarks.poles[rows, i][:, None])
        nearest = np.where(np.isnan(distance), np.inf, distance).argmin(axis=-1)
        those = np.flatnonzero(hidden[rows, i])
        values[those, nearest[those]] = complex(np.nan, np.nan)
    poles[there] = values
    return poles


def _interval(
    landmarks: Landmarks, hidden: BoolArray, zeta: FloatArray, k: FloatArray, flown: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Ends (N,) of the interval of gains about `flown` (N,) in which all moving poles are damped enough.

    The least damping ratio changes sides only where a pole lies on the ray, or where one passes the origin.
    """
    crossing = crossings(landmarks)
    edges = _rising(np.concatenate([k, np.where(crossing.point == 0.0, crossing.gain, np.nan)], axis=-1))
    N = len(edges)
    count = (~np.isnan(edges)).sum(axis=-1)
    low = np.concatenate([np.zeros((N, 1)), edges], axis=-1)
    high = np.concatenate([edges, np.full((N, 1), np.nan)], axis=-1)
    high[np.arange(N), count] = np.inf
    bad = _damping(_moving_poles(landmarks, hidden, _inside(low, high, landmarks.reference))) < zeta[:, None, None]
    good = ~bad.any(axis=-1).reshape(*low.shape, -1).any(axis=-1) & ~np.isnan(low)
    # A gain on an edge belongs to either side.
    flown = flown[:, None]
    below, above = ((edges < bound).sum(axis=-1) for bound in (flown * (1.0 - EXACT), flown * (1.0 + EXACT)))
    rows = np.arange(N)
    first = last = np.where(good[rows, below], below, above)
    does = good[rows, first]
    for _ in range(edges.shape[-1]):
        first = first - ((first > 0) & good[rows, np.maximum(first - 1, 0)])
        last = last + ((last < count) & good[rows, np.minimum(last + 1, count)])
    return np.where(does, low[rows, first], np.nan), np.where(does, high[rows, last], np.nan)


def _inside(low: FloatArray, high: FloatArray, reference: FloatArray) -> FloatArray:
    """A few gains within each interval (N, M), one after the other; nan in those whose ends are nan."""
    low, high = low[..., None], high[..., None]
    finite = np.isfinite(high) & (low > 0.0)
    between = low * np.where(finite, high / np.where(finite, low, 1.0), 1.0) ** PLACES
    beyond = np.where(low > 0.0, low, reference[:, None, None]) * BEYOND
    result = np.where(finite, between, np.where(np.isinf(high), beyond, high * PLACES))
    return np.asarray(result.reshape(len(low), -1))


def _rising(gain: FloatArray) -> FloatArray:
    """Gains (N, M) in rising order, each once, nan at the end."""
    gain = np.sort(gain, axis=-1)
    gain[:, 1:][np.diff(gain) <= EXACT * gain[:, 1:]] = np.nan
    return np.sort(gain, axis=-1)


def _damping(poles: ComplexArray) -> FloatArray:
    return np.where(np.isnan(poles), np.nan, damping_ratio_of(poles))
