"""The parts of a scheduled loop that move with the scheduling variable: plant, trim, gains, and what is integrated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.classical.controller import ClassicalController
from design.gains import Gain
from design.loop import Loop
from design.lqr.hamiltonian import solve_or_nan
from model.arrays import FloatArray, GridArrays
from model.lag_states import LAG_STATES
from model.linear_model import LinearModel
from schedules.analysis import PlantEnvelope, analyse
from schedules.designed import DesignedController
from schedules.flown_loop_with import flown_loop_with
from schedules.interpolate import node_slopes
from schedules.proof.flown_with import unprovable
from schedules.proof.plant_terms import given_point_by_point
from schedules.schedule import GainSchedule
from schedules.study import PlantStudy, Study

#: Step of the plant's derivative, as a part of the scheduling variable.
STEP = 1e-3
#: Five-point central difference: multiples of the step, and weights.
STENCIL = ((-2, 1.0 / 12.0), (-1, -8.0 / 12.0), (1, 8.0 / 12.0), (2, -1.0 / 12.0))
#: The grid's axis that moves: its speed.
SPEED = 1

#: States that are a torque, in the order of the model's inputs.
_TORQUES = ("tab_torque", "aileron_torque")
_INTEGRALS = ("int_a", "int_t")


@dataclass(frozen=True, eq=False)
class MovingLoop(GridArrays):
    """Loops (N,) of the points that carry a design; slopes are per unit of the scheduling variable q.

    The second axis of what the gains do is the side of the grid point, below and above.

    Attributes
    ----------
    closed : (N, n, n) Acl
    rest : (N, n) x_s at the reference, deviations from trim
    trim_slope : (N, n) X0_q
    by_plant (N, n, n), reference_by_plant (N, n) : slopes of Acl and of ``(E + B N) r`` at constant gains
    by_gains (N, 2, n, n), reference_by_gains (N, 2, n) : at a constant plant
    by_stored : (N, 2, n, n) the part of `by_gains` that the integrators' own gains have
    late_trim : (N, n) ``B (U0_q + K X0_q)``, and X0_q's part in the errors that are integrated
    states : names (n)
    """

    closed: FloatArray
    rest: FloatArray
    trim_slope: FloatArray
    by_plant: FloatArray
    reference_by_plant: FloatArray
    by_gains: FloatArray
    reference_by_gains: FloatArray
    by_stored: FloatArray
    late_trim: FloatArray
    states: tuple[str, ...]


def why_no_coupling(study: Study, plant: PlantEnvelope, designed: DesignedController) -> str | None:
    """Why the loop of a controller is not taken into motion; None where it is."""
    if not np.any(designed.outcomes.ok):
        return "no point carries a design"
    barred = unprovable(study, plant, designed)
    if barred is not None and not barred.known:
        return barred.reason
    request = designed.request
    if isinstance(request, ClassicalController):
        if request.tab_command == "deflection" and study.tab_actuator.servo_bandwidth is None:
            return (
                "an ideal tab deflection moves the aileron's rate at once, by an amount that changes with the flight "
                "point: give the servo a bandwidth"
            )
    elif request.measurement is not None and set(LAG_STATES) & set(designed.loop.states):
        return "the controller runs filters of the circulation's lag, whose pace changes with the flight point"
    if given_point_by_point(study.trim):
        return "the trim is given grid point by grid point: nothing says how it moves between them"
    return None


def moving_loop(study: Study, plant: PlantEnvelope, designed: DesignedController, schedule: GainSchedule) -> MovingLoop:
    """Slopes of a controller's loops along the grid's speed axis.

    Raises
    ------
    ValueError : `why_no_coupling` has a reason
    """
    reason = why_no_coupling(study, plant, designed)
    if reason is not None:
        raise ValueError(f"controller {designed.request.name}: {reason}")
    ok, breakpoints = designed.outcomes.ok, schedule.axes[SPEED].values
    gains = [replace(gain, values=gain.values[ok]) for gain in schedule.gains]
    slopes = [replace(gain, values=gain.values[ok]) for gain in node_slopes(schedule, SPEED)]

    def assembled(model: LinearModel, flown: Sequence[Gain]) -> Loop:
        return flown_loop_with(study, plant, designed, model, {gain.name: gain.values for gain in flown})

    def pair(loop: Loop) -> FloatArray:
        """Acl and ``(E + B N) r`` side by side (N, n, n + 1)."""
        return np.concatenate([loop.closed, (loop.reference_input @ r)[..., None]], axis=-1)

    model = plant.model.take(ok)
    loop = assembled(model, gains)
    r, n = study.reference.sizes(loop.references), len(loop.states)
    # The plant and its trim, at flight points a little aside; nan where the model has none.
    step = STEP * np.broadcast_to(np.asarray(breakpoints), ok.shape)[ok]
    by_plant, trim_slope = np.zeros((len(step), n, n + 1)), np.zeros((len(step), n))
    command_slope = np.zeros((len(step), len(loop.inputs)))
    for multiple, weight in STENCIL:
        aside = _aside(study, 1.0 + multiple * STEP).model.take(ok)
        part = (weight / step)[:, None]
        by_plant += part[..., None] * pair(assembled(aside, gains))
        trim_slope += part * _resting_states(aside, loop)
        command_slope += part * _resting_commands(aside, designed)
    # Loops are of second degree in the gains at most, so differences over whole cells are derivatives.
    by_gains, by_stored = np.zeros((2, len(step), 2, n, n + 1))
    for side, widths in enumerate(_widths(breakpoints)):
        width = np.broadcast_to(widths, ok.shape)[ok]
        for sign in (1.0, -1.0):
            moved = [
                replace(k, values=k.values + sign * width * d.values[:, side])
                for k, d in zip(gains, slopes, strict=True)
            ]
            stored = [there if _integrates(there.name) else here for here, there in zip(gains, moved, strict=True)]
            part = (0.5 * sign / width)[:, None, None]
            by_gains[:, side] += part * pair(assembled(model, moved))
            by_stored[:, side] += part * pair(assembled(model, stored))
    late = (loop.B @ (command_slope[..., None] + loop.K @ trim_slope[..., None]))[..., 0]
    integrals = [loop.states.index(name) for name in _INTEGRALS if name in loop.states]
    late[:, integrals] -= (loop.A[:, integrals] @ trim_slope[..., None])[..., 0]
    return MovingLoop(
        closed=loop.closed, rest=-solve_or_nan(loop.closed, pair(loop)[..., n:])[..., 0], trim_slope=trim_slope,
        by_plant=by_plant[..., :n], reference_by_plant=by_plant[..., n], by_gains=by_gains[..., :n],
        reference_by_gains=by_gains[..., n], by_stored=by_stored[..., :n], late_trim=late, states=loop.states,
    )  # fmt: skip


def _aside(study: Study, factor: float) -> PlantEnvelope:
    """The plant of a study at other speeds."""
    grid = replace(study.grid, speed=tuple(factor * speed for speed in study.grid.speed))
    return analyse(PlantStudy(study.geometry, study.inertia, study.aerodynamics, study.trim, grid))


def _resting_states(model: LinearModel, loop: Loop) -> FloatArray:
    """Totals (N, n) of a loop's states in trim: integrators at zero, filters where what they filter is."""
    states = np.zeros((len(model.A), len(loop.states)))
    for i, name in enumerate(loop.states):
        of = name.removesuffix("_filtered")
        if of in _TORQUES:
            states[:, i] = model.input_offset[:, _TORQUES.index(of)]
        elif of not in _INTEGRALS:
            states[:, i] = model.state_offset[:, model.states.index(of)]
    return states


def _resting_commands(model: LinearModel, designed: DesignedController) -> FloatArray:
    """Totals (N, m) of the commands there: torques, or the tab's deflection; its rate is zero."""
    if not isinstance(designed.request, ClassicalController):
        return model.input_offset
    angle = model.state_offset[:, model.states.index("dt"), None]
    return angle if designed.request.tab_command == "deflection" else np.zeros_like(angle)


def _integrates(name: str) -> bool:
    return name == "K_i" or name.endswith(tuple(f"_{integral}" for integral in _INTEGRALS))


def _widths(breakpoints: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Width of the cell below and above each breakpoint, a table's own scale; 1 where there is none."""
    width = np.diff(np.asarray(breakpoints, dtype=float))
    return np.concatenate([[1.0], width]), np.concatenate([width, [1.0]])
