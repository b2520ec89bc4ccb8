"""Continuous Riccati equations, batched over the grid, each with a certificate.

Balanced Hamiltonian eigenvectors, one Newton step, certificate; the points that fail it go through scipy
one by one and face the same certificate; what still fails carries no gain.

The certificate
---------------
A small residual and a stable closed loop are not enough: with an unobservable mode on the axis rounding
splits the double eigenvalue of the Hamiltonian, and a solution that does not exist passes both. So each
point also shows that a stabilising solution exists next to the computed one (Newton-Kantorovich, in the
order of symmetric matrices). Let ``Ac = A - GX``, let the diagonal W bound the residual with its rounding
error, ``-W <= R(X) <= W``, and let P solve ``Ac'P + P Ac = -W``. Then the Newton map sends the set
``-2P <= D <= 2P`` into itself, and P stays a Lyapunov function on all of it, when ::

    doubt = 4 trace(W^-1 P) trace(G P) < 1

so the exact stabilising solution lies within 2P of X. `doubt` is also about the relative change which the
error can make in the damping of a closed-loop pole; `MAX_DOUBT` asks for much less than 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
import scipy.linalg

from design.hamiltonian import RiccatiEquation, balanced_equation, solve_or_nan, stabilising_candidate
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray, ObjectArray

Solver = Literal["eigenvectors", "scipy", "none"]

#: Largest relative residual, in balanced coordinates, of a certified solution.
MAX_RESIDUAL = 1e-10
#: Largest `doubt` of a certified solution (see above; 1 would still prove existence).
MAX_DOUBT = 1e-3
#: X may be singular (a stable mode that costs nothing); more negative than this, relative, it is not.
NEGATIVE = 1e-10
#: Rounding of the residual, in units of the sum of the magnitudes of its terms.
ROUNDING = 16 * float(np.finfo(float).eps)
FLOOR = 1e-6
#: Weights less symmetric than this, relative to their largest entry, are refused.
ASYMMETRY = 1e-9


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
class _Problem(GridArrays):
    """The regulator problem over N points, cross term kept; `posed` marks the points worth solving."""

    A: FloatArray
    B: FloatArray
    S: FloatArray
    cross: FloatArray
    posed: BoolArray
    equation: RiccatiEquation


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A solution of the scaled equation after a Newton step, and the doubt about it (N,)."""

    X: FloatArray
    residual: FloatArray
    doubt: FloatArray


def solve_riccati(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray | None = None
) -> RiccatiSolution:
    """Stabilising solution of ``A'X + XA - (XB + N) R^-1 (B'X + N') + Q = 0`` at every point.

    It minimises ``int( x'Qx + u'Ru + 2x'Nu ) dt`` over ``u = -K x`` when ``R > 0`` and ``Q - N R^-1 N' >= 0``
    (`design.weights` checks that and says why). A point without a certified solution (no stabilising one, too
    ill-conditioned, data not finite) has nan in X and K; nothing is raised for it.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, m) : ``x' = A x + B u``
    Q (n, n), R (m, m), N (n, m) or None : weights, with or without the grid's axes

    Raises
    ------
    ValueError : shapes that do not belong together
    """
    grid = _check_shapes(A, B, Q, R, N)
    with np.errstate(all="ignore"):
        problem = _problem(grid, A, B, Q, R, N)
        solution = _certify(problem, stabilising_candidate(problem.equation), "eigenvectors")
        failed = np.flatnonzero(problem.posed & ~solution.certified)
        if failed.size:
            solution = _replaced(solution, failed, _second_opinion(problem.take(failed)))
    return RiccatiSolution(
        X=solution.X.reshape(*grid, *solution.X.shape[1:]),
        K=solution.K.reshape(*grid, *solution.K.shape[1:]),
        residual=solution.residual.reshape(grid),
        largest_real_part=solution.largest_real_part.reshape(grid),
        certified=solution.certified.reshape(grid),
        solver=solution.solver.reshape(grid),
    )


def _check_shapes(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray | None
) -> tuple[int, ...]:
    n, m = B.shape[-2:]
    grid = A.shape[:-2]
    wanted = {"A": (A, (n, n)), "Q": (Q, (n, n)), "R": (R, (m, m))}
    if N is not None:
        wanted["N"] = (N, (n, m))
    for name, (matrix, shape) in wanted.items():
        if matrix.shape[-2:] != shape or matrix.shape[:-2] not in ((), grid):
            raise ValueError(f"{name} has shape {matrix.shape}: expected {shape} at each point of {grid}")
    if B.shape[:-2] != grid:
        raise ValueError(f"A and B have different grids: {grid} and {B.shape[:-2]}")
    return grid


