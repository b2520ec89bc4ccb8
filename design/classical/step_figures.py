"""Overshoot, settling and the tab's motion after the reference step, with their derivatives in the gains.

A loop has settled by a time when its error stays within the band from then on. That is asked of the error at that
time and at its extremes thereafter, each smooth in the gains, where the settling time itself jumps as an extreme
enters the band.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.classical.figure import Figure, outer
from design.classical.frequency_samples import most_severe
from design.classical.modal_signal import ModalSignal
from design.classical.open_gains import OpenGains
from design.classical.pole_figures import Poles
from design.classical.steering import StepReference
from design.classical.walls import Settled
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: Samples of a block, the steps of each next one being twice as long, and number of blocks.
SAMPLES, BLOCKS = 20, 5
#: A step is followed until its slowest mode has gone through this many time constants, or to the horizon.
DECAYED = 9.0
#: Band of the settling time.
BAND = 0.02


@dataclass(frozen=True, eq=False)
class StepLoops(GridArrays):
    """What the step responses of P points are worked out from.

    Attributes
    ----------
    aileron, tab : (P, m + 1) polynomials of `OpenGains`
    integral : (P, 1 + J) rows of the product y_i
    frequency : (P,) omega_n [rad/s]
    horizon : (P,) in units of 1 / omega_n
    tab_step : (P,) what ``tab`` over p is worth in tab angle for the reference step [rad]
    tab_trim : (P,) angle of the tab at trim [rad]
    """

    aileron: FloatArray
    tab: FloatArray
    integral: FloatArray
    frequency: FloatArray
    horizon: FloatArray
    tab_step: FloatArray
    tab_trim: FloatArray

    @classmethod
    def of(cls, family: OpenGains, reference: StepReference) -> StepLoops:
        """Of each point of a family; the reference's trim is (P,)."""
        form = family.form
        return cls(
            family.aileron, family.tab, family.products[:, :, -1], form.frequency,
            reference.horizon * form.frequency, reference.size / form.dc_gain, reference.tab_trim,
        )  # fmt: skip


