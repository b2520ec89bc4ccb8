"""What a response asks of the actuators: torque, rate, deflection, power and energy, with the worst over the grid.

Torque is the total that the motor holds against, trim included. Power is torque times the rate of the surface
it moves: positive when the motor drives the surface, negative when the air drives the motor.

Peaks are those of the continuous response, refined between the samples (1e-8 of the peak). Mean squares and
energies are integrals of the polynomials through the samples of the graded mesh (1e-8 of their value).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from design.loop import Loop
from design.response.extremes import NOISE, largest_magnitudes
from design.response.graded import GradedStates
from design.response.interpolant import crossings, interval_integrals, sign_changes, windows
from design.response.step_response import Response
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

_LETTERS: dict[str, str] = {"tab": "t", "aileron": "a"}
#: A jump at t = 0 is one when it exceeds this part of the signal's peak.
_JUMP = 1e-12
#: Order of an actuator's signals.
_TORQUE, _RATE, _DEFLECTION, _ACCELERATION, _POWER = range(5)


@dataclass(frozen=True, eq=False)
class ActuatorDemand(GridArrays):
    """Demand on one actuator over the grid, each (*G,), for the length of the response.

    Attributes
    ----------
    peak_torque, rms_torque : of the total torque [N m]
    holding_torque : magnitude of the torque the loop settles to [N m]; nan where it does not settle. Outside
        the response, so it exceeds the peak when the response is cut short
    peak_rate : [rad/s]
    peak_acceleration : [rad/s^2]; inf where the rate jumps at t = 0
    peak_deflection : of the total deflection [rad]
    peak_power, rms_power : [W]
    energy_out : work of the actuator on the surface while its power is positive [J], >= 0
    energy_back : work of the surface on the actuator while its power is negative [J], >= 0

    Where the deflection itself jumps at t = 0, peak rate, acceleration and power are inf. Where a loop has no torque
    among its outputs because it is not finite (an ideal deflection), torque and power are inf, and the energies and
    the holding torque nan. A loop that leaves the range of doubles has inf or nan.
    """

    peak_torque: FloatArray
    rms_torque: FloatArray
    holding_torque: FloatArray
    peak_rate: FloatArray
    peak_acceleration: FloatArray
    peak_deflection: FloatArray
    peak_power: FloatArray
    rms_power: FloatArray
    energy_out: FloatArray
    energy_back: FloatArray


@dataclass(frozen=True, eq=False)
class _Work(GridArrays):
    """Net work and the integral of the magnitude of the power, each (*G, a) [J]."""

    net: FloatArray
    gross: FloatArray


def actuator_demand(loop: Loop, response: Response, actuator: str) -> ActuatorDemand:
    """Demand of a response on one actuator, ``tab`` or ``aileron``; see `actuator_demands`."""
    return actuator_demands(loop, response, (actuator,))[0]


def actuator_demands(loop: Loop, response: Response, actuators: tuple[str, ...]) -> tuple[ActuatorDemand, ...]:
    """Demand of a response on each of some actuators, all worked out together.

    Parameters
    ----------
    loop : closed loops over the grid
    response : their response (``design.response.step_response.step_response``)
    actuators : names, of ``tab`` and ``aileron``

    Raises
    ------
    ValueError : no such actuator, or the loop lacks its rate or deflection among the outputs
    """
    rows = _output_indices(response, actuators)
    with np.errstate(over="ignore", invalid="ignore"):
        signals = _signals(response, rows)
        peaks = largest_magnitudes(signals)
        squares = _mean_squares(response.graded, signals)
        work = _work(response.graded, signals[..., _POWER, :, :], peaks[..., _POWER])
        jumps = np.abs(signals[..., :3, 0, 0] - loop.offset[..., rows]) > _JUMP * peaks[..., :3]
    angle_jumps, rate_jumps = jumps[..., _DEFLECTION], jumps[..., _RATE] | jumps[..., _DEFLECTION]
    holding = np.abs(response.final_outputs[..., rows[:, _TORQUE]])
    demands = (
        ActuatorDemand(
            peak_torque=peaks[..., i, _TORQUE],
            rms_torque=np.sqrt(squares[..., i, 0]),
            holding_torque=holding[..., i],
            peak_rate=np.where(angle_jumps[..., i], np.inf, peaks[..., i, _RATE]),
            peak_acceleration=np.where(rate_jumps[..., i], np.inf, peaks[..., i, _ACCELERATION]),
            peak_deflection=peaks[..., i, _DEFLECTION],
            peak_power=np.where(angle_jumps[..., i], np.inf, peaks[..., i, _POWER]),
            rms_power=np.sqrt(squares[..., i, 1]),
            energy_out=np.maximum(0.5 * (work.gross + work.net)[..., i], 0.0),
            energy_back=np.maximum(0.5 * (work.gross - work.net)[..., i], 0.0),
        )
        for i in range(len(actuators))
    )
    has_torque = [_torque_name(name) in response.names for name in actuators]
    return tuple(d if finite else _without_torque(d) for d, finite in zip(demands, has_torque, strict=True))


def _without_torque(demand: ActuatorDemand) -> ActuatorDemand:
    """The demand on an actuator whose torque is not finite."""
    unlimited, unknown = (np.full(demand.peak_rate.shape, value) for value in (np.inf, np.nan))
    return replace(
        demand, peak_torque=unlimited, rms_torque=unlimited, peak_power=unlimited, rms_power=unlimited,
        peak_acceleration=unlimited, holding_torque=unknown, energy_out=unknown, energy_back=unknown,
    )  # fmt: skip


def _output_indices(response: Response, actuators: tuple[str, ...]) -> IntArray:
    """(a, 3) indices of each actuator's torque, rate and deflection among the outputs.

    The rate stands in for a torque that is not there.
    """
    unknown = [name for name in actuators if name not in _LETTERS]
    if unknown:
        raise ValueError(f"no actuator {unknown[0]!r}; there are {', '.join(_LETTERS)}")
    indices = []
    for actuator in actuators:
        angle, torque = f"d{_LETTERS[actuator]}", _torque_name(actuator)
        rate = response.index(f"{angle}_rate")
        indices.append([response.index(torque) if torque in response.names else rate, rate, response.index(angle)])
    return np.array(indices, dtype=np.int64)


def _torque_name(actuator: str) -> str:
    return f"T_{_LETTERS[actuator]}"


def _signals(response: Response, indices: IntArray) -> FloatArray:
    """(*G, a, 5, S, m+1) torque, rate, deflection, acceleration and power on the graded mesh."""
    *grid, _, size = response.rows.shape
    mesh, count = response.graded, len(indices)
    rows = np.empty((*grid, count, _POWER, size))
    rows[..., : _DEFLECTION + 1, :] = response.rows[..., indices, :]
    rows[..., _ACCELERATION, :] = rows[..., _RATE, :] @ response.generator
    signals = np.empty((*grid, count, _POWER + 1, mesh.blocks, mesh.intervals + 1))
    linear = mesh.signals(rows.reshape(*grid, count * _POWER, size))
    signals[..., :_POWER, :, :] = linear.reshape(*grid, count, _POWER, mesh.blocks, mesh.intervals + 1)
    np.multiply(signals[..., _TORQUE, :, :], signals[..., _RATE, :, :], out=signals[..., _POWER, :, :])
    return signals


def _mean_squares(mesh: GradedStates, signals: FloatArray) -> FloatArray:
    """(*G, a, 2) means over the response of the squares of torque and power."""
    weights = mesh.steps[:, None] * interval_integrals(mesh.intervals).sum(axis=-1)
    chosen = signals[..., _TORQUE :: _POWER - _TORQUE, :, :]
    return np.asarray(np.einsum("...sk,...sk,sk->...", chosen, chosen, weights) / mesh.duration)


def _work(mesh: GradedStates, power: FloatArray, peak: FloatArray) -> _Work:
    """Work of powers (*G, a, S, m+1): interval by interval, those where it changes sign in two parts."""
    blocks, samples = power.shape[-2:]
    parts = power @ interval_integrals(mesh.intervals)
    sizes = np.abs(parts)
    rows = power.reshape(-1, samples)
    row, before = np.nonzero(sign_changes(rows, NOISE * np.repeat(peak.reshape(-1), blocks)))
    low = before.astype(float)
    middle = crossings(rows, row, before, np.zeros(len(row)))
    curve = windows(rows, row, low + 0.5)
    halves = np.abs(curve.integral(low, middle)) + np.abs(curve.integral(middle, low + 1.0))
    sizes.reshape(-1, samples - 1)[row, before] = halves
    return _Work(np.asarray(parts.sum(axis=-1) @ mesh.steps), np.asarray(sizes.sum(axis=-1) @ mesh.steps))


@dataclass(frozen=True)
class Requirement:
    """The largest demand of one kind over the grid: its value in SI and the flat index of its point.

    Both None when no point has that value.
    """

    quantity: str
    value: float | None
    point: int | None


@dataclass(frozen=True)
class EnvelopeDemand:
    """What one actuator must be able to do over the whole grid, one requirement for each quantity."""

    actuator: str
    requirements: tuple[Requirement, ...]

    def requirement(self, quantity: str) -> Requirement:
        """The requirement of a quantity of `ActuatorDemand`; KeyError when there is none."""
        for requirement in self.requirements:
            if requirement.quantity == quantity:
                return requirement
        raise KeyError(quantity)


def envelope_demand(actuator: str, demand: ActuatorDemand, ok: BoolArray) -> EnvelopeDemand:
    """Largest of each demand over the points that carry a design, and the point that sets it.

    Parameters
    ----------
    actuator : its name
    demand : over the grid, or over the points of `ok` alone, in row-major order
    ok : (*G,) mask of the points that carry a design

    Returns
    -------
    EnvelopeDemand; points are flat row-major indices into the grid. A value of nan sets no requirement.
    """
    points = np.flatnonzero(ok)
    on_grid = demand.peak_torque.shape == np.shape(ok)
    found = []
    for field in fields(demand):
        values = getattr(demand, field.name)
        values = values[ok] if on_grid else values.reshape(-1)
        if np.all(np.isnan(values)):
            found.append(Requirement(field.name, None, None))
            continue
        worst = int(np.nanargmax(values))
        found.append(Requirement(field.name, float(values[worst]), int(points[worst])))
    return EnvelopeDemand(actuator, tuple(found))
