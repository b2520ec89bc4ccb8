"""Frequency responses of candidates on a grid of their point, and where on it something happens.

The grid is coarse: it only says between which samples a margin, a peak or the bandwidth is to be looked for.
"""

from __future__ import annotations

from collections.abc import Callable, Set
from dataclasses import dataclass

import numpy as np

from design.classical.figure import Figure, outer
from design.classical.log_response import Factors
from design.classical.normal_form import NormalForm
from design.classical.open_gains import OpenGains
from design.classical.pole_figures import companion_roots
from model.arrays import BoolArray, ComplexArray, FloatArray, Floats, GridArrays, IntArray

#: Samples over the whole range, and about the least damped mode of the open loop in units of its half width.
SAMPLES = 56
OFFSETS = np.array([-3.0, -1.0, -0.3, 0.3, 1.0, 3.0])
#: Range of the grid: from this part of the slower of aileron and drive, to this many times the faster of them.
RANGE = (0.004, 12.0)
#: Range of the top, over omega_n.
TOP = (20.0, 1e4)
#: How many events of one kind are followed, worst first.
EVENTS = 2
#: Figures of the loop transfer's crossings, and of summits over the frequency.
CROSSINGS = ("gain_margin", "phase_margin", "delay_margin")
SUMMITS = ("disk_margin", "sensitivity_peak", "noise_gain")
OF_FREQUENCY = frozenset({*CROSSINGS, *SUMMITS, "bandwidth"})


@dataclass(frozen=True, eq=False)
class Events:
    """Events of one kind of K candidates.

    Attributes
    ----------
    kind : of `OF_FREQUENCY`
    x : (E, K) frequencies where they are looked for
    ends : (2, E, K) samples that enclose them
    exists : (E, K)
    """

    kind: str
    x: FloatArray
    ends: FloatArray
    exists: BoolArray


@dataclass(frozen=True, eq=False)
class FrequencySamples(GridArrays):
    """What the loops of P points are made of, on W frequencies of each point's own.

    Attributes
    ----------
    x : (P, W) rising, in units of omega_n
    log_x : (P, W)
    loop : (P, 1 + J, W) rows of the loop transfer
    tracking : (P, W) logarithm of twice ``|n_i / d|^2``: of the tracking over ``y_i S``
    noise : (P, 1 + J, W) rows of ``sum_j y_j noise_j / d``
    drive : (P, 2, W) D and ``N exp(-j x delay)``
    products : (P, 1 + J, 2) rows of the first and the last of the products of the gains
    """

    x: FloatArray
    log_x: FloatArray
    loop: ComplexArray
    tracking: FloatArray
    noise: ComplexArray
    drive: ComplexArray
    products: FloatArray

    @classmethod
    def of(cls, family: OpenGains, fineness: int = 1, modes: ComplexArray | None = None) -> FrequencySamples:
        """Samples of each point, `fineness` times as many, and some about each of the `modes` (P, m)."""
        poles = _least_damped(family.form.denominator)
        poles = poles if modes is None else np.concatenate([poles, modes], axis=-1)
        x = np.sort(np.concatenate([_even(family.form, fineness), _about(poles)], axis=-1), axis=-1)
        rows = Factors.of(family, ("d", "q", "c", "n", "D", "N")).at(x, 0)[:, :, :, 0]
        loop, noise = (rows[:, m] / rows[:, 0, :1] for m in (1, 2))
        tracking = 2.0 * np.log(np.abs(rows[:, 3, 0] / rows[:, 0, 0])) + np.log(2.0)
        return cls(x, np.log(x), loop, tracking, noise, rows[:, 4:, 0], family.products[:, :, [0, -1]])

    def events(self, z: FloatArray, kinds: Set[str], rate_command: bool) -> list[Events]:
        """Where the samples show something of each kind, of K = P candidates z (K, J); crossings first."""
        weights = np.ones((z.shape[0], 1, z.shape[1] + 1))
        weights[:, 0, 1:] = z
        L = (weights @ self.loop)[:, 0]
        re, im = L.real, L.imag
        size = re * re + im * im
        difference = 1.0 + 2.0 * re + size
        looked_at = []
        if "gain_margin" in kinds:
            crosses, at = _crossing(im, re)
            crosses &= at < 0.0
            looked_at.append(("gain_margin", im, crosses, -np.abs(np.log(np.where(crosses, -at, 1.0)))))
        if not kinds.isdisjoint({"phase_margin", "delay_margin"}):
            excess = np.log(size)
            crosses, at = _crossing(excess, re)
            if "phase_margin" in kinds:
                looked_at.append(("phase_margin", excess, crosses, -at))
            if "delay_margin" in kinds:
                lag = np.arctan2(-_crossing(excess, im)[1], -at) % (2.0 * np.pi)
                looked_at.append(("delay_margin", excess, crosses, -lag / self.x[:, :-1]))
        integral = (weights @ self.products[:, :, 1:])[:, 0]
        lost = self.tracking - np.log(difference) + 2.0 * np.log(integral)
        found = self._worst(looked_at, lost)
        heights: dict[str, Callable[[], Floats]] = {
            "disk_margin": lambda: 1.0 - 2.0 * re + size,
            "sensitivity_peak": lambda: 1.0,
            "noise_gain": lambda: self._noise(weights, rate_command),
        }
        found += [self._summits(kind, np.log(heights[kind]() / difference)) for kind in SUMMITS if kind in kinds]
        return found

    def at_top(self, z: FloatArray, level: float) -> Figure:
        """Logarithm of ``|L|`` over a level, where the samples end, of K = P candidates z (K, J).

        What is beyond is not looked at.
        """
        rows = self.loop[:, :, -1]
        L = rows[:, 0] + (z * rows[:, 1:]).sum(axis=-1)
        by = rows[:, 1:] / L[:, None]
        there = np.ones((1, L.size), dtype=bool)
        return Figure(np.log(np.abs(L) / level)[None], by.real[None], -outer(by).real[None], there)

    def _noise(self, weights: FloatArray, rate_command: bool) -> FloatArray:
        """Squared magnitude (K, W) of the commanded deflection over that of the noise, over that of S."""
        signal = (weights @ self.noise)[:, 0]
        if rate_command:
            signal = signal * (self.drive[:, 0] / (weights @ self.products[:, :, :1])[:, 0] + self.drive[:, 1])
        return np.asarray(signal.real**2 + signal.imag**2)

    def _worst(self, looked_at: list[tuple[str, FloatArray, BoolArray, FloatArray]], lost: FloatArray) -> list[Events]:
        """The most severe crossing of zero of each of some f (K, W), and where `lost` first falls below zero."""
        first = np.argmax(lost < 0.0, axis=-1)[None]
        found, count = [Events("bandwidth", *self._between(lost, np.maximum(first - 1, 0)), first > 0)], lost.shape[0]
        if looked_at:
            place, exists = most_severe(*(np.concatenate([one[k] for one in looked_at]) for k in (2, 3)))
            for n, (kind, f, _, _) in enumerate(looked_at):
                part = slice(n * count, (n + 1) * count)
                found.insert(n, Events(kind, *self._between(f, place[:, part]), exists[:, part]))
        return found

    def _between(self, f: FloatArray, place: IntArray) -> tuple[FloatArray, FloatArray]:
        """Zero of f (K, W) between the samples `place` (E, K) and the next ones, by a chord in log x; and the two."""
        row = np.arange(f.shape[0])
        low, high = f[row, place], f[row, place + 1]
        ends = np.stack([self.x[row, place], self.x[row, place + 1]])
        part = low / np.where(low == high, 1.0, low - high)
        return ends[0] * (ends[1] / ends[0]) ** np.minimum(np.maximum(part, 0.0), 1.0), ends

    def _summits(self, kind: str, height: FloatArray) -> Events:
        """The highest of the summits of a height (K, W), each on the parabola through three samples."""
        inner = height[:, 1:-1]
        place, exists = most_severe((inner > height[:, :-2]) & (inner >= height[:, 2:]), inner)
        row = np.arange(height.shape[0])
        left, middle, right = (self.log_x[row, place + i] for i in range(3))
        f, g, h = (height[row, place + i] for i in range(3))
        rise, fall = (g - f) / (middle - left), (h - g) / (right - middle)
        bend = (fall - rise) / (right - left)
        top = 0.5 * (left + middle) - 0.5 * rise / np.where(bend < 0.0, bend, -np.inf)
        x = np.exp(np.stack([np.clip(top, left, right), left, right]))
        return Events(kind, x[0], x[1:], exists)


