"""Concurrent actuation: the linear-quadratic regulator of every structure and kind of weights, over the grid."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from design.delay.characteristic import SHORTEST
from design.delay.damping import unstable_poles
from design.frequency.margins import margins
from design.loop import Loop
from design.lqr.controller import LqrController
from design.lqr.cost import Cost, cost_of
from design.lqr.flown import flown_loop
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights, Weights
from design.lqr.regulator import finite
from design.lqr.retuning import Retuning, Wanted, retuned
from design.lqr.return_difference import ReturnDifference, return_difference
from design.lqr.riccati import RiccatiSolution, solve_riccati
from design.lqr.solvability import Solvability, solvability
from design.lqr.structures import Structure
from design.lqr.tracking import SteadyState, TrackingPlant, augment_with_integral, feed_forward, steady_state
from design.lqr.weights import WeightsRefused
from design.outcome import Outcome, Outcomes
from model.actuators import Actuator
from model.arrays import BoolArray, FloatArray, GridArrays, ObjectArray
from model.linear_model import LinearModel

__all__ = ["LqrController", "LqrDesign", "design_lqr"]

#: Phase [rad] that a delay may turn below the last gain crossover for its poles to be counted.
MANY_TURNS = 60.0
#: How far below 1 rounding may bring the return difference of an optimal gain.
KALMAN_TOLERANCE = 1e-6


_IDEAL = Actuator()


@dataclass(frozen=True, eq=False)
class LqrDesign(GridArrays):
    """Gains over the grid, and what certifies them; nan where the outcome is not ok.

    Attributes
    ----------
    K : (*G, 2, n) law ``u = -K x + N r``, u = [T_t, T_a] commanded from trim [N m], x = `states`
    N : (*G, 2, p) feed-forward [N m/rad], of the p references of the structure
    X : (*G, n, n) solution of the Riccati equation
    residual : (*G,) its relative residual in balanced coordinates
    largest_real_part : (*G,) of the eigenvalues of ``A - B K`` of the plant that is designed for [1/s]
    return_difference_min : (*G,) smallest singular value of ``R^1/2 (I + L) R^-1/2`` over frequency
    outcomes : (*G,)
    retuning : factors on the weights where powers or settling are asked for (`design.lqr.retuning`); else None
    states : names of the states: ``dt dt_rate da da_rate``, integrals, torques behind a lag, lag states, delays
    structure : references and actuators
    """

    K: FloatArray
    N: FloatArray
    X: FloatArray
    residual: FloatArray
    largest_real_part: FloatArray
    return_difference_min: FloatArray
    outcomes: Outcomes
    retuning: Retuning | None
    states: tuple[str, ...]
    structure: Structure


def design_lqr(
    model: LinearModel,
    controller: LqrController,
    outcomes: Outcomes | None = None,
    tab: Actuator = _IDEAL,
    aileron: Actuator = _IDEAL,
) -> LqrDesign:
    """Gains at every point whose outcome is ok; a point that gets none has an outcome and a reason instead.

    A certified solution proves that the point is stabilisable and has no unobserved mode on the axis, so the
    rank tests which say why not are run at the points without one: `INFEASIBLE` where they fail,
    `NOT_CERTIFIED` where the numbers fail. No gain leaves without the eigenvalues of ``A - B K``, computed
    afresh, in the left half plane; nor, without a cross term, one against Kalman's inequality; nor, with a delay,
    one whose loop is not proved stable with it.

    Parameters
    ----------
    model : (*G) plant
    controller : weights and structure
    outcomes : (*G) what became of each point before; all ok when None
    tab, aileron : actuators: bandwidth of the torque loops, delay, and the limits that an allocation refers to

    Raises
    ------
    WeightsRefused : the weights define no regulator, or fail to see a mode on the axis at every ok point
    ValueError : actuators or a structure that do not exist
    """
    structure = controller.structure(tab, aileron)
    plant = augment_with_integral(model, structure)
    cost = cost_of(controller.weights, plant)
    if outcomes is None:
        outcomes = Outcomes.all_ok(model.A.shape[:-2])
    known = finite(model.A) & finite(model.B)
    outcomes = outcomes.failing(
        ~known, Outcome.NOT_CERTIFIED, lambda index: "the linear model holds numbers that are not finite"
    )
    rest = steady_state(model, controller.tab_allocation, structure)
    outcomes = outcomes.failing(~rest.attainable, Outcome.INFEASIBLE, lambda index: str(rest.reasons[index]))
    if cost.inadmissible is not None:
        outcomes = _infeasible(outcomes, cost.inadmissible)
    retuning, wanted = None, _wanted(controller.weights, structure)
    if wanted is not None:
        found = retuned(model, plant, rest, _before(controller.weights, plant), cost, wanted, outcomes.ok)
        outcomes, cost, retuning = _infeasible(outcomes, found.reasons), found.cost, found.retuning
    design = _gains(plant, cost, rest, outcomes)
    if retuning is not None:
        gained = design.outcomes.ok
        design = replace(design, retuning=retuning.take(gained).spread(gained))
    return _judged_with_delay(model, design)


def _infeasible(outcomes: Outcomes, reasons: ObjectArray) -> Outcomes:
    """Points (*G,) that have a reason in words are infeasible."""
    return outcomes.failing(np.array(reasons, dtype=bool), Outcome.INFEASIBLE, lambda index: str(reasons[index]))


def _wanted(weights: Weights, structure: Structure) -> Wanted | None:
    """What the reference step is to need; None where the weights do not ask anything of it."""
    if isinstance(weights, PowerBalancedWeights):
        wanted = Wanted(weights.step, weights.tab_power, weights.aileron_power, weights.keep_settling)
    elif isinstance(weights, NetWorkWeights) and weights.retuned_on is not None:
        wanted = Wanted(weights.retuned_on, None, None, True)
    else:
        return None
    if not structure.references:
        raise WeightsRefused("R", None, "a regulator follows no reference: there is no step to judge its power on")
    return wanted


def _before(weights: Weights, plant: TrackingPlant) -> Cost:
    """The cost without regard to power."""
    return cost_of(weights.base if isinstance(weights, NetWorkWeights | PowerBalancedWeights) else weights, plant)


def _gains(plant: TrackingPlant, cost: Cost, rest: SteadyState, outcomes: Outcomes) -> LqrDesign:
    """Solve where the outcome is ok, judge, and keep the numbers of the points that pass."""
    ok = outcomes.ok
    here = cost.at(ok)
    solution = solve_riccati(plant.A[ok], plant.B[ok], here.Q, here.R, here.N).spread(ok)
    outcomes = _without_certificate(outcomes, solution, plant, cost)
    solved = outcomes.ok
    growth, kalman = np.full(ok.shape, np.nan), np.full(ok.shape, np.nan)
    difference = _return_difference(plant.take(solved), solution.K[solved], cost.at(solved).R)
    growth[solved], kalman[solved] = difference.poles.real.max(axis=-1), difference.smallest
    outcomes = outcomes.failing(
        ~(growth < 0),
        Outcome.NOT_CERTIFIED,
        lambda index: f"the closed loop has an eigenvalue with real part {growth[index]:.6g} 1/s",
    )
    if cost.N is None:
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
        retuning=None,
        states=plant.states,
        structure=plant.structure,
    )
    return design if np.array_equal(outcomes.ok, solution.certified) else _kept(design, outcomes)


def _kept(design: LqrDesign, outcomes: Outcomes) -> LqrDesign:
    """The design with the numbers of the points that are still ok, and no others."""
    kept = outcomes.ok
    return replace(design.take(kept).spread(kept), outcomes=outcomes)


def _return_difference(plant: TrackingPlant, K: FloatArray, R: FloatArray) -> ReturnDifference:
    """Return difference of N points with R (2, 2) or (N, 2, 2), by inputs in which R is the identity."""
    if R.ndim == 2:
        return return_difference(plant.A, plant.B, K, R, KALMAN_TOLERANCE)
    values, vectors = np.linalg.eigh(R)
    root, inverse = ((vectors * values[:, None, :] ** power) @ vectors.mT for power in (0.5, -0.5))
    return return_difference(plant.A, plant.B @ inverse, root @ K, np.eye(R.shape[-1]), KALMAN_TOLERANCE)


def _without_certificate(outcomes: Outcomes, solution: RiccatiSolution, plant: TrackingPlant, cost: Cost) -> Outcomes:
    """Infeasible with the mode that forbids a solution, or not certified, where there is no certificate."""
    failed = outcomes.ok & ~solution.certified
    if not np.any(failed):
        return outcomes
    here = cost.at(failed)
    why = solvability(plant.A[failed], plant.B[failed], here.Q, here.R, here.N)
    if np.array_equal(failed, outcomes.ok):
        _refuse_blind_weights(why, cost)
    outcomes = _infeasible(outcomes, why.spread(failed).reasons)
    return outcomes.failing(
        failed,
        Outcome.NOT_CERTIFIED,
        lambda index: (
            f"no certified solution of the Riccati equation: relative residual {solution.residual[index]:.3g}, "
            f"largest real part {solution.largest_real_part[index]:.6g} 1/s; the problem is too ill-conditioned"
        ),
    )


def _refuse_blind_weights(why: Solvability, cost: Cost) -> None:
    """Refuse the request when no point can be designed because the weights miss a mode on the axis."""
    if np.all(why.stabilisable & ~why.observable_on_axis):
        matrix: Literal["Q", "N"] = "Q" if cost.N is None else "N"
        raise WeightsRefused(matrix, complex(why.unobserved[0]), str(why.reasons[0]))


def _judged_with_delay(model: LinearModel, design: LqrDesign) -> LqrDesign:
    """Withdraw the gains whose loop, delays included, is not proved stable."""
    drives, ok = design.structure.drives, design.outcomes.ok
    if not any(drive.delay > SHORTEST for drive in drives) or not np.any(ok):
        return design
    loop = flown_loop(model.take(ok), design.structure, design.K[ok], design.N[ok])
    count = np.full(ok.shape, np.nan)
    slow = _slow_enough(loop)
    proved = ok.copy()
    proved[ok] = slow
    if slow.any():
        count[proved] = unstable_poles(loop.take(slow))
    delays = ", ".join(f"{drive.name} {drive.delay:.6g} s" for drive in drives)
    blind = any(drive.delay > SHORTEST and not drive.chain for drive in drives)

    def reason(index: tuple[int, ...]) -> str:
        if np.isnan(count[index]):
            return f"the loop with its delays ({delays}) could not be proved stable"
        said = f"the loop with its delays ({delays}) has {count[index]:.0f} unstable poles"
        return f"{said}; it is designed without them (delay_states 0)" if blind else said

    outcomes = design.outcomes.failing(~(count == 0.0), Outcome.NOT_CERTIFIED, reason)
    return design if np.array_equal(outcomes.ok, ok) else _kept(design, outcomes)


def _slow_enough(loop: Loop) -> BoolArray:
    """Mask (N,) of the loops (N,) whose gain has fallen to 1 before their delays have turned the phase many times.

    The others hold thousands of unstable poles, which would take minutes to count.
    """
    prompt = replace(loop, delay=(0.0,) * len(loop.inputs))
    crossing = np.nan_to_num(margins(prompt.cuts()).phase_omega, nan=0.0).max(axis=-1)
    return np.asarray(np.max(crossing, axis=0) * max(loop.delay) < MANY_TURNS)
