"""Continuous Riccati equations, batched over the grid, each solution with a certificate.

Balanced Hamiltonian eigenvectors, one Newton step, certificate. The points that fail it get a second opinion
from scipy, one by one; what still fails carries no gain.

The certificate
---------------
A small residual and a stable closed loop are not enough: where a mode on the axis is not observed, rounding
splits the double eigenvalue of the Hamiltonian, and a solution that does not exist passes both tests. So a
certified point also shows that a stabilising solution exists, in one of two ways.

*Proof* (Newton-Kantorovich, in the order of symmetric matrices). Let ``Ac = A - GX``, let the diagonal W bound
the residual with its rounding error, ``-W <= R(X) <= W``, and let P solve ``Ac'P + P Ac = -W``. When ::

    doubt = 4 trace(W^-1 P) trace(G P) < 1

the Newton map sends the set ``-2P <= D <= 2P`` into itself, and P stays a Lyapunov function on all of it: the
exact stabilising solution lies within 2P of X. `doubt` is also about the largest relative error of a closed-loop
pole's damping, so it is asked to be far below 1, which leaves room for the rounding of P itself too.

*Two witnesses.* With weights many decades apart the proof is too pessimistic. Then eigenvectors and scipy, two
algorithms with different rounding, must agree on the gain and on the damping of every pole, and the rank tests
of `design.lqr.solvability` must be passed with room to spare.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.linalg

from design.lqr.hamiltonian import solve_or_nan, stabilising_candidate
from design.lqr.regulator import RegulatorProblem, RiccatiEquation, finite, regulator_problem
from design.lqr.solvability import problem_solvability
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray, ObjectArray

#: Largest relative residual, in balanced coordinates, of a certified solution.
MAX_RESIDUAL = 1e-10
#: Largest doubt of a proved solution; 1 would still prove existence.
MAX_DOUBT = 1e-6
#: X may be singular (a stable mode that costs nothing); more negative than this, relative, it is not.
NEGATIVE = 1e-10
#: Rounding error of a sum of products, in units of the sum of their magnitudes.
ROUNDING = 16 * float(np.finfo(float).eps)
#: Two witnesses agree: relative difference of their gains, and of the damping of their closed-loop poles.
SAME_GAIN, SAME_DAMPING = 1e-7, 1e-4
#: Distance from losing rank at which two witnesses are believed: above the square root of rounding error.
CLEARLY_SOLVABLE = 2e-8


@dataclass(frozen=True, eq=False)
class RiccatiSolution(GridArrays):
    """Stabilising solutions, and what certifies them.

    Attributes
    ----------
    X : (*G, n, n) solution, symmetric and positive semidefinite; nan where not certified
    K : (*G, m, n) ``R^-1 (B'X + N')``, law ``u = -K x``; nan where not certified
    residual : (*G,) Frobenius norm of ``A'X + XA - XGX + Q`` over that of its terms, in balanced coordinates
    largest_real_part : (*G,) of the eigenvalues of ``A - B K`` [1/s]; nan where there was no candidate
    certified : (*G,) bool
    solver : (*G,) object, who found the certified solution: ``eigenvectors``, ``scipy`` or ``none``
    """

    X: FloatArray
    K: FloatArray
    residual: FloatArray
    largest_real_part: FloatArray
    certified: BoolArray
    solver: ObjectArray


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A candidate over N points, after a Newton step.

    X : (N, n, n) of the scaled equation; X_states, K : in the states' units; poles : (N, n) of ``A - B K``
    sound : stable, positive semidefinite, small residual; proved : sound, and with little doubt
    """

    X: FloatArray
    X_states: FloatArray
    K: FloatArray
    poles: FloatArray
    residual: FloatArray
    sound: BoolArray
    proved: BoolArray