def _even(form: NormalForm, fineness: int) -> FloatArray:
    """Frequencies (P, W) that are evenly spaced in their logarithm."""
    lag = np.maximum(form.lag, 1e-9)
    bottom, top = RANGE[0] * np.minimum(1.0, 1.0 / lag), np.clip(RANGE[1] / lag, *TOP)
    part = np.linspace(0.0, 1.0, SAMPLES * fineness)
    return np.asarray(np.exp(np.log(bottom)[:, None] + np.log(top / bottom)[:, None] * part))


def _least_damped(denominator: FloatArray) -> ComplexArray:
    """The least damped mode of the open loop (P, 1); j where there is none."""
    poles = companion_roots(denominator)
    upper = poles.imag > 1e-6
    ratio = np.where(upper, -poles.real / np.where(upper, np.abs(poles), 1.0), np.inf)
    pick = np.argmin(ratio, axis=-1)[:, None]
    return np.where(np.take_along_axis(upper, pick, axis=-1), np.take_along_axis(poles, pick, axis=-1), 1j)


def _about(poles: ComplexArray) -> FloatArray:
    """Frequencies (P, M) about the resonances of poles (P, m)."""
    centre = np.maximum(np.abs(poles.imag), 0.1 * np.abs(poles))
    width = np.maximum(np.abs(poles.real), 1e-4 * centre)
    x = centre[..., None] + width[..., None] * OFFSETS
    return np.asarray(np.maximum(x, 0.05 * centre[..., None]).reshape(poles.shape[0], -1))


def _crossing(f: FloatArray, other: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Where f (K, W) changes sign between two samples (K, W - 1), and `other` there by a chord."""
    crosses = f[:, 1:] * f[:, :-1] < 0.0
    part = f[:, :-1] / np.where(crosses, f[:, :-1] - f[:, 1:], 1.0)
    return crosses, other[:, :-1] + part * (other[:, 1:] - other[:, :-1])


def most_severe(present: BoolArray, severity: FloatArray) -> tuple[IntArray, BoolArray]:
    """Places (E, K) of the most severe of the present events (K, W), and which of them are there."""
    rank = np.where(present, severity, -np.inf)
    row = np.arange(rank.shape[0])
    places, exists = [], []
    for _ in range(EVENTS):
        place = np.argmax(rank, axis=-1)
        places.append(place)
        exists.append(rank[row, place] > -np.inf)
        rank[row, place] = -np.inf
    return np.stack(places), np.stack(exists)
