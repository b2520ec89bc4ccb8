"""Discrete Riccati equations, batched over the grid, each solution with a certificate.

The structure-preserving doubling algorithm, one Newton step, certificate: `design.lqr.certificate` says what it holds,
and who is asked where it fails. A may be singular, as it is with states that hold a delayed input.

The proof that a stabilising solution exists
--------------------------------------------
In scaled inputs (``R = I``, ``F = B R^-1/2``) and for ``X >= 0`` let ``K = (I + F'XF)^-1 F'XA``, ``Ac = A - F K``,
``T = F (I + F'XF)^-1 F'`` and R(X) the residual. Exactly ::

    R(X + D) = R(X) + Ac'D Ac - D - Ac'D F (I + F'XF + F'D F)^-1 F'D Ac

Let the diagonal W bound the residual with its rounding error, ``-W <= R(X) <= W``, and let P solve
``Ac'P Ac - P = -W``. When ::

    doubt = 8 trace(W^-1 P) trace(T P) < 1

the Newton map sends the set ``-2P <= D <= 2P`` into itself: on it ``F'D F`` is at most a quarter of ``I + F'XF``, so
that the last term lies between 0 and ``2 Ac'D T D Ac <= 8 trace(T P) Ac'P Ac <= 8 trace(T P) P <= W``. The closed loop
of ``X + D`` is ``(I + T D)^-1 Ac``, larger than Ac in the norm of P by at most ``1 / (1 - 2 trace(T P))``, which the
decrease ``W >= P / trace(W^-1 P)`` outweighs. So the exact stabilising solution lies within 2P of X.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from design.lqr.certificate import RiccatiKind, certified_candidates
from design.lqr.doubt import doubt_of, norm, residual_bound
from design.lqr.hamiltonian import solve_or_nan, subspace
from design.lqr.lyapunov import solve_stein
from design.lqr.regulator import RiccatiEquation, regulator_problem
from design.lqr.solvability import distance_from_unsolvable
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, ObjectArray

#: Doublings at most: a closed loop that decays by 1e-10 a sample needs 38.
MAX_DOUBLINGS = 40
#: Doubling ends when it adds less than this to the solution, relative: what is missing is about its square.
DOUBLED = 1e-9


@dataclass(frozen=True, eq=False)
class DiscreteRiccatiSolution(GridArrays):
    """Stabilising solutions, and what certifies them.

    Attributes
    ----------
    X : (*G, n, n) solution, symmetric and positive semidefinite; nan where not certified
    K : (*G, m, n) ``(R + B'XB)^-1 (B'XA + N')``, law ``u = -K x``; nan where not certified
    residual : (*G,) Frobenius norm of the residual over that of its terms, in balanced coordinates
    spectral_radius : (*G,) largest modulus of the eigenvalues of ``A - B K``; nan where there was no candidate
    certified : (*G,) bool
    solver : (*G,) object, who found the certified solution: ``doubling``, ``scipy`` or ``none``
    """

    X: FloatArray
    K: FloatArray
    residual: FloatArray
    spectral_radius: FloatArray
    certified: BoolArray
    solver: ObjectArray


def solve_discrete_riccati(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray | None = None
) -> DiscreteRiccatiSolution:
    """Stabilising solution of ``X = A'XA - (A'XB + N)(R + B'XB)^-1 (B'XA + N') + Q`` at every point.

    It minimises ``sum( x'Qx + u'Ru + 2x'Nu )`` over ``u = -K x``. A point without a certified solution (R not positive
    definite, ``Q - N R^-1 N'`` not positive semidefinite, no stabilising solution, too ill-conditioned, data not
    finite) has nan in X and K; nothing is raised for it. `design.lqr.solvability` with ``discrete`` says why.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, m) : ``x+ = A x + B u``
    Q (n, n), R (m, m), N (n, m) or None : weights, with or without the grid's axes

    Raises
    ------
    ValueError : shapes that do not belong together
    """
    grid = A.shape[:-2]
    with np.errstate(all="ignore"):
        problem = regulator_problem(A, B, Q, R, N, discrete=True)
        found, solver = certified_candidates(_DISCRETE, problem)
    X, K, residual = found.X_states, found.K, found.residual
    certified = np.asarray(solver != "none", dtype=bool)
    if not certified.all():
        known = certified[:, None, None]
        X, K = np.where(known, X, np.nan), np.where(known, K, np.nan)
        residual = np.where(problem.posed, residual, np.nan)
    return DiscreteRiccatiSolution(
        X=X.reshape(*grid, *X.shape[1:]),
        K=K.reshape(*grid, *K.shape[1:]),
        residual=residual.reshape(grid),
        spectral_radius=(1.0 - found.damping[:, 0]).reshape(grid),
        certified=certified.reshape(grid),
        solver=solver.reshape(grid),
    )


@dataclass(frozen=True, eq=False)
class _Loop:
    """What a solution X does, over N points.

    K : (N, m, n) gain on the scaled inputs; closed : (N, n, n) ``A - F K``; pivot : (N, m, m) ``I + F'XF``
    """

    K: FloatArray
    closed: FloatArray
    pivot: FloatArray


def _loop(equation: RiccatiEquation, X: FloatArray) -> _Loop:
    F = equation.F
    half = F.mT @ X
    pivot = np.eye(F.shape[-1]) + half @ F
    K = solve_or_nan(pivot, half @ equation.A)
    return _Loop(K, equation.A - F @ K, pivot)


def _newton(equation: RiccatiEquation, X: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One Newton step (Hewer 1971), kept where it lowers the residual.

    Returns
    -------
    X (N, n, n), its relative residual (N,), and the doubt (N,) about the solution, see the module
    """
    loop = _loop(equation, X)
    error, residual = _residual(equation, X, loop)
    bound = _residual_bound(equation, X, loop, error)
    D, P = solve_stein(loop.closed, error, -bound)
    gramian = equation.F @ solve_or_nan(loop.pivot, equation.F.mT)
    doubt = 8.0 * doubt_of(gramian, P, bound)
    _, lower = _residual(equation, X - D, _loop(equation, X - D))
    better = lower < residual
    return np.where(better[:, None, None], X - D, X), np.where(better, lower, residual), doubt


