"""The guaranteed peak of every output over all references of bounded size and rate, over the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.loop import Loop
from design.worst_case.channels import Channels, channels
from design.worst_case.kernel import Samples, in_one_row, samples_of
from design.worst_case.refine import Bounds, limited, unlimited
from model.arrays import FloatArray, Floats, GridArrays


@dataclass(frozen=True, eq=False)
class GuaranteedPeaks(GridArrays):
    """Largest magnitude of each output, trim included, over all admissible references.

    Attributes
    ----------
    upper : (*G, o) no admissible reference exceeds it; inf where an output takes the rate of a reference that may jump,
        and where the loop is not stable, or next to it (a damping ratio below 0.004, or a mode that decays 1e8 times
        slower than the fastest one); nan where the point is not finite
    lower : (*G, o) admissible references come as close to it as one likes; the trim where the loop is not stable
    names : of the outputs
    """

    upper: FloatArray
    lower: FloatArray
    names: tuple[str, ...]

    def index(self, name: str) -> int:
        """Index of the named output; ValueError when there is none."""
        if name not in self.names:
            raise ValueError(f"there is no output {name!r}; there are {', '.join(self.names)}")
        return self.names.index(name)


def guaranteed_peaks(
    loop: Loop, amplitude: Floats, rate: Floats | None = None, outputs: tuple[str, ...] | None = None
) -> GuaranteedPeaks:
    """Bounds of ``max |y|`` over all references with ``|r| <= amplitude`` and ``|r'| <= rate``, from trim, for ever.

    Without a limit of the rate that is the trim's magnitude and the amplitude times the L1 norm of the impulse
    response, direct feed-through included. With one it is a linear programme (`design.worst_case.programme`), solved
    so that the two bounds differ by 1e-4 of the change, seldom by up to 1e-3. References are independent of each other,
    so their peaks add up; and as both signs are admissible, so does the trim.

    Parameters
    ----------
    loop : closed loops over any grid; points may carry nan
    amplitude : (p,) of each reference, or one for all [rad], at least 0
    rate : (p,) of each reference, or one for all [rad/s], above 0; inf or None without a limit
    outputs : names of outputs, and tracking errors (``da_error``); all outputs when left out

    A loop with delays is judged with chains of states instead (`design.delay.with_pade`): the bounds are those of that
    loop. Where a delayed command reaches an output directly (a torque) and the reference may jump, the chain rings
    about a jump that the delay passes on unchanged, and the bounds may be twice those of the loop itself.

    Raises
    ------
    ValueError : limits of the wrong shape or sign, or no such output
    """
    size, speed = limits(loop, amplitude, rate)
    seen = channels(loop, loop.outputs if outputs is None else outputs)
    grid = seen.stable.shape
    changed = np.zeros((2, *grid, len(seen.names)))
    for p in np.flatnonzero(size > 0.0):
        changed += size[p] * _channel(seen, int(p), size[p] / speed[p])
        with np.errstate(invalid="ignore"):
            rates = np.where(seen.R[..., p] == 0.0, 0.0, np.abs(seen.R[..., p]) * speed[p])
        changed += rates
    peaks = np.abs(seen.trim) + changed
    known, stable = seen.finite[..., None], seen.stable[..., None]
    upper = np.where(known, np.where(stable, peaks[1], np.inf), np.nan)
    lower = np.where(known, np.where(stable, peaks[0], np.abs(seen.trim)), np.nan)
    return GuaranteedPeaks(upper, lower, seen.names)


def limits(loop: Loop, amplitude: Floats, rate: Floats | None) -> tuple[FloatArray, FloatArray]:
    """Amplitude and rate (p,) of each reference of a loop, checked; inf without a limit."""
    count = len(loop.references)
    try:
        size = np.broadcast_to(np.asarray(amplitude, dtype=float), (count,))
        speed = np.broadcast_to(np.asarray(np.inf if rate is None else rate, dtype=float), (count,))
    except ValueError as error:
        raise ValueError(f"amplitude and rate are one number, or one for each of {count} references") from error
    if not np.all((size >= 0.0) & (size < np.inf)):
        raise ValueError(f"amplitudes must be finite and not negative, are {size} rad")
    if not np.all(speed > 0.0):
        raise ValueError(f"rates must be positive, are {speed} rad/s")
    return size, speed


def _channel(seen: Channels, reference: int, travel_time: float) -> FloatArray:
    """(2, *G, o) lower and upper peak of the change for one reference of size 1 that takes so long [s] to get there."""
    found = np.zeros((2, *seen.stable.shape, len(seen.names)))
    alike: dict[tuple[int, ...], list[tuple[tuple[int, ...], Samples]]] = {}
    for place in np.argwhere(seen.stable):
        index = tuple(int(i) for i in place)
        samples = samples_of(seen.A[index], seen.B[index][:, reference], seen.C[index])
        alike.setdefault(samples.value.shape, []).append((index, samples))
    for points in alike.values():
        samples = in_one_row([each for _, each in points])
        direct = np.concatenate([seen.D[index][:, reference] for index, _ in points])
        bounds = peaks_of(samples, direct, travel_time)
        for number, (index, _) in enumerate(points):
            mine = slice(number * len(seen.names), (number + 1) * len(seen.names))
            found[(0, *index)], found[(1, *index)] = bounds.lower[mine], bounds.upper[mine]
    return found


def peaks_of(samples: Samples, direct: FloatArray, travel_time: float) -> Bounds:
    """Bounds (N,) for references of size 1 that take `travel_time` [s] to get there; 0 when they may jump."""
    if travel_time == 0.0:
        return unlimited(samples, direct)
    return limited(samples, direct, travel_time / samples.horizon)
