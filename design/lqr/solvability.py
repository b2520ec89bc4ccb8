"""Does the regulator problem have a stabilising solution? Point by point, and if not, which mode forbids it.

With ``R > 0`` and ``Q - N R^-1 N' >= 0`` the stabilising solution exists exactly when (Kucera 1972) ::

    (A, B) is stabilisable, and
    (Q - N R^-1 N', A - B R^-1 N') has no unobservable mode on the boundary of stability:
    the imaginary axis, in discrete time the unit circle.

An unobservable unstable mode is no obstacle: the stabilising solution mirrors it into the stable region, at the least
cost of control. One on the boundary mirrors into itself, so no feedback of this kind moves it.
Both conditions are rank tests (Popov, Belevitch, Hautus) in balanced coordinates, with A, the columns of B
and the rows of Q scaled to unit size: how strongly an input acts or a state is weighted does not matter,
only whether.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.lqr.regulator import RegulatorProblem, regulator_problem
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, ObjectArray

#: A singular value below this, relative to the balanced matrices, is a loss of rank.
RANK = 1e-12
#: Sweeps of the balancing of a pair; each one halves what is left of 2^1000.
PAIR_SWEEPS = 16


@dataclass(frozen=True, eq=False)
class Solvability(GridArrays):
    """Rank tests over the grid.

    Attributes
    ----------
    control_distance : (*G,) smallest singular value of ``[sI - A, B]`` over the eigenvalues s of A that are not
        stable; inf where all are
    observation_distance : (*G,) smallest singular value of ``[sI - A; Q]`` over the s of the boundary of stability
    uncontrolled : (*G,) the eigenvalue of A that the first is smallest at [1/s; in discrete time 1]
    unobserved : (*G,) the point of the boundary that the second is smallest at [1/s; in discrete time 1]
    reasons : (*G,) object array of str, None where the problem has a stabilising solution
    """

    control_distance: FloatArray
    observation_distance: FloatArray
    uncontrolled: ComplexArray
    unobserved: ComplexArray
    reasons: ObjectArray

    @property
    def stabilisable(self) -> BoolArray:
        """(*G,) every mode that is not stable is reached by an input."""
        return np.asarray(self.control_distance > RANK)

    @property
    def observable_on_axis(self) -> BoolArray:
        """(*G,) every mode on the boundary of stability is seen by Q."""
        return np.asarray(self.observation_distance > RANK)


def solvability(
    A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray | None = None, discrete: bool = False
) -> Solvability:
    """Whether each point has a stabilising solution, and the eigenvalue which forbids it.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, m) : the plant
    Q (n, n), R (m, m), N (n, m) or None : weights, with or without the grid's axes; R > 0, Q - N R^-1 N' >= 0
    discrete : in discrete time

    Raises
    ------
    ValueError : shapes that do not belong together
    """
    grid = A.shape[:-2]
    with np.errstate(all="ignore"):
        result = problem_solvability(regulator_problem(A, B, Q, R, N, discrete))
    return Solvability(
        result.control_distance.reshape(grid),
        result.observation_distance.reshape(grid),
        result.uncontrolled.reshape(grid),
        result.unobserved.reshape(grid),
        result.reasons.reshape(grid),
    )


def problem_solvability(problem: RegulatorProblem) -> Solvability:
    """`solvability` of a problem over N points."""
    equation = problem.equation.unscaled()
    eigenvalues = np.linalg.eigvals(equation.A).astype(complex)
    if problem.discrete:
        size = np.abs(eigenvalues)
        stable, boundary = size < 1.0 - RANK, np.where(size > 0, eigenvalues / size, 1.0)
    else:
        stable, boundary = eigenvalues.real < -RANK * _size(equation.A)[:, 0], 1j * eigenvalues.imag
    distance = np.where(stable, np.inf, _rank_distance(eigenvalues, equation.A, equation.F))
    control, uncontrolled = _worst(distance, eigenvalues)
    observation, unobserved = _worst(_rank_distance(boundary, equation.A.mT, equation.Q), boundary)
    reasons = np.full(len(control), None, dtype=object)
    for i in np.flatnonzero(~problem.posed | (control <= RANK) | (observation <= RANK)):
        if not problem.posed[i]:
            reasons[i] = _not_posed(problem)
        elif control[i] <= RANK:
            reasons[i] = f"(A, B) is not stabilisable: no input reaches the mode at {_mode(uncontrolled[i], problem)}"
        else:
            where = "unit circle" if problem.discrete else "imaginary axis"
            reasons[i] = (
                f"{_weight(problem)} does not see the mode at {_mode(unobserved[i], problem)} on the {where}: "
                "no stabilising solution; give that mode a weight"
            )
    return Solvability(control, observation, uncontrolled, unobserved, reasons)


def distance_from_unsolvable(problem: RegulatorProblem) -> FloatArray:
    """The smaller of both distances (N,)."""
    solvable = problem_solvability(problem)
    return np.minimum(solvable.control_distance, solvable.observation_distance)


def _not_posed(problem: RegulatorProblem) -> str:
    semidefinite = f", {_weight(problem)} is not positive semidefinite" if problem.discrete else ""
    return f"R is not positive definite, Q is not symmetric{semidefinite}, or the data are not finite"


def _weight(problem: RegulatorProblem) -> str:
    return "Q - N R^-1 N'" if np.any(problem.cross) else "Q"


def _mode(s: complex, problem: RegulatorProblem) -> str:
    value = f"{s.real:.6g}" if s.imag == 0 else f"{s.real:.6g}{s.imag:+.6g}j"
    return f"z = {value}" if problem.discrete else f"{value} 1/s"


def _size(matrix: FloatArray) -> FloatArray:
    """Largest entry (N, 1, 1); 1 for a matrix of zeros."""
    size = np.max(np.abs(matrix), axis=(1, 2), keepdims=True)
    return np.where(size > 0, size, 1.0)


def _rank_distance(s: ComplexArray, A: FloatArray, B: FloatArray) -> FloatArray:
    """Smallest singular value of ``[sI - A, B]`` (N, n) at each of the n values s, A of unit size."""
    A, B = _balanced_pair(A, B)
    size = _size(A)
    A, B, s = A / size, B / size, s / size[:, 0]
    pencil = s[:, :, None, None] * np.eye(A.shape[-1]) - A[:, None]
    inputs = np.broadcast_to(B[:, None], (*s.shape, *B.shape[1:]))
    singular = np.linalg.svd(np.concatenate([pencil, inputs], axis=-1), compute_uv=False)
    return np.asarray(singular[..., -1])


def _balanced_pair(A: FloatArray, B: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A and B in states where the rows of ``[A, B]`` and the columns of A are of like size, as far as can be.

    The columns of B are made as large as A, so that it depends neither on the strength of the inputs nor on the
    units of the states whether rank is lost.
    """
    diagonal = np.eye(A.shape[-1], dtype=bool)
    for _ in range(PAIR_SWEEPS):
        size = _size(A)
        B = _unit_columns(B) * size
        coupling = np.where(diagonal, 0.0, np.abs(A))
        rows = np.maximum(coupling.max(axis=2), np.abs(B).max(axis=2))
        columns = coupling.max(axis=1)
        # Where there is nothing to compare with, the size of A serves.
        ratio = np.where(rows > 0, rows, size[:, 0]) / np.where(columns > 0, columns, size[:, 0])
        scale = np.exp2(np.rint(0.25 * np.log2(ratio)))[:, :, None]
        A, B = A * scale.mT / scale, B / scale
    return A, _unit_columns(B) * _size(A)


def _unit_columns(B: FloatArray) -> FloatArray:
    """The largest entry of each column becomes 1; a column of zeros stays."""
    length = np.max(np.abs(B), axis=1, keepdims=True)
    return B / np.where(length > 0, length, 1.0)


def _worst(distance: FloatArray, s: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    worst = np.argmin(distance, axis=1)[:, None]
    return np.take_along_axis(distance, worst, 1)[:, 0], np.take_along_axis(s, worst, 1)[:, 0]
