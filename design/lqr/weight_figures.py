"""What a search of weights sees of a loop: numbers that are smooth in the weights but for few places.

The number of a spec is 0 where its limit is reached, negative inside it, and grows outside it like the logarithm of the
value over the limit; that of what is minimised is its logarithm. The largest of several things has a kink in the
weights wherever another one takes over, and the optimum is usually found right there. So a peak over time is given
window by window, each window twice as long as the one before, and a damping ratio mode by mode.

The step response is the sum of the loop's modes, ``y(t) = y_end + sum_k r_k exp(s_k t)``, on the same blocks of samples
for every loop: numbers of a loop do not depend, by a single bit, on which other loops are judged with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.delay.damping import DECAY_PER_DELAY
from design.delay.with_pade import without_delay
from design.frequency.poles import damping_ratio
from design.loop import Loop
from design.lqr.hamiltonian import eigenvectors_or_nan, solve_or_nan
from design.lqr.weight_request import WeightSearch
from design.response.step_metrics import BAND
from design.specs import Spec
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: Numbers of specs are kept between these: beyond them no step is decided.
LOWEST, HIGHEST = -3.0, 20.0
#: Windows, each as long as all before it together; blocks of samples are these, and more in the first one where modes
#: are fast, so many at a time and so often at most, until the first samples are this part of the fastest apart [rad].
WINDOWS, _MORE, _MOST, _RESOLUTION = 10, 4, 4, 0.25
#: Intervals of each block; even, for Simpson's rule.
INTERVALS = 32
#: The band of the settling time is narrower by this part: a ripple that leaves it by a hair moves that time by far.
_INSIDE = 5e-3
#: States that stand for each delay.
_ORDER = 4
#: Damping ratios of so many of the least damped modes are given.
_MODES = 2
_TINY = 1e-300
#: Outputs that are looked at, and the quantities that are peaks of them.
_OUTPUTS = ("dt", "dt_rate", "T_t", "da", "da_rate", "T_a")
_PEAKS = ("tab_deflection", "tab_rate", "tab_torque", "aileron_deflection", "aileron_rate", "aileron_torque")
_POWERS = ("tab_power", "aileron_power")


@dataclass(frozen=True, eq=False)
class Columns:
    """Which number is which.

    Attributes
    ----------
    group : (F,) -1 for what is minimised, else the number of the spec
    time : (F,) mask of the number that is the time by which the aileron is to have settled, over its limit; the other
        numbers of a settling time say whether it has
    """

    group: IntArray
    time: BoolArray

    @classmethod
    def of(cls, search: WeightSearch) -> Columns:
        """Those of a search."""
        counts = {"damping_ratio": _MODES, "settling_time": 2 + WINDOWS}
        each = [counts.get(spec.quantity, WINDOWS) for spec in search.specs]
        least = WINDOWS if search.minimised.startswith("peak") else 1
        group = np.repeat(np.arange(-1, len(each)), [least, *each])
        first = np.concatenate([[True], group[1:] != group[:-1]])
        return cls(group, first & (group == search.settling) & (group >= 0))


@dataclass(frozen=True, eq=False)
class WeightFigures(GridArrays):
    """Step responses of N loops as sums of their modes, delays included, in the outputs `_OUTPUTS`.

    Attributes
    ----------
    poles : (N, n) s_k [1/s]
    residues : (N, 6, n) r_k
    trim, final : (N, 6) values before the step, and those that the outputs tend to
    search : what is asked for
    delay : longest delay [s]
    """

    poles: ComplexArray
    residues: ComplexArray
    trim: FloatArray
    final: FloatArray
    search: WeightSearch
    delay: float

    @classmethod
    def of(cls, search: WeightSearch, loop: Loop) -> WeightFigures:
        """Those of loops (N) that are finite."""
        chained = without_delay(loop, _ORDER)
        index = [chained.outputs.index(name) for name in _OUTPUTS]
        sizes = {"r_a": search.step.aileron, "r_t": search.step.tab}
        step = np.array([sizes[name] for name in chained.references])[:, None]
        closed, rows = chained.closed, chained.closed_outputs[:, index]
        poles, modes = eigenvectors_or_nan(closed)
        rest = solve_or_nan(closed, -chained.reference_input @ step)
        part = solve_or_nan(modes, -rest.astype(complex))
        trim = chained.offset[:, index]
        jump = chained.reference_feedthrough[:, index] @ step
        final = (rows @ rest + jump)[..., 0] + trim
        return cls(poles, (rows @ modes) * part.mT, trim, final, search, max(loop.delay))

    def numbers(self, limits: FloatArray, by: FloatArray) -> FloatArray:
        """All numbers (N, F), in the order of `Columns`; `HIGHEST` throughout where a loop is not stable.

        Parameters
        ----------
        limits : (N, s) of the specs
        by : (N,) times [s] by which the aileron is to have settled
        """
        known = np.isfinite(self.residues).all(axis=(-2, -1)) & np.isfinite(self.final).all(axis=-1)
        stable = known & (self.poles.real < 0.0).all(axis=-1)
        size = np.where(stable, np.abs(self.poles).max(axis=-1), 0.0)
        finer = np.log2(np.maximum(size * self.search.step.duration / (_RESOLUTION * INTERVALS), 1.0))
        more = np.clip(np.ceil((finer + 1.0 - WINDOWS) / _MORE), 0, _MOST)
        blocks = WINDOWS + _MORE * more.astype(np.int64)
        numbers = np.full((len(size), Columns.of(self.search).group.size), HIGHEST)
        for count in np.unique(blocks[stable]):
            rows = np.flatnonzero(stable & (blocks == count))
            with np.errstate(all="ignore"):
                found = _Sampled(self.take(rows), int(count)).numbers(limits[rows], by[rows])
            numbers[rows] = np.where(np.isfinite(found), found, HIGHEST)
        return numbers


class _Sampled:
    """Stable loops on samples of so many blocks."""

    def __init__(self, figures: WeightFigures, blocks: int) -> None:
        self._search, self._delay, self._blocks = figures.search, figures.delay, blocks
        self._poles, self._residues = figures.poles, figures.residues
        self._trim, self._final = figures.trim, figures.final
        #: First block of each window; the first window has all that is earlier.
        self._first = np.concatenate([[0], np.arange(blocks - WINDOWS + 1, blocks)])

    def numbers(self, limits: FloatArray, by: FloatArray) -> FloatArray:
        """As `WeightFigures.numbers`."""
        logs = np.log(np.maximum(self._least, _TINY))
        parts = [np.maximum(logs, logs.max(axis=-1, keepdims=True) + LOWEST)]
        for k, spec in enumerate(self._search.specs):
            if spec.quantity == "settling_time":
                parts.append(self._settling(limits[:, k], by))
            else:
                parts.append(_miss(spec, self._values(spec.quantity), limits[:, k, None]))
        return np.concatenate(parts, axis=-1)

    @property
    def _duration(self) -> float:
        return self._search.step.duration

    @cached_property
    def _steps(self) -> FloatArray:
        """(S,) sample step of each block [s]."""
        longer = np.maximum(np.arange(self._blocks) - 1, 0)
        return np.asarray(self._duration / INTERVALS * 0.5 ** (self._blocks - 1 - longer))

    @cached_property
    def _times(self) -> FloatArray:
        """(S, m+1) of the samples [s]."""
        start = np.where(np.arange(self._blocks) > 0, INTERVALS * self._steps, 0.0)
        return np.asarray(start[:, None] + self._steps[:, None] * np.arange(INTERVALS + 1))

    def _windowed(self, peaks: FloatArray) -> FloatArray:
        """Peaks of blocks (..., S) as those of windows (..., W)."""
        return np.asarray(np.maximum.reduceat(peaks, self._first, axis=-1))

    @cached_property
    def _signals(self) -> FloatArray:
        """(N, 6, S, m+1) `_OUTPUTS`."""
        count, n = self._poles.shape
        E = np.empty((count, n, self._blocks, INTERVALS + 1), dtype=complex)
        E[:, :, 0] = power = np.exp(self._poles[..., None] * (self._steps[0] * np.arange(INTERVALS + 1)))
        for s in range(1, self._blocks):
            # A block begins after as many of its own steps as it has, and the next one has steps twice as long.
            np.multiply(power, power[..., -1:], out=E[:, :, s])
            power = power * power
        flat = E.reshape(count, n, -1)
        moving = _real_rows(self._residues) @ np.concatenate([flat.real, flat.imag], axis=1)
        signals = moving.reshape(count, len(_OUTPUTS), self._blocks, INTERVALS + 1)
        return np.asarray(signals + self._final[..., None, None])

    @cached_property
    def _powers(self) -> FloatArray:
        """(N, 2, S, m+1) of tab and aileron [W]."""
        return np.asarray(self._signals[:, 2::3] * self._signals[:, 1::3])

    @cached_property
    def _peaks(self) -> dict[str, FloatArray]:
        """Peaks (N, S) of the magnitudes that are asked for, all found together."""
        asked, minimised = {spec.quantity for spec in self._search.specs}, self._search.minimised
        chosen = {name: self._signals[:, row] for row, name in enumerate(_PEAKS) if name in asked}
        chosen |= {name: self._powers[:, i] for i, name in enumerate(_POWERS) if name in asked}
        if minimised == "peak_aileron_torque":
            chosen[minimised] = self._signals[:, _OUTPUTS.index("T_a")]
        if minimised == "peak_total_power":
            chosen[minimised] = np.abs(self._powers[:, 0]) + np.abs(self._powers[:, 1])
        if not chosen:
            return {}
        peaks = self._windowed(block_peaks(np.abs(np.stack(list(chosen.values()), axis=1))))
        return {name: peaks[:, i] for i, name in enumerate(chosen)}

    @cached_property
    def _least(self) -> FloatArray:
        """What is minimised (N, its columns), in its own unit."""
        minimised = self._search.minimised
        if minimised == "total_rms_power":
            return np.asarray(np.sqrt(self._mean(np.square(self._powers))).sum(axis=-1, keepdims=True))
        if minimised == "energy_out":
            out = self._duration * self._mean(np.maximum(self._powers, 0.0))
            return np.asarray(out.sum(axis=-1, keepdims=True))
        return self._peaks[minimised]

    def _mean(self, signals: FloatArray) -> FloatArray:
        """Means over the response (N, q) of signals (N, q, S, m+1), by Simpson's rule."""
        rule = np.ones(INTERVALS + 1)
        rule[1:-1:2], rule[2:-1:2] = 4.0, 2.0
        weights = self._steps[:, None] * rule / (3.0 * self._duration)
        return np.asarray((signals * weights).sum(axis=(-2, -1)))

    @cached_property
    def _course(self) -> FloatArray:
        """(N, S, m+1) the aileron's change as a part of the one it ends with."""
        column = _OUTPUTS.index("da")
        trim = self._trim[:, column, None, None]
        return np.asarray((self._signals[:, column] - trim) / (self._final[:, column, None, None] - trim))

    def _values(self, quantity: str) -> FloatArray:
        """Values of a quantity (N, its columns), in its own unit."""
        if quantity == "damping_ratio":
            found = self._poles
            counts = (found.imag >= 0.0) & (-found.real * self._delay <= DECAY_PER_DELAY)
            each = np.where(counts, damping_ratio(found), 1.0)
            return np.asarray(np.sort(each, axis=-1)[:, :_MODES])
        if quantity == "overshoot":
            return self._windowed(block_peaks(self._course)) - 1.0
        return self._peaks[quantity]

    def _settling(self, limit: FloatArray, by: FloatArray) -> FloatArray:
        """Time over its limit, and the error over its band by that time and in each block after it (N, 2 + S)."""
        column = _OUTPUTS.index("da")
        by = np.minimum(by, self._duration)
        change = self._final[:, column] - self._trim[:, column]
        at = (self._residues[:, column] * np.exp(self._poles * by[:, None])).real.sum(axis=-1) / change
        size = np.abs(self._course - 1.0)
        # Of the block that is under way no more than the samples: what it begins with is the error at the time itself.
        later = self._times >= by[:, None, None]
        whole, begun = block_peaks(size), np.where(later, size, 0.0).max(axis=-1)
        after = self._windowed(np.where(later[..., 0], whole, begun))
        error = np.concatenate([np.abs(at)[:, None], after], axis=-1) / ((1.0 - _INSIDE) * BAND)
        # Like the logarithm where the error is large, and through zero without a kink.
        outside = np.arcsinh(error) - np.arcsinh(1.0)
        return np.concatenate([np.log(by / limit)[:, None], np.clip(outside, LOWEST, HIGHEST)], axis=-1)