def _residual(equation: RiccatiEquation, X: FloatArray, loop: _Loop) -> tuple[FloatArray, FloatArray]:
    """``Ac'X Ac - X + K'K + Q`` (N, n, n), and its norm over that of its terms (N,); 0 / 0 counts as 0.

    In this form the rounding error of K enters by its square only.
    """
    kept, control = loop.closed.mT @ X @ loop.closed, loop.K.mT @ loop.K
    kept = 0.5 * (kept + kept.mT)
    error = kept - X + control + equation.Q
    size = norm(kept) + norm(X) + norm(control) + norm(equation.Q)
    value = norm(error)
    return error, np.where(value == 0.0, 0.0, value / size)


def _residual_bound(equation: RiccatiEquation, X: FloatArray, loop: _Loop, error: FloatArray) -> FloatArray:
    """Diagonal of W (N, n)."""
    size, K = np.abs(X), np.abs(loop.K)
    closed = np.abs(equation.A) + np.abs(equation.F) @ K
    return residual_bound(closed.mT @ size @ closed + size + K.mT @ K + np.abs(equation.Q), error)


def _by_doubling(equation: RiccatiEquation) -> tuple[FloatArray, None]:
    """The limit X (N, n, n) of the doubling algorithm (Chu, Fan, Lin and Wang 2004); nan where it does not settle.

    After k steps A, G and H belong to 2^k samples at once: H is the cost of that many samples, and A the state
    after them. A point stops when it has settled, so its solution does not depend on its neighbours in the batch.
    """
    X = np.full_like(equation.A, np.nan)
    points = np.arange(len(X))
    A, G = equation.A, equation.G
    H = np.broadcast_to(equation.Q, A.shape)
    n = A.shape[-1]
    for _ in range(MAX_DOUBLINGS):
        both = solve_or_nan(np.eye(n) + G @ H, np.concatenate([A, G], axis=-1))
        first, second = both[:, :, :n], both[:, :, n:]
        more = A.mT @ (H @ first)
        spread = A @ second @ A.mT
        H, G, A = H + 0.5 * (more + more.mT), G + 0.5 * (spread + spread.mT), A @ first
        size = norm(H)
        settled = norm(more) <= DOUBLED * size
        X[points[settled]] = H[settled]
        going = ~settled & np.isfinite(size)
        if not going.any():
            break
        points, A, G, H = points[going], A[going], G[going], H[going]
    return X, None


def _by_cayley(equation: RiccatiEquation) -> FloatArray:
    """X (N, n, n) from the eigenvectors of a Hamiltonian matrix; nan where it has no stable subspace.

    The eigenvectors of the symplectic pencil ``[A 0; -Q I] - z [I G; 0 A']`` are those of a Hamiltonian matrix with
    the eigenvalues ``s = (z - 1) / (z + 1)``: inside the unit circle is left of the axis.
    """
    A, G, Q = equation.A, equation.G, equation.Q
    points, n, _ = A.shape
    identity = np.eye(n)
    minus, plus = np.empty((points, 2 * n, 2 * n)), np.empty((points, 2 * n, 2 * n))
    minus[:, :n, :n], minus[:, :n, n:], minus[:, n:, :n], minus[:, n:, n:] = A - identity, -G, -Q, identity - A.mT
    plus[:, :n, :n], plus[:, :n, n:], plus[:, n:, :n], plus[:, n:, n:] = A + identity, G, -Q, identity + A.mT
    return subspace(solve_or_nan(plus, minus)).X


def _by_scipy(equation: RiccatiEquation) -> FloatArray:
    """Solutions (N, n, n) by scipy, point by point, symmetric; nan where it raises."""
    X = np.full_like(equation.A, np.nan)
    for i, (A, F, Q) in enumerate(zip(equation.A, equation.F, equation.Q, strict=True)):
        try:
            X[i] = scipy.linalg.solve_discrete_are(A, F, Q, np.eye(F.shape[-1]))
        except (np.linalg.LinAlgError, ValueError):
            continue
    return 0.5 * (X + X.mT)


def _feedback(equation: RiccatiEquation, X: FloatArray) -> FloatArray:
    return _loop(equation, X).K


def _damping(poles: ComplexArray) -> FloatArray:
    return np.asarray(1.0 - np.abs(poles))


_DISCRETE = RiccatiKind(
    batched="doubling",
    quick=_by_doubling,
    thorough=_by_cayley,
    by_scipy=_by_scipy,
    newton=_newton,
    feedback=_feedback,
    damping=_damping,
    deep=0.5,
    distance=distance_from_unsolvable,
)
