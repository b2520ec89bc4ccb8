"""Margins and poles of sampled loops, exact.

The bilinear map ``z = (1 + s) / (1 - s)`` takes the unit circle to the imaginary axis and its inside to the left
half-plane: gains, phases and peaks on the one are those on the other, ``z = exp(j w T)`` is at
``s = j tan(w T / 2)``, and half the sampling rate is at infinity. So a sampled loop has its margins taken by
`design.frequency.margins` like any other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.frequency.feedback import ClosedLoop, scaled
from design.frequency.margins import Margins, margins_of
from design.frequency.poles import damping_ratio, pole_order
from design.frequency.transfer import transfer
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays

#: A mode that has decayed by this within the longest delay cannot be told from one at z = 0, which is over after it:
#: so far does rounding carry the many poles that a delay puts there.
OVER = 1e-13


@dataclass(frozen=True, eq=False)
class DiscreteLoop(GridArrays):
    """One sampled loop, opened at one place while all the others stay as they are.

    The closed loop with gain k is ``A - sign k b c``: the loop transfer is ``L(z) = c (zI - A)^-1 b`` and the
    return difference ``1 + sign k L(z)``, as in `design.loop.SisoLoop`.

    Attributes
    ----------
    name : name of the loop: an actuator input (``tab``)
    A : (*G, n, n), b : (*G, n), c : (*G, n) from one sample to the next
    gain : (*G,) the gain at which the design flies this loop
    sign : +1 or -1
    sample_time : [s]
    """

    name: str
    A: FloatArray
    b: FloatArray
    c: FloatArray
    gain: FloatArray
    sign: int
    sample_time: float

    def closed(self, gain: FloatArray | float | None = None) -> FloatArray:
        """Closed-loop matrix ``A - sign k b c`` (*G, n, n) at `gain` (default: the one flown)."""
        k = np.asarray(self.gain if gain is None else gain, dtype=float)
        outer = self.b[..., :, None] * self.c[..., None, :]
        return self.A - self.sign * k[..., None, None] * outer


def sampled_margins(loop: DiscreteLoop) -> Margins:
    """Margins of a sampled loop at the gain it is flown with, the delay of computation and all others included.

    As in `Margins`, where the axis is the unit circle: frequencies are up to half the sampling rate, ``pi / T``,
    which is itself a frequency where the gain can be critical, so that there are n + 1 gain ratios. The delay
    margin is the phase margin over the frequency, least of all crossovers: exact for whole samples; a fraction of
    a sample also changes how the hold fills the time between samples.

    Parameters
    ----------
    loop : its arrays finite

    Raises
    ------
    ValueError : the sample time is not positive, or there are more states than `design.frequency.margins.LARGEST`
    numpy.linalg.LinAlgError : an entry is not finite
    """
    if not loop.sample_time > 0.0:
        raise ValueError(f"sample time must be positive, is {loop.sample_time} s")
    return margins_of(_bilinear(loop), loop.gain.shape)


@dataclass(frozen=True, eq=False)
class SampledPoles(GridArrays):
    """Closed-loop poles of a sampled loop.

    Attributes
    ----------
    z : (*G, n) poles, in the order of `equivalent`
    equivalent : (*G, n) the poles [rad/s] that a continuous loop with the same modes at the samples has,
        ``ln(z) / T``, in `pole_order`; -inf for a mode that is over after some samples (``z = 0``)
    damping_ratio : (*G, n) of these; 1 for ``z = 0``
    stable : (*G,) all poles inside the unit circle
    """

    z: ComplexArray
    equivalent: ComplexArray
    damping_ratio: FloatArray
    stable: BoolArray


def sampled_poles(A: FloatArray, sample_time: float, waiting: int = 0) -> SampledPoles:
    """Poles of ``x_(k+1) = A x_k``.

    Parameters
    ----------
    A : (*G, n, n), finite
    sample_time : [s]
    waiting : samples that the longest delay in the loop takes. It puts as many poles at z = 0, where rounding strews
        them far: modes that are over within it are taken to be these

    Raises
    ------
    numpy.linalg.LinAlgError : an entry is not finite
    """
    z = np.linalg.eigvals(A).astype(complex)
    z[np.abs(z) <= OVER ** (1.0 / max(waiting, 1))] = 0.0
    equivalent = np.empty_like(z)
    with np.errstate(divide="ignore"):
        equivalent.real, equivalent.imag = np.log(np.abs(z)) / sample_time, np.angle(z) / sample_time
    equivalent = pole_order(equivalent)
    over = np.isneginf(equivalent.real)
    lasting = np.where(over, -1.0, equivalent)
    damping = np.where(over, 1.0, damping_ratio(lasting))
    ordered = np.where(over, 0.0, np.exp(lasting * sample_time))
    return SampledPoles(ordered, equivalent, damping, np.abs(z).max(axis=-1) < 1.0)


def _bilinear(loop: DiscreteLoop) -> ClosedLoop:
    """The closed loop in ``s = (z - 1) / (z + 1)``.

    With ``M = (A + I)^-1`` of the closed loop: the poles are those of ``M (A - I)``, and
    ``T = 2 c M (sI - M (A - I))^-1 M b - c M b``.
    """
    n = loop.A.shape[-1]
    A, c = loop.closed().reshape(-1, n, n), loop.c.reshape(-1, n)
    if not np.all(np.isfinite(A)):
        raise np.linalg.LinAlgError("the closed loop has an entry that is not finite")
    b = loop.b.reshape(-1, n) * (loop.sign * loop.gain.reshape(-1))[:, None]
    identity = np.eye(n)
    # A pole at half the sampling rate is not stable; one at zero frequency, which is not either, stands for it.
    singular = np.linalg.det(A + identity) == 0.0
    A = np.where(singular[:, None, None], identity, A)
    M = np.linalg.inv(A + identity)
    matrix, driven = M @ (A - identity), np.einsum("nij,nj->ni", M, b)
    ratio, scale = scaled(transfer(matrix, driven, 2.0 * np.einsum("nj,nji->ni", c, M)))
    through = -np.einsum("ni,ni->n", c, driven)
    numerator = ratio.numerator + through[:, None] * ratio.denominator
    sample_time = np.full(scale.shape, loop.sample_time)
    return ClosedLoop(matrix, numerator, ratio.denominator, scale, np.zeros_like(scale), sample_time)
