"""The course of a step response from 0 (trim) to 1 (final value): its crossings and its peak, in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.response.extremes import NOISE, SAMPLED_PART
from design.response.interpolant import Extremes, crossings, local_maxima, windows
from model.arrays import FloatArray, GridArrays, IntArray


@dataclass(frozen=True, eq=False)
class Peak(GridArrays):
    """Largest value and the time [s] when it is reached, each (N,)."""

    value: FloatArray
    time: FloatArray


@dataclass(frozen=True, eq=False)
class Course:
    """Courses of N points on a graded mesh.

    Attributes
    ----------
    fraction : (N, S, m+1) the change since trim, as a fraction of the final change
    times : (S, m+1) sample times [s]
    """

    fraction: FloatArray
    times: FloatArray

    @property
    def rows(self) -> FloatArray:
        """(N S, m+1) the blocks, each a row of even samples."""
        return self.fraction.reshape(-1, self.fraction.shape[-1])

    @property
    def flat(self) -> FloatArray:
        """(N, S (m+1)) the samples in order of time."""
        return self.fraction.reshape(len(self.fraction), self.times.size)

    def first_time(self, level: float) -> FloatArray:
        """(N,) time when the level is first reached [s]; nan where it is not."""
        reached = self.flat >= level
        index = np.argmax(reached, axis=-1)
        return np.where(np.any(reached, axis=-1), self._crossing_time(index, np.full(len(index), level)), np.nan)

    def settling_time(self, band: float) -> FloatArray:
        """(N,) time after which the course stays within 1 +- band [s]; nan where it ends outside."""
        error = np.abs(self.flat - 1.0)
        outside = error > band
        last = self.times.size - 1 - np.argmax(outside[:, ::-1], axis=-1)
        ends_outside = outside[:, -1]
        level = 1.0 + band * np.sign(np.take_along_axis(self.flat, last[:, None], axis=-1)[:, 0] - 1.0)
        after = np.minimum(last + 1, self.times.size - 1)
        settled = np.where(np.any(outside, axis=-1), self._crossing_time(after, level), 0.0)
        settled = self._after_hidden_excursions(settled, band)
        return np.where(ends_outside, np.nan, settled)

    def peak(self) -> Peak:
        """Largest value of each course and its time."""
        index = np.argmax(self.flat, axis=-1)
        value = np.take_along_axis(self.flat, index[:, None], axis=-1)[:, 0]
        time = self.times.reshape(-1)[index]
        found = self._maxima(self.fraction)
        point = found.row // len(self.times)
        higher = np.flatnonzero(found.value > value[point])
        # Of several maxima of one point the last written stays: the highest, so they are written in order.
        order = higher[np.argsort(found.value[higher], kind="stable")]
        value[point[order]] = found.value[order]
        time[point[order]] = self._time(found.row[order], found.place[order])
        return Peak(value, time)

    def undershoot(self) -> FloatArray:
        """(N,) largest excursion the wrong way, >= 0."""
        largest: FloatArray = np.maximum(0.0 - np.min(self.flat, axis=-1), 0.0)
        found = self._maxima(-self.fraction)
        np.maximum.at(largest, found.row // len(self.times), found.value)
        return largest

    def _time(self, row: IntArray, place: FloatArray) -> FloatArray:
        """(E,) time [s] of places [samples] in rows."""
        block = row % len(self.times)
        start = self.times[block, 0]
        return np.asarray(start + (self.times[block, 1] - start) * place)

    def _maxima(self, signal: FloatArray) -> Extremes:
        """Refined local maxima among the largest of each point."""
        top = np.max(signal, axis=(-2, -1))
        return local_maxima(signal, SAMPLED_PART * top, NOISE * np.abs(top))

    def _crossing_time(self, index: IntArray, level: FloatArray) -> FloatArray:
        """(N,) time at which the level is crossed between sample `index` and the one before it."""
        samples = self.times.shape[-1]
        time: FloatArray = self.times.reshape(-1)[index]  # right as it is where `index` begins a block
        between = np.flatnonzero(index % samples > 0)
        row = between * len(self.times) + index[between] // samples
        place = crossings(self.rows, row, index[between] % samples - 1, level[between])
        time[between] = self._time(row, place)
        return time

    def _after_hidden_excursions(self, settled: FloatArray, band: float) -> FloatArray:
        """Settling times moved behind peaks that leave the band between two samples that do not."""
        error = self.fraction - 1.0
        floor = np.full(len(error), SAMPLED_PART * band)
        found = local_maxima(np.abs(error), floor, NOISE * floor, signed=error)
        error = error.reshape(self.rows.shape)
        sampled = np.abs(error)[found.row, np.round(found.place).astype(np.int64)]
        point = found.row // len(self.times)
        time = self._time(found.row, found.place)
        hidden = np.flatnonzero((found.value > band) & (sampled <= band) & (time > settled[point]))
        row, place = found.row[hidden], found.place[hidden]
        curve = windows(error, row, place)
        level = band * np.sign(curve.value(place))
        end = np.minimum(np.floor(place) + 1.0, float(self.times.shape[-1] - 1))
        back = curve.minus(level).root(place, end, 0.5 * (place + end))
        np.maximum.at(settled, point[hidden], self._time(row, back))
        return settled
