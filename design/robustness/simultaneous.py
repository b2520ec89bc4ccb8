"""How much both inputs of a loop may change at once: simultaneous disk margins and singular values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.robustness.delayed import delayed_peaks
from design.robustness.diagonal import smallest_perturbation
from design.robustness.gains import BALANCED, COMPLEMENTARY, EVERY, SENSITIVITY, SIGMA_S, SIGMA_T
from design.robustness.input_loop import InputLoop
from design.robustness.peaks import Peaks, peaks
from model.arrays import BoolArray, ComplexArray, FloatArray, Floats, GridArrays

#: Points that are worked on together: what they need stays in the cache.
BLOCK, DELAYED_BLOCK = 64, 8


@dataclass(frozen=True, eq=False)
class SimultaneousMargins(GridArrays):
    """What a loop ``L = K (sI - A)^-1 B`` with two inputs stands when both change at once, independently.

    The changes are complex factors, one at each input of the plant. At points whose closed loop is not stable
    everything is nan (`proved` is False); so it is where a delay is too long for the loop to be searched.

    Attributes
    ----------
    disk_margin : (*G,) m in (0, 2]: stable for all factors ``(1 + d_i/2) / (1 - d_i/2)``, ``|d_i| < m`` (no skew);
        ``2 / max mu(S - T)`` (Seiler, Packard and Gahinet 2020), mu for diagonal complex perturbations
    disk_omega : (*G,) frequency of that maximum [rad/s]; inf where it is the limit at infinite frequency, m = 2
    worst_factors : (*G, 2) factors of that disk, ``|d_i| <= m``, with which the closed loop has a pole at
        ``j disk_omega``; nan where only an infinite factor would do
    gain_margin_up_db, gain_margin_down_db : (*G,) gains of both inputs may change at once, each between these
        [dB], ``-+ 20 lg (1 + m/2) / (1 - m/2)``; inf for m = 2
    phase_margin : (*G,) so may their phases, each by this much [rad], ``2 atan(m/2)``
    sensitivity_margin : (*G,) ``1 / max mu(S)``, at most 1: stable for all factors ``1 / (1 - d_i)``, ``|d_i|`` less
    complementary_margin : (*G,) ``1 / max mu(T)``: stable for all factors ``1 + d_i``, ``|d_i|`` less; inf if T is 0
    return_difference : (*G,) smallest singular value of ``I + L`` over frequency, at most 1
    return_difference_omega : (*G,) its frequency [rad/s], inf where it is the limit
    sensitivity_peak, sensitivity_omega : (*G,) ``max sigma(S) = 1 / return_difference``, and where [rad/s]
    complementary_peak, complementary_omega : (*G,) ``max sigma(T)``, and where [rad/s]
    proved : (*G,) that none of the maxima is higher at a frequency that was not looked at; not with delays
    """

    disk_margin: FloatArray
    disk_omega: FloatArray
    worst_factors: ComplexArray
    gain_margin_up_db: FloatArray
    gain_margin_down_db: FloatArray
    phase_margin: FloatArray
    sensitivity_margin: FloatArray
    complementary_margin: FloatArray
    return_difference: FloatArray
    return_difference_omega: FloatArray
    sensitivity_peak: FloatArray
    sensitivity_omega: FloatArray
    complementary_peak: FloatArray
    complementary_omega: FloatArray
    proved: BoolArray


def simultaneous_margins(
    A: FloatArray, B: FloatArray, K: FloatArray, delays: Floats | None = None
) -> SimultaneousMargins:
    """Margins against simultaneous changes at both inputs of ``x' = A x + B u``, ``u = -K x``.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, 2), K (*G, 2, n) : points with an entry that is not finite get nan
    delays : (2,) or (*G, 2) transport delay of each input [s]; treated exactly, but the frequencies are then searched
        on a grid, and the peaks refined, without a proof

    Raises
    ------
    ValueError : the shapes do not fit, or a delay is negative or not finite
    """
    loop, grid = as_loop(A, B, K, delays)
    late = np.any(loop.delay > 0.0, axis=-1)
    # Delays may stabilise what is not stable without.
    regular = off_axis(loop) & (late | (loop.poles.real.max(axis=-1) < 0.0))
    return margins_of(peaks_of(loop, regular), grid)


def as_loop(A: FloatArray, B: FloatArray, K: FloatArray, delays: Floats | None) -> tuple[InputLoop, tuple[int, ...]]:
    """The loops of all points in one row, parameters as of `simultaneous_margins`, and the grid's shape.

    Points with an entry that is not finite get nothing but poles at the origin.
    """
    A, B, K, grid = stacked(A, B, K)
    delay = np.zeros(2) if delays is None else np.asarray(delays, dtype=float)
    if not np.all(np.isfinite(delay) & (delay >= 0.0)):
        raise ValueError("delays must be finite and not negative")
    delay = np.broadcast_to(delay, (*grid, 2)).reshape(-1, 2)
    closed, _ = closed_or_zero(A, B, K)
    return InputLoop(closed, B, K, np.zeros((len(A), 2, 2)), np.linalg.eigvals(closed).astype(complex), delay), grid


def off_axis(loop: InputLoop) -> BoolArray:
    """Mask (N,) of the points without a pole of the loop without delay on the axis, or as near as rounding."""
    size = np.abs(loop.poles).max(axis=-1)
    return np.asarray(np.abs(loop.poles.real).min(axis=-1) > 1e-12 * size)


def stacked(A: FloatArray, B: FloatArray, K: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, tuple[int, ...]]:
    """The matrices of all points in one row, (N, n, n), (N, n, 2) and (N, 2, n), and the grid's shape."""
    n = A.shape[-1]
    if A.shape[-2:] != (n, n) or B.shape[-2:] != (n, 2) or K.shape[-2:] != (2, n):
        raise ValueError(f"A, B, K must be (*G, n, n), (*G, n, 2), (*G, 2, n), are {A.shape}, {B.shape}, {K.shape}")
    grid = np.broadcast_shapes(A.shape[:-2], B.shape[:-2], K.shape[:-2])
    A, B, K = (np.broadcast_to(v, (*grid, *v.shape[-2:])).reshape(-1, *v.shape[-2:]) for v in (A, B, K))
    return A, B, K, grid


