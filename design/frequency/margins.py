"""Gain, phase, delay and disk margins of a loop, exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.crossovers import Crossings, critical_ratio, gain_crossings, phase_crossings
from design.frequency.delayed import grid_response
from design.frequency.feedback import ClosedLoop, closed_loop, log_slope, open_loop_value
from design.frequency.peaks import peaks
from design.loop import SisoLoop
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays

TURN = 2.0 * np.pi
#: Points that are searched at a time: each takes some hundred kilobytes.
BLOCK = 128
#: With this many states the response by polynomials is still good to seven digits.
LARGEST = 60


@dataclass(frozen=True, eq=False)
class Margins(GridArrays):
    """How far the loop ``L = sign gain c (sI - A)^-1 b exp(-s delay)`` is from losing stability.

    All are distances from the loop as it is flown, along one line each, to the *first* point where a
    closed-loop pole reaches the axis. They exist only where the closed loop ``1 + L`` is stable; at other
    points everything is nan. Lists are nan padded, sorted by frequency.

    Attributes
    ----------
    gain_ratio, gain_omega : (*G, M) every gain, over the gain flown, that puts a closed-loop pole on the
        axis, and its frequency [rad/s], 0 included. A ratio of 0 (the open loop's own poles on the axis) is
        no margin, nor is one beyond 120 dB. M is n, of a sampled loop n + 1; with a delay, or more than 20 states,
        it is 16, those nearest to the gain flown, and 60 dB is the most they are looked for
    gain_margin_up_db : (*G,) smallest raise that destabilises [dB], positive; inf when none does
    gain_margin_down_db : (*G,) smallest reduction that destabilises [dB], negative; -inf when none does
    phase, phase_omega : (*G, n) phase margin at every gain crossover [rad], in (-pi, pi], and its frequency
        [rad/s]. Positive: that much lag destabilises; negative: that much lead
    phase_margin : (*G,) smallest of them in magnitude [rad], given as the magnitude; inf without a crossover
    crossover : (*G,) its frequency [rad/s], nan without a crossover
    delay_margin : (*G,) smallest delay, on top of the loop's own, that destabilises [s]; inf when none does
    disk_margin : (*G,) ``2 / max |S - T|``, in (0, 2]: the loop stays stable with any factor of the disk
        ``(1 + d/2) / (1 - d/2)``, ``|d| < disk_margin`` (Seiler, Packard and Gahinet 2020, no skew)
    sensitivity_peak : (*G,) ``max |1 + L|^-1``, at least 1
    """

    gain_ratio: FloatArray
    gain_omega: FloatArray
    gain_margin_up_db: FloatArray
    gain_margin_down_db: FloatArray
    phase: FloatArray
    phase_omega: FloatArray
    phase_margin: FloatArray
    crossover: FloatArray
    delay_margin: FloatArray
    disk_margin: FloatArray
    sensitivity_peak: FloatArray


def margins(loop: SisoLoop) -> Margins:
    """Margins of the loop at the gain it is flown with; see `Margins`.

    Parameters
    ----------
    loop : its arrays finite; a delay is treated exactly, not approximated

    Raises
    ------
    ValueError : the delay is negative, or there are more states than `LARGEST`
    numpy.linalg.LinAlgError : an entry is not finite
    """
    if loop.delay < 0.0:
        raise ValueError(f"delay must not be negative, is {loop.delay} s")
    return margins_of(closed_loop(loop), loop.gain.shape)


def margins_of(closed: ClosedLoop, shape: tuple[int, ...]) -> Margins:
    """Margins of a closed loop whose points, in one row, are those of a grid of that shape.

    Raises
    ------
    ValueError : there are more states than `LARGEST`
    numpy.linalg.LinAlgError : an entry is not finite
    """
    if closed.matrix.shape[-1] > LARGEST:
        raise ValueError(f"margins are good for {LARGEST} states at most, there are {closed.matrix.shape[-1]}")
    N = closed.scale.size
    if closed.searched and N > BLOCK:
        parts = [_margins(closed.take(slice(i, i + BLOCK))) for i in range(0, N, BLOCK)]
        values = [np.concatenate(each) for each in zip(*parts, strict=True)]
    else:
        values = _margins(closed)
    return Margins(*(v.reshape((*shape, *v.shape[1:])) for v in values))


def _margins(closed: ClosedLoop) -> list[FloatArray]:
    """What `Margins` holds, for points in one row."""
    loop = closed.quietened(closed.regular if closed.delayed else closed.stable)
    found = grid_response(loop) if loop.searched else None
    gain, unity = phase_crossings(loop, found), gain_crossings(loop, found)
    ratio, peak = critical_ratio(gain.value), peaks(loop, closed.poles, found)
    phase, phase_omega = _phase(loop, unity), loop.frequency(unity.omega)
    # Where there is no crossover the column picked is nan, and says so.
    nearest = np.argmin(_without_nan(np.abs(phase)), axis=-1)[:, None]
    phase_margin, crossover = (np.take_along_axis(v, nearest, axis=-1)[:, 0] for v in (phase, phase_omega))
    values: list[FloatArray] = [
        ratio,
        loop.frequency(gain.omega),
        _decibels(np.where(ratio > 1.0, ratio, np.inf).min(axis=-1)),
        _decibels(np.where(ratio < 1.0, ratio, 0.0).max(axis=-1)),
        phase,
        phase_omega,
        _without_nan(np.abs(phase_margin)),
        crossover,
        _without_nan((phase % TURN) / phase_omega).min(axis=-1),
        2.0 / peak.balanced,
        peak.sensitivity,
    ]
    stable = closed.regular & _stable(loop, closed.poles, unity) if closed.delayed else closed.stable
    if not stable.all():
        values = [_where(stable, v) for v in values]
    return values


def _phase(closed: ClosedLoop, unity: Crossings) -> FloatArray:
    """Angle from -1 to L with its delay at the gain crossovers (N, M) [rad], in (-pi, pi]."""
    turn = np.exp(-1j * unity.omega * closed.delay[:, None])
    return np.asarray(np.angle(-open_loop_value(unity.value) * turn))


def _stable(closed: ClosedLoop, poles: ComplexArray, unity: Crossings) -> BoolArray:
    """Mask (N,) of the points whose closed loop is stable with its delay; without it its poles are at `poles` (N, n).

    As the delay grows from 0, closed-loop poles meet the axis only at the gain crossovers, each time the
    delay has used up the phase there: they leave to the right where ``|L|`` falls with frequency, and come
    back where it rises (Cooke and van den Driessche 1986).
    """
    T, omega = unity.value, unity.omega
    falling = -np.sign(log_slope(T, unity.slope))
    lag = np.angle(-open_loop_value(T)) % TURN
    visits = np.floor((omega * closed.delay[:, None] - lag) / TURN) + 1.0
    pairs = np.where(np.isnan(omega), 0.0, falling * np.maximum(visits, 0.0)).sum(axis=-1)
    return np.asarray((poles.real > 0.0).sum(axis=-1) + 2.0 * pairs == 0.0)


def _without_nan(values: FloatArray) -> FloatArray:
    """A distance that does not exist is infinite."""
    return np.where(np.isnan(values), np.inf, values)


def _decibels(ratio: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore"):
        return 20.0 * np.log10(ratio)


def _where(stable: BoolArray, values: FloatArray) -> FloatArray:
    return np.where(stable.reshape(-1, *(1,) * (values.ndim - 1)), values, np.nan)
