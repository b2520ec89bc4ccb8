"""Weights of the quadratic cost: Bryson's rule or explicit matrices, and what no solve can repair (seed 5.1).

``int( x'Qx + u'Ru + 2x'Nu ) dt`` over the states ``dt dt_rate da da_rate`` and the integrals ``int_a int_t``
[rad, rad/s, rad s], and the inputs ``T_t T_a`` [N m]. What `design.lqr.structures` adds, the torques behind a lag, the
lag states of unsteady damping and the states of delays, has no weight unless explicit matrices give it one.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from design.lqr.regulator import ASYMMETRY
from model.arrays import FloatArray

WEIGHTED_STATES = ("dt", "dt_rate", "da", "da_rate", "int_a")
WEIGHTED_INPUTS = ("T_t", "T_a")

#: State -> the field of Bryson's rule that weighs it.
_INTEGRALS = {"int_a": "aileron_integral", "int_t": "tab_integral"}
_BRYSON = {"dt": "tab", "dt_rate": "tab_rate", "da": "aileron", "da_rate": "aileron_rate", **_INTEGRALS}

#: An eigenvalue this much below zero, relative and on a unit diagonal, is still rounding.
NEGATIVE = 1e-10

WeightName = Literal["Q", "R", "N", "W_y", "W_u"]


class WeightsRefused(ValueError):
    """Weights which define no regulator, at any point.

    Attributes
    ----------
    matrix : the matrix at fault: ``Q``, ``R`` or ``N``; of output weights ``W_y`` or ``W_u``
    eigenvalue : the eigenvalue that shows it; of the matrix, or of the plant for a mode no weight sees. None
        where shape, symmetry or a number that is not finite is the fault
    reason : in words and numbers
    """

    def __init__(self, matrix: WeightName, eigenvalue: complex | None, reason: str) -> None:
        super().__init__(reason)
        self.matrix: WeightName = matrix
        self.eigenvalue = eigenvalue
        self.reason = reason

    def __reduce__(self) -> tuple[type[WeightsRefused], tuple[WeightName, complex | None, str]]:
        """Made again from what it was made of: so that it comes back from another process."""
        return WeightsRefused, (self.matrix, self.eigenvalue, self.reason)


@dataclass(frozen=True)
class BrysonWeights:
    """Bryson's rule: the largest acceptable value of each state and input; weights are one over its square.

    Attributes
    ----------
    aileron, tab : deflections [rad]
    aileron_rate, tab_rate : [rad/s]
    aileron_integral : of the aileron's error [rad s]; None where the aileron has no reference
    tab_torque, aileron_torque : deviations from trim [N m]
    tab_integral : of the tab's error [rad s]; None where the tab has no reference
    """

    aileron: float
    aileron_rate: float
    tab: float
    tab_rate: float
    aileron_integral: float | None
    tab_torque: float
    aileron_torque: float
    tab_integral: float | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is None and field.name in _INTEGRALS.values():
                continue
            if value is None or not (np.isfinite(value) and value > 0):
                raise ValueError(f"{field.name}: the largest acceptable value must be positive, not {value}")


@dataclass(frozen=True, eq=False)
class ExplicitWeights:
    """Q (n, n), R (2, 2), N (n, 2) or None, in SI and radians over states and `WEIGHTED_INPUTS`.

    n is the number of `Structure.weighted_states`, and every other state has no weight; or that of all the states.
    """

    Q: FloatArray
    R: FloatArray
    N: FloatArray | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None:
                matrix = np.array(value, dtype=float)
                matrix.flags.writeable = False
                object.__setattr__(self, field.name, matrix)


def weight_matrices(
    weights: BrysonWeights | ExplicitWeights, states: tuple[str, ...] = WEIGHTED_STATES
) -> ExplicitWeights:
    """Q, R and N of either kind of weights; those of Bryson's rule are over `states`, of which it weighs what it knows.

    Raises
    ------
    WeightsRefused : Bryson's rule without a value for an integral that is among the states
    """
    if isinstance(weights, ExplicitWeights):
        return weights
    for state, name in _INTEGRALS.items():
        if state in states and getattr(weights, name) is None:
            reason = f"{name} is missing: Q would not see the mode at 0 1/s of the integral {state}"
            raise WeightsRefused("Q", 0j, reason)
    values = [getattr(weights, _BRYSON[state]) if state in _BRYSON else np.inf for state in states]
    inputs = (weights.tab_torque, weights.aileron_torque)
    # A value too small to square makes an infinite weight, which `check_weights` refuses.
    with np.errstate(over="ignore", divide="ignore"):
        return ExplicitWeights(
            Q=np.diag(np.square(1.0 / np.array(values))), R=np.diag(np.square(1.0 / np.array(inputs)))
        )


def check_weights(Q: FloatArray, R: FloatArray, N: FloatArray | None = None, tolerance: float = NEGATIVE) -> None:
    """Refuse weights that no plant could be regulated with; to be called before any solve.

    Definiteness is judged with the rows and columns of each matrix scaled to a unit diagonal, which
    keeps the signs of its eigenvalues (Sylvester) and lets units be mixed.

    Parameters
    ----------
    Q (n, n), R (m, m), N (n, m) or None
    tolerance : an eigenvalue of the scaled ``Q - N R^-1 N'`` above minus this counts as zero

    Raises
    ------
    WeightsRefused : a shape, an entry that is not finite, asymmetry, R not positive definite, Q or
        ``Q - N R^-1 N'`` not positive semidefinite
    """
    n, m = len(Q), len(R)
    _check_matrix("Q", Q, (n, n))
    check_definite(R, (m, m))
    check_semidefinite(Q, (n, n), tolerance=tolerance)
    if N is not None:
        _check_matrix("N", N, (n, m))
        with np.errstate(over="ignore", invalid="ignore"):
            reduced = Q - N @ np.linalg.solve(R, N.T)
        _refuse_negative("N", "Q - N R^-1 N'", reduced, Q, tolerance)


def check_definite(matrix: FloatArray, shape: tuple[int, int], name: WeightName = "R") -> None:
    """Refuse a weight of inputs of another shape, or not positive definite with the margin that its inverse needs.

    Raises
    ------
    WeightsRefused : names the matrix and its eigenvalue
    """
    _check_matrix(name, matrix, shape)
    diagonal = np.diag(matrix)
    if np.all(diagonal > 0) and _lowest_eigenvalue(_scaled(matrix, diagonal)) > len(matrix) * np.finfo(float).eps:
        return
    lowest = _lowest_eigenvalue(matrix)
    said = f"{name} is not positive definite: its smallest eigenvalue is {lowest:.6g}; every input needs a weight"
    raise WeightsRefused(name, lowest, said)


def check_semidefinite(
    matrix: FloatArray, shape: tuple[int, int], name: WeightName = "Q", tolerance: float = NEGATIVE
) -> None:
    """Refuse a weight of states or outputs of another shape, or not positive semidefinite up to rounding.

    Raises
    ------
    WeightsRefused : names the matrix and its eigenvalue
    """
    _check_matrix(name, matrix, shape)
    _refuse_negative(name, name, matrix, matrix, tolerance)


def _check_matrix(name: WeightName, matrix: FloatArray, shape: tuple[int, int]) -> None:
    if matrix.shape != shape:
        raise WeightsRefused(name, None, f"{name} has shape {matrix.shape}: expected {shape}")
    if not np.all(np.isfinite(matrix)):
        raise WeightsRefused(name, None, f"{name} holds an entry that is not finite")
    if name == "N":
        return
    skew = np.max(np.abs(matrix - matrix.T), initial=0.0)
    if skew > ASYMMETRY * np.max(np.abs(matrix), initial=0.0):
        raise WeightsRefused(name, None, f"{name} is not symmetric: entries differ by {skew:.6g}")


def _refuse_negative(name: WeightName, text: str, matrix: FloatArray, Q: FloatArray, tolerance: float) -> None:
    """Unless ``matrix >= 0`` up to rounding in the size of Q's diagonal."""
    # The larger of the two: what a cross term takes from a state without a weight counts in full.
    diagonal = np.maximum(np.abs(np.diag(Q)), np.abs(np.diag(matrix)))
    scaled = _scaled(matrix, np.where(diagonal > 0, diagonal, 1.0))
    if not len(matrix) or _lowest_eigenvalue(scaled) >= -tolerance:
        return
    lowest = _lowest_eigenvalue(matrix)
    raise WeightsRefused(name, lowest, f"{text} is not positive semidefinite: its smallest eigenvalue is {lowest:.6g}")


def _scaled(matrix: FloatArray, diagonal: FloatArray) -> FloatArray:
    unit = 1.0 / np.sqrt(diagonal)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        return np.asarray(matrix * unit[:, None] * unit)


def _lowest_eigenvalue(matrix: FloatArray) -> float:
    """Smallest eigenvalue of a symmetric matrix: never above its smallest diagonal entry, whatever rounding says.

    nan where the matrix overflowed.
    """
    if not np.isfinite(matrix).all():
        return float("nan")
    return float(min(np.linalg.eigvalsh(0.5 * matrix + 0.5 * matrix.T)[0], matrix.diagonal().min()))
