"""Closed loops at flight conditions where nothing moves: exact, not enclosed. What samples see, and what refutes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, Floats
from schedules.proof.family import LoopFamily
from schedules.proof.flight_box import Box, Flight

#: Points along each coordinate of a cell that are looked at.
SAMPLES = 5
#: Times that the neighbourhood of the slowest point is halved and looked at again.
ZOOMS = 8


@dataclass(frozen=True)
class SlowestPoint:
    """Where a cell's frozen loop decays slowest, of the points that were looked at.

    Attributes
    ----------
    altitude : [m]
    speed : in the axis's unit
    dynamic_pressure : [Pa]
    eigenvalue : the closed loop's rightmost one there [rad/s]
    factors : what parameters of the plant are multiplied by there; without entries at the model itself
    """

    altitude: float
    speed: float
    dynamic_pressure: float
    eigenvalue: complex
    factors: tuple[tuple[str, float], ...]

    @property
    def rate(self) -> float:
        """Decay rate [1/s]; negative where the loop grows."""
        return -self.eigenvalue.real


def multilinear(corners: FloatArray, across: Floats, along: Floats) -> FloatArray:
    """Gains (*N, g) at fractions of a cell (*N,), from those at its corners (2, 2, g)."""
    u, v = np.broadcast_arrays(np.asarray(across, float), np.asarray(along, float))
    u, v = u[..., None], v[..., None]
    low = (1.0 - v) * corners[0, 0] + v * corners[0, 1]
    high = (1.0 - v) * corners[1, 0] + v * corners[1, 1]
    return np.asarray((1.0 - u) * low + u * high)


def frozen_loops(
    made: LoopFamily, flight: Flight, box: Box, gains: FloatArray, across: FloatArray, along: FloatArray
) -> FloatArray:
    """Loops (W, *N, n, n) of every variant at fractions of a box (*N,), gains (2, 2, g) at its corners."""
    altitude = box.altitude[0] + across * (box.altitude[1] - box.altitude[0])
    speed = box.speed[0] + along * (box.speed[1] - box.speed[0])
    products = made.products(multilinear(gains, across, along))
    return made.closed(flight.terms(altitude, speed, made.terms), products)


def rightmost(loops: FloatArray) -> FloatArray:
    """The eigenvalue (*G,) with the largest real part."""
    values = np.linalg.eigvals(loops).astype(complex)
    pick = np.argmax(values.real, axis=-1)[..., None]
    return np.asarray(np.take_along_axis(values, pick, axis=-1)[..., 0])


def slowest_points(made: LoopFamily, flight: Flight, boxes: list[Box], gains: FloatArray) -> list[SlowestPoint]:
    """The slowest of `SAMPLES` by `SAMPLES` points of each of many boxes, gains (C, 2, 2, g) at their corners."""
    fractions = np.linspace(0.0, 1.0, SAMPLES)
    across, along = np.meshgrid(fractions, fractions, indexing="ij")
    loops = np.stack(
        [frozen_loops(made, flight, box, corner, across, along) for box, corner in zip(boxes, gains, strict=True)]
    )
    values = rightmost(loops)
    return [_of(made, flight, box, at, across, along) for box, at in zip(boxes, values, strict=True)]


def slower_still(made: LoopFamily, flight: Flight, box: Box, gains: FloatArray) -> SlowestPoint:
    """The slowest point of a box, looked for in ever smaller neighbourhoods of the slowest so far."""
    fractions = np.linspace(-1.0, 1.0, SAMPLES)
    u, v, reach = 0.5, 0.5, 0.5
    found: SlowestPoint | None = None
    for _ in range(ZOOMS):
        across, along = np.meshgrid(
            np.clip(u + reach * fractions, 0.0, 1.0), np.clip(v + reach * fractions, 0.0, 1.0), indexing="ij"
        )
        values = rightmost(frozen_loops(made, flight, box, gains, across, along))
        k = np.unravel_index(int(np.argmax(values.real)), values.shape)
        u, v = float(across[k[1:]]), float(along[k[1:]])
        point = _of(made, flight, box, values, across, along)
        if found is None or point.rate < found.rate:
            found = point
        reach *= 0.5
    assert found is not None
    return found


def _of(
    made: LoopFamily, flight: Flight, box: Box, values: FloatArray, across: FloatArray, along: FloatArray
) -> SlowestPoint:
    """The slowest of eigenvalues (W, *N) at fractions of a box."""
    k = np.unravel_index(int(np.argmax(values.real)), values.shape)
    altitude = box.altitude[0] + float(across[k[1:]]) * (box.altitude[1] - box.altitude[0])
    speed = box.speed[0] + float(along[k[1:]]) * (box.speed[1] - box.speed[0])
    factors = zip(made.variants.parameters, made.variants.factors[k[0]].tolist(), strict=True)
    return SlowestPoint(
        altitude, speed, float(flight.condition(altitude, speed).dynamic_pressure), complex(values[k]),
        tuple((name, factor) for name, factor in factors if factor != 1.0),
    )  # fmt: skip
