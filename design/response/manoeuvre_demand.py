"""What a manoeuvre asks of the actuators, beside limits, and how well the references are followed.

Peaks are those of the continuous response, limits just before and after each knot included (1e-8 of the peak). Times
are between refined crossings. Mean squares and energies are integrals of the polynomials through samples that resolve
the response after every knot (1e-8 of their value).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from design.delay.with_pade import without_delay
from design.loop import Loop
from design.manoeuvre import Manoeuvre
from design.response.actuator_signals import (
    DEFLECTION,
    JUMP,
    POWER,
    RATE,
    SQUARED,
    TORQUE,
    Work,
    linear_rows,
    output_indices,
    square_integrals,
    torque_name,
    with_power,
    works,
)
from design.response.demand import ActuatorDemand, Tally, demands_of
from design.response.knot_peaks import raised
from design.response.limit_times import times_beyond
from design.response.manoeuvre_response import ManoeuvreResponse, knots_flown
from design.response.needed_bandwidth import needed_bandwidths
from model.actuators import ActuatorLimits
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: Order of the signals that have limits.
_LIMITED = (DEFLECTION, RATE, TORQUE, POWER)


@dataclass(frozen=True, eq=False)
class ManoeuvreDemand(ActuatorDemand):
    """Demand of a manoeuvre on one actuator over the grid, each (*G,), for the length of the response.

    All that `ActuatorDemand` says holds, with these words for manoeuvres: jumps count at every knot; the holding torque
    is that after the last knot before the end of the response, nan where the manoeuvre goes on changing from there.

    Attributes
    ----------
    time_at_deflection_limit, time_at_rate_limit, time_at_torque_limit, time_at_power_limit : for which the magnitude is
        the limit or more [s]; nan where there is no limit, and where torque and power are not finite
    needed_bandwidth : of the actuator at small amplitude (`design.response.needed_bandwidth`) [rad/s]
    """

    time_at_deflection_limit: FloatArray
    time_at_rate_limit: FloatArray
    time_at_torque_limit: FloatArray
    time_at_power_limit: FloatArray
    needed_bandwidth: FloatArray


@dataclass(frozen=True, eq=False)
class TrackingErrors(GridArrays):
    """How far surfaces are from where their references want them, each (*G, p) in the order of the references [rad].

    Attributes
    ----------
    peak : largest magnitude of the reference less the change of the angle from trim
    rms : root of the mean square over the response
    """

    peak: FloatArray
    rms: FloatArray


def manoeuvre_demands(
    loop: Loop, response: ManoeuvreResponse, actuators: tuple[str, ...], limits: tuple[ActuatorLimits, ...]
) -> tuple[ManoeuvreDemand, ...]:
    """Demand of a manoeuvre on each of some actuators, all worked out together.

    Parameters
    ----------
    loop : closed loops over the grid
    response : their response (`manoeuvre_response`)
    actuators : names, of ``tab`` and ``aileron``
    limits : of each of them

    Raises
    ------
    ValueError : no such actuator, one whose rate or deflection the loop lacks among its outputs, or not as many limits
    """
    if len(limits) != len(actuators):
        raise ValueError(f"{len(actuators)} actuators need as many sets of limits, not {len(limits)}")
    at = output_indices(response, actuators)
    asked = np.array([[each.deflection, each.rate, each.torque, each.power] for each in limits], dtype=float)
    with np.errstate(over="ignore", invalid="ignore"):
        tally, times = _counted(response, at, asked.reshape(len(actuators), 4))
        tally = _with_jumps(tally, without_delay(loop), response, at)
    holding = np.abs(response.final_outputs[..., at[:, TORQUE]])
    needed = needed_bandwidths(loop, actuators)
    finite = [torque_name(name) in response.names for name in actuators]
    times[..., np.logical_not(finite), 2:] = np.nan
    return tuple(
        ManoeuvreDemand(
            **{field.name: getattr(demand, field.name) for field in fields(ActuatorDemand)},
            time_at_deflection_limit=times[..., i, 0],
            time_at_rate_limit=times[..., i, 1],
            time_at_torque_limit=times[..., i, 2],
            time_at_power_limit=times[..., i, 3],
            needed_bandwidth=needed[..., i],
        )
        for i, demand in enumerate(demands_of(response, actuators, tally, response.duration, holding))
    )


def tracking_errors(loop: Loop, response: ManoeuvreResponse) -> TrackingErrors:
    """How far each surface is from its reference (``da`` follows ``r_a``, ``dt`` follows ``r_t``) in a manoeuvre.

    Raises
    ------
    ValueError : the loop lacks the angle of a reference among its outputs
    """
    at = [response.index("d" + name.removeprefix("r_")) for name in response.reference_names]
    rows = response.reference_rows - response.rows[..., at, :]
    rows[..., -1] += loop.offset[..., at]
    squares = np.zeros(rows.shape[:-1])
    peaks = np.zeros(rows.shape[:-1])
    with np.errstate(over="ignore", invalid="ignore"):
        for part in response.driven.signals(rows):
            peaks = raised(peaks, part.values)
            squares += square_integrals(_in_one_row(part.values), part.steps.reshape(-1))
    return TrackingErrors(peaks, np.sqrt(squares / response.duration))


def _counted(response: ManoeuvreResponse, at: IntArray, limits: FloatArray) -> tuple[Tally, FloatArray]:
    """What is counted of actuators with these outputs (a, 3), and times (*G, a, 4) beyond limits (a, 4)."""
    grid, count = response.rows.shape[:-2], len(at)
    rows = linear_rows(response.rows, response.generator, at)
    peaks, squares = np.zeros((*grid, count, POWER + 1)), np.zeros((*grid, count, len(SQUARED)))
    net, gross, times = (np.zeros((*grid, count, *more)) for more in ((), (), (4,)))
    for part in response.driven.signals(rows):
        steps = part.steps.reshape(-1)
        signals = with_power(_in_one_row(part.values))
        peaks = raised(peaks, signals.reshape(*signals.shape[:-2], *part.values.shape[-3:]))
        squares += square_integrals(signals[..., SQUARED, :, :], steps)
        work = works(signals[..., POWER, :, :], steps, peaks[..., POWER])
        net, gross = net + work.net, gross + work.gross
        if not np.all(np.isnan(limits)):
            times += times_beyond(signals[..., _LIMITED, :, :], limits, steps)
    known = np.isfinite(peaks[..., _LIMITED]) & ~np.isnan(limits)
    no_jumps = np.zeros((*grid, count, 3), dtype=bool)
    return Tally(peaks, squares, Work(net, gross), no_jumps), np.where(known, times, np.nan)


def _in_one_row(values: FloatArray) -> FloatArray:
    """(..., c S, m+1) of signals (..., c, S, m+1)."""
    return values.reshape(*values.shape[:-3], values.shape[-3] * values.shape[-2], values.shape[-1])


def _with_jumps(tally: Tally, loop: Loop, response: ManoeuvreResponse, at: IntArray) -> Tally:
    """The tally with the jumps of outputs at knots, and their impulses, which no sample shows, as what they are."""
    jumps, slopes = _reference_jumps(response.manoeuvre, response.duration)
    of_rates = loop.H @ loop.N
    indices = at.reshape(-1)
    jumped = _largest(loop.reference_feedthrough[..., indices, :], jumps, of_rates[..., indices, :], slopes)
    struck = _largest(of_rates[..., indices, :], jumps, None, slopes) > 0.0
    shape = (*tally.jumps.shape,)
    struck = struck.reshape(shape)
    peaks = tally.peaks.copy()
    peaks[..., :3] = np.where(struck, np.inf, peaks[..., :3])
    both = struck[..., TORQUE] | struck[..., RATE]
    peaks[..., POWER] = np.where(both, np.inf, peaks[..., POWER])
    squares = np.where(np.stack([struck[..., TORQUE], both, both], axis=-1), np.inf, tally.squares)
    work = Work(*(np.where(both, np.nan, each) for each in (tally.work.net, tally.work.gross)))
    beyond: BoolArray = jumped.reshape(shape) > JUMP * tally.peaks[..., :3]
    return Tally(peaks, squares, work, beyond)


def _reference_jumps(manoeuvre: Manoeuvre, duration: float) -> tuple[FloatArray, FloatArray]:
    """(k, p) by how much references [rad] and their rates [rad/s] jump at the knots before the end."""
    slopes = np.diff(manoeuvre.slopes, axis=0, prepend=0.0)
    slopes[0] += manoeuvre.amplitude * manoeuvre.omega
    k = knots_flown(manoeuvre, duration)
    return manoeuvre.jumps[:k], slopes[:k]


def _largest(by_jump: FloatArray, jumps: FloatArray, by_slope: FloatArray | None, slopes: FloatArray) -> FloatArray:
    """(*G, q) largest ``|by_jump jump + by_slope slope|`` over the knots, by_ each (*G, q, p)."""
    largest = np.zeros(by_jump.shape[:-1])
    for low in range(0, len(jumps), 256):
        part = by_jump @ jumps[low : low + 256].T
        if by_slope is not None:
            part = part + by_slope @ slopes[low : low + 256].T
        largest = np.maximum(largest, np.max(np.abs(part), axis=-1))
    return largest
