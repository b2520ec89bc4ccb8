"""Largest singular value of a transfer over all frequencies, found and proved by level sets of its Hamiltonian.

A level is the largest singular value at some frequency exactly when ``j w`` is an eigenvalue of a Hamiltonian matrix
(Boyd, Balakrishnan and Kabamba 1989). So a frequency grid and Newton's method find a peak, and the eigenvalues for a
level just above it either prove that nothing is higher or bound the frequencies that are, where the search goes on
(Bruinsma and Steinbuch 1990).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from design.disturbance.open_parts import Matrices
from design.disturbance.summits import Summits, climbed, largest_singular_value
from model.arrays import BoolArray, ComplexArray, FloatArray, GridArrays, IntArray

#: A peak is proved to be the largest to within this part of it.
RESOLUTION = 4e-10
#: Where the gain at infinity is above this part of the level, the level set is looked for from another place.
_LOUD = 0.99
#: One or two passes prove a peak; more are for loops that are next to unstable.
LARGEST_NUMBER_OF_PASSES = 30
#: An eigenvalue this near to the axis, in parts of its size and of the matrix, bounds a level set: rounding takes them
#: off it. One too many does no harm but to the time it takes.
_NEAR_AXIS, _ROUNDING = 1e-4, 1e-11

AnyArray = TypeVar("AnyArray", FloatArray, ComplexArray)

#: Of systems (K,) and their highest known summits, a mask (K,): False where nothing is higher for certain.
Screen = Callable[[IntArray, Summits], BoolArray]


@dataclass(frozen=True, eq=False)
class Peak(GridArrays):
    """Largest gains over all frequencies, and where they are [rad/s]: 0, or inf where one is only approached there."""

    gain: FloatArray
    omega: FloatArray


def proved_peak(system: Matrices, start: FloatArray, quiet: FloatArray, screen: Screen | None = None) -> Peak:
    """Peak over all frequencies of transfers of stable systems.

    Rounding hides from the proof, not from the search, a resonance that is narrower than about 1e-6 of its frequency:
    it must be in sight of a start.

    Parameters
    ----------
    system : real matrices of N stable systems (N, ...), balanced (`design.disturbance.lyapunov.balanced`)
    start : (N, S) frequencies in sight of the highest summits [rad/s], nan padded
    quiet : (N,) a frequency at which the gain is small [rad/s]
    screen : a cheaper proof that is tried first

    Returns
    -------
    Peak; nan where the proof does not come to an end
    """
    if system.B.shape[-1] > system.C.shape[-2]:  # the transposed system has the same singular values, and less inputs
        system = Matrices(system.A.mT, system.C.mT, system.B.mT, system.D.mT)
    row, place = np.nonzero(np.isfinite(start))
    found = Summits.at_infinity(system).raised(row, climbed(system.take(row), start[row, place]))
    active = np.flatnonzero(found.gain > 0.0)
    for _ in range(LARGEST_NUMBER_OF_PASSES):
        if screen is not None:
            active = active[screen(active, found.take(active))]
        if not active.size:
            break
        candidate = _above(system.take(active), found.take(active), quiet[active])
        active = active[candidate.exists]
        higher = climbed(system.take(active), candidate.omega[candidate.exists])
        better = higher.gain > found.gain[active] * (1.0 + RESOLUTION)
        active = active[better]
        found = found.raised(active, higher.take(better))
    proved = np.ones(found.gain.shape, dtype=bool)
    proved[active] = False
    return Peak(np.where(proved, found.gain, np.nan), np.where(proved & (found.gain > 0.0), found.omega, np.nan))


@dataclass(frozen=True, eq=False)
class _Candidate:
    """Whether there is a frequency (N,) where the gain may be above the level, and the best of them (N,)."""

    exists: BoolArray
    omega: FloatArray


def _above(system: Matrices, known: Summits, quiet: FloatArray) -> _Candidate:
    """The most promising frequency at which each system may be above what is known, if there is one."""
    level = known.gain * (1.0 + RESOLUTION)
    edges = _edges(system, level, known)
    loud = np.flatnonzero(largest_singular_value(system.D.astype(np.complex128)) > _LOUD * level)
    if loud.size:
        edges[loud] = _edges_seen_from(system.take(loud), level[loud], quiet[loud])
    edges = np.where(edges > 0.0, edges, np.inf)
    exists = np.asarray(np.isfinite(edges).any(axis=-1))
    most = int(np.isfinite(edges).sum(axis=-1).max(initial=1))
    edges = np.sort(edges[exists], axis=-1)[:, :most]
    edges = np.concatenate([np.zeros((len(edges), 1)), edges], axis=-1)
    tried = np.concatenate([edges, 0.5 * (edges[:, 1:] + edges[:, :-1]), 2.0 * edges[:, 1:]], axis=-1)
    real = np.isfinite(tried)
    chosen = system.take(exists).take((slice(None), None))
    heights = largest_singular_value(chosen.response(np.where(real, tried, 0.0)))
    best = np.argmax(np.where(real, heights, -1.0), axis=-1)
    candidate = np.zeros(len(level))
    candidate[exists] = np.take_along_axis(tried, best[:, None], axis=-1)[:, 0]
    return _Candidate(exists, candidate)


def _edges(system: Matrices, level: FloatArray, known: Summits) -> FloatArray:
    """Frequencies (N, 2n) of either sign at which a singular value is at the level, inf where there are fewer."""
    eigenvalues, norm = _hamiltonian_eigenvalues(system.A, system.B, system.C, system.D, level)
    near = np.abs(eigenvalues.real) <= nearness(np.abs(eigenvalues), norm)
    own = is_own_pair(eigenvalues.imag, eigenvalues.real, known)
    return np.where(near & ~own & (eigenvalues.imag != 0.0), eigenvalues.imag, np.inf)


def _hamiltonian_eigenvalues(
    A: AnyArray, B: AnyArray, C: AnyArray, D: AnyArray, level: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Eigenvalues (N, 2n) of the Hamiltonian of a level (N,), and its norm (N,)."""
    n, p, o = A.shape[-1], B.shape[-1], C.shape[-2]
    root = np.sqrt(level)[:, None, None]
    B, C, D = B / root, C / root, D / level[:, None, None]
    adjoint = D.mT.conj()
    inner, outer = np.linalg.inv(np.eye(p) - adjoint @ D), np.linalg.inv(np.eye(o) - D @ adjoint)
    drift = A + B @ inner @ adjoint @ C
    H = np.empty((len(A), 2 * n, 2 * n), dtype=drift.dtype)
    H[:, :n, :n], H[:, :n, n:] = drift, B @ inner @ B.mT.conj()
    H[:, n:, :n], H[:, n:, n:] = -C.mT.conj() @ outer @ C, -drift.mT.conj()
    return np.linalg.eigvals(H).astype(np.complex128), np.asarray(np.linalg.norm(H, axis=(-2, -1)))


