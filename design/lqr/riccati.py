"""Continuous Riccati equations, batched over the grid, each solution with a certificate.

Balanced Hamiltonian eigenvectors, one Newton step, certificate: `design.lqr.certificate` says what it holds, and who is
asked where it fails.

The proof that a stabilising solution exists
--------------------------------------------
Let ``Ac = A - GX``, let the diagonal W bound the residual with its rounding error, ``-W <= R(X) <= W``, and let P solve
``Ac'P + P Ac = -W``. When ::

    doubt = 4 trace(W^-1 P) trace(G P) < 1

the Newton map sends the set ``-2P <= D <= 2P`` into itself, for there ``D G D <= 4 trace(G P) P <= W``, and P stays a
Lyapunov function on all of it: the exact stabilising solution lies within 2P of X.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from design.lqr.certificate import RiccatiKind, certified_candidates
from design.lqr.doubt import doubt_of, norm, residual_bound
from design.lqr.hamiltonian import StableSubspace, hamiltonian, stabilising_candidate, subspace_by_square
from design.lqr.lyapunov import solve_lyapunov
from design.lqr.regulator import RiccatiEquation, regulator_problem
from design.lqr.solvability import distance_from_unsolvable
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, ObjectArray


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
        found, solver = certified_candidates(_CONTINUOUS, problem)
        slowest = -np.ldexp(found.damping[:, 0], problem.equation.time_exponent)
    X, K, residual = found.X_states, found.K, found.residual
    certified = np.asarray(solver != "none", dtype=bool)
    if not certified.all():
        known = certified[:, None, None]
        X, K = np.where(known, X, np.nan), np.where(known, K, np.nan)
        residual = np.where(problem.posed, residual, np.nan)
    return RiccatiSolution(
        X=X.reshape(*grid, *X.shape[1:]),
        K=K.reshape(*grid, *K.shape[1:]),
        residual=residual.reshape(grid),
        largest_real_part=slowest.reshape(grid),
        certified=certified.reshape(grid),
        solver=solver.reshape(grid),
    )


def _newton(equation: RiccatiEquation, X: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One Newton step, kept where it lowers the residual.

    Returns
    -------
    X (N, n, n), its relative residual (N,), and the doubt (N,) about the solution, see the module
    """
    error, residual = _residual(equation, X)
    bound = _residual_bound(equation, X, error)
    D, P = solve_lyapunov(equation.A - equation.G @ X, error, -bound)
    doubt = 4.0 * doubt_of(equation.G, P, bound)
    _, lower = _residual(equation, X - D)
    better = lower < residual
    return np.where(better[:, None, None], X - D, X), np.where(better, lower, residual), doubt


def _residual(equation: RiccatiEquation, X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``A'X + XA - XGX + Q`` (N, n, n), and its norm over that of its terms (N,); 0 / 0 counts as 0."""
    half = equation.A.mT @ X
    root = X @ equation.F
    quadratic = root @ root.mT
    error = half + half.mT - quadratic + equation.Q
    size = 2.0 * norm(half) + norm(quadratic) + norm(equation.Q)
    value = norm(error)
    return error, np.where(value == 0.0, 0.0, value / size)


def _residual_bound(equation: RiccatiEquation, X: FloatArray, error: FloatArray) -> FloatArray:
    """Diagonal of W (N, n)."""
    size = np.abs(X)
    half = np.abs(equation.A).mT @ size
    root = size @ np.abs(equation.F)
    return residual_bound(half + half.mT + root @ root.mT + np.abs(equation.Q), error)


def _quick(equation: RiccatiEquation) -> tuple[FloatArray, StableSubspace]:
    found = subspace_by_square(hamiltonian(equation.A, equation.G, equation.Q))
    return found.X, found


def _feedback(equation: RiccatiEquation, X: FloatArray) -> FloatArray:
    """``F'X`` (N, m, n)."""
    return np.asarray(equation.F.mT @ X)


def _damping(poles: ComplexArray) -> FloatArray:
    return -poles.real


def _by_scipy(equation: RiccatiEquation) -> FloatArray:
    """Solutions (N, n, n) by scipy, point by point, symmetric; nan where it raises."""
    X = np.full_like(equation.A, np.nan)
    for i, (A, F, Q) in enumerate(zip(equation.A, equation.F, equation.Q, strict=True)):
        try:
            X[i] = scipy.linalg.solve_continuous_are(A, F, Q, np.eye(F.shape[-1]))
        except (np.linalg.LinAlgError, ValueError):
            continue
    return 0.5 * (X + X.mT)


_CONTINUOUS = RiccatiKind(
    batched="eigenvectors",
    quick=_quick,
    thorough=stabilising_candidate,
    by_scipy=_by_scipy,
    newton=_newton,
    feedback=_feedback,
    damping=_damping,
    deep=np.inf,
    distance=distance_from_unsolvable,
)