def closed_or_zero(A: FloatArray, B: FloatArray, K: FloatArray) -> tuple[FloatArray, BoolArray]:
    """``A - B K`` (N, n, n), 0 for those that are not finite, and the mask (N,) of those that are."""
    with np.errstate(over="ignore", invalid="ignore"):
        closed = A - B @ K
    finite: BoolArray = np.asarray(np.isfinite(closed).all(axis=(-2, -1)))
    return np.where(finite[:, None, None], closed, 0.0), finite


def peaks_of(loop: InputLoop, regular: BoolArray) -> Peaks:
    """Peaks of N points, a block of them at a time; nan where not `regular` (N,)."""
    points = len(regular)
    gain = np.full((points, len(EVERY.identity)), np.nan)
    omega, proved = gain.copy(), np.zeros(points, dtype=bool)
    T = np.full((*gain.shape, 2, 2), complex(np.nan, np.nan))
    late = np.any(loop.delay > 0.0, axis=-1)
    for search, which, block in ((peaks, ~late, BLOCK), (delayed_peaks, late, DELAYED_BLOCK)):
        members = np.flatnonzero(regular & which)
        for at in np.split(members, range(block, len(members), block)):
            if at.size:
                found = search(loop.take(at))
                gain[at], omega[at], T[at], proved[at] = found.gain, found.omega, found.T, found.proved
    return Peaks(gain, omega, T, proved)


def margins_of(found: Peaks, grid: tuple[int, ...]) -> SimultaneousMargins:
    """Margins (*G,) from the peaks of the points in one row."""
    gain, omega = found.gain, found.omega
    with np.errstate(divide="ignore"):
        # At most 2 but for rounding: mu is at least 1 at infinite frequency.
        margin = np.minimum(2.0 / gain[:, BALANCED], 2.0)
        up = 20.0 * np.log10((2.0 + margin) / (2.0 - margin))
        smaller = 1.0 / gain
    values = (
        margin,
        omega[:, BALANCED],
        _worst_factors(found.T[:, BALANCED]),
        up,
        -up,
        2.0 * np.arctan(0.5 * margin),
        smaller[:, SENSITIVITY],
        smaller[:, COMPLEMENTARY],
        smaller[:, SIGMA_S],
        omega[:, SIGMA_S],
        gain[:, SIGMA_S],
        omega[:, SIGMA_S],
        gain[:, SIGMA_T],
        omega[:, SIGMA_T],
        found.proved,
    )
    return SimultaneousMargins(*(v.reshape((*grid, *v.shape[1:])) for v in values))


def _worst_factors(T: ComplexArray) -> ComplexArray:
    """``(1 + delta) / (1 - delta)`` (N, 2) of the smallest delta with ``det(I - diag(delta) (I - 2 T)) = 0``."""
    delta = smallest_perturbation(np.eye(2) - 2.0 * T)
    with np.errstate(divide="ignore", invalid="ignore"):
        factors = (1.0 + delta) / (1.0 - delta)
    reached = (np.abs(1.0 - delta) > 1e-12).all(axis=-1, keepdims=True)
    return np.where(reached, factors, complex(np.nan, np.nan))
