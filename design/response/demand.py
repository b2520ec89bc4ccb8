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
from design.response.actuator_signals import (
    ACCELERATION,
    DEFLECTION,
    JUMP,
    POWER,
    RATE,
    SQUARED,
    TORQUE,
    Outputs,
    Work,
    linear_rows,
    output_indices,
    square_integrals,
    torque_name,
    with_power,
    works,
)
from design.response.extremes import largest_magnitudes
from design.response.step_response import Response
from model.arrays import BoolArray, FloatArray, GridArrays


@dataclass(frozen=True, eq=False)
class ActuatorDemand(GridArrays):
    """Demand on one actuator over the grid, each (*G,), for the length of the response.

    Attributes
    ----------
    peak_torque, rms_torque : of the total torque [N m]
    holding_torque : magnitude of the torque the loop settles to [N m]; nan where it does not settle. Outside
        the response, so it exceeds the peak when the response is cut short
    peak_rate : [rad/s]
    peak_acceleration, rms_acceleration : of the surface [rad/s^2]; inf where the rate jumps, at t = 0 or at a knot of
        a manoeuvre
    peak_deflection : of the total deflection [rad]
    peak_power, rms_power : [W]
    energy_out : work of the actuator on the surface while its power is positive [J], >= 0
    energy_back : work of the surface on the actuator while its power is negative [J], >= 0

    Where the deflection itself jumps, peak rate, acceleration and power are inf. Where a loop has no torque
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
    rms_acceleration: FloatArray


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
    rows = output_indices(response, actuators)
    with np.errstate(over="ignore", invalid="ignore"):
        mesh = response.graded
        signals = with_power(mesh.signals(linear_rows(response.rows, response.generator, rows)))
        peaks = largest_magnitudes(signals)
        squares = square_integrals(signals[..., SQUARED, :, :], mesh.steps)
        jumps = np.abs(signals[..., :3, 0, 0] - loop.offset[..., rows]) > JUMP * peaks[..., :3]
        tally = Tally(peaks, squares, works(signals[..., POWER, :, :], mesh.steps, peaks[..., POWER]), jumps)
    holding = np.abs(response.final_outputs[..., rows[:, TORQUE]])
    return demands_of(response, actuators, tally, mesh.duration, holding)


@dataclass(frozen=True, eq=False)
class Tally(GridArrays):
    """What is counted of the signals of a actuators over a response (`design.response.actuator_signals`).

    Attributes
    ----------
    peaks : (*G, a, 5) largest magnitudes
    squares : (*G, a, 3) integrals of the squares of torque, acceleration and power
    work : of the powers
    jumps : (*G, a, 3) whether torque, rate and deflection jump somewhere
    """

    peaks: FloatArray
    squares: FloatArray
    work: Work
    jumps: BoolArray


def demands_of(
    response: Outputs, actuators: tuple[str, ...], tally: Tally, duration: float, holding: FloatArray
) -> tuple[ActuatorDemand, ...]:
    """The demands that a tally over a response of this duration [s] stands for, with holding torques (*G, a)."""
    peaks, squares = tally.peaks, tally.squares / duration
    angle_jumps, rate_jumps = tally.jumps[..., DEFLECTION], tally.jumps[..., RATE] | tally.jumps[..., DEFLECTION]
    demands = (
        ActuatorDemand(
            peak_torque=peaks[..., i, TORQUE],
            rms_torque=np.sqrt(squares[..., i, 0]),
            holding_torque=holding[..., i],
            peak_rate=np.where(angle_jumps[..., i], np.inf, peaks[..., i, RATE]),
            peak_acceleration=np.where(rate_jumps[..., i], np.inf, peaks[..., i, ACCELERATION]),
            peak_deflection=peaks[..., i, DEFLECTION],
            peak_power=np.where(angle_jumps[..., i], np.inf, peaks[..., i, POWER]),
            rms_power=np.sqrt(squares[..., i, 2]),
            energy_out=tally.work.out[..., i],
            energy_back=tally.work.back[..., i],
            rms_acceleration=np.where(rate_jumps[..., i], np.inf, np.sqrt(squares[..., i, 1])),
        )
        for i in range(len(actuators))
    )
    has_torque = [torque_name(name) in response.names for name in actuators]
    return tuple(d if finite else _without_torque(d) for d, finite in zip(demands, has_torque, strict=True))


def _without_torque(demand: ActuatorDemand) -> ActuatorDemand:
    """The demand on an actuator whose torque is not finite."""
    unlimited, unknown = (np.full(demand.peak_rate.shape, value) for value in (np.inf, np.nan))
    return replace(
        demand, peak_torque=unlimited, rms_torque=unlimited, peak_power=unlimited, rms_power=unlimited,
        peak_acceleration=unlimited, rms_acceleration=unlimited, holding_torque=unknown, energy_out=unknown,
        energy_back=unknown,
    )  # fmt: skip


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
