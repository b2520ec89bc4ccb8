"""The nu-gap between two loops, and the generic stability margin that it is to be held against (Vinnicombe 1993).

A controller that stabilises one plant with the generic stability margin b stabilises every plant whose nu-gap from that
one is less than b. Both numbers depend on the units of what lies between plant and controller. Here each plant is
weighed with the controller itself: what is compared are loop transfers ``L = K (sI - A)^-1 B`` cut at the commands,
each closed by 1, so that the margin is that of the loop as it is flown. Of two commands the units are still free; any
are right as long as they are the same in both numbers, and `best_units` finds those that prove most.

With ``T = L (I + L)^-1`` and ``S = I - T`` the columns of ``[S; T]`` span the graph of L, whatever poles L has on the
axis, and the chordal distance of two loops at a frequency is ::

    psi = sigma_max( (S2 S2' + T2 T2')^-1/2 (S2 - S1) (S1'S1 + T1'T1)^-1/2 )

The nu-gap is the largest psi, if ``det(S2'S1 + T2'T1)`` winds about the origin as often as the closed loops have
unstable poles, ``winding + unstable_2 - unstable_1 = 0``; else it is 1. (For stable closed loops ``[S; T]`` are coprime
factors over the stable systems, of which the winding number is zero; each unstable pole turns them once.) The margin is
``1 / sup sigma_max([I; I] S [I, L]) = 1 / (sqrt(2) sup sigma_max([S, T]))``, at most ``1 / sqrt(2)``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: Frequencies per search, and how far beyond the modes they go.
POINTS, REACH = 400, 1e3
#: Places about each mode, in half widths.
OFFSETS = np.linspace(-4.0, 4.0, 17)
#: Largest turn of the determinant between two frequencies [rad]; where it turns more there is one more between them.
TURN, HALVINGS = 0.5, 40
#: Summits that are climbed, and steps of the golden section that climbs them.
SUMMITS, STEPS = 4, 40
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
#: Logarithms of units that are tried.
UNITS = (-8.0, 8.0)
#: Two loops this far apart or further have perpendicular graphs somewhere, and no winding number.
PERPENDICULAR = 1.0 - 1e-12


@dataclass(frozen=True, eq=False)
class CutLoop(GridArrays):
    """``L(s) = K (sI - A)^-1 B``, closed by ``u = -L u``.

    Attributes
    ----------
    A : (*G, n, n), B : (*G, n, m), K : (*G, m, n), finite; ``A - B K`` without poles on the imaginary axis
    """

    A: FloatArray
    B: FloatArray
    K: FloatArray

    @property
    def closed(self) -> FloatArray:
        """``A - B K`` (*G, n, n)."""
        return self.A - self.B @ self.K

    def in_units(self, units: FloatArray) -> CutLoop:
        """The loop with its commands in units (*G, m) of themselves."""
        return CutLoop(self.A, self.B * units[..., None, :], self.K / units[..., :, None])


@dataclass(frozen=True, eq=False)
class NuGap(GridArrays):
    """How far two loops are from each other.

    Attributes
    ----------
    gap : (*G,) the nu-gap, 0 to 1
    distance : (*G,) the largest chordal distance over frequency; less than the gap where the winding number is wrong
    omega : (*G,) where that is [rad/s]
    comparable : (*G,) whether the winding number is right; where it is not, the gap is 1
    """

    gap: FloatArray
    distance: FloatArray
    omega: FloatArray
    comparable: BoolArray


@dataclass(frozen=True, eq=False)
class StabilityMargin(GridArrays):
    """The generic stability margin (*G,), 0 to ``1 / sqrt(2)``, 0 where the loop is not stable; its omega [rad/s]."""

    margin: FloatArray
    omega: FloatArray


def nu_gap(one: CutLoop, other: CutLoop) -> NuGap:
    """The nu-gap between loops over a grid, of the same number of inputs; symmetric.

    Found by a sweep over frequency whose highest summits are refined, so that it is a lower bound in principle.

    Raises
    ------
    ValueError : grids or inputs differ
    numpy.linalg.LinAlgError : an entry is not finite
    """
    grid, m = one.A.shape[:-2], one.B.shape[-1]
    if other.A.shape[:-2] != grid or other.B.shape[-1] != m:
        raise ValueError(f"loops over {grid} and {other.A.shape[:-2]} with {m} and {other.B.shape[-1]} inputs")
    first, second = _Row.of(one), _Row.of(other)
    points = len(first.F)
    found = [_gap(first.take([i]), second.take([i])) for i in range(points)]
    gap, distance, omega = (np.array([each[k] for each in found], dtype=float).reshape(grid) for k in range(3))
    return NuGap(gap, distance, omega, np.array([each[3] for each in found], dtype=bool).reshape(grid))


def stability_margin(loop: CutLoop) -> StabilityMargin:
    """The generic stability margin of loops over a grid, found like `nu_gap`."""
    row, grid = _Row.of(loop), loop.A.shape[:-2]
    found = [_margin(row.take([i])) for i in range(len(row.F))]
    margin, omega = (np.array([each[k] for each in found], dtype=float).reshape(grid) for k in range(2))
    return StabilityMargin(margin, omega)


def _gap(one: _Row, other: _Row) -> tuple[float, float, float, bool]:
    """Gap, distance, its frequency, and whether the winding number is right, of one point."""
    place = _places(np.concatenate([one.poles, other.poles], axis=-1))[0]
    distance, omega = _summit(lambda at: _chordal(one.at(at), other.at(at)), place)
    right = _winding(one, other, place) + int(other.unstable[0]) - int(one.unstable[0]) == 0
    comparable = right and distance < PERPENDICULAR
    return (distance if comparable else 1.0), distance, omega, comparable


def _margin(row: _Row) -> tuple[float, float]:
    """Margin and its frequency of one point."""

    def size(omega: FloatArray) -> FloatArray:
        T = row.at(omega)
        both = np.concatenate([np.eye(T.shape[-1]) - T, T], axis=-1)
        return np.asarray(np.linalg.norm(both, 2, axis=(-2, -1)))

    highest, omega = _summit(size, _places(row.poles)[0])
    if highest < 1.0:  # at infinite frequency the loop is open: S is 1 and T is 0
        highest, omega = 1.0, np.inf
    return (0.0 if row.unstable[0] else 1.0 / (np.sqrt(2.0) * highest)), omega


def best_units(loop: CutLoop) -> FloatArray:
    """Units of the commands (*G, m) in which the generic stability margin is largest, the last of them 1.

    The norm that it is the inverse of is log-convex in the logarithms of the units, so that a search along one of them
    finds the best.

    Raises
    ------
    ValueError : more than two commands
    """
    grid, m = loop.A.shape[:-2], loop.B.shape[-1]
    if m > 2:
        raise ValueError(f"units are found for two commands at most, there are {m}")
    row = _Row.of(loop)
    units = np.ones((len(row.F), m))
    if m == 2:
        units[:, 0] = [_best_unit(row.take([i])) for i in range(len(row.F))]
    return units.reshape(*grid, m)


def _best_unit(row: _Row) -> float:
    """Unit of the first of two commands of one point."""
    T = row.at(_places(row.poles)[0])
    both = np.stack([np.eye(2) - T, T], axis=-3)  # (W, 2, 2, 2)

    def size(log_unit: float) -> float:
        unit = np.array([np.exp(log_unit), 1.0])
        scaled = both * (unit / unit[:, None])
        return float(np.linalg.norm(np.concatenate([scaled[:, 0], scaled[:, 1]], axis=-1), 2, axis=(-2, -1)).max())

    return float(np.exp(minimize_scalar(size, bounds=UNITS, method="bounded", options={"xatol": 1e-3}).x))


@dataclass(frozen=True, eq=False)
class _Row(GridArrays):
    """Closed loops in one row: ``T = K (sI - F)^-1 B`` by F (N, n, n), its modes where they are apart, poles (N, n)."""

    F: FloatArray
    B: FloatArray
    K: FloatArray
    poles: ComplexArray

    @classmethod
    def of(cls, loop: CutLoop) -> _Row:
        *_, n, m = loop.B.shape
        F = loop.closed.reshape(-1, n, n)
        poles = np.linalg.eigvals(F).astype(np.complex128)
        return cls(F, loop.B.reshape(-1, n, m), loop.K.reshape(-1, m, n), poles)

    @property
    def unstable(self) -> IntArray:
        """Number of unstable poles (N,)."""
        return np.asarray(np.sum(self.poles.real >= 0.0, axis=-1))

    def at(self, omega: FloatArray) -> ComplexArray:
        """T (W, m, m) of the only point at frequencies (W,) [rad/s]."""
        matrix = 1j * omega[:, None, None] * np.eye(self.F.shape[-1]) - self.F
        return np.asarray(self.K @ np.linalg.solve(matrix, self.B.astype(complex)))


def _chordal(T1: ComplexArray, T2: ComplexArray) -> FloatArray:
    """The distance psi (W,) of T (W, m, m)."""
    one = np.eye(T1.shape[-1])
    S1, S2 = one - T1, one - T2
    right = np.linalg.cholesky(S1.conj().mT @ S1 + T1.conj().mT @ T1)
    left = np.linalg.cholesky(S2 @ S2.conj().mT + T2 @ T2.conj().mT)
    # X = left^-1 (S2 - S1) right^-*: triangular roots have the singular values of the symmetric ones
    X = np.linalg.solve(left, S2 - S1)
    X = np.linalg.solve(right, X.conj().mT)
    return np.asarray(np.minimum(np.linalg.norm(X, 2, axis=(-2, -1)), 1.0))


def _places(poles: ComplexArray) -> FloatArray:
    """Frequencies (N, W), rising, from 0 over the ladder and about every mode [rad/s]."""
    size = np.abs(poles)
    low, high = size.min(axis=-1, keepdims=True) / REACH, size.max(axis=-1, keepdims=True) * REACH
    ladder = low * (high / low) ** np.linspace(0.0, 1.0, POINTS)
    about = np.abs(poles.imag)[..., None] + np.abs(poles.real)[..., None] * OFFSETS
    place = np.concatenate([0.0 * low, ladder, np.abs(about).reshape(len(poles), -1)], axis=-1)
    return np.sort(place, axis=-1)


def _summit(height: Callable[[FloatArray], FloatArray], place: FloatArray) -> tuple[float, float]:
    """Largest height and where: the best of the places (W,), refined by golden section between its neighbours."""
    values = height(place)
    inner = np.pad(values, 1, constant_values=-np.inf)
    tops = np.flatnonzero((values >= inner[:-2]) & (values >= inner[2:]))
    best = tops[np.argsort(values[tops])[-SUMMITS:]]
    low, high = place[np.maximum(best - 1, 0)], place[np.minimum(best + 1, place.size - 1)]
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left, at_right = height(left), height(right)
    for _ in range(STEPS):
        rises = at_left < at_right
        low, high = np.where(rises, left, low), np.where(rises, high, right)
        fresh = np.where(rises, low + GOLDEN * (high - low), high - GOLDEN * (high - low))
        at_fresh = height(fresh)
        left, right = np.where(rises, right, fresh), np.where(rises, fresh, left)
        at_left, at_right = np.where(rises, at_right, at_fresh), np.where(rises, at_fresh, at_left)
    omega, values = np.concatenate([place, left]), np.concatenate([values, at_left])
    top = int(np.argmax(values))
    return float(values[top]), float(omega[top])


def _winding(one: _Row, other: _Row, place: FloatArray) -> int:
    """Times that the determinant of one point goes round the origin, from minus to plus infinite frequency."""

    def determinant(omega: FloatArray) -> ComplexArray:
        T1, T2 = one.at(omega), other.at(omega)
        identity = np.eye(T1.shape[-1])
        graph = (identity - T2).conj().mT @ (identity - T1) + T2.conj().mT @ T1
        return np.asarray(np.linalg.det(graph))

    omega = np.unique(place)
    value = determinant(omega)
    for _ in range(HALVINGS):
        wide = np.flatnonzero(np.abs(np.angle(value[1:] / value[:-1])) > TURN)
        if not wide.size:
            break
        between = 0.5 * (omega[wide] + omega[wide + 1])
        omega, value = np.insert(omega, wide + 1, between), np.insert(value, wide + 1, determinant(between))
    # At infinite frequency both loops are open, and the determinant is 1; negative frequencies are the mirror image.
    turned = np.angle(np.append(value[1:], 1.0) / value).sum()
    return int(np.rint(turned / np.pi))
