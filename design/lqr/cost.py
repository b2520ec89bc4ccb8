"""The quadratic cost of a plant: any kind of weights as Q, R and N over all its states, checked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.lqr.output_weights import OutputWeights, check_output_weights, output_map
from design.lqr.power_weights import NetWorkWeights, PlainWeights, PowerBalancedWeights, Weights, largest_price
from design.lqr.tracking import TrackingPlant
from design.lqr.weights import WeightName, WeightsRefused, check_weights, weight_matrices
from design.padded import padded
from model.arrays import BoolArray, FloatArray, IntArray, ObjectArray

#: A price above the largest admissible one by this part of it is so by rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Cost:
    """``int( x'Qx + u'Ru + 2x'Nu ) dt``; each matrix the same everywhere, or with the grid's axes.

    Attributes
    ----------
    Q (n, n) or (*G, n, n), R (2, 2) or (*G, 2, 2), N (n, 2) or (*G, n, 2) or None
    inadmissible : (*G,) object array of str, why a point has no cost; None where no point is without
    """

    Q: FloatArray
    R: FloatArray
    N: FloatArray | None
    inadmissible: ObjectArray | None = None

    def at(self, points: BoolArray | IntArray) -> Cost:
        """The cost of some points of the grid, by a mask (*G,) or, on a grid of one axis, their numbers."""

        def some(matrix: FloatArray) -> FloatArray:
            return np.asarray(matrix[points]) if matrix.ndim > 2 else matrix

        return Cost(some(self.Q), some(self.R), None if self.N is None else some(self.N))

    def scaled(self, state_factors: FloatArray, input_factors: FloatArray) -> Cost:
        """The cost of states and inputs times factors (*G, n), (*G, 2): a congruence, which keeps it semidefinite."""
        x, u = state_factors, input_factors
        return Cost(
            Q=self.Q * (x[..., :, None] * x[..., None, :]),
            R=self.R * (u[..., :, None] * u[..., None, :]),
            N=None if self.N is None else self.N * (x[..., :, None] * u[..., None, :]),
            inadmissible=self.inadmissible,
        )


def cost_of(weights: Weights, plant: TrackingPlant) -> Cost:
    """The cost before any balance of powers: that of `PowerBalancedWeights` is the cost of what they scale.

    Raises
    ------
    WeightsRefused : weights that define no regulator at any point
    """
    if isinstance(weights, PowerBalancedWeights):
        return _plain(weights.base, plant)
    if isinstance(weights, NetWorkWeights):
        return _with_price(_plain(weights.base, plant), weights, plant)
    return _plain(weights, plant)


def _plain(weights: PlainWeights, plant: TrackingPlant) -> Cost:
    if isinstance(weights, OutputWeights):
        check_output_weights(weights)
        seen = output_map(weights.outputs, plant)
        # A model that is not finite has no cost, and must not cost its neighbours theirs.
        C, D = (np.where(np.isfinite(matrix), matrix, 0.0) for matrix in (seen.C, seen.D))
        weighed = C.mT @ weights.W_y
        N = weighed @ D
        return Cost(weighed @ C, weights.W_u + D.mT @ weights.W_y @ D, N if np.any(N) else None)
    least, states = plant.structure.weighted_states(), plant.states
    given = weight_matrices(weights, least)
    n = (len(least), len(states))
    _check_size("Q", given.Q, [(k, k) for k in n], plant)
    _check_size("R", given.R, [(2, 2)], plant)
    if given.N is not None:
        _check_size("N", given.N, [(k, 2) for k in n], plant)
    Q = padded(given.Q, len(states), len(states))
    cross = None if given.N is None else padded(given.N, len(states), 2)
    check_weights(Q, given.R, cross)
    return Cost(Q, given.R, cross)


def _check_size(name: WeightName, matrix: FloatArray, allowed: list[tuple[int, int]], plant: TrackingPlant) -> None:
    """Explicit weights are over the named states and inputs, in order."""
    if matrix.shape in allowed:
        return
    least, states = plant.structure.weighted_states(), plant.states
    over = f"the states {' '.join(states)} and the inputs T_t T_a"
    if len(states) > len(least):
        over += f", or only {' '.join(least)} of the states"
    expected = " or ".join(str(shape) for shape in dict.fromkeys(reversed(allowed)))
    raise WeightsRefused(name, None, f"{name} has shape {matrix.shape}: expected {expected}, over {over}")


def _with_price(cost: Cost, weights: NetWorkWeights, plant: TrackingPlant) -> Cost:
    """``w_i / 2`` between each torque and its rate in N."""
    n = len(plant.states)
    price = np.zeros((n, 2))
    for i, (rate, w) in enumerate((("dt_rate", weights.tab), ("da_rate", weights.aileron))):
        price[plant.states.index(rate), i] = 0.5 * w
    base = np.zeros((n, 2)) if cost.N is None else cost.N
    largest = largest_price(_joint(cost.Q, base, cost.R), _joint(np.zeros((n, n)), price, np.zeros((2, 2))))
    if weights.part is not None:
        if not np.all(largest > 0.0):
            raise WeightsRefused(
                "N", 0j, "no price of net work is admissible: a rate that it acts on has no weight in Q"
            )
        return Cost(cost.Q, cost.R, base + (weights.part * largest)[..., None, None] * price)
    priced = Cost(cost.Q, cost.R, base + price)
    beyond = largest * (1.0 + _ROUNDING) < 1.0
    if not np.any(beyond):
        return priced
    lowest = np.linalg.eigvalsh(cost.Q - (base + price) @ np.linalg.solve(cost.R, (base + price).mT))[..., 0]
    said = (
        "Q - N R^-1 N' is not positive semidefinite: its smallest eigenvalue is {:.6g}; "
        "at most {:.6g} times these prices of net work are admissible"
    )
    if np.all(beyond):
        worst = np.unravel_index(int(np.argmin(largest)), np.shape(largest))
        raise WeightsRefused("N", complex(lowest[worst]), said.format(lowest[worst], largest[worst]))
    reasons = np.full(np.shape(largest), None, dtype=object)
    for index in map(tuple, np.argwhere(beyond)):
        reasons[index] = said.format(lowest[index], largest[index])
    return Cost(priced.Q, priced.R, priced.N, reasons)


def _joint(Q: FloatArray, N: FloatArray, R: FloatArray) -> FloatArray:
    """``[Q N; N' R]`` (..., n + m, n + m)."""
    shape = np.broadcast_shapes(Q.shape[:-2], N.shape[:-2], R.shape[:-2])
    n, m = N.shape[-2:]
    joint = np.empty((*shape, n + m, n + m))
    joint[..., :n, :n], joint[..., :n, n:], joint[..., n:, :n], joint[..., n:, n:] = Q, N, N.mT, R
    return joint
