"""How fast the flight point may move: the largest rates of altitude and speed for which an envelope is proved.

A cell by cell proof allows any motion inside each piece, but says nothing of motion from one to the other; one matrix
for the whole envelope allows any motion at all, and is often not to be had. Between the two stands a Lyapunov matrix
that moves with the flight point (`moving_matrix`): continuous over the whole envelope, for rates up to a bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import FloatArray, IntArray
from schedules.proof.cells import Cell, cells, corners_of_part
from schedules.proof.control_loops import control_tensor
from schedules.proof.decay import SAFETY
from schedules.proof.flight_box import Box
from schedules.proof.moving_matrix import MovingCell, best_moving, forms
from schedules.proof.result import ScheduleProof
from schedules.proof.search import modal

#: Programmes solved on one grid of nodes at most.
MOST_ROUNDS = 6
#: A round that raises the rate by less than this part is the last.
WORTHWHILE = 0.05
#: Times that intervals of speed are halved for more nodes, while nothing is proved.
MOST_HALVINGS = 2


@dataclass(frozen=True, eq=False)
class SchedulingRates:
    """Rates that the whole envelope is proved for, both at once and either way.

    Attributes
    ----------
    altitude_rate : largest |h'| [m/s]
    speed_rate : largest |s'| [unit of the speed axis per s]; infinite where one matrix proves the whole envelope, 0
        where nothing is proved
    alpha : decay rate that was asked for [1/s]
    altitude, speed : (nh,), (ns,) nodes of the Lyapunov matrix; empty where nothing is proved
    P : (nh, ns, n, n) the Lyapunov matrix there
    """

    altitude_rate: float
    speed_rate: float
    alpha: float
    altitude: FloatArray
    speed: FloatArray
    P: FloatArray


def scheduling_rates(proof: ScheduleProof, altitude_rate: float, decay: float = 0.0) -> SchedulingRates:
    """The largest rate of the speed coordinate that an envelope is proved for, climbing and sinking at a given rate.

    Parameters
    ----------
    proof : of a schedule that was taken apart
    altitude_rate : largest |h'| [m/s]
    decay : rate at which the loop must decay meanwhile [1/s]; 0 is stability

    Raises
    ------
    ValueError : a rate below zero, the loops cannot be taken apart, or a grid point has no gains
    """
    made = proof.family
    if made is None:
        raise ValueError(f"controller {proof.controller}: {proof.reason}")
    if not (0.0 <= altitude_rate < np.inf and 0.0 <= decay < np.inf):
        raise ValueError(f"rates must be at least 0 and finite, are {altitude_rate} m/s and {decay} 1/s")
    if not np.all(np.isfinite(made.tables)):
        raise ValueError(f"controller {proof.controller}: a grid point has no gains")
    if proof.common is not None and all(cell.wanted >= decay for cell in proof.cells):
        nodes = [np.asarray(axis.values) for axis in proof.axes]
        P = np.broadcast_to(proof.common, (len(nodes[0]), len(nodes[1]), *proof.common.shape))
        return SchedulingRates(altitude_rate, float("inf"), decay, nodes[0], nodes[1], P)
    for halvings in range(MOST_HALVINGS + 1):
        found = _on_nodes(proof, altitude_rate, decay, 2**halvings)
        if found is not None:
            return found
    none = np.zeros(0)
    return SchedulingRates(altitude_rate, 0.0, decay, none, none, np.zeros((0, 0, made.order, made.order)))


def _on_nodes(proof: ScheduleProof, altitude_rate: float, decay: float, parts: int) -> SchedulingRates | None:
    altitude, speed = np.asarray(proof.axes[0].values), _finer(np.asarray(proof.axes[1].values), parts)
    moving = _moving_cells(proof, altitude, speed)
    count, n = len(altitude) * len(speed), moving[0].loops.shape[-1]
    P = np.zeros((count, n, n))
    for cell in moving:
        # A corner of a cell is the first coefficient along an axis, or the last.
        for (a, b), node in np.ndenumerate(cell.nodes):
            P[node] = modal(np.mean(cell.loops[-a, -b], axis=0))
    rate = -np.inf
    for _ in range(MOST_ROUNDS):
        asked = max(rate, 0.0)
        blocks = [(cell.nodes, cell.coefficients(altitude_rate, asked, decay)) for cell in moving]
        tried = best_moving(blocks, np.asarray(np.linalg.cholesky(P)))
        if tried is None or not _positive(tried):
            break
        reached = _largest_rate(moving, tried, altitude_rate, decay)
        gained = reached > max(rate, 0.0) * (1.0 + WORTHWHILE)
        if rate >= 0.0 and reached <= rate:
            break
        P, rate = tried, reached
        if rate > 0.0 and not gained:
            break
    if not rate > 0.0:
        return None
    return SchedulingRates(altitude_rate, rate, decay, altitude, speed, P.reshape(len(altitude), len(speed), n, n))


def _positive(P: FloatArray) -> bool:
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        return False
    return True


def _finer(values: FloatArray, parts: int) -> FloatArray:
    """Breakpoints with each interval in equal parts."""
    if values.size == 1 or parts == 1:
        return values
    steps = np.arange(parts) / parts
    between = values[:-1, None] + steps * np.diff(values)[:, None]
    return np.append(between.ravel(), values[-1])


def _moving_cells(proof: ScheduleProof, altitude: FloatArray, speed: FloatArray) -> list[MovingCell]:
    made = proof.family
    assert made is not None
    found = []
    numbers: IntArray = np.arange(len(altitude) * len(speed)).reshape(len(altitude), len(speed))
    for cell in cells(proof.axes):
        inside = np.flatnonzero((speed >= cell.box.speed[0]) & (speed <= cell.box.speed[1]))
        rows = np.unique(cell.across)
        for k in range(max(len(inside) - 1, 1)):
            columns = inside[k : k + 2]
            box = Box(cell.box.altitude, (float(speed[columns[0]]), float(speed[columns[-1]])))
            found.append(_moving_cell(proof, cell, box, numbers[rows][:, columns]))
    return found


def _moving_cell(proof: ScheduleProof, cell: Cell, box: Box, nodes: IntArray) -> MovingCell:
    made = proof.family
    assert made is not None
    gains = corners_of_part(cell.box, cell.corners(made.tables), box)
    return MovingCell(np.asarray(nodes), box, control_tensor(made, proof.flight, box, gains))


def _largest_rate(moving: list[MovingCell], P: FloatArray, altitude_rate: float, decay: float) -> float:
    """Largest rate of the speed for which given matrices prove every cell; below 0 where they do not even at rest."""
    if not _holds(moving, P, altitude_rate, 0.0, decay):
        return -1.0
    low, high = 0.0, 1.0
    while _holds(moving, P, altitude_rate, high, decay):
        low, high = high, 4.0 * high
        if high > 1e12:
            return low
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _holds(moving, P, altitude_rate, middle, decay) else (low, middle)
    return low


def _holds(moving: list[MovingCell], P: FloatArray, altitude_rate: float, speed_rate: float, decay: float) -> bool:
    for cell in moving:
        F, corners = cell.coefficients(altitude_rate, speed_rate, decay), P[cell.nodes]
        turn = np.linalg.inv(np.linalg.cholesky(np.mean(corners, axis=(0, 1))))
        turned = turn @ forms(F, corners) @ turn.T
        size = np.abs(turn) @ forms(np.abs(F), np.abs(corners)) @ np.abs(turn).T
        units = 16.0 * SAFETY * turned.shape[-1] * F.shape[1] * F.shape[2] * float(np.finfo(float).eps)
        margin = units * np.sqrt(np.sum(size**2, axis=(-2, -1)))
        if not np.all(np.linalg.eigvalsh(0.5 * (turned + np.swapaxes(turned, -1, -2)))[:, -1] < -margin):
            return False
    return True
