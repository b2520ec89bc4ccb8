"""Concurrent actuation: the linear-quadratic regulator with an aileron reference, over the grid (seed 5.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.outcome import Outcome, Outcomes
from design.return_difference import return_difference_min
from design.riccati import RiccatiSolution, solve_riccati
from design.solvability import Solvability, solvability
from design.tracking import (
    SteadyState,
    TabAllocation,
    TrackingPlant,
    augment_with_integral,
    feed_forward,
    steady_state,
)
from design.weights import (
    BrysonWeights,
    ExplicitWeights,
    WeightsRefused,
    check_weights,
    weight_matrices,
)
from model.arrays import BoolArray, FloatArray, GridArrays
from model.linear_model import LinearModel

#: How far below 1 rounding may bring the return difference of an optimal gain.
KALMAN_TOLERANCE = 1e-6


@dataclass(frozen=True)
class LqrController:
    """A state feedback with integral action asked for by its weights.

    Attributes
    ----------
    name : unique in its study
    weights : Bryson's rule, or explicit matrices over ``dt dt_rate da da_rate int_a`` and ``T_t T_a``
    tab_allocation : where the free tab rests when the aileron is on its reference
    reference : what follows a reference
    """

    name: str
    weights: BrysonWeights | ExplicitWeights
    tab_allocation: TabAllocation = "zero_aileron_torque"
    reference: Literal["aileron"] = "aileron"

    @property
    def kind(self) -> Literal["lqr"]:
        """Kind of controller, as in requests and files."""
        return "lqr"


@dataclass(frozen=True, eq=False)
class LqrDesign(GridArrays):
    """Gains over the grid, and what certifies them; nan where the outcome is not ok.

    Attributes
    ----------
    K : (*G, 2, 5) law ``u = -K [dt dt_rate da da_rate int_a] + N r_a``, u = [T_t, T_a] from trim [N m]
    N : (*G, 2, 1) feed-forward [N m/rad]
    X : (*G, 5, 5) solution of the Riccati equation
    residual : (*G,) its relative residual in balanced coordinates
    largest_real_part : (*G,) of the eigenvalues of ``A - B K`` [1/s]
    return_difference_min : (*G,) smallest singular value of ``R^1/2 (I + L) R^-1/2`` over frequency
    outcomes : (*G,)
    """

    K: FloatArray
    N: FloatArray
    X: FloatArray
    residual: FloatArray
    largest_real_part: FloatArray
    return_difference_min: FloatArray
    outcomes: Outcomes


def design_lqr(model: LinearModel, controller: LqrController, outcomes: Outcomes | None = None) -> LqrDesign:
    """Gains at every point whose outcome is ok; a point that gets none has an outcome and a reason instead.

    A certified solution proves that the point is stabilisable and has no unobserved mode on the axis, so the
    rank tests which say why not are run at the points without one: `INFEASIBLE` where they fail,
    `NOT_CERTIFIED` where the numbers fail. No gain leaves without the eigenvalues of ``A - B K``, computed
    afresh, in the left half plane; nor, without a cross term, one against Kalman's inequality.

    Parameters
    ----------
    model : (*G) plant
    controller : weights and reference
    outcomes : (*G) what became of each point before; all ok when None

    Raises
    ------
    WeightsRefused : the weights define no regulator, or fail to see a mode on the axis at every ok point
    """
    weights = weight_matrices(controller.weights)
    plant = augment_with_integral(model)
    _check_order(weights, plant, model)
    check_weights(weights.Q, weights.R, weights.N)
    if outcomes is None:
        outcomes = Outcomes.all_ok(model.A.shape[:-2])
    outcomes = outcomes.failing(
        ~(np.isfinite(model.A).all(axis=(-2, -1)) & np.isfinite(model.B).all(axis=(-2, -1))),
        Outcome.NOT_CERTIFIED,
        lambda index: "the linear model holds numbers that are not finite",
    )
    rest = steady_state(model, controller.tab_allocation)
    outcomes = outcomes.failing(
        ~rest.attainable,
        Outcome.INFEASIBLE,
        lambda index: (
            "the tab has no authority over the aileron's hinge moment: no tab angle balances a deflected "
            f"aileron (tab_allocation {controller.tab_allocation})"
        ),
    )
    return _gains(plant, weights, rest, outcomes)


def _check_order(weights: ExplicitWeights, plant: TrackingPlant, model: LinearModel) -> None:
    """Weights are over the named states and inputs, in order."""
    n, m = len(plant.states), len(model.inputs)
    for name, matrix, shape in (("Q", weights.Q, (n, n)), ("R", weights.R, (m, m)), ("N", weights.N, (n, m))):
        if matrix is not None and matrix.shape != shape:
            over = f"the states {' '.join(plant.states)} and the inputs {' '.join(model.inputs)}"
            raise WeightsRefused(
                name,  # type: ignore[arg-type]
                None,
                f"{name} has shape {matrix.shape}: expected {shape}, over {over}",
            )


def _gains(plant: TrackingPlant, weights: ExplicitWeights, rest: SteadyState, outcomes: Outcomes) -> LqrDesign:
    """Solve where the outcome is ok, judge, and spread the results over the grid."""
    ok = outcomes.ok
    A, B = plant.A[ok], plant.B[ok]
    solution = solve_riccati(A, B, weights.Q, weights.R, weights.N)
    outcomes = _without_certificate(outcomes, ok, solution, A, B, weights)
    certified = solution.take(solution.certified)
    A, B = A[solution.certified], B[solution.certified]
    largest = np.linalg.eigvals(A - B @ certified.K).real.max(axis=-1)
    difference = return_difference_min(A, B, certified.K, weights.R, KALMAN_TOLERANCE)
    solved = outcomes.ok
    growth, kalman = _spread(largest, solved), _spread(difference, solved)
    outcomes = outcomes.failing(
        solved & ~(growth < 0),
        Outcome.NOT_CERTIFIED,
        lambda index: f"the closed loop has an eigenvalue with real part {growth[index]:.6g} 1/s",
    )
    if weights.N is None:
        outcomes = outcomes.failing(
            solved & ~(kalman >= 1.0 - KALMAN_TOLERANCE),
            Outcome.NOT_CERTIFIED,
            lambda index: f"the return difference falls to {kalman[index]:.9g}; an optimal gain keeps it at 1 or more",
        )
    K = _spread(certified.K, solved)
    return _kept(
        LqrDesign(
            K=K,
            N=feed_forward(K, rest),
            X=_spread(certified.X, solved),
            residual=_spread(certified.residual, solved),
            largest_real_part=growth,
            return_difference_min=kalman,
            outcomes=outcomes,
        )
    )


def _without_certificate(
    outcomes: Outcomes,
    ok: BoolArray,
    solution: RiccatiSolution,
    A: FloatArray,
    B: FloatArray,
    weights: ExplicitWeights,
) -> Outcomes:
    """Outcome of the points with no certified solution: infeasible with the mode that forbids one, or not certified."""
    failed = ~solution.certified
    if not np.any(failed):
        return outcomes
    why = solvability(A[failed], B[failed], weights.Q, weights.R, weights.N)
    _refuse_blind_weights(why, failed, weights)
    where = ok.copy()
    where[ok] = failed
    reasons = np.full(ok.shape, None, dtype=object)
    reasons[where] = why.reasons
    unsolvable = np.asarray(reasons != None, dtype=bool)  # noqa: E711
    outcomes = outcomes.failing(unsolvable, Outcome.INFEASIBLE, lambda index: str(reasons[index]))
    residual, growth = _spread(solution.residual, ok), _spread(solution.largest_real_part, ok)
    return outcomes.failing(
        where,
        Outcome.NOT_CERTIFIED,
        lambda index: (
            f"no certified solution of the Riccati equation: relative residual {residual[index]:.3g}, "
            f"largest real part {growth[index]:.6g} 1/s; the weights or the model are too ill-conditioned"
        ),
    )


def _refuse_blind_weights(why: Solvability, failed: BoolArray, weights: ExplicitWeights) -> None:
    """Refuse the request when the weights miss a mode on the axis at every point that could be designed."""
    blind = why.stabilisable & ~why.observable_on_axis
    if np.all(failed) and np.all(blind):
        matrix: Literal["Q", "N"] = "Q" if weights.N is None else "N"
        raise WeightsRefused(matrix, complex(why.unobserved[0]), str(why.reasons[0]))


def _kept(design: LqrDesign) -> LqrDesign:
    """The design with every number removed at the points that are not ok."""
    ok = design.outcomes.ok

    def where_ok(values: FloatArray) -> FloatArray:
        return np.where(ok.reshape(*ok.shape, *[1] * (values.ndim - ok.ndim)), values, np.nan)

    return LqrDesign(
        K=where_ok(design.K),
        N=where_ok(design.N),
        X=where_ok(design.X),
        residual=where_ok(design.residual),
        largest_real_part=where_ok(design.largest_real_part),
        return_difference_min=where_ok(design.return_difference_min),
        outcomes=design.outcomes,
    )


def _spread(values: FloatArray, where: BoolArray) -> FloatArray:
    """Values of the points of a mask (P, ...), put back on its grid (*G, ...); nan elsewhere."""
    spread = np.full((*where.shape, *values.shape[1:]), np.nan)
    spread[where] = values
    return spread
