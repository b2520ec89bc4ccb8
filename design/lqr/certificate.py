"""From candidates to certified solutions: what Riccati equations in continuous and in discrete time have in common.

A candidate gets Newton steps and is judged. The points that it does not prove are solved again by a second
algorithm, and those that remain by scipy, one by one; what still fails carries no gain.

A small residual and a stable closed loop are not enough: where a mode on the boundary of stability is not
observed, rounding splits the double eigenvalue of the Hamiltonian, and a solution that does not exist passes both
tests. So a certified point also shows that a stabilising solution exists, in one of two ways.

*Proof*: a doubt below `MAX_DOUBT`, see `design.lqr.riccati` and `design.lqr.discrete_riccati`. Below 1 it proves that
the exact stabilising solution lies next to the candidate (Newton-Kantorovich, in the order of symmetric matrices).
It is also about the largest relative error of a closed-loop pole's damping, so it is asked to be far below 1, which
leaves room for the rounding of the doubt itself too.

*Two witnesses.* With weights many decades apart the proof is too pessimistic. Then the second algorithm and one of
the others, with different rounding, must agree on the gain and on the damping of every pole, and the rank tests
of `design.lqr.solvability` must be passed with room to spare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from design.lqr.doubt import ROUNDING, norm
from design.lqr.hamiltonian import StableSubspace
from design.lqr.regulator import RegulatorProblem, RiccatiEquation, finite
from design.lqr.solvability import RANK
from model.arrays import BoolArray, ComplexArray, FloatArray, IntArray, ObjectArray

#: Largest relative residual, in balanced coordinates, of a certified solution.
MAX_RESIDUAL = 1e-10
#: Largest doubt of a proved solution; 1 would still prove existence.
MAX_DOUBT = 1e-4
#: X may be singular (a stable mode that costs nothing); more negative than this, relative, it is not.
NEGATIVE = 1e-10
#: Two witnesses agree: relative difference of their gains, and of the damping of their closed-loop poles.
SAME_GAIN, SAME_DAMPING = 1e-7, 1e-4
#: Distance from losing rank at which two witnesses are believed: above the square root of rounding error.
CLEARLY_SOLVABLE = 2e-8
#: Points that are worked on at once: more would only take memory.
BATCH = 4096
#: Largest error of a pole read off the eigenvectors of a candidate, relative to the smallest damping.
MODE_ERROR = 1e-9


@dataclass(frozen=True)
class RiccatiKind:
    """What tells one kind of Riccati equation from the other.

    Attributes
    ----------
    batched : name of the two algorithms that take the whole batch
    quick, thorough : they, with different rounding: candidates X (N, n, n), nan where there is none; the first with
        the stable subspace that it found them by, if it did
    by_scipy : candidates point by point
    newton : X to X after one step, kept where it lowers the residual (N, n, n); its relative residual (N,); doubt (N,)
    feedback : X to the gain (N, m, n) on the scaled states and inputs
    damping : closed-loop poles (N, n) of the scaled equation to their distance from the boundary of stability (N, n),
        positive inside
    deep : poles with more damping than this are as stable as each other: no rounding comes near to splitting them
    distance : how far the problem is from having no stabilising solution (N,), by rank tests
    """

    batched: str
    quick: Callable[[RiccatiEquation], tuple[FloatArray, StableSubspace | None]]
    thorough: Callable[[RiccatiEquation], FloatArray]
    by_scipy: Callable[[RiccatiEquation], FloatArray]
    newton: Callable[[RiccatiEquation, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
    feedback: Callable[[RiccatiEquation, FloatArray], FloatArray]
    damping: Callable[[ComplexArray], FloatArray]
    deep: float
    distance: Callable[[RegulatorProblem], FloatArray]


@dataclass(frozen=True, eq=False)
class Candidate:
    """Solutions over N points, judged.

    Attributes
    ----------
    X : (N, n, n) of the scaled equation
    X_states, K : (N, n, n), (N, m, n) in the states' units
    scaled_gain : (N, m, n) of the scaled states and inputs
    damping : (N, n) of the poles of ``A - B K`` of the scaled equation, smallest first; nan where there is no X
    residual : (N,) relative, of the scaled equation
    sound : (N,) stable, positive semidefinite, small residual
    proved : (N,) sound, and with little doubt
    """

    X: FloatArray
    X_states: FloatArray
    K: FloatArray
    scaled_gain: FloatArray
    damping: FloatArray
    residual: FloatArray
    sound: BoolArray
    proved: BoolArray

    def take(self, index: IntArray | BoolArray) -> Candidate:
        """The candidates at some of the points."""
        return Candidate(**{name: getattr(self, name)[index] for name in self.__dataclass_fields__})

    def replaced(self, index: IntArray, other: Candidate) -> Candidate:
        """These candidates with those of `other` at some points."""
        values = {}
        for name in self.__dataclass_fields__:
            values[name] = getattr(self, name).copy()
            values[name][index] = getattr(other, name)
        return Candidate(**values)


def certified_candidates(kind: RiccatiKind, problem: RegulatorProblem) -> tuple[Candidate, ObjectArray]:
    """The best candidate of every point, and who found it (N,), ``none`` where it is not certified.

    numpy's floating-point warnings are the caller's.
    """
    points = len(problem.posed)
    if points > BATCH:
        parts = [certified_candidates(kind, problem.take(slice(k, k + BATCH))) for k in range(0, points, BATCH)]
        found = Candidate(
            **{
                name: np.concatenate([getattr(candidate, name) for candidate, _ in parts])
                for name in Candidate.__dataclass_fields__
            }
        )
        return found, np.concatenate([solver for _, solver in parts])
    X, subspace = kind.quick(problem.equation)
    found = _judged(kind, problem, X, subspace)
    solver = np.where(found.proved, kind.batched, "none").astype(object)
    doubtful = np.flatnonzero(problem.posed & ~found.proved)
    if doubtful.size:
        better, by = _second_opinion(kind, problem.take(doubtful), found.take(doubtful))
        found = found.replaced(doubtful, better)
        solver[doubtful] = by
    return found, solver


def _second_opinion(kind: RiccatiKind, problem: RegulatorProblem, quick: Candidate) -> tuple[Candidate, ObjectArray]:
    """The same for the points that the quick algorithm does not prove."""
    quick = _judged(kind, problem, _stepped(kind, problem, quick.X))
    thorough = _judged(kind, problem, _stepped(kind, problem, kind.thorough(problem.equation)), witness=True)
    by_quick = quick.proved & ~thorough.proved
    found = thorough.replaced(np.flatnonzero(by_quick), quick.take(by_quick))
    believed = found.proved | _agree(kind, problem, thorough, quick)
    solver = np.where(believed, kind.batched, "none").astype(object)
    doubtful = np.flatnonzero(~believed)
    if doubtful.size:
        # Where a rank is lost there is nothing to find, and no need to ask point by point.
        doubtful = doubtful[kind.distance(problem.take(doubtful)) > RANK]
    if doubtful.size:
        better, by = _third_opinion(kind, problem.take(doubtful), thorough.take(doubtful))
        found = found.replaced(doubtful, better)
        solver[doubtful] = by
    return found, solver


def _third_opinion(kind: RiccatiKind, problem: RegulatorProblem, thorough: Candidate) -> tuple[Candidate, ObjectArray]:
    """The same for the points where the two algorithms disagree."""
    other = _judged(kind, problem, _stepped(kind, problem, kind.by_scipy(problem.equation)))
    by_scipy = other.proved
    seconded = ~by_scipy & _agree(kind, problem, thorough, other)
    solver = np.full(len(seconded), "none", dtype=object)
    solver[seconded] = kind.batched
    solver[by_scipy] = "scipy"
    return thorough.replaced(np.flatnonzero(by_scipy), other.take(by_scipy)), solver


def _stepped(kind: RiccatiKind, problem: RegulatorProblem, X: FloatArray) -> FloatArray:
    """X after one Newton step more than the one that its judge makes."""
    return kind.newton(problem.equation, X)[0]


def _judged(
    kind: RiccatiKind,
    problem: RegulatorProblem,
    X: FloatArray,
    subspace: StableSubspace | None = None,
    witness: bool = False,
) -> Candidate:
    """A Newton step from X, the gain, and every test on what comes out.

    Parameters
    ----------
    subspace : where X comes from, if that was a stable subspace
    witness : take the poles of the transposed closed loop, so that they agree with those of another candidate only
        where rounding cannot move them
    """
    equation = problem.equation
    X, residual, doubt = kind.newton(equation, X)
    gain = kind.feedback(equation, X)
    K = problem.S @ equation.gain_in_states(gain) + problem.cross
    closed = equation.in_scale(problem.A - problem.B @ K)
    X_states = equation.solution_in_states(X)
    size = norm(closed)
    usable = problem.posed & np.isfinite(size) & finite(X_states)
    damping = _damping(kind, closed.mT if witness else closed, usable, subspace)
    stable = damping[:, 0] > ROUNDING * size
    sound = usable & (residual <= MAX_RESIDUAL) & stable & _positive(X, usable)
    return Candidate(X, X_states, K, gain, damping, residual, sound, sound & (doubt <= MAX_DOUBT))


def _damping(kind: RiccatiKind, closed: FloatArray, usable: BoolArray, subspace: StableSubspace | None) -> FloatArray:
    """Damping (N, n) of the eigenvalues of `closed` (N, n, n), smallest first; nan where it is not usable.

    Eigenvectors that come with the candidate make it nearly diagonal: its eigenvalues lie in Gershgorin's discs.
    Where these are not small, eigenvalues are computed afresh.
    """
    if subspace is None:
        damping = np.full(closed.shape[:2], np.nan)
        known = np.zeros(len(closed), dtype=bool)
    else:
        image = (closed @ subspace.modes.view(np.float64)).view(np.complex128)
        near_diagonal: ComplexArray = subspace.inverse @ image
        poles = np.diagonal(near_diagonal, axis1=-2, axis2=-1)
        size = np.abs(poles)
        radius = np.max(np.sum(np.abs(near_diagonal), axis=-1) - size, axis=-1)
        condition = norm(subspace.modes.view(np.float64)) * norm(subspace.inverse.view(np.float64))
        damping = np.sort(kind.damping(poles), axis=-1)
        known = radius + ROUNDING * condition * np.max(size, axis=-1) <= MODE_ERROR * damping[:, 0]
    afresh = usable & ~known
    if afresh.any():
        damping[afresh] = np.sort(kind.damping(np.linalg.eigvals(closed[afresh]).astype(complex)), axis=-1)
    if not usable.all():
        damping[~usable] = np.nan
    return damping


def _positive(X: FloatArray, usable: BoolArray) -> BoolArray:
    """Mask of the points where X is positive semidefinite up to rounding."""
    shift = NEGATIVE * norm(X) + np.finfo(float).tiny
    if not usable.all():
        X, shift = np.where(usable[:, None, None], X, 0.0), np.where(usable, shift, 1.0)
    try:
        # Cholesky's factorisation of a matrix of a batch that is not positive definite raises for all of it.
        np.linalg.cholesky(X + shift[:, None, None] * np.eye(X.shape[-1]))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.eigvalsh(X)[:, 0] >= -shift)
    return usable


def _agree(kind: RiccatiKind, problem: RegulatorProblem, one: Candidate, other: Candidate) -> BoolArray:
    """Two sound candidates with the same gain and the same damping, of a clearly solvable problem."""
    gain, difference = norm(one.scaled_gain), norm(one.scaled_gain - other.scaled_gain)
    shallow, theirs = (np.minimum(candidate.damping, kind.deep) for candidate in (one, other))
    damping = np.max(np.abs(shallow - theirs) / np.abs(shallow), axis=-1)
    same = one.sound & other.sound & (difference <= SAME_GAIN * gain) & (damping <= SAME_DAMPING)
    index = np.flatnonzero(same)
    if index.size:
        same[index] = kind.distance(problem.take(index)) >= CLEARLY_SOLVABLE
    return np.asarray(same)
