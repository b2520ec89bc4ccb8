"""The steady Kalman filter of the plant of a loop, from the measured angles (Kalman and Bucy 1961).

::

    plant      x' = A x + B v + Gamma w,  y = C x + n     w of intensity W, n of intensity V
    estimate   z' = A z + B v + L (y - C z)
    A P + P A' - P C' V^-1 C P + Gamma W Gamma' = 0 ,  L = P C' V^-1

By duality the equation is that of a regulator of ``A', C'`` with weights ``Gamma W Gamma'`` and V, and carries the same
certificate (`design.lqr.riccati`). The plant holds all that the controller does not run itself: torques behind a lag
and lag states of the circulation too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.estimation.noise_model import NoiseModel
from design.estimation.readings import RATES, TORQUES, is_controllers, known_points, refuse_unless_full_state
from design.frequency.poles import poles
from design.loop import Loop
from design.lqr.riccati import solve_riccati
from design.lqr.solvability import Solvability, solvability
from design.outcome import Outcome, Outcomes
from model.arrays import BoolArray, ComplexArray, FloatArray, Floats, GridArrays


@dataclass(frozen=True, eq=False)
class KalmanFilter(GridArrays):
    """A filter over the grid, and what certifies it; nan where the outcome is not ok.

    Attributes
    ----------
    L : (*G, k, 2) gain on the errors of the measured angles, order [tab, aileron] [unit of the state per rad s]
    P : (*G, k, k) covariance of the error of the estimate, under the noise that the filter believes in
    poles : (*G, k) eigenvalues of ``A - L C`` [rad/s]
    residual : (*G,) of the Riccati equation, relative, in balanced coordinates
    outcomes : (*G,)
    states : names of the k states that are estimated
    """

    L: FloatArray
    P: FloatArray
    poles: ComplexArray
    residual: FloatArray
    outcomes: Outcomes
    states: tuple[str, ...]

    @property
    def error_rms(self) -> FloatArray:
        """(*G, k) root mean square of the error of each estimate [unit of the state]."""
        return np.sqrt(np.maximum(np.diagonal(self.P, axis1=-2, axis2=-1), 0.0))


@dataclass(frozen=True, eq=False)
class _FilterProblem(GridArrays):
    """A (*G, k, k) and C (*G, 2, k) of the plant, Q (*G, k, k) and V (*G, 2, 2) of the noise that is believed in."""

    A: FloatArray
    C: FloatArray
    Q: FloatArray
    V: FloatArray


def kalman_filter(loop: Loop, noise: NoiseModel, outcomes: Outcomes | None = None) -> KalmanFilter:
    """The filter of every point; a point that has none has an outcome and a reason instead.

    The delays of the actuators do not enter: what the filter is told of its commands is told it late
    (`design.estimation.observer`).

    Parameters
    ----------
    loop : full-state feedback, over any grid
    noise : intensities
    outcomes : (*G) what became of each point before; all ok when None

    Raises
    ------
    ValueError : the loop is not a full-state feedback, or its plant has no state that noise is said to act on
    """
    refuse_unless_full_state(loop)
    states = tuple(name for name in loop.states if not is_controllers(name))
    problem = _problem(loop, noise, states)
    if outcomes is None:
        outcomes = Outcomes.all_ok(loop.A.shape[:-2])
    outcomes = outcomes.failing(
        ~known_points(loop), Outcome.NOT_CERTIFIED, lambda index: "the loop holds numbers that are not finite"
    )
    ok = outcomes.ok
    here = problem.take(ok)
    solution = solve_riccati(here.A.mT, here.C.mT, here.Q, here.V).spread(ok)
    outcomes = _without_certificate(outcomes, solution.certified, problem, solution.residual)
    L, values = np.array(solution.K.mT), np.full((*ok.shape, len(states)), complex(np.nan, np.nan))
    certified = outcomes.ok
    values[certified] = poles(problem.A[certified] - L[certified] @ problem.C[certified])
    residual = np.where(certified, solution.residual, np.nan)
    return KalmanFilter(L, solution.X, values, residual, outcomes, states)


def _problem(loop: Loop, noise: NoiseModel, states: tuple[str, ...]) -> _FilterProblem:
    grid, k = loop.A.shape[:-2], len(states)
    plant = [loop.states.index(name) for name in states]
    C = np.zeros((*grid, len(RATES), k))
    V = np.zeros((*grid, len(RATES), len(RATES)))
    for row, (angle, intensity) in enumerate(zip(RATES, noise.angles, strict=True)):
        C[..., row, states.index(angle)] = 1.0
        V[..., row, row] = intensity
    Q = np.zeros((*grid, k, k))
    for further in noise.states:
        if further.state not in states:
            raise ValueError(f"the plant has no state {further.state!r}; it has {', '.join(states)}")
        Q[..., states.index(further.state), states.index(further.state)] += further.intensity
    torques = [loop.disturbances.index(name) for name in TORQUES]
    on_surfaces = loop.G[..., plant, :][..., torques]
    on_commands = loop.B[..., plant, :]
    with np.errstate(over="ignore", invalid="ignore"):
        for i, intensity in enumerate(noise.torques):
            Q += _spread_by(on_surfaces[..., i], intensity)
            Q += _spread_by(on_commands[..., i], np.asarray(noise.recovery) * intensity)
    return _FilterProblem(loop.A[..., plant, :][..., plant], C, Q, V)


def _spread_by(column: FloatArray, intensity: Floats) -> FloatArray:
    """``intensity g g'`` (*G, k, k) of columns g (*G, k)."""
    return np.asarray(intensity)[..., None, None] * (column[..., :, None] * column[..., None, :])


def _without_certificate(
    outcomes: Outcomes, certified: BoolArray, problem: _FilterProblem, residual: FloatArray
) -> Outcomes:
    """Infeasible with the mode that forbids a filter, or not certified, where there is no certificate."""
    failed = outcomes.ok & ~certified
    if not np.any(failed):
        return outcomes
    here = problem.take(failed)
    why = solvability(here.A.mT, here.C.mT, here.Q, here.V).spread(failed)
    unseen, undriven = failed & ~why.stabilisable, failed & ~why.observable_on_axis
    outcomes = outcomes.failing(unseen, Outcome.INFEASIBLE, lambda index: _unseen(why, index))
    outcomes = outcomes.failing(undriven, Outcome.INFEASIBLE, lambda index: _undriven(why, index))
    return outcomes.failing(
        failed,
        Outcome.NOT_CERTIFIED,
        lambda index: (
            f"no certified solution of the filter's Riccati equation: relative residual {residual[index]:.3g}; "
            "the problem is too ill-conditioned"
        ),
    )


def _unseen(why: Solvability, index: tuple[int, ...]) -> str:
    return f"no measured angle sees the mode at {why.uncontrolled[index]:.6g} 1/s: its state cannot be estimated"


def _undriven(why: Solvability, index: tuple[int, ...]) -> str:
    mode = why.unobserved[index].imag
    return (
        f"no noise drives the mode at {mode:.6g} rad/s on the imaginary axis: give its state or a torque an intensity"
    )