def block_peaks(signals: FloatArray) -> FloatArray:
    """Largest value in each block (..., S) of signals (..., S, m+1), by parabolas between the samples."""
    top = signals.max(axis=-1)
    k = np.clip(signals.argmax(axis=-1), 1, signals.shape[-1] - 2)[..., None]
    before, here, after = (np.take_along_axis(signals, k + i, axis=-1)[..., 0] for i in (-1, 0, 1))
    slope, bend = 0.5 * (after - before), before - 2.0 * here + after
    place = np.clip(-slope / np.where(bend < 0.0, bend, -np.inf), -1.0, 1.0)
    return np.asarray(np.maximum(top, here + slope * place + 0.5 * bend * place * place))


def _real_rows(residues: ComplexArray) -> FloatArray:
    """Real rows (N, q, 2 n) of complex ones (N, q, n) that take ``[Re E, Im E]`` to ``Re(residues E)``."""
    return np.concatenate([residues.real, -residues.imag], axis=-1)


def _miss(spec: Spec, values: FloatArray, limit: FloatArray) -> FloatArray:
    """Numbers of values (N, c) for a limit (N, 1)."""
    part = values / limit - 1.0 if spec.sense == "max" else 1.0 - values / limit
    bent = part > 0.0 if spec.sense == "max" else part < 0.0
    return np.clip(np.where(bent, np.sign(part) * np.log1p(np.abs(part)), part), LOWEST, HIGHEST)
