"""Weighing the power of the actuators: as a cross term that prices net work, or as a balance of peaks (seed 5.2).

The power of an actuator, ``p_i = T_i d_i'``, is no quadratic form by itself, but a product of an input and a state:

- `NetWorkWeights` add ``int( w_t T_t dt' + w_a T_a da' ) dt`` to the cost: a cross term N with ``w_i / 2`` between each
  torque command and the rate of its surface. It prices the *net* work: what comes back from the surface is
  credited, and a peak that is paid back soon costs nothing. It is admissible while the whole cost stays semidefinite.
- `PowerBalancedWeights` scale the weight of each torque together with that of its rate, ``R_ii`` and the weight of
  ``d_i'``, by one factor rho_i, until the actuator's peak power for a reference step is what is wanted. In Bryson's
  terms the product of the largest acceptable torque and rate, the acceptable power, is divided by rho_i.

Both make the response slower. So the integrals' weights may be scaled by one more factor sigma, with which the
aileron settles exactly when it does without regard to power. It must be the integrals': a cost that is multiplied as a
whole has the same optimum, so scaling the weights of the angles too would undo the balance, not make up for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.lqr.output_weights import OutputWeights
from design.lqr.weights import BrysonWeights, ExplicitWeights
from model.arrays import FloatArray

#: Weights without regard to power.
PlainWeights = BrysonWeights | ExplicitWeights | OutputWeights
#: An eigenvalue of the unit-diagonal cost below this is zero: no price may touch its direction.
_ZERO = 1e-12


@dataclass(frozen=True)
class ReferenceStep:
    """The manoeuvre on which power is judged: steps of both references [rad] from trim, followed for `duration` [s]."""

    aileron: float
    duration: float
    tab: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.aileron) and self.aileron != 0.0 and np.isfinite(self.tab)):
            raise ValueError("a reference step must move the aileron, by a finite angle")
        if not 0.0 < self.duration < np.inf:
            raise ValueError(f"the duration of a step must be positive and finite, not {self.duration} s")


@dataclass(frozen=True)
class NetWorkWeights:
    """Net work of the actuators priced on top of other weights.

    The torque that is priced is the commanded one; a lag or a delay in the torque loop is not seen by the price.

    Attributes
    ----------
    base : the other weights
    tab, aileron : price w of the work of each [unit of the cost per J], at least 0, one of them positive
    part : None takes the prices as they are; a number in (0, 1] takes them in this proportion, times the factor
        that makes them this part of the largest admissible ones
    retuned_on : step on which the aileron is to settle as with `base`; None leaves the response as it becomes
    """

    base: PlainWeights
    tab: float
    aileron: float
    part: float | None = None
    retuned_on: ReferenceStep | None = None

    def __post_init__(self) -> None:
        prices = self.tab, self.aileron
        if not (np.all(np.isfinite(prices)) and min(prices) >= 0.0 and max(prices) > 0.0):
            raise ValueError(f"prices of work must be at least 0, one of them positive, not {self.tab}, {self.aileron}")
        if self.part is not None and not 0.0 < self.part <= 1.0:
            raise ValueError(f"part of the largest admissible price: must be in (0, 1], not {self.part}")


@dataclass(frozen=True)
class PowerBalancedWeights:
    """Weights scaled point by point until the peak power of each actuator is its share of what it can do.

    Attributes
    ----------
    base : the weights that are scaled
    tab_power, aileron_power : peak of ``abs(T d')``, trim torque included, for `step` [W]; None asks nothing of that
        actuator, and scales its weights like the other's. One of them is given
    step : the reference step
    keep_settling : the aileron settles as with `base`
    """

    base: PlainWeights
    tab_power: float | None
    aileron_power: float | None
    step: ReferenceStep
    keep_settling: bool = True

    def __post_init__(self) -> None:
        given = [power for power in (self.tab_power, self.aileron_power) if power is not None]
        if not given or not all(0.0 < power < np.inf for power in given):
            raise ValueError(
                f"peak powers must be positive [W], one of them given, not {self.tab_power}, {self.aileron_power}"
            )


Weights = PlainWeights | NetWorkWeights | PowerBalancedWeights


def largest_price(cost: FloatArray, price: FloatArray) -> FloatArray:
    """Largest factor (*G,) by which `price` may be added to `cost` so that the sum stays positive semidefinite.

    Parameters
    ----------
    cost : (*G, k, k) symmetric, positive semidefinite: ``[Q N; N' R]``
    price : (*G, k, k) or (k, k) symmetric

    Returns
    -------
    (*G,) zero where the price touches a direction without any cost; else ``-1 / s`` of the smallest eigenvalue s of the
    price in coordinates where the cost is the identity, infinite unless s is negative
    """
    diagonal = np.diagonal(cost, axis1=-2, axis2=-1)
    unit = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    scale = unit[..., :, None] * unit[..., None, :]
    values, vectors = np.linalg.eigh(cost * scale)
    seen = values > _ZERO
    root = np.where(seen, 1.0 / np.sqrt(np.where(seen, values, 1.0)), 0.0)[..., None, :] * vectors
    priced = price * scale
    blind = np.where(seen[..., None, :], 0.0, vectors)
    outside = np.abs(priced @ blind).max(axis=(-2, -1)) > np.sqrt(_ZERO) * np.abs(priced).max(axis=(-2, -1))
    lowest = np.linalg.eigvalsh(root.mT @ priced @ root)[..., 0]
    binds = lowest < 0.0
    edge = np.where(binds, -1.0 / np.where(binds, lowest, -1.0), np.inf)
    return np.asarray(np.where(outside, 0.0, edge))
