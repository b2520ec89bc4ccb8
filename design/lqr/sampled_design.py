"""Concurrent actuation by code: the regulator of the sampled cost, designed for the sample time (seed 6.4.2)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from design.gains import Gain
from design.lqr.coded_loop import CodedLoop, coded_loop
from design.lqr.controller import LqrController
from design.lqr.cost import Cost, cost_of
from design.lqr.discrete_riccati import DiscreteRiccatiSolution, solve_discrete_riccati
from design.lqr.flown import flown_loop
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights
from design.lqr.regulator import finite
from design.lqr.retuning import Retuning, scaled_cost
from design.lqr.sampled_problem import SampledProblem, held_at_rest, sampled_problem, without_delay_states
from design.lqr.solvability import solvability
from design.lqr.structures import Structure
from design.lqr.synthesis import LqrDesign, design_lqr
from design.lqr.tracking import augment_with_integral, feed_forward, steady_state
from design.lqr.weights import WeightsRefused
from design.outcome import Outcome, Outcomes
from design.sampling import Sampling
from model.actuators import Actuator
from model.arrays import FloatArray, GridArrays
from model.linear_model import INPUTS, LinearModel

_IDEAL = Actuator()
#: Units of gains on states; those on torques, held ones too, have the unit 1.
_UNITS = {"rate": "N m s/rad", "int": "N m/(rad s)", "angle": "N m/rad"}


@dataclass(frozen=True, eq=False)
class SampledLqrDesign(GridArrays):
    """Gains over the grid, and what certifies them; nan where the outcome is not ok.

    Attributes
    ----------
    K : (*G, 2, n) law ``u_k = -K x_k + N r_k``, u = [T_t, T_a] commanded from trim [N m], x = `states`
    N : (*G, 2, p) feed-forward [N m/rad], of the p references of the structure
    X : (*G, n, n) solution of the discrete Riccati equation
    residual : (*G,) its relative residual in balanced coordinates
    spectral_radius : (*G,) largest modulus of the poles of the loop as it is coded (`design.lqr.coded_loop`), afresh
    outcomes : (*G,)
    retuning : factors on the weights where powers or settling are asked for, those of the continuous design; else None
    states : of the plant, ``dt dt_rate da da_rate``, integrals by the trapezoidal rule, torques behind a lag, lag
        states; then the commands under way, ``T_t_1`` the last one of the tab, ``T_t_2`` the one before, ``T_a_1``
    structure : references and actuators
    sampling : what it is designed for
    """

    K: FloatArray
    N: FloatArray
    X: FloatArray
    residual: FloatArray
    spectral_radius: FloatArray
    outcomes: Outcomes
    retuning: Retuning | None
    states: tuple[str, ...]
    structure: Structure
    sampling: Sampling


def design_lqr_sampled(
    model: LinearModel,
    controller: LqrController,
    sampling: Sampling,
    outcomes: Outcomes | None = None,
    tab: Actuator = _IDEAL,
    aileron: Actuator = _IDEAL,
    retuning: Retuning | None = None,
) -> SampledLqrDesign:
    """Gains at every point whose outcome is ok; a point that gets none has an outcome and a reason instead.

    The cost is that of the continuous weights, integrated over each sample (`design.lqr.sampled_problem`). Delays of
    computation and actuators, whole samples or not, are exact: the commands under way are states.
    `LqrController.delay_states` has no effect. Weights that are scaled until the reference step is as wanted take the
    factors of the continuous design, whose outcomes are then inherited.

    Parameters
    ----------
    model : (*G) plant
    controller : weights and structure, as of the continuous design
    sampling : sample time, and the time of the computation
    outcomes : (*G) what became of each point before; all ok when None
    tab, aileron : actuators: bandwidth of the torque loops, delay, and the limits that an allocation refers to
    retuning : (*G) factors found before; None has them found where the weights need any. A point without has no gains

    Raises
    ------
    WeightsRefused : the weights define no regulator, or fail to see a mode on the unit circle at every ok point
    ValueError : actuators, a structure, a sample time or a delay that do not exist
    """
    structure = without_delay_states(controller.structure(tab, aileron))
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
        reasons = cost.inadmissible
        outcomes = outcomes.failing(
            np.array(reasons, dtype=bool), Outcome.INFEASIBLE, lambda index: str(reasons[index])
        )
    if not _needs_retuning(controller):
        retuning = None
    elif retuning is None:
        continuous = design_lqr(model, controller, outcomes, tab, aileron)
        outcomes, retuning = continuous.outcomes, continuous.retuning
    if retuning is not None:
        factors = np.stack([retuning.tab, retuning.aileron, retuning.integrals], axis=-1)
        found = np.asarray(np.isfinite(factors).all(axis=-1))
        outcomes = outcomes.failing(~found, Outcome.INFEASIBLE, lambda index: "the weights have no factors here")
        cost = scaled_cost(cost, plant, np.where(found[..., None], factors, 1.0))
    ok = outcomes.ok
    problem = sampled_problem(plant.take(ok), cost.at(ok), sampling)
    solution = solve_discrete_riccati(problem.A, problem.B, problem.Q, problem.R, problem.N)
    outcomes = _without_certificate(outcomes, solution, problem, cost, sampling)
    design = SampledLqrDesign(
        K=solution.K,
        N=feed_forward(solution.K, held_at_rest(rest.take(ok), problem.held)),
        X=solution.X,
        residual=solution.residual,
        spectral_radius=np.full(solution.residual.shape, np.nan),
        outcomes=outcomes.take(ok),
        retuning=None if retuning is None else retuning.take(ok),
        states=problem.states,
        structure=structure,
        sampling=sampling,
    ).spread(ok)
    return _judged(model, replace(design, outcomes=outcomes))


def _needs_retuning(controller: LqrController) -> bool:
    weights = controller.weights
    if isinstance(weights, NetWorkWeights):
        return weights.retuned_on is not None
    return isinstance(weights, PowerBalancedWeights)


def _without_certificate(
    outcomes: Outcomes, solution: DiscreteRiccatiSolution, problem: SampledProblem, cost: Cost, sampling: Sampling
) -> Outcomes:
    """Outcomes (*G,) of the points that are ok, of which solution and problem are, and have no certificate."""
    ok = outcomes.ok
    if np.all(solution.certified):
        return outcomes
    failed, certified = ok.copy(), np.zeros(ok.shape, dtype=bool)
    failed[ok], certified[ok] = ~solution.certified, solution.certified
    here, beyond = problem.take(~solution.certified), np.zeros(ok.shape, dtype=bool)
    beyond[failed] = ~(finite(here.A) & finite(here.B) & finite(here.Q) & finite(here.R) & finite(here.N))
    outcomes = outcomes.failing(
        beyond,
        Outcome.NOT_CERTIFIED,
        lambda index: f"what the plant does within a sample of {sampling.time:.6g} s leaves double precision",
    )
    why = solvability(here.A, here.B, here.Q, here.R, here.N, discrete=True)
    if np.array_equal(failed, ok) and np.all(why.stabilisable & ~why.observable_on_axis):
        matrix: Literal["Q", "N"] = "Q" if cost.N is None else "N"
        raise WeightsRefused(matrix, complex(np.log(why.unobserved[0]) / sampling.time), str(why.reasons[0]))
    reasons = why.spread(failed).reasons
    outcomes = outcomes.failing(
        np.array(reasons, dtype=bool), Outcome.INFEASIBLE, lambda index: f"sampled, {reasons[index]}"
    )
    found = solution.spread(ok)
    return outcomes.failing(
        failed,
        Outcome.NOT_CERTIFIED,
        lambda index: (
            f"no certified solution of the discrete Riccati equation: relative residual {found.residual[index]:.3g}, "
            f"spectral radius {found.spectral_radius[index]:.9g}; the problem is too ill-conditioned"
        ),
    )


def _judged(model: LinearModel, design: SampledLqrDesign) -> SampledLqrDesign:
    """The design with the spectral radius of its loop as it is coded, and without the gains that are not stable."""
    ok = design.outcomes.ok
    radius = np.full(ok.shape, np.nan)
    if np.any(ok):
        radius[ok] = np.abs(np.linalg.eigvals(_loop(model.take(ok), design.take(ok)).closed)).max(axis=-1)
    outcomes = design.outcomes.failing(
        ~(radius < 1.0),
        Outcome.NOT_CERTIFIED,
        lambda index: f"the coded loop has a pole of modulus {radius[index]:.9g}",
    )
    kept = replace(design, spectral_radius=radius).take(outcomes.ok).spread(outcomes.ok)
    return replace(kept, outcomes=outcomes)


def sampled_lqr_loop(model: LinearModel, design: SampledLqrDesign) -> CodedLoop:
    """The loop that the design flies, over the grid; nan at the points whose outcome is not ok."""
    ok = design.outcomes.ok
    return _loop(model.take(ok), design.take(ok)).spread(ok)


def emulated_lqr_loop(model: LinearModel, design: LqrDesign, sampling: Sampling) -> CodedLoop:
    """The loop that continuous gains fly when they are run as code, over the grid; nan where the outcome is not ok.

    Raises
    ------
    ValueError : the design has states for its delays, which would have to be discretised with the gains
    """
    if design.structure.delay_states:
        raise ValueError("a controller that runs a model of its delays is not emulated; design it with delay_states 0")
    ok = design.outcomes.ok
    loop = flown_loop(model.take(ok), design.structure, design.K[ok], design.N[ok])
    return coded_loop(loop, sampling).spread(ok)


def _loop(model: LinearModel, design: SampledLqrDesign) -> CodedLoop:
    n = len(design.structure.states(model.states))
    loop = flown_loop(model, design.structure, design.K[..., :n], design.N)
    return coded_loop(loop, design.sampling, design.K[..., n:])


def sampled_gains(design: SampledLqrDesign) -> tuple[Gain, ...]:
    """``K_<input>_<state>`` and ``N_<input>_<reference>``, row by row; ``K_T_t_T_t_1`` is of a command under way."""
    feedback = [
        Gain(f"K_{u}_{x}", _unit(x), design.K[..., i, j])
        for i, u in enumerate(INPUTS)
        for j, x in enumerate(design.states)
    ]
    forward = [
        Gain(f"N_{u}_{r}", _UNITS["angle"], design.N[..., i, j])
        for i, u in enumerate(INPUTS)
        for j, r in enumerate(design.structure.references)
    ]
    return (*feedback, *forward)


def _unit(state: str) -> str:
    if state.startswith("int_"):
        return _UNITS["int"]
    if state.endswith("_rate"):
        return _UNITS["rate"]
    return _UNITS["angle"] if state in ("dt", "da") or state.startswith("lag_") else "1"
