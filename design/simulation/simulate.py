"""Non-linear simulation of closed loops over the whole grid: points of equal steps together, in bounded memory."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from design.delay.characteristic import SHORTEST
from design.loop import Loop
from design.manoeuvre import Manoeuvre
from design.simulation.anti_windup import anti_windup_gain
from design.simulation.demand import at_limits, demands, limit_signals, time_at_limits
from design.simulation.dynamics import Dynamics, Flown
from design.simulation.energy import EnergyBalance, energy_balance
from design.simulation.freeplay import with_link
from design.simulation.plant import NonlinearPlant
from design.simulation.request import SimulationRequest
from design.simulation.response import NonlinearResponse, SimulationOutcome
from design.simulation.signals import Signals, signals
from design.simulation.tab_servo import TabDynamics
from design.simulation.time_grid import LARGEST_COUNT, Segment, needed_substeps, segments
from design.simulation.trajectory import Trajectory, dynamics_of, trajectory
from model.arrays import BoolArray, FloatArray, GridArrays, IntArray

#: Numbers that the nodes of a chunk of points may take: 256 MiB. More is hardly faster, a quarter of it half as fast.
_NUMBERS = 1 << 25
#: Numbers of a node beside states, rates, inputs and outputs.
_BESIDES = 60


def simulate(plant: NonlinearPlant, loop: Loop, manoeuvre: Manoeuvre, request: SimulationRequest) -> NonlinearResponse:
    """Simulate the loop that is flown with the non-linear plant, from trim.

    Parameters
    ----------
    plant : what the loop's model was linearised from (*G)
    loop : closed loops over the same grid; points with numbers that are not finite are left out
    manoeuvre : references, from trim
    request : duration, steps, limits, friction, freeplay

    Returns
    -------
    NonlinearResponse; a point that fails is nan, with an outcome that says why, and does not touch the others

    Raises
    ------
    ValueError : references that are not those of the loop, a grid that is not the plant's, an ideal tab deflection,
        freeplay of a loop that commands torques, or a limit or friction that the drive has no place for
    """
    grid = loop.A.shape[:-2]
    if plant.alpha.shape != grid:
        raise ValueError(f"the plant is over a grid of {plant.alpha.shape}, the loop of {grid}")
    if manoeuvre.values.shape[-1] != len(loop.references):
        raise ValueError(f"the manoeuvre must have the references {', '.join(loop.references) or 'of none'}")
    if "dt" not in loop.states:
        raise ValueError("a tab whose deflection is ideal moves at any rate: give the servo a bandwidth to simulate it")
    finite = _finite(loop) & _finite(plant)
    if request.freeplay is not None and loop.inputs == ("tab",):
        loop = with_link(loop, plant.model, request.freeplay)
    cut = segments(manoeuvre, loop.delay, request.duration, request.samples)
    longest = max((s.end - s.begin) / s.intervals for s in cut)
    flown = Flown(plant.take(finite), loop.take(finite), np.zeros(0), request)
    needed = _substeps(flown.loop, request, longest)
    intervals = sum(s.intervals for s in cut)
    slow = needed * intervals <= LARGEST_COUNT
    simulated = np.array(finite)
    simulated[finite] = slow
    part = Flown(
        plant.take(simulated),
        loop.take(simulated),
        anti_windup_gain(loop.take(simulated), request.anti_windup),
        request,
    )
    found = _of_points(part, manoeuvre, cut, needed[slow])
    return _over_grid(found, simulated, finite)


def simulation_steps(loop: Loop, manoeuvre: Manoeuvre, request: SimulationRequest) -> IntArray:
    """Steps that a simulation of finite loops takes (*G,), freeplay left out: what its time grows with."""
    cut = segments(manoeuvre, loop.delay, request.duration, request.samples)
    longest = max((s.end - s.begin) / s.intervals for s in cut)
    return np.asarray(_substeps(loop, request, longest) * sum(s.intervals for s in cut))


def _substeps(loop: Loop, request: SimulationRequest, longest: float) -> IntArray:
    """Steps between two samples (P,)."""
    if request.substeps is not None:
        shortest = min((d for d in loop.delay if d > SHORTEST), default=np.inf)
        return np.full(loop.A.shape[0], max(request.substeps, int(np.ceil(min(longest / shortest, 2.0**40)))))
    return needed_substeps(loop.closed, loop.A, request.tolerance, longest, loop.delay)


def _finite(result: Loop | NonlinearPlant) -> BoolArray:
    """(*G,) where every number is finite."""
    arrays = [getattr(result, f.name) for f in fields(result)]
    grid = (result.A if isinstance(result, Loop) else result.model.A).shape[:-2]
    found = np.ones(grid, dtype=bool)
    for array in arrays:
        if isinstance(array, np.ndarray):
            found = found & np.isfinite(array).reshape(*grid, -1).all(axis=-1)
    return np.asarray(found)


def _of_points(flown: Flown, manoeuvre: Manoeuvre, cut: tuple[Segment, ...], substeps: IntArray) -> NonlinearResponse:
    """The responses of P points, those of equal steps together and no more than fit into memory."""
    loop, intervals = flown.loop, sum(s.intervals for s in cut)
    numbers = 2 * len(loop.states) + len(loop.inputs) + len(loop.outputs) + _BESIDES
    parts, order = [], []
    for count in np.unique(substeps):
        index = np.flatnonzero(substeps == count)
        room = max(1, int(_NUMBERS / (numbers * intervals * int(count))))
        for begin in range(0, len(index), room):
            chunk = index[begin : begin + room]
            parts.append(_simulated(flown.take(chunk), manoeuvre, cut, int(count)))
            order.append(chunk)
    if not parts:
        nothing = np.zeros(0, dtype=np.int64)
        return _simulated(flown.take(nothing), manoeuvre, cut, 1)
    if len(parts) == 1:
        return parts[0]
    back = np.argsort(np.concatenate(order))
    joined: NonlinearResponse = _joined(parts, back)
    return joined


def _simulated(flown: Flown, manoeuvre: Manoeuvre, cut: tuple[Segment, ...], substeps: int) -> NonlinearResponse:
    """Points with the same steps; with half of them too where an estimate of the error is asked for."""
    dynamics = dynamics_of(flown)
    found = trajectory(dynamics, manoeuvre, cut, substeps)
    made = _response(dynamics, manoeuvre, found, substeps)
    if not flown.request.estimate_error:
        return made
    finer = trajectory(dynamics, manoeuvre, cut, 2 * substeps)
    better = _response(dynamics, manoeuvre, finer, 2 * substeps)
    return replace(better, error_estimate=np.abs(better.outputs - made.outputs).max(axis=-2, initial=0.0))


def _response(dynamics: Dynamics, manoeuvre: Manoeuvre, found: Trajectory, substeps: int) -> NonlinearResponse:
    points, flown = dynamics.points, dynamics.flown
    with np.errstate(over="ignore", invalid="ignore"):
        seen = signals(dynamics, found)
        reached = at_limits(dynamics, limit_signals(seen))
        asked, balance = demands(dynamics, found, seen), energy_balance(dynamics, found, seen)
    time = found.time[found.sampled]
    end = np.where(np.isnan(found.diverged_at), np.inf, found.diverged_at)
    over = np.asarray(time[None] >= end[:, None])
    gone = np.asarray(over.any(axis=-1))
    codes, reasons = np.empty(points, dtype=object), np.full(points, None, dtype=object)
    codes.fill(SimulationOutcome.COMPLETED)
    for i in np.flatnonzero(~np.isnan(found.diverged_at)):
        codes[i] = SimulationOutcome.DIVERGED
        reasons[i] = f"a surface passes a right angle within {found.diverged_at[i]:.4g} s"
    reference = manoeuvre.at(time)
    return NonlinearResponse(
        time=np.broadcast_to(time, (points, len(time))),
        states=_blanked(_samples(found, found.states), over),
        outputs=_blanked(_samples(found, seen.outputs), over),
        reference=np.broadcast_to(reference, (points, *reference.shape)),
        at_limit=np.moveaxis(reached[found.sampled], -1, 0) & ~over[..., None, None],
        time_at_limit=np.where(gone[:, None, None], np.nan, time_at_limits(found, reached)),
        held=_samples(found, found.mode),
        codes=codes,
        reasons=reasons,
        diverged_at=found.diverged_at,
        left_data_at=_left_data(dynamics, found, seen),
        demand=asked,
        energy=_until(balance, over),
        anti_windup_gain=flown.anti_windup,
        substeps=np.full(points, substeps),
        error_estimate=np.full((points, len(flown.loop.outputs)), np.nan),
        names=flown.loop.outputs,
        state_names=flown.loop.states,
        unenforced=dynamics.unenforced if isinstance(dynamics, TabDynamics) else (),
        duration=float(time[-1]),
    )


def _samples(found: Trajectory, nodes: Any) -> Any:
    """(P, T, ...) of nodes (M, ..., P)."""
    return np.ascontiguousarray(np.moveaxis(nodes[found.sampled], -1, 0))


def _until(balance: EnergyBalance, over: BoolArray) -> EnergyBalance:
    """The balance, nan where a point has diverged (P, T)."""
    return EnergyBalance(**{f.name: _blanked(getattr(balance, f.name), over) for f in fields(balance)})


def _blanked(values: FloatArray, over: BoolArray) -> FloatArray:
    """Values (P, T, ...), nan where a point has diverged (P, T)."""
    if not over.any():
        return values
    return np.where(over.reshape(*over.shape, *(1,) * (values.ndim - 2)), np.nan, values)


def _left_data(dynamics: Dynamics, found: Trajectory, seen: Signals) -> FloatArray:
    """(P,) when the angles are first beyond what the source of hinge moments knows; nan where never."""
    plant = dynamics.flown.plant
    if plant.linear_source:
        return np.full(dynamics.points, np.nan)
    known = plant.source.covers(plant.alpha, seen.angle[:, 0], seen.angle[:, 1])
    return np.where(known.all(axis=0), np.nan, found.time[np.argmin(known, axis=0)])


def _over_grid(found: NonlinearResponse, simulated: BoolArray, finite: BoolArray) -> NonlinearResponse:
    """The response over the grid, with outcomes of the points that were left out."""
    if simulated.all():
        return found.take(np.arange(simulated.size).reshape(simulated.shape))
    whole = found.spread(simulated)
    codes, reasons = whole.codes.copy(), whole.reasons.copy()
    codes[~finite], reasons[~finite] = SimulationOutcome.NO_LOOP, "the point carries no loop, or no finite one"
    fast = finite & ~simulated
    codes[fast], reasons[fast] = (
        SimulationOutcome.TOO_FAST,
        f"its fastest mode, or a delay, needs more than {LARGEST_COUNT} steps",
    )
    return replace(whole, codes=codes, reasons=reasons)


def _joined(parts: list[Any], order: IntArray) -> Any:
    """One result of several over the points, put into order."""
    first = parts[0]
    if isinstance(first, np.ndarray):
        return np.concatenate(parts)[order]
    if isinstance(first, GridArrays) and is_dataclass(first):
        values = {f.name: _joined([getattr(p, f.name) for p in parts], order) for f in fields(first)}
        return type(first)(**values)
    if isinstance(first, tuple) and first and is_dataclass(first[0]):
        return tuple(_joined(list(each), order) for each in zip(*parts, strict=True))
    return first