class StepFigures:
    """Figures of the step responses of K candidates z (K, J), each of its own loops; of stable ones only."""

    def __init__(self, loops: StepLoops, poles: Poles, z: FloatArray, fineness: int = 1) -> None:
        self._loops, self._poles, self._fineness = loops, poles, fineness
        self._gain = loops.integral[:, 0] + (z * loops.integral[:, 1:]).sum(axis=-1)
        steps = np.repeat(2.0 ** np.arange(BLOCKS), SAMPLES * fineness)
        part = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
        self._times = part * np.minimum(DECAYED / np.maximum(poles.decay, 1e-6), loops.horizon)[:, None]

    @cached_property
    def _modes(self) -> ComplexArray:
        """``exp(s t)`` at the sample times (K, m, T)."""
        count = SAMPLES * self._fineness
        ratio = np.exp(self._poles.s * self._times[:, 1:2])
        modes = np.ones((*ratio.shape, 1 + BLOCKS * count), dtype=complex)
        for block in range(BLOCKS):
            part = modes[:, :, block * count : (block + 1) * count + 1]
            part[:, :, 1:] = ratio[..., None]
            np.multiply.accumulate(part, axis=-1, out=part)
            ratio = ratio * ratio
        return modes

    @cached_property
    def _error(self) -> ModalSignal:
        return ModalSignal.of_step(self._poles, self._loops.aileron, self._gain, self._loops.integral[:, 1:])

    @cached_property
    def _error_samples(self) -> FloatArray:
        return self._error.samples(self._modes)

    @cached_property
    def _tab(self) -> ModalSignal:
        return ModalSignal.of_step(self._poles, self._loops.tab, self._gain, self._loops.integral[:, 1:])

    def of_error(
        self, overshoot: bool, by: FloatArray | None, band: float = BAND
    ) -> tuple[Figure | None, Settled | None]:
        """Figures of the error of a unit step, those that are asked for.

        Parameters
        ----------
        overshoot : whether that is asked for
        by : (K,) times [s] by which the error is to stay within a band; None when that is not asked for
        band : of the error, at most that of the settling time

        Returns
        -------
        Heights of the summits of the response over its final value. How far the error is outside its band at the times
        `by` and at its extremes later, like its logarithm, at most 0 where it has settled.
        """
        samples, row = self._error_samples, np.arange(self._gain.size)
        summits = _turns(samples, 1.0)
        events = []
        if overshoot:
            place, exists = most_severe(summits, samples[:, 1:-1])
            events.append((*self._around(samples, place), np.ones(place.shape), exists))
        if by is not None:
            by = by * self._loops.frequency
            turns = (summits | _turns(samples, -1.0)) & (self._times[:, 1:-1] > by[:, None])
            place, exists = most_severe(turns, np.abs(samples[:, 1:-1]))
            t, ends = self._around(samples, place)
            sign = np.where(samples[row, place + 1] < 0.0, -1.0, 1.0)
            events.append((t, np.maximum(ends, by), sign, exists))
            # Where the limit is reached the error is looked at as it is: the step that its ends leave is none.
            events.append((by[None], np.stack([by, by])[:, None], np.zeros((1, by.size)), np.ones((1, by.size), bool)))
        t, sign, exists = (np.concatenate([event[k] for event in events]) for k in (0, 2, 3))
        ends = np.concatenate([event[1] for event in events], axis=1)
        error, rate = _at_extreme(self._error, t, ends, sign, exists)
        first = 2 if overshoot else 0
        summit = error.take(slice(0, first)) if overshoot else None
        if by is None:
            return summit, None
        error, sign = error.take(slice(first, None)), sign[first:]
        sign[-1] = np.where(error.value[-1] < 0.0, -1.0, 1.0)
        error = error.mapped(sign * error.value, sign)
        size = np.hypot(error.value, band)
        by_time = np.zeros(sign.shape)
        by_time[-1] = sign[-1] * rate[-1] / size[-1] * self._loops.frequency
        # Like the logarithm where the error is large, and through zero without a kink.
        value = np.arcsinh(error.value / band) - np.arcsinh(1.0)
        return summit, Settled(error.mapped(value, 1.0 / size, -error.value / size**3), by_time)

    def settling_time(self) -> FloatArray:
        """Time (K,) after which the error stays within the band [s]; nan when it does not within the samples."""
        samples, times, row = self._error_samples, self._times, np.arange(self._gain.size)
        outside = np.abs(samples) > BAND
        last = samples.shape[-1] - 1 - np.argmax(outside[:, ::-1], axis=-1)
        settled = last < samples.shape[-1] - 1
        k = np.minimum(last, samples.shape[-1] - 2)
        low, high = times[row, k], times[row, k + 1]
        f_low, f_high = np.abs(samples[row, k]) - BAND, np.abs(samples[row, k + 1]) - BAND
        for _ in range(3):
            t = low + f_low * (high - low) / np.where(f_low > f_high, f_low - f_high, np.inf)
            f = np.abs(np.sum(self._error.r * np.exp(self._poles.s * t[:, None]), axis=-1).real) - BAND
            low, f_low = np.where(f > 0.0, t, low), np.where(f > 0.0, f, f_low)
            high, f_high = np.where(f > 0.0, high, t), np.where(f > 0.0, f_high, f)
        return np.where(settled, t, np.nan) / self._loops.frequency

    def tab_deflection(self) -> Figure:
        """Extremes of the tab's angle, trim included, and where it starts and ends; magnitudes [rad]."""
        loops = self._loops
        # At rest the aileron has moved by the reference and the tab by that over K_ss, whatever the gains.
        return self._magnitudes(self._tab, loops.tab_step, loops.tab_trim + loops.tab_step)

    def tab_rate(self) -> Figure:
        """Extremes of the tab's rate, and what it starts and ends with; magnitudes [rad/s]."""
        unit = self._loops.tab_step * self._loops.frequency
        return self._magnitudes(self._tab.differentiated(), unit, np.zeros_like(unit))

    def _magnitudes(self, signal: ModalSignal, unit: FloatArray, offset: FloatArray) -> Figure:
        """The largest ``|offset + unit v|`` at the ends and the extremes of a signal v (K,)."""
        total = offset[:, None] + unit[:, None] * signal.samples(self._modes)
        present = np.ones(total.shape, dtype=bool)
        present[:, 1:-1] = _turns(total, 1.0) | _turns(total, -1.0)
        place, exists = most_severe(present, np.abs(total))
        row = np.arange(unit.size)
        sign = np.where(total[row, place] < 0.0, -1.0, 1.0)
        t, ends = self._around(total, np.clip(place - 1, 0, total.shape[1] - 3))
        inner = (place > 0) & (place < total.shape[1] - 1)
        fixed = self._times[row, place]
        t, ends = np.where(inner, t, fixed), np.where(inner, ends, fixed)
        turn = np.where(inner, sign * np.where(unit < 0.0, -1.0, 1.0), 0.0)
        at, _ = _at_extreme(signal, t, ends, turn, exists)
        return at.mapped(sign * (offset + unit * at.value), sign * unit)

    def _around(self, samples: FloatArray, place: IntArray) -> tuple[FloatArray, FloatArray]:
        """Where the parabola through the sample ``place + 1`` (E, K) and its neighbours turns, and the neighbours."""
        row = np.arange(samples.shape[0])
        left, middle, right = (self._times[row, place + i] for i in range(3))
        f, g, h = (samples[row, place + i] for i in range(3))
        rise, fall = (g - f) / (middle - left), (h - g) / (right - middle)
        bend = (fall - rise) / (right - left)
        top = 0.5 * (left + middle) - 0.5 * rise / np.where(bend == 0.0, np.inf, bend)
        return np.clip(top, left, right), np.stack([left, right])


def _turns(samples: FloatArray, sign: float) -> BoolArray:
    """Where samples (K, T) have a summit, or with a sign of -1 a trough (K, T - 2)."""
    inner = sign * samples[:, 1:-1]
    return (inner > sign * samples[:, :-2]) & (inner >= sign * samples[:, 2:])


def _at_extreme(
    signal: ModalSignal, t: FloatArray, ends: FloatArray, sign: FloatArray, exists: BoolArray
) -> tuple[Figure, FloatArray]:
    """The signal at its summit (sign 1) or trough (-1) next to t (E, K), between `ends`; with a sign of 0 at t itself.

    The times are close, and what is left to the extreme is taken along the parabola there. Besides, the rate at t.
    """
    at = signal.at(t)
    bend = np.where(sign * at.bend < 0.0, at.bend, np.inf)
    step = np.clip(-at.rate / bend, ends[0] - t, ends[1] - t)
    value = at.value + step * (at.rate + 0.5 * step * at.bend)
    gradient = at.by_gain + step[..., None] * at.rate_by_gain
    return Figure(value, gradient, at.curvature - outer(at.rate_by_gain) / bend[..., None, None], exists), at.rate