def _problem(
    grid: tuple[int, ...],
    A: FloatArray,
    B: FloatArray,
    Q: FloatArray,
    R: FloatArray,
    N: FloatArray | None,
) -> _Problem:
    """Cross term removed, balanced, grid flattened; points that are not posed hold a harmless equation."""
    n, m = B.shape[-2:]
    A, B = A.reshape(-1, n, n), B.reshape(-1, n, m)
    S, posed = _inverse_root(R)
    S, posed = S.reshape(-1, m, m), posed.reshape(-1)
    cross = np.zeros((1, m, n))
    Q = Q.reshape(-1, n, n)
    posed = posed & _symmetric(Q)
    A_reduced, F = A, B @ S
    if N is not None:
        half = S.mT @ N.reshape(-1, n, m).mT
        cross = S @ half
        A_reduced, Q = A - B @ cross, Q - half.mT @ half
        posed = posed & _finite(Q)
    posed = posed & _finite(A_reduced) & _finite(F)
    if not np.all(posed):
        A_reduced = np.where(posed[:, None, None], A_reduced, -np.eye(n))
        F = np.where(posed[:, None, None], F, 0.0)
        Q = np.where(posed[:, None, None], Q, np.eye(n))
    Q = np.broadcast_to(Q, A.shape)
    points = (len(A), m)
    return _Problem(
        A=A,
        B=B,
        S=np.broadcast_to(S, (*points, m)),
        cross=np.broadcast_to(cross, (*points, n)),
        posed=posed,
        equation=balanced_equation(A_reduced, F, 0.5 * (Q + Q.mT)),
    )


def _inverse_root(R: FloatArray) -> tuple[FloatArray, BoolArray]:
    """S with ``R^-1 = S S'``, and where R is finite, symmetric and positive definite (S is 0 elsewhere)."""
    posed = _symmetric(R)
    diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    posed = posed & np.all(diagonal > 0, axis=-1)
    # Inputs in mixed units: positive definiteness is judged with a unit diagonal.
    unit = 1.0 / np.sqrt(np.where(posed[..., None], diagonal, 1.0))
    scaled = (
        np.where(posed[..., None, None], R, np.eye(R.shape[-1])) * unit[..., :, None] * unit[..., None, :]
    )
    values, vectors = np.linalg.eigh(scaled)
    posed = posed & (values[..., 0] > R.shape[-1] * np.finfo(float).eps)
    values = np.where(posed[..., None], values, 1.0)
    S = unit[..., :, None] * vectors / np.sqrt(values)[..., None, :]
    return np.where(posed[..., None, None], S, 0.0), posed


def _finite(matrix: FloatArray) -> BoolArray:
    return np.asarray(np.isfinite(matrix).all(axis=(-2, -1)))


def _symmetric(matrix: FloatArray) -> BoolArray:
    """Finite and symmetric, point by point."""
    size = np.max(np.abs(matrix), axis=(-2, -1))
    return np.asarray(np.max(np.abs(matrix - matrix.mT), axis=(-2, -1)) <= ASYMMETRY * size) & _finite(matrix)


def _certify(problem: _Problem, X: FloatArray, solver: Solver) -> RiccatiSolution:
    """One Newton step from X, gains, and the certificate on what comes out."""
    candidate = _newton(problem.equation, X)
    X = problem.equation.solution_in_states(candidate.X)
    K = problem.S @ problem.equation.feedback_in_states(candidate.X) + problem.cross
    closed = problem.A - problem.B @ K
    usable = problem.posed & _finite(closed) & _finite(X)
    if not usable.all():
        closed[~usable] = 0.0
    largest = np.where(usable, np.linalg.eigvals(closed).real.max(axis=-1), np.nan)
    certified = (
        usable
        & (candidate.residual <= MAX_RESIDUAL)
        & (candidate.doubt <= MAX_DOUBT)
        & (largest < 0)
        & _semidefinite(np.where(usable[:, None, None], candidate.X, 0.0))
    )
    rejected = ~certified[:, None, None]
    return RiccatiSolution(
        X=np.where(rejected, np.nan, X),
        K=np.where(rejected, np.nan, K),
        residual=np.where(problem.posed, candidate.residual, np.nan),
        largest_real_part=largest,
        certified=certified,
        solver=np.where(certified, solver, "none").astype(object),
    )


def _semidefinite(X: FloatArray) -> BoolArray:
    spectrum = np.linalg.eigvalsh(X)
    return np.asarray(spectrum[:, 0] >= -NEGATIVE * np.abs(spectrum[:, -1]))