def nearness(size: FloatArray, norm: FloatArray) -> FloatArray:
    """How far off its line (N, k) rounding may take an eigenvalue of a size (N, k) of a matrix of a norm (N,)."""
    return _NEAR_AXIS * size + _ROUNDING * norm[:, None]


def is_own_pair(along: FloatArray, off: FloatArray, known: Summits) -> BoolArray:
    """Whether eigenvalues (N, k), `along` the axis and `off` it, are the two that the known summit itself has.

    Next to a summit at w the gain falls like ``1 - sharpness (W - w)^2 / 2``: it is at a level just above where W is
    ``sqrt(2 RESOLUTION / sharpness)`` beside w, at a right angle to the axis.
    """
    distance = np.sqrt(2.0 * RESOLUTION / np.where(known.sharpness > 0.0, known.sharpness, np.inf))[:, None]
    place = np.where(np.isfinite(known.omega), known.omega, 0.0)[:, None]
    beside = np.abs(np.abs(off) - distance) <= 0.5 * distance
    return np.asarray(beside & (np.abs(np.abs(along) - place) <= 0.5 * distance))


def _edges_seen_from(system: Matrices, level: FloatArray, centre: FloatArray) -> FloatArray:
    """The same from ``z = 1 / (s - j centre)``, in which infinite frequency is a place like any other.

    ``H(s) = H_c - C_c (zI - A_c)^-1 B_c`` with ``A_c = -(jcI - A)^-1``, ``H_c = H(jc)``: next to the gain at infinity
    the Hamiltonian in s is singular, this one is not when the gain at the centre is small.
    """
    n = system.A.shape[-1]
    pencil = 1j * centre[:, None, None] * np.eye(n) - system.A
    A = np.asarray(-np.linalg.inv(pencil), dtype=np.complex128)
    B, C = np.asarray(-A @ system.B, dtype=np.complex128), np.asarray(system.C @ A, dtype=np.complex128)
    value = np.asarray(system.D - C @ system.B, dtype=np.complex128)
    eigenvalues, norm = _hamiltonian_eigenvalues(A, B, C, value, level)
    near = (np.abs(eigenvalues.real) <= nearness(np.abs(eigenvalues), norm)) & (eigenvalues.imag != 0.0)
    return np.where(near, centre[:, None] - 1.0 / np.where(near, eigenvalues.imag, 1.0), np.inf)
