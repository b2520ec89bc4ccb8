"""Manoeuvres: the references of a loop as functions of time, that actuators are judged on (seed 4.3, 5.7, 6.3.2).

Steps, rate-limited steps, ramps, doublets and recorded series are all piecewise linear, a step being a jump; a sine
adds to that. Both are driven by a system that nothing drives, so that responses to them are exact (`Manoeuvre.free`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """References (p) over time, from trim, zero before t = 0: linear from knot to knot, plus a sine.

    From knot k to the next one, and from the last one on for ever::

        r(t) = values[k] + slopes[k] (t - times[k]) + amplitude sin(omega t)

    Attributes
    ----------
    times : (k,) knots, increasing from 0 [s]
    values : (k, p) just after each knot [rad]
    slopes : (k, p) from each knot on [rad/s]
    amplitude : (p,) of the sines [rad]
    omega : frequency of the sines [rad/s]; 0 without

    Raises
    ------
    ValueError : arrays that do not fit, knots that do not increase from 0, numbers that are not finite, a sine of
        negative frequency or an amplitude without one
    """

    times: FloatArray
    values: FloatArray
    slopes: FloatArray
    amplitude: FloatArray
    omega: float = 0.0

    def __post_init__(self) -> None:
        k, p = len(self.times), len(self.amplitude)
        if self.times.shape != (k,) or self.values.shape != (k, p) or self.slopes.shape != (k, p) or k == 0:
            raise ValueError("a manoeuvre needs times (k,), values (k, p), slopes (k, p) and amplitude (p,)")
        numbers = (self.times, self.values, self.slopes, self.amplitude, np.array(self.omega))
        if not all(np.isfinite(each).all() for each in numbers):
            raise ValueError("a manoeuvre holds numbers that are not finite")
        if self.times[0] != 0.0 or np.any(np.diff(self.times) <= 0.0):
            raise ValueError("the knots of a manoeuvre increase, from 0 s on")
        if self.omega < 0.0 or (self.omega == 0.0 and np.any(self.amplitude)):
            raise ValueError(f"a sine needs a frequency above 0, not {self.omega} rad/s")

    @property
    def ends(self) -> FloatArray:
        """(k, p) what is left of each stretch just before the next knot, without the sine; of the last its value."""
        length = np.append(np.diff(self.times), 0.0)
        return np.asarray(self.values + self.slopes * length[:, None])

    @property
    def jumps(self) -> FloatArray:
        """(k, p) by how much the references jump at each knot [rad]."""
        before = np.concatenate([np.zeros((1, len(self.amplitude))), self.ends[:-1]])
        return np.asarray(self.values - before)

    def at(self, time: FloatArray) -> FloatArray:
        """(*T, p) the references at some times (*T), just after a jump [rad]."""
        t = np.asarray(time, dtype=float)
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, None)
        found = self.values[k] + self.slopes[k] * (t - self.times[k])[..., None]
        found = found + self.amplitude * np.sin(self.omega * t)[..., None]
        return np.where(t[..., None] < 0.0, 0.0, found)

    def free(self, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The references from knot k on as a system that nothing drives: ``z' = S z, r = W z``.

        Returns
        -------
        S (4, 4), W (p, 4) and z (4,) at the knot, z = [1, t - t_k, sin, cos] [-, s, -, -]
        """
        S = np.zeros((4, 4))
        S[1, 0] = 1.0
        S[2, 3], S[3, 2] = self.omega, -self.omega
        zero = np.zeros_like(self.amplitude)
        W = np.stack([self.values[k], self.slopes[k], self.amplitude, zero], axis=-1)
        phase = self.omega * self.times[k]
        return S, W, np.array([1.0, 0.0, np.sin(phase), np.cos(phase)])


def _of(times: FloatArray, values: FloatArray, slopes: FloatArray) -> Manoeuvre:
    return Manoeuvre(times, values, slopes, np.zeros(values.shape[-1]))


def step(size: FloatArray) -> Manoeuvre:
    """A step of each reference (p,) [rad] at t = 0."""
    return _of(np.zeros(1), np.asarray(size, float)[None], np.zeros((1, len(size))))


def rate_limited_step(size: FloatArray, rate: float) -> Manoeuvre:
    """A step of each reference (p,) [rad] that is reached at this rate [rad/s], the smaller ones sooner (Fig 5.20).

    Raises
    ------
    ValueError : the rate is not positive and finite
    """
    _check("rate", rate, "rad/s")
    size = np.asarray(size, float)
    reached = np.abs(size) / rate
    times = np.unique(np.append(reached, 0.0))
    values = np.sign(size) * rate * np.minimum(times[:, None], reached)
    slopes = np.where(times[:, None] < reached, np.sign(size) * rate, 0.0)
    return _of(times, np.where(times[:, None] < reached, values, size), slopes)


def ramp(slope: FloatArray) -> Manoeuvre:
    """A ramp of each reference, of this slope (p,) [rad/s], without end."""
    slope = np.asarray(slope, float)
    return _of(np.zeros(1), np.zeros((1, len(slope))), slope[None])


def doublet(size: FloatArray, length: float) -> Manoeuvre:
    """Each reference (p,) held at its size [rad] for a length [s], at the opposite for as long, then at zero.

    Raises
    ------
    ValueError : the length is not positive and finite
    """
    _check("length", length, "s")
    size = np.asarray(size, float)
    return _of(np.array([0.0, length, 2.0 * length]), np.stack([size, -size, 0.0 * size]), np.zeros((3, len(size))))


def sine(amplitude: FloatArray, omega: float) -> Manoeuvre:
    """A sine of each reference, of this amplitude (p,) [rad] and frequency [rad/s], from t = 0.

    Raises
    ------
    ValueError : the frequency is not positive and finite
    """
    _check("frequency", omega, "rad/s")
    amplitude = np.asarray(amplitude, float)
    nothing = np.zeros((1, len(amplitude)))
    return Manoeuvre(np.zeros(1), nothing, nothing, amplitude, float(omega))


def recorded(times: FloatArray, series: FloatArray) -> Manoeuvre:
    """A recorded series (k, p) [rad] at times (k,) [s], straight lines between them, held at the end.

    A series that does not begin at zero jumps there; two equal times are a jump.

    Raises
    ------
    ValueError : times that fall or do not begin at 0, three equal ones, or arrays that do not fit
    """
    times, series = np.asarray(times, float), np.asarray(series, float)
    if series.ndim != 2 or times.shape != series.shape[:1] or len(times) == 0:
        raise ValueError("a recorded series needs times (k,) and values (k, p)")
    gaps = np.diff(times)
    if np.any(gaps < 0.0) or np.any((gaps[1:] == 0.0) & (gaps[:-1] == 0.0)):
        raise ValueError("the times of a recorded series rise; two may be equal, where it jumps")
    slopes = np.zeros_like(series)
    rising = gaps > 0.0
    slopes[:-1][rising] = np.diff(series, axis=0)[rising] / gaps[rising, None]
    kept = np.append(rising, True)
    return _of(times[kept], series[kept], slopes[kept])


def _check(what: str, value: float, unit: str) -> None:
    if not 0.0 < value < np.inf:
        raise ValueError(f"the {what} of a manoeuvre must be positive and finite, not {value} {unit}")