def solve_riccati(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray | None = None
) -> RiccatiSolution:
    """Stabilising solution of ``A'X + XA - (XB + N) R^-1 (B'X + N') + Q = 0`` at every point.

    It minimises ``int( x'Qx + u'Ru + 2x'Nu ) dt`` over ``u = -K x`` when ``R > 0`` and ``Q - N R^-1 N' >= 0``
    (`design.lqr.weights` checks that and says why not). A point without a certified solution (no stabilising one,
    too ill-conditioned, data not finite) has nan in X and K; nothing is raised for it.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, m) : ``x' = A x + B u``
    Q (n, n), R (m, m), N (n, m) or None : weights, with or without the grid's axes

    Raises
    ------
    ValueError : shapes that do not belong together
    """
    grid = A.shape[:-2]
    with np.errstate(all="ignore"):
        problem = regulator_problem(A, B, Q, R, N)
        first = _judged(problem, stabilising_candidate(problem.equation))
        certified = first.proved
        solver = np.where(certified, "eigenvectors", "none").astype(object)
        doubtful = np.flatnonzero(problem.posed & ~certified)
        if doubtful.size:
            first, solver = _second_opinion(problem, first, solver, doubtful)
            certified = solver != "none"
        X, K, residual = first.X_states, first.K, first.residual
    if not certified.all():
        X[~certified], K[~certified] = np.nan, np.nan
        residual = np.where(problem.posed, residual, np.nan)
    return RiccatiSolution(
        X=X.reshape(*grid, *X.shape[1:]),
        K=K.reshape(*grid, *K.shape[1:]),
        residual=residual.reshape(grid),
        largest_real_part=first.poles.max(axis=-1).reshape(grid),
        certified=np.asarray(certified, dtype=bool).reshape(grid),
        solver=solver.reshape(grid),
    )


def _judged(problem: RegulatorProblem, X: FloatArray) -> _Candidate:
    """One Newton step from X, the gain, and every test on what comes out."""
    equation = problem.equation
    X, residual, doubt = _newton(equation, X)
    K = problem.S @ equation.feedback_in_states(X) + problem.cross
    closed = equation.in_scale(problem.A - problem.B @ K)
    X_states = equation.solution_in_states(X)
    usable = problem.posed & finite(closed) & finite(X_states)
    if not usable.all():
        closed[~usable] = 0.0
    poles = np.sort(np.linalg.eigvals(closed).real, axis=-1)
    poles[~usable] = np.nan
    spectrum = np.linalg.eigvalsh(X if usable.all() else np.where(usable[:, None, None], X, 0.0))
    sound = (
        usable
        & (residual <= MAX_RESIDUAL)
        & (poles[:, -1] < -ROUNDING * _norm(closed))
        & (spectrum[:, 0] >= -NEGATIVE * np.abs(spectrum[:, -1]))
    )
    poles = np.ldexp(poles, equation.time_exponent[:, None])
    return _Candidate(X, X_states, K, poles, residual, sound, sound & (doubt <= MAX_DOUBT))


