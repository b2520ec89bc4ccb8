"""Does the regulator problem have a stabilising solution? Point by point, and if not, which mode forbids it.

With ``R > 0`` and ``Q - N R^-1 N' >= 0`` the stabilising solution exists exactly when (Kucera 1972) ::

    (A, B) is stabilisable, and
    (Q - N R^-1 N', A - B R^-1 N') has no unobservable mode on the imaginary axis.

An unobservable mode in the right half plane is no obstacle: the stabilising solution mirrors it into the left
half plane, at the least cost of control. One on the axis mirrors into itself, so no feedback of this kind moves it.
Both conditions are rank tests (Popov, Belevitch, Hautus) in balanced coordinates, with A, the columns of B
and the rows of Q scaled to unit size: how strongly an input acts or a state is weighted does not matter,
only whether.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.lqr.regulator import RegulatorProblem, RiccatiEquation, regulator_problem
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
    observation_distance : (*G,) smallest singular value of ``[jwI - A; Q]`` over the axis
    uncontrolled : (*G,) the eigenvalue of A [1/s] that the first is smallest at
    unobserved : (*G,) the point of the axis [1/s] that the second is smallest at
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
        """(*G,) every mode on the imaginary axis is seen by Q."""
        return np.asarray(self.observation_distance > RANK)


def solvability(A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray | None = None) -> Solvability:
    """Whether each point has a stabilising solution, and the eigenvalue which forbids it.

    Parameters
    ----------
    A (*G, n, n), B (*G, n, m) : the plant
    Q (n, n), R (m, m), N (n, m) or None : weights, with or without the grid's axes; R > 0, Q - N R^-1 N' >= 0

    Raises
    ------
    ValueError : shapes that do not belong together
    """
    grid = A.shape[:-2]
    with np.errstate(all="ignore"):
        result = problem_solvability(regulator_problem(A, B, Q, R, N))
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
    control, uncontrolled = _control_distance(equation, eigenvalues)
    observation, unobserved = _observation_distance(equation, eigenvalues)
    reasons = np.full(len(control), None, dtype=object)
    for i in np.flatnonzero(~problem.posed | (control <= RANK) | (observation <= RANK)):
        if not problem.posed[i]:
            reasons[i] = "R is not positive definite, Q is not symmetric, or the data are not finite"
        elif control[i] <= RANK:
            reasons[i] = f"(A, B) is not stabilisable: no input reaches the mode at {_rate(uncontrolled[i])} 1/s"
        else:
            matrix = "Q - N R^-1 N'" if np.any(problem.cross) else "Q"
            reasons[i] = (
                f"{matrix} does not see the mode at {_rate(unobserved[i])} 1/s on the imaginary axis: "
                "no stabilising solution; give that mode a weight"
            )
    return Solvability(control, observation, uncontrolled, unobserved, reasons)


def _size(matrix: FloatArray) -> FloatArray:
    """Largest entry (N, 1, 1); 1 for a matrix of zeros."""
    size = np.max(np.abs(matrix), axis=(1, 2), keepdims=True)
    return np.where(size > 0, size, 1.0)


def _rate(s: complex) -> str:
    return f"{s.real:.6g}" if s.imag == 0 else f"{s.real:.6g}{s.imag:+.6g}j"


def _control_distance(equation: RiccatiEquation, eigenvalues: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    """Smallest singular value of ``[sI - A, B]`` over the eigenvalues with ``Re s >= 0``, and that s."""
    distance = _rank_distance(eigenvalues, equation.A, equation.F)
    distance[eigenvalues.real < -RANK * _size(equation.A)[:, 0]] = np.inf
    return _worst(distance, eigenvalues)


def _observation_distance(equation: RiccatiEquation, eigenvalues: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    """Smallest singular value of ``[jwI - A; Q]`` at the points of the axis below the eigenvalues, and that jw."""
    axis = np.asarray(1j * eigenvalues.imag, dtype=complex)
    return _worst(_rank_distance(axis, equation.A.mT, equation.Q), axis)


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
