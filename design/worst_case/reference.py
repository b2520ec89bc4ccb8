"""The worst reference of one point: a series that makes an output as large as is possible."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.loop import Loop
from design.manoeuvre import Manoeuvre
from design.worst_case.channels import channels
from design.worst_case.kernel import Samples, samples_of
from design.worst_case.peaks import limits
from design.worst_case.refine import passes
from model.arrays import FloatArray, Floats

#: The last stretch of a reference whose rate an output takes, as a part of its first interval.
_LAST = 1e-3


@dataclass(frozen=True)
class _Series:
    """One reference of size 1: knots (k,) [s], values just after them and slopes from there on, zero at the end."""

    times: FloatArray
    values: FloatArray
    slopes: FloatArray

    def later(self, by: float) -> _Series:
        """The same, at rest for some time [s] before."""
        if by == 0.0:
            return self
        return _Series(*(np.append(0.0, each) for each in (self.times + by, self.values, self.slopes)))


def worst_reference(loop: Loop, output: str, amplitude: Floats, rate: Floats | None = None) -> Manoeuvre:
    """A reference with ``|r| <= amplitude`` and ``|r'| <= rate`` that makes ``|y|`` reach its guaranteed peak.

    The peak is reached at the last knot: where references may jump just after it, and where an output takes the rate
    of a reference just before it; there they stay. Parameters and errors are those of
    `design.worst_case.peaks.guaranteed_peaks`.

    Parameters
    ----------
    loop : one stable point, without grid axes (``loop.take(index)``)
    output : name of the output, or a tracking error (``da_error``)

    Returns
    -------
    Manoeuvre : of as many references as the loop has

    Raises
    ------
    ValueError : as `guaranteed_peaks`; or the loop has grid axes, is not stable, or has no largest output because it
        takes the rate of a reference that may jump
    """
    size, speed = limits(loop, amplitude, rate)
    seen = channels(loop, (output,))
    if seen.stable.shape:
        raise ValueError(f"a worst reference is that of one point, not of a grid {seen.stable.shape}")
    if not seen.stable:
        raise ValueError("the loop is not stable, or next to it: no largest value of its outputs is known")
    if np.any((seen.R[0] != 0.0) & np.isinf(speed) & (size > 0.0)):
        raise ValueError(f"{output} takes the rate of a reference that may jump: it has no largest value")
    found = []
    for p in range(size.size):
        samples = samples_of(seen.A, seen.B[:, p], seen.C)
        if size[p] == 0.0:
            found.append(_Series(*np.zeros((3, 1))))
        elif np.isinf(speed[p]):
            found.append(_jumping(samples, float(seen.D[0, p])))
        else:
            found.append(_moving(samples, float(seen.D[0, p]), float(seen.R[0, p]), size[p] / speed[p]))
    end = max(float(series.times[-1]) for series in found)
    found = [series.later(end - float(series.times[-1])) for series in found]
    size = np.where(seen.trim[0] < 0.0, -size, size)
    times = np.unique(np.concatenate([series.times for series in found]))
    values, slopes = np.empty((2, times.size, size.size))
    for p, series in enumerate(found):
        k = np.searchsorted(series.times, times, side="right") - 1
        values[:, p] = size[p] * (series.values[k] + series.slopes[k] * (times - series.times[k]))
        slopes[:, p] = size[p] * series.slopes[k]
    return Manoeuvre(times, values, slopes, np.zeros(size.size))


def _jumping(samples: Samples, direct: float) -> _Series:
    """What references that may jump do: always at a bound, by the sign of g, and in the end by that of D."""
    zeros = samples.zeros[0][(samples.zeros[0] > 0.0) & (samples.zeros[0] < 1.0)]
    edges = np.concatenate([[0.0], zeros, [1.0]])
    gamma, _ = samples.at(np.zeros(edges.size, dtype=np.int64), edges)
    signs = np.sign(gamma[:-1] - gamma[1:])[::-1]
    last = np.sign(direct) if direct != 0.0 else signs[-1]
    times = (1.0 - edges[::-1]) * samples.horizon[0]
    return _Series(times, np.append(signs, last), np.zeros(times.size))


def _moving(samples: Samples, direct: float, of_rate: float, travel_time: float) -> _Series:
    """What references of bounded rate do, with a stretch at the end for an output that takes their rate."""
    tau = np.array([travel_time / samples.horizon[0]])
    best, *_ = sorted(passes(samples, np.array([direct]), tau), key=lambda each: -float(each.reached.value[0]))
    s, rho = best.problem.times[0], best.reached.rho[0]
    kept = np.append(np.diff(s) > 0.0, True)
    s, rho = s[kept], rho[kept]
    if of_rate != 0.0:
        s = np.concatenate([[0.0, _LAST * s[1]], s[1:]])
        change = np.sign(of_rate) * s[1] / tau[0]
        before = rho[0] + _LAST * (rho[1] - rho[0])
        end = np.clip(before + change, -1.0, 1.0)
        rho = np.concatenate([[end, end - change], rho[1:]])
    lead = abs(rho[-1]) * tau[0]
    if lead > 0.0:
        s, rho = np.append(s, s[-1] + lead), np.append(rho, 0.0)
    times, values = (s[-1] - s[::-1]) * samples.horizon[0], rho[::-1]
    later = np.append(np.diff(times) > 0.0, True)  # rounding merges knots
    times, values = times[later], values[later]
    slopes = np.append(np.diff(values) / np.diff(times), 0.0)
    turns = np.abs(np.diff(slopes, prepend=0.0)) * travel_time > 1e-9  # the others lie on a straight line
    turns[[0, -1]] = True
    return _Series(times[turns], values[turns], slopes[turns])