def _newton(equation: RiccatiEquation, X: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One Newton step, kept where it lowers the residual.

    Returns
    -------
    X (N, n, n), its relative residual (N,), and the doubt (N,) about the solution, see the module
    """
    n = X.shape[-1]
    error, residual = _residual(equation, X)
    bound = _residual_bound(equation, X, error)
    rows, columns, unpack, lyapunov = _symmetric_index(n)
    closed = equation.A - equation.G @ X
    operator = (closed.reshape(-1, n * n) @ lyapunov).reshape(-1, len(rows), len(rows))
    right = np.zeros((len(X), len(rows), 2))
    right[:, :, 0] = error[:, rows, columns]
    right[:, rows == columns, 1] = -bound
    step = solve_or_nan(operator, right)[:, unpack]
    D, P = step[..., 0], step[..., 1]
    spread = np.sum(np.diagonal(P, axis1=-2, axis2=-1) / bound, axis=-1)
    doubt = 4.0 * spread * np.sum(equation.G * P, axis=(-2, -1))
    # P is a Lyapunov function only when it is positive definite, as it is when Ac is stable.
    doubt[~np.all(np.diagonal(P, axis1=-2, axis2=-1) > 0, axis=-1)] = np.inf
    _, lower = _residual(equation, X - D)
    better = lower < residual
    return np.where(better[:, None, None], X - D, X), np.where(better, lower, residual), doubt


def _residual(equation: RiccatiEquation, X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``A'X + XA - XGX + Q`` (N, n, n), and its norm over that of its terms (N,); 0 / 0 counts as 0."""
    half = equation.A.mT @ X
    root = X @ equation.F
    quadratic = root @ root.mT
    error = half + half.mT - quadratic + equation.Q
    size = 2.0 * _norm(half) + _norm(quadratic) + _norm(equation.Q)
    norm = _norm(error)
    return error, np.where(norm == 0.0, 0.0, norm / size)


def _norm(matrix: FloatArray) -> FloatArray:
    entries = matrix.reshape(len(matrix), matrix.shape[1] * matrix.shape[2])
    return np.asarray(np.sqrt(np.vecdot(entries, entries)))


def _residual_bound(equation: RiccatiEquation, X: FloatArray, error: FloatArray) -> FloatArray:
    """Diagonal of W (N, n), positive: row sums of the residual and of its rounding error."""
    size = np.abs(X)
    half = np.abs(equation.A).mT @ size
    root = size @ np.abs(equation.F)
    terms = half + half.mT + root @ root.mT + np.abs(equation.Q)
    bound = np.sum(np.abs(error) + ROUNDING * terms, axis=2)
    # A state without any terms still needs a positive weight for P to be a Lyapunov function.
    floor = np.finfo(float).eps * np.max(bound, axis=1, keepdims=True) + np.finfo(float).tiny
    return np.asarray(bound + floor)


@lru_cache(maxsize=16)
def _symmetric_index(n: int) -> tuple[IntArray, IntArray, IntArray, FloatArray]:
    """Packing of symmetric matrices, and the map from Ac to the matrix of ``D -> Ac'D + D Ac`` on it.

    Returns
    -------
    rows, columns (p,) of the upper triangle, p = n (n + 1) / 2; unpack (n, n) position of each entry;
    lyapunov (n n, p p) with ``vec(Ac) @ lyapunov`` the operator, row by row
    """
    rows, columns = np.triu_indices(n)
    unpack = np.zeros((n, n), dtype=np.int64)
    unpack[rows, columns] = unpack[columns, rows] = np.arange(len(rows))
    lyapunov = np.zeros((n, n, len(rows), len(rows)))
    for equation, (i, j) in enumerate(zip(rows, columns, strict=True)):
        for k in range(n):
            lyapunov[k, i, equation, unpack[k, j]] += 1.0
            lyapunov[k, j, equation, unpack[i, k]] += 1.0
    return rows, columns, unpack, lyapunov.reshape(n * n, -1)


def _second_opinion(
    problem: RegulatorProblem, first: _Candidate, solver: ObjectArray, doubtful: IntArray
) -> tuple[_Candidate, ObjectArray]:
    """Candidates and solvers with the doubtful points judged again: more Newton steps, and scipy."""
    problem = problem.take(doubtful)
    equation = problem.equation
    eigen = _judged(problem, _newton(equation, first.X[doubtful])[0])
    scipy_X = np.stack([_scipy_candidate(*point) for point in zip(equation.A, equation.F, equation.Q, strict=True)])
    other = _judged(problem, _newton(equation, scipy_X)[0])
    by_scipy = other.proved & ~eigen.proved
    believed = eigen.proved | by_scipy | _agree(problem, eigen, other)
    solver[doubtful[believed]] = "eigenvectors"
    solver[doubtful[by_scipy]] = "scipy"
    values = {}
    for name in ("X", "X_states", "K", "poles", "residual", "sound", "proved"):
        values[name] = getattr(first, name).copy()
        mine, theirs = getattr(eigen, name), getattr(other, name)
        values[name][doubtful] = np.where(by_scipy.reshape(-1, *[1] * (mine.ndim - 1)), theirs, mine)
    return _Candidate(**values), solver


def _agree(problem: RegulatorProblem, one: _Candidate, other: _Candidate) -> BoolArray:
    """Two sound candidates with the same gain and the same damping, of a clearly solvable problem."""
    F = problem.equation.F
    gain, difference = _norm(F.mT @ one.X), _norm(F.mT @ (one.X - other.X))
    damping = np.max(np.abs(one.poles - other.poles) / np.abs(one.poles), axis=-1)
    same = one.sound & other.sound & (difference <= SAME_GAIN * gain) & (damping <= SAME_DAMPING)
    if not np.any(same):
        return np.asarray(same)
    solvable = problem_solvability(problem)
    distance = np.minimum(solvable.control_distance, solvable.observation_distance)
    return np.asarray(same & (distance >= CLEARLY_SOLVABLE))


def _scipy_candidate(A: FloatArray, F: FloatArray, Q: FloatArray) -> FloatArray:
    """Solution by scipy at one point (n, n), symmetric; nan where it raises."""
    try:
        X = scipy.linalg.solve_continuous_are(A, F, Q, np.eye(F.shape[-1]))
    except (np.linalg.LinAlgError, ValueError):
        return np.full(A.shape, np.nan)
    return np.asarray(0.5 * (X + X.T))
