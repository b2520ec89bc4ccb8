"""Where the free tab rests when the aileron is on its reference: the steady-state map of seed 2.5, linear (seed 5.3).

At rest the torques that hold the surfaces away from trim are ``T = H [dt, da]`` with the static stiffness H. Of every
radian of aileron the tab takes k, and the torques per radian of aileron are ``T_t = H_tt k + H_ta``,
``T_a = H_at k + H_aa``:

======================== ==========================================================================================
``zero_aileron_torque``  ``T_a = 0``: the tab floats the aileron to its reference
``least_torque``         least ``(T_t / T_t,max)^2 + (T_a / T_a,max)^2``
``least_power``          least ``(T_t k / p_t,max)^2 + (T_a / p_a,max)^2``
a `TabRatio`             k is given
======================== ==========================================================================================

- Torques are deviations from trim. The tab angle at which the *total* torques, trim included, are least is a straight
  line over the aileron's angle too, of the same slope k; it goes through trim when trim is on it (the trim rule
  ``least_torque``). So k is right for the totals as far as trim is.
- Nothing that holds still has power. But while both surfaces move to their rest together, along any course ``r(t)``,
  the power against the air is ``p_t = T_t k r r'``, ``p_a = T_a r r'``: ``least_power`` makes the squares of both
  least at every moment of every such course. Of two tab angles that do so the smaller one counts.
- Torques and powers are parts of the actuators' limits where both actuators have one, else they count alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.frequency.polynomials import roots
from model.actuators import Actuator
from model.arrays import FloatArray

TabRule = Literal["zero_aileron_torque", "least_torque", "least_power"]

#: Beyond this many radians of tab for a radian of aileron, the tab has no authority.
MAX_TAB_TRAVEL = 1e3
#: A root of the cubic is real when its imaginary part is below this part of it: a pair that rounding has split.
_REAL = 1e-6
#: A coefficient of the cubic below this part of the largest is zero: what it decides is beyond every tab angle.
_NOTHING = 1e-30
#: Newton steps that polish a root of the cubic.
_POLISHING = 2


@dataclass(frozen=True)
class TabRatio:
    """The tab rests at `ratio` radians for every radian of aileron, both from trim."""

    ratio: float

    def __post_init__(self) -> None:
        if not abs(self.ratio) <= MAX_TAB_TRAVEL:
            raise ValueError(f"tab angle per aileron angle: must be within +-{MAX_TAB_TRAVEL:g}, not {self.ratio}")


TabAllocation = TabRule | TabRatio


def tab_travel(holding: FloatArray, allocation: TabAllocation, tab: Actuator, aileron: Actuator) -> FloatArray:
    """Tab angle k per aileron angle at rest (*G,) [rad/rad].

    Parameters
    ----------
    holding : (*G, 2, 2) H of ``T = H [dt, da]``, order [tab, aileron] [N m/rad]
    allocation : the rule, or the ratio itself
    tab, aileron : the actuators, for their limits of torque and power

    Returns
    -------
    (*G,) nan where the rule decides nothing: a tab that moves no torque, or numbers that are not finite

    Raises
    ------
    ValueError : an unknown rule
    """
    tab_row, aileron_row = holding[..., 0, :], holding[..., 1, :]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if isinstance(allocation, TabRatio):
            return np.asarray(np.where(np.isfinite(holding).all(axis=(-2, -1)), allocation.ratio, np.nan))
        if allocation == "zero_aileron_torque":
            return np.asarray(-aileron_row[..., 1] / aileron_row[..., 0])
        if allocation == "least_torque":
            by_tab, by_aileron = _parts(tab.limits.torque, aileron.limits.torque)
            own = by_tab * tab_row[..., 0] ** 2 + by_aileron * aileron_row[..., 0] ** 2
            cross = by_tab * tab_row[..., 0] * tab_row[..., 1] + by_aileron * aileron_row[..., 0] * aileron_row[..., 1]
            return np.asarray(-cross / own)
        if allocation == "least_power":
            by_tab, by_aileron = _parts(tab.limits.power, aileron.limits.power)
            return _least_power(tab_row, aileron_row, by_tab, by_aileron)
    raise ValueError(f"unknown tab allocation {allocation!r}")


def no_rest(allocation: TabAllocation) -> str:
    """Why a rule finds no tab angle, in words."""
    if allocation == "zero_aileron_torque":
        return (
            "the tab has no authority over the aileron's hinge moment: no tab angle balances a deflected aileron "
            "(tab_allocation zero_aileron_torque)"
        )
    if isinstance(allocation, TabRatio):
        return "the torques have no authority over the surfaces: nothing holds them at an angle"
    return (
        f"the tab's angle moves neither torque, or no torque holds it: nothing is least (tab_allocation {allocation})"
    )


def _parts(tab: float | None, aileron: float | None) -> tuple[float, float]:
    """What the squares of both are to be multiplied by, order [tab, aileron]."""
    return (1.0, 1.0) if tab is None or aileron is None else ((aileron / tab) ** 2, 1.0)


def _least_power(tab_row: FloatArray, aileron_row: FloatArray, by_tab: float, by_aileron: float) -> FloatArray:
    """Travel k (*G,) of least ``f(k) = by_tab ((H_tt k + H_ta) k)^2 + by_aileron (H_at k + H_aa)^2``: a root of f'."""
    a, b, c, d = tab_row[..., 0], tab_row[..., 1], aileron_row[..., 0], aileron_row[..., 1]
    slope = np.stack(
        [2.0 * by_tab * a**2, 3.0 * by_tab * a * b, by_tab * b**2 + by_aileron * c**2, by_aileron * c * d], axis=-1
    )
    size = np.abs(slope).max(axis=-1, keepdims=True)
    slope = np.where(np.isfinite(size) & (np.abs(slope) > _NOTHING * size), slope / size, 0.0)
    k = roots(slope)
    real = _polished(slope, np.where(np.abs(k.imag) <= _REAL * np.abs(k), k.real, np.nan))
    T_t, T_a = a[..., None] * real + b[..., None], c[..., None] * real + d[..., None]
    cost = by_tab * (T_t * real) ** 2 + by_aileron * T_a**2
    cost = np.where(np.isfinite(cost), cost, np.inf)
    least = cost <= np.min(cost, axis=-1, keepdims=True) * (1.0 + 1e-9)
    nearest = np.argmin(np.where(least & np.isfinite(cost), np.abs(real), np.inf), axis=-1)
    return np.asarray(np.take_along_axis(real, nearest[..., None], axis=-1)[..., 0])


def _polished(cubic: FloatArray, k: FloatArray) -> FloatArray:
    """Roots (*G, 3) after some Newton steps."""
    p3, p2, p1, p0 = (cubic[..., i, None] for i in range(4))
    for _ in range(_POLISHING):
        value, slope = ((p3 * k + p2) * k + p1) * k + p0, (3.0 * p3 * k + 2.0 * p2) * k + p1
        k = np.where(slope != 0.0, k - value / slope, k)
    return k
