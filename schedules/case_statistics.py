"""What many cases of a figure come to at each point: the worst and its case, percentiles, and what it depends on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: Which way a figure is bad.
Bad = Literal["small", "large"]
#: A linear fit whose normal equations are worse conditioned than this does not tell the parameters apart.
WORST_CONDITION = 1e10


@dataclass(frozen=True, eq=False)
class Distribution(GridArrays):
    """A figure over its cases, each (*G,) but the factors.

    A case in which the figure does not exist (not stable, not settled in time) counts as worse than all others, so
    that what is left of an unstable plant does not look good. Percentiles are values of cases: of D of them the
    ``ceil(D p / 100)``-th from below.

    Attributes
    ----------
    worst : worst value; nan where it does not exist in some case, or nothing is flown
    worst_case : number of that case; of several without a value the one with the largest real part; -1 where nothing
        is flown
    worst_factors : (*G, k) what the parameters are multiplied by in it
    p05, p50, p95 : percentiles; nan where they fall on a case without a value
    """

    worst: FloatArray
    worst_case: IntArray
    worst_factors: FloatArray
    p05: FloatArray
    p50: FloatArray
    p95: FloatArray


@dataclass(frozen=True, eq=False)
class Influence(GridArrays):
    """How a figure depends on each parameter: the linear fit over the cases in which it exists.

    Attributes
    ----------
    slope : (*G, k) change of the figure with the factor on each parameter [its unit]: by a hundredth of it for 1 %
    standardised : (*G, k) slope times the standard deviation of the factor over that of the figure [-]; the squares
        add up to `explained` where the factors are uncorrelated, as corners are
    explained : (*G,) part of the figure's variance that the fit accounts for [-]; near 1 the rest may be believed
    """

    slope: FloatArray
    standardised: FloatArray
    explained: FloatArray


def distribution_of(
    values: FloatArray, growth: FloatArray, flown: BoolArray, factors: FloatArray, bad: Bad
) -> Distribution:
    """Distribution of a figure over its cases.

    Parameters
    ----------
    values : (*G, D) the figure; nan where it does not exist
    growth : (*G, D) largest real part of the poles [1/s], to tell cases without a value apart
    flown : (*G,) where anything is
    factors : (D, k)
    bad : which way the figure is bad
    """
    sign = 1.0 if bad == "large" else -1.0
    badness = np.where(np.isnan(values), np.inf, sign * values)
    worst = np.max(badness, axis=-1, keepdims=True)
    of_equals = np.where(badness == worst, np.nan_to_num(growth, nan=np.inf), -np.inf)
    case = np.where(flown, np.argmax(of_equals, axis=-1), -1)
    from_below = np.sort(sign * badness, axis=-1)
    from_below = np.where(flown[..., None] & np.isfinite(from_below), from_below, np.nan)
    count = values.shape[-1]
    p05, p50, p95 = (from_below[..., -(-count * p // 100) - 1] for p in (5, 50, 95))
    extreme = from_below[..., -1 if bad == "large" else 0]
    return Distribution(extreme, case, np.where(flown[..., None], factors[case], np.nan), p05, p50, p95)


def influence_of(values: FloatArray, factors: FloatArray) -> Influence:
    """Least-squares fit of a figure, linear in the factors, at every point.

    nan where fewer than k + 2 cases have a value, where these do not tell the parameters apart, and, but for the
    slope, where the figure does not change.

    Parameters
    ----------
    values : (*G, D), nan where the figure does not exist
    factors : (D, k)
    """
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    enough = count >= factors.shape[1] + 2
    share = known / np.maximum(count, 1)[..., None]
    x, y = factors - factors.mean(axis=0), np.where(known, values, 0.0)
    x_mean, y_mean = share @ x, np.sum(share * y, axis=-1)
    off = np.where(known, y - y_mean[..., None], 0.0)
    covariance = np.einsum("...d,di,dj->...ij", share, x, x) - x_mean[..., :, None] * x_mean[..., None, :]
    deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=-2, axis2=-1), 0.0))
    spread = np.where(deviation > 0.0, deviation, 1.0)
    alike = covariance / (spread[..., :, None] * spread[..., None, :])
    apart = enough & (np.linalg.cond(alike) < WORST_CONDITION)
    alike = np.where(apart[..., None, None], alike, np.eye(factors.shape[1]))
    by_factor = ((share * off) @ x) / spread
    fit = np.where(apart[..., None], np.linalg.solve(alike, by_factor[..., None])[..., 0], np.nan)
    variance = np.sum(share * off**2, axis=-1)
    moves = variance > (1e-12 * np.abs(y_mean)) ** 2
    unit = np.where(moves, np.sqrt(variance), np.nan)
    return Influence(fit / spread, fit / unit[..., None], np.sum(fit * by_factor, axis=-1) / unit**2)
