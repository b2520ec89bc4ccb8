"""Modes of linear models: eigenvalues in continuous branches, and how the surfaces take part in each (seed 2.4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import ComplexArray, FloatArray, GridArrays
from model.branches import branch_places

#: Eigenvectors whose matrix is closer to singular than this do not span the states.
_DEFECTIVE = 1e-12


@dataclass(frozen=True, eq=False)
class Modes(GridArrays):
    """Modes of state matrices (*G, n, n); mode j of every field is the same.

    Attributes
    ----------
    eigenvalues : (*G, n) [rad/s]
    output : (*G, p, n) ``|C V|`` of seed 2.4.8, eigenvectors of unit length: what each output shows of each mode
    participation : (*G, n, n) share of each state (row) in each mode (column), ``|W V'|`` with the left
        eigenvectors, columns summing to one; it does not depend on units. nan where two modes share an eigenvector
    """

    eigenvalues: ComplexArray
    output: FloatArray
    participation: FloatArray

    @property
    def natural_frequency(self) -> FloatArray:
        """``|lambda|`` (*G, n) [rad/s]."""
        return np.abs(self.eigenvalues)

    @property
    def damping_ratio(self) -> FloatArray:
        """``-Re(lambda)/|lambda|`` (*G, n) [-]; nan for an eigenvalue of zero."""
        size = self.natural_frequency
        return np.asarray(-self.eigenvalues.real / np.where(size > 0.0, size, np.nan))


def modes(A: FloatArray, C: FloatArray) -> Modes:
    """Modes of finite state matrices A (*G, n, n) seen through C (*G, p, n), by real, then imaginary part."""
    values, vectors = np.linalg.eig(A)
    order = np.lexsort((values.imag, values.real), axis=-1)
    values = np.take_along_axis(values.astype(complex), order, axis=-1)
    V = np.take_along_axis(vectors.astype(complex), order[..., None, :], axis=-1)
    complete = np.linalg.svd(V, compute_uv=False)[..., -1:, None] > _DEFECTIVE
    W = np.linalg.inv(np.where(complete, V, np.eye(V.shape[-1])))
    factors = np.where(complete, np.abs(V * np.swapaxes(W, -1, -2)), 1.0)
    shares = factors / np.sum(factors, axis=-2, keepdims=True)
    return Modes(values, np.abs(C @ V), np.where(complete, shares, np.nan))


def tracked_modes(A: FloatArray, C: FloatArray) -> Modes:
    """Modes along the last grid axis (*G, m) of A (*G, m, n, n): mode j of one place continues that of the one before.

    Eigenvalues of neighbours are matched so that the sum of their squared distances is least: a pattern that only
    grows or shrinks is followed exactly, whatever the step. The first place's go by real, then imaginary part.
    """
    found = modes(A, C)
    values = found.eigenvalues
    m, n = values.shape[-2:]
    lists = values.reshape(-1, m, n)
    places = branch_places(lists).reshape(values.shape)
    return Modes(
        np.take_along_axis(values, places, axis=-1),
        np.take_along_axis(found.output, places[..., None, :], axis=-1),
        np.take_along_axis(found.participation, places[..., None, :], axis=-1),
    )
