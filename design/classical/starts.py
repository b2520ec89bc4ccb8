"""Where the search begins: gains that give the second-order aileron a frequency, a damping and an integral action.

In the normal form the aileron with its feedback is ``x^2 + (2 zeta + kappa_d) x + 1 + kappa_p``, ``1 - f`` with
positive feedback, as long as the drive is fast. So a start is a frequency w, a damping ratio and a corner of the
integral action over w, the slower and the weaker the more the drive lags behind.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from design.classical.normal_form import NormalForm
from design.classical.open_gains import OpenGains
from model.arrays import FloatArray

#: Damping ratio and integral corner of a start whose stiffness exceeds the aileron's by this part of what lags by a
#: radian; and of one as fast as the drive allows, its frequency over what lags by a radian.
SLOW, FAST = (0.12, 0.5, 0.35), (0.7, 0.7, 0.3)
#: Part of the stiffness that is cancelled, and integral corner.
CANCELLED = ((0.75, 0.1), (0.4, 0.1))
#: Inner gains of a rate command over what lags by a radian, and over omega_n.
INNER_OVER_LAG, INNER = 0.6, 0.7
#: Lag, in radians at the frequency that is aimed at, from which on the feedback is made weaker.
LAG = 0.5
#: Largest frequency of a start.
FASTEST = 30.0


def quick_starts(family: OpenGains) -> FloatArray:
    """A few unknowns (S, P, J) to begin with, far apart."""
    return _starts(family, _inner_gains(family.form), _few)


def many_starts(family: OpenGains) -> FloatArray:
    """Many unknowns (S, P, J) to begin with."""
    return _starts(family, _inner_gains(family.form), _many)


Outer = Callable[[NormalForm, FloatArray], list[FloatArray]]


def _starts(family: OpenGains, inner: list[FloatArray], outer: Outer) -> FloatArray:
    form = family.form
    if not form.rate_command:
        return np.stack([family.unknowns_of(kappa) for kappa in outer(form, form.lag)])
    found = [np.column_stack([k, kappa]) for k in inner for kappa in outer(form, form.lag + 1.0 / k)]
    return np.stack([family.unknowns_of(kappa) for kappa in found])


def _few(form: NormalForm, lag: FloatArray) -> list[FloatArray]:
    if form.positive:
        return [_positive_gains(part, corner, lag) for part, corner in CANCELLED]
    lag = np.maximum(lag, 1e-9)
    slow = np.minimum(np.sqrt(1.0 + SLOW[0] / lag), FASTEST)
    fast = np.clip(FAST[0] / lag, slow, FASTEST)
    return [_negative_gains(slow, *SLOW[1:], lag, form.drag), _negative_gains(fast, *FAST[1:], lag, form.drag)]


def _many(form: NormalForm, lag: FloatArray) -> list[FloatArray]:
    if form.positive:
        parts, corners = (0.1, 0.4, 0.6, 0.75, 0.9), (0.08, 0.3)
        return [_positive_gains(part, corner, lag) for part, corner in product(parts, corners)]
    top = np.clip(1.0 / np.maximum(lag, 1e-9), 1.6, FASTEST)
    steps, ratios, corners = (0.0, 0.33, 0.67, 1.0), (0.4, 0.8), (0.1, 0.4)
    return [
        _negative_gains(top**step, ratio, corner, lag, form.drag)
        for step, ratio, corner in product(steps, ratios, corners)
    ]


def _inner_gains(form: NormalForm) -> list[FloatArray]:
    fast = INNER_OVER_LAG / np.maximum(form.lag, 1e-3)
    slow = np.full(form.lag.shape, INNER)
    return [fast, slow, 2.5 * fast]


def _negative_gains(w: FloatArray, ratio: float, corner: float, lag: FloatArray, drag: FloatArray) -> FloatArray:
    """Frequency, damping ratio and integral corner as gains, weaker where the drive lags too much for them."""
    square = 1.0 + (w**2 - 1.0) * np.minimum(1.0, LAG / np.maximum(lag * w, 1e-9))
    w_n = np.sqrt(square)
    slower = np.minimum(1.0, LAG / np.maximum(lag * w_n, 1e-9))
    rate = slower * np.maximum(2.0 * ratio * w_n - drag, 0.02)
    return np.column_stack([rate, square - 1.0, corner * slower * square * w_n])


def _positive_gains(part: float, corner: float, lag: FloatArray) -> FloatArray:
    w_n = np.sqrt(1.0 - part)
    slower = np.minimum(1.0, LAG / np.maximum(lag * w_n, 1e-9))
    return np.column_stack([np.full(lag.shape, part), corner * slower * w_n**3])