def _newton(equation: RiccatiEquation, X: FloatArray) -> _Candidate:
    """One Newton step, kept where it lowers the residual, and the doubt about the solution."""
    n = X.shape[-1]
    error, residual = _residual(equation, X)
    bound = _residual_bound(equation, X, error)
    rows, columns, unpack, lyapunov = _symmetric_index(n)
    closed = equation.A - equation.G @ X
    operator = (closed.reshape(-1, n * n) @ lyapunov).reshape(-1, len(rows), len(rows))
    right = np.zeros((len(X), len(rows), 2))
    right[:, :, 0] = error[:, rows, columns]
    right[:, rows == columns, 1] = -bound
    step = solve_or_nan(operator, right)
    D, P = step[:, unpack, 0], step[:, unpack, 1]
    spread = np.sum(np.diagonal(P, axis1=-2, axis2=-1) / bound, axis=-1)
    doubt = 4.0 * spread * np.sum(equation.G * P, axis=(-2, -1))
    # Only a Lyapunov function proves anything: positive definite when the closed loop is stable.
    definite = np.all(np.diagonal(P, axis1=-2, axis2=-1) > 0, axis=-1)
    _, better = _residual(equation, X - D)
    keep = ~(better < residual)
    return _Candidate(
        X=np.where(keep[:, None, None], X, X - D),
        residual=np.where(keep, residual, better),
        doubt=np.where(definite, doubt, np.inf),
    )


def _residual(equation: RiccatiEquation, X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``A'X + XA - XGX + Q`` (N, n, n), and its norm over that of its terms (N,); 0 / 0 counts as 0."""
    half = equation.A.mT @ X
    linear = half + half.mT
    root = X @ equation.F
    quadratic = root @ root.mT
    error = linear - quadratic + equation.Q
    size = 2.0 * _norm(half) + _norm(quadratic) + _norm(equation.Q)
    norm = _norm(error)
    return error, np.where(norm == 0.0, 0.0, norm / size)


def _norm(matrix: FloatArray) -> FloatArray:
    entries = matrix.reshape(len(matrix), -1)
    return np.asarray(np.sqrt(np.vecdot(entries, entries)))


def _residual_bound(equation: RiccatiEquation, X: FloatArray, error: FloatArray) -> FloatArray:
    """Diagonal of W (N, n): ``-W <= E <= W`` for any symmetric E within the residual and its rounding error.

    Row sums of ``|E_ij| d_j / d_i`` dominate for every positive d; entries that are graded like
    ``sqrt(E_ii E_jj)`` ask for ``d_i = E_ii^-1/2``.
    """
    size = np.abs(X)
    half = np.abs(equation.A).mT @ size
    root = size @ np.abs(equation.F)
    terms = half + half.mT + root @ root.mT + np.abs(equation.Q)
    bound = np.abs(error) + ROUNDING * terms
    diagonal = np.sqrt(np.diagonal(bound, axis1=-2, axis2=-1))
    diagonal = diagonal + FLOOR * np.max(diagonal, axis=1, keepdims=True)
    return np.asarray(diagonal * np.sum(bound / diagonal[:, None, :], axis=2))


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


def _second_opinion(problem: _Problem) -> RiccatiSolution:
    """The points which eigenvectors could not certify: scipy one by one, then two Newton steps."""
    equation = problem.equation
    X = np.stack([_scipy_candidate(equation.take(i)) for i in range(len(equation.A))])
    return _certify(problem, _newton(equation, X).X, "scipy")


def _scipy_candidate(equation: RiccatiEquation) -> FloatArray:
    """scipy's solution at one point (n, n), symmetric; nan where it raises."""
    try:
        X = scipy.linalg.solve_continuous_are(
            equation.A, equation.F, equation.Q, np.eye(equation.F.shape[-1])
        )
    except (np.linalg.LinAlgError, ValueError):
        return np.full(equation.A.shape, np.nan)
    return np.asarray(0.5 * (X + X.T))


def _replaced(solution: RiccatiSolution, where: IntArray, by: RiccatiSolution) -> RiccatiSolution:
    """The same solutions with those at the flat indices `where` replaced if `by` is certified there."""
    better = where[by.certified]
    new = by.take(by.certified)
    values = {}
    for name in ("X", "K", "residual", "largest_real_part", "certified", "solver"):
        array = np.array(getattr(solution, name))
        array[better] = getattr(new, name)
        values[name] = array
    return RiccatiSolution(**values)
