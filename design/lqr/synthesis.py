"""Concurrent actuation: the linear-quadratic regulator with an aileron reference, over the grid (seed 5.3)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from design.lqr.regulator import finite
from design.lqr.return_difference import return_difference
from design.lqr.riccati import RiccatiSolution, solve_riccati
from design.lqr.solvability import Solvability, solvability
from design.lqr.tracking import (
    SteadyState,
    TabAllocation,
    TrackingPlant,
    augment_with_integral,
    feed_forward,
    steady_state,
)
from design.lqr.weights import (
    BrysonWeights,
    ExplicitWeights,
    WeightsRefused,
    check_weights,
    weight_matrices,
)
from design.outcome import Outcome, Outcomes
from model.arrays import FloatArray, GridArrays
from model.linear_model import LinearModel

#: How far below 1 rounding may bring the return difference of an optimal gain.
KALMAN_TOLERANCE = 1e-6


@dataclass(frozen=True)
class LqrController:
    """A state feedback with integral action asked for by its weights.

    Attributes
    ----------
    name : unique in its study
    weights : Bryson's rule, or explicit matrices over ``dt dt_rate da da_rate int_a`` (with unsteady damping
        then ``lag_1 lag_2``) and ``T_t T_a``
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
    K : (*G, 2, n) law ``u = -K [dt dt_rate da da_rate int_a] + N r_a``, u = [T_t, T_a] from trim [N m]; n is 5,
        or 7 with the lag states of unsteady damping after the others
    N : (*G, 2, 1) feed-forward [N m/rad]
    X : (*G, n, n) solution of the Riccati equation
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
    plant = augment_with_integral(model)
    weights = weight_matrices(controller.weights, plant.states)
    _check_order(weights, plant, model)
    check_weights(weights.Q, weights.R, weights.N)
    if outcomes is None:
        outcomes = Outcomes.all_ok(model.A.shape[:-2])
    known = finite(model.A) & finite(model.B)
    outcomes = outcomes.failing(
        ~known, Outcome.NOT_CERTIFIED, lambda index: "the linear model holds numbers that are not finite"
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
    """Solve where the outcome is ok, judge, and keep the numbers of the points that pass."""
    ok = outcomes.ok
    solution = solve_riccati(plant.A[ok], plant.B[ok], weights.Q, weights.R, weights.N).spread(ok)
    outcomes = _without_certificate(outcomes, solution, plant, weights)
    solved = outcomes.ok
    A, B, K = plant.A[solved], plant.B[solved], solution.K[solved]
    growth, kalman = np.full(ok.shape, np.nan), np.full(ok.shape, np.nan)
    difference = return_difference(A, B, K, weights.R, KALMAN_TOLERANCE)
    growth[solved], kalman[solved] = difference.poles.real.max(axis=-1), difference.smallest
    outcomes = outcomes.failing(
        ~(growth < 0),
        Outcome.NOT_CERTIFIED,
        lambda index: f"the closed loop has an eigenvalue with real part {growth[index]:.6g} 1/s",
    )
    if weights.N is None:
        outcomes = outcomes.failing(
            ~(kalman >= 1.0 - KALMAN_TOLERANCE),
            Outcome.NOT_CERTIFIED,
            lambda index: f"the return difference falls to {kalman[index]:.9g}; an optimal gain keeps it at 1",
        )
    design = LqrDesign(
        K=solution.K,
        N=feed_forward(solution.K, rest),
        X=solution.X,
        residual=np.where(solution.certified, solution.residual, np.nan),
        largest_real_part=growth,
        return_difference_min=kalman,
        outcomes=outcomes,
    )
    kept = outcomes.ok
    if np.array_equal(kept, solution.certified):
        return design
    return replace(design.take(kept).spread(kept), outcomes=outcomes)


def _without_certificate(
    outcomes: Outcomes, solution: RiccatiSolution, plant: TrackingPlant, weights: ExplicitWeights
) -> Outcomes:
    """Infeasible with the mode that forbids a solution, or not certified, where there is no certificate."""
    failed = outcomes.ok & ~solution.certified
    if not np.any(failed):
        return outcomes
    why = solvability(plant.A[failed], plant.B[failed], weights.Q, weights.R, weights.N)
    if np.array_equal(failed, outcomes.ok):
        _refuse_blind_weights(why, weights)
    reasons = why.spread(failed).reasons
    unsolvable = np.array(reasons, dtype=bool)
    outcomes = outcomes.failing(unsolvable, Outcome.INFEASIBLE, lambda index: str(reasons[index]))
    return outcomes.failing(
        failed,
        Outcome.NOT_CERTIFIED,
        lambda index: (
            f"no certified solution of the Riccati equation: relative residual {solution.residual[index]:.3g}, "
            f"largest real part {solution.largest_real_part[index]:.6g} 1/s; the problem is too ill-conditioned"
        ),
    )


def _refuse_blind_weights(why: Solvability, weights: ExplicitWeights) -> None:
    """Refuse the request when no point can be designed because the weights miss a mode on the axis."""
    if np.all(why.stabilisable & ~why.observable_on_axis):
        matrix: Literal["Q", "N"] = "Q" if weights.N is None else "N"
        raise WeightsRefused(matrix, complex(why.unobserved[0]), str(why.reasons[0]))
