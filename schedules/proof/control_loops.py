"""Finitely many closed loops between which all those of a box lie: the corners, or control points, of the box.

A loop that is a polynomial of each coordinate is a weighted mean of its Bernstein coefficients, with weights that are
positive and add to one. Gains are linear in altitude and in speed, so in most cases these are the eight corners of
(h, s, D): only products of two gains, or a term of the plant with s^2, have a middle coefficient besides.
"""

from __future__ import annotations

import numpy as np

from model.arrays import FloatArray
from schedules.proof.family import LoopFamily
from schedules.proof.flight_box import EXPONENTS, Box, Flight, power_controls


def control_loops(
    made: LoopFamily, flight: Flight, box: Box, gains: FloatArray, reading: tuple[float, float] = (1.0, 1.0)
) -> FloatArray:
    """Closed loops (K, n, n) whose convex hull holds every loop of a box, of every variant of the plant.

    Parameters
    ----------
    made : the loops taken apart
    flight : altitude and speed to terms
    box : the part of the envelope
    gains : (2, 2, g) at the box's corners, altitude then speed
    reading : interval of true speed by the speed that the gains are read at
    """
    return _sums(_weights(made, flight, box, gains, reading), _parts(made))


def control_tensor(made: LoopFamily, flight: Flight, box: Box, gains: FloatArray) -> FloatArray:
    """The same loops by their place (a + 1, b + 1, E, n, n): coefficients of degree a in altitude, b in speed.

    Over the third axis vary the ends of the factors and the variants of the plant; an axis of no width has degree 0.
    """
    weights, parts = _weights_by_place(made, flight, box, gains, (1.0, 1.0)), _parts(made)
    loops = np.einsum("abep,wpij->abewij", weights, parts)
    return np.asarray(loops.reshape(*loops.shape[:2], -1, *loops.shape[-2:]))


def control_sizes(
    made: LoopFamily, flight: Flight, box: Box, gains: FloatArray, reading: tuple[float, float] = (1.0, 1.0)
) -> FloatArray:
    """Sums (K, n, n) of the absolute values of the parts that `control_loops` adds up: what rounding is measured by."""
    return _sums(np.abs(_weights(made, flight, box, gains, reading)), np.abs(_parts(made)))


def _weights(made: LoopFamily, flight: Flight, box: Box, gains: FloatArray, reading: tuple[float, float]) -> FloatArray:
    """Control values (K, J + M) of the terms and of the gains' products."""
    weights = _weights_by_place(made, flight, box, gains, reading)
    return np.asarray(weights.reshape(-1, weights.shape[-1]))


def _weights_by_place(
    made: LoopFamily, flight: Flight, box: Box, gains: FloatArray, reading: tuple[float, float]
) -> FloatArray:
    """The same (a + 1, b + 1, E, J + M), by degree in altitude, degree in speed and ends of the factors."""
    across = made.gain_degree
    along = max(across, int(max(EXPONENTS[flight.speed_axis][name] for name in made.terms)))
    products = _product_controls(made, gains, across, along)  # (across + 1, along + 1, M)
    terms = _term_controls(made, flight, box, along, reading)  # (along + 1, E, J)
    if box.altitude[0] == box.altitude[1]:
        products = products[:1]
    if box.speed[0] == box.speed[1]:
        products, terms = products[:, :1], terms[:1]
    shape = (*products.shape[:2], terms.shape[1])
    return np.concatenate(
        [
            np.broadcast_to(terms[None], (*shape, terms.shape[-1])),
            np.broadcast_to(products[:, :, None], (*shape, products.shape[-1])),
        ],
        axis=-1,
    )


def _parts(made: LoopFamily) -> FloatArray:
    """Matrices (W, J + M, n, n) of the variants that stand for all."""
    corners = made.variants.corners
    return np.concatenate([made.plants[corners], made.injections[corners]], axis=1)


def _sums(weights: FloatArray, parts: FloatArray) -> FloatArray:
    n = parts.shape[-1]
    return np.asarray((weights @ parts.reshape(*parts.shape[:2], n * n)).reshape(-1, n, n))


def _product_controls(made: LoopFamily, gains: FloatArray, across: int, along: int) -> FloatArray:
    columns = []
    for monomial in made.monomials:
        if len(monomial) == 1:
            grid = gains[..., monomial[0]]
        else:
            first, second = (gains[..., i] for i in monomial)
            # Bernstein coefficients of a product of two multilinear functions, one axis after the other.
            grid = np.zeros((3, 3))
            for i in range(2):
                for j in range(2):
                    for k in range(2):
                        for m in range(2):
                            weight = (0.5 if i != k else 1.0) * (0.5 if j != m else 1.0)
                            grid[i + k, j + m] += weight * first[i, j] * second[k, m]
        columns.append(_raised(_raised(grid, across).T, along).T)
    return np.stack(columns, axis=-1) if columns else np.zeros((across + 1, along + 1, 0))


def _term_controls(made: LoopFamily, flight: Flight, box: Box, along: int, reading: tuple[float, float]) -> FloatArray:
    """Values (along + 1, E, J) of the terms: Bernstein coefficients along s, and all ends of the factors."""
    factors = flight.factors(box, made.terms, reading)
    pinned = {}
    for name in made.terms:
        below, above = power_controls(EXPONENTS[flight.speed_axis][name], *box.speed)
        pinned[name] = [_raised(np.array(values), along) for values in (below, above)]
    ends = [(0,) if f.low == f.high and _same(f.terms, pinned) else (0, 1) for f in factors]
    found = []
    for choice in np.ndindex(*(len(sides) for sides in ends)):
        values = []
        for name in made.terms:
            mine = [(f, k) for f, k in zip(factors, choice, strict=True) if name in f.terms]
            # The first factor of a term is its own: chord with its lower end, tangent with its upper.
            side = mine[0][1] if mine else 0
            values.append(pinned[name][side] * np.prod([(f.low, f.high)[k] for f, k in mine]))
        found.append(np.stack(values, axis=-1))
    return np.stack(found, axis=1)


def _same(names: tuple[str, ...], pinned: dict[str, list[FloatArray]]) -> bool:
    return all(np.array_equal(pinned[name][0], pinned[name][1]) for name in names if name in pinned)


def _raised(coefficients: FloatArray, degree: int) -> FloatArray:
    """Bernstein coefficients along the first axis, of a polynomial written as one of a higher degree."""
    while len(coefficients) <= degree:
        n = len(coefficients)
        part = (np.arange(n + 1) / n).reshape(-1, *(1,) * (coefficients.ndim - 1))
        lower = np.concatenate([coefficients[:1], coefficients])
        upper = np.concatenate([coefficients, coefficients[-1:]])
        coefficients = part * lower + (1.0 - part) * upper
    return coefficients
