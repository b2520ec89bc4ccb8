"""A gain schedule as a system of python-control, to be simulated with any plant of one's own."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from design.lqr.structures import FOLLOWED, INTEGRALS
from design.python_control import nonlinear_system
from model.arrays import FloatArray
from model.linear_model import INPUTS
from schedules.interpolate import interpolate
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name

#: States that a controller of its own would have to run: commands under way, models of delays, estimates.
_NOT_MEASURED = re.compile(r"T_[ta]_\d+|(tab|aileron)_delay_\d+")
#: Sign of the servo-tab's DC gain in the laws of the classical kinds.
_SIGMA = -1.0


def gain_scheduled_system(schedule: GainSchedule, rate_filter: float | None = None) -> Any:
    """The controller as a ``control.NonlinearIOSystem`` with named signals, its gains interpolated at every instant.

    The rule between the grid points is the schedule's own, multilinear and clipped at the edges: it is not that of
    ``control.create_statefbk_iosystem``, whose linear rule is of triangles, which takes the nearest point outside the
    grid and no axis of one breakpoint, and schedules by states, references and inputs only.

    Inputs are what is measured (``dt dt_rate da da_rate``, torques and lags where gains are on them), the references
    ``r_a r_t``, and the grid's coordinates by their names on the wire (``altitude_m``, ``dynamic_pressure_pa``, ..).
    Outputs are ``T_t T_a`` [N m] of state feedback, ``dt_command`` [rad] or ``dt_rate_command`` [rad/s] of a tab-only
    law. Angles [rad], rates [rad/s] and torques are deviations from trim, TE-up positive. States are the integrals, and
    ``da_filtered``. Where a grid point that counts has no gains, outputs are nan.

    Parameters
    ----------
    schedule : of a continuous controller
    rate_filter : cut-off of the filtered derivative [rad/s] that a tab-only law takes for ``da_rate``; None where the
        rate is measured, which is then an input

    Raises
    ------
    ValueError : gains of a controller that runs as code, models its delays or estimates its states; a rate filter of a
        law without a rate, or one that is not positive
    """
    names = {gain.name for gain in schedule.gains}
    if schedule.kind == "lqr":
        if rate_filter is not None:
            raise ValueError("a rate filter is part of a tab-only law; filter the measured rates of a state feedback")
        return _state_feedback(schedule, names)
    if rate_filter is not None and ("K_d" not in names or not 0.0 < rate_filter < np.inf):
        raise ValueError(f"a rate filter of {rate_filter} rad/s has no place in a law with the gains {sorted(names)}")
    return _tab_law(schedule, names, rate_filter)


class _Gains:
    """Gains by name at coordinates (of one instant)."""

    def __init__(self, schedule: GainSchedule) -> None:
        self._schedule = schedule

    def at(self, coordinates: FloatArray) -> dict[str, float]:
        found = interpolate(self._schedule, [float(each) for each in coordinates])
        return {gain.name: float(gain.values) for gain in found.gains}


def _coordinates(schedule: GainSchedule) -> tuple[str, ...]:
    return tuple(axis_name(axis) for axis in schedule.axes)


def _state_feedback(schedule: GainSchedule, names: set[str]) -> Any:
    prefix = f"K_{INPUTS[0]}_"
    states = [gain.name.removeprefix(prefix) for gain in schedule.gains if gain.name.startswith(prefix)]
    foreign = [name for name in names if not name.startswith(("K_", "N_"))]
    own = [state for state in states if _NOT_MEASURED.fullmatch(state)]
    if foreign or own:
        said = ", ".join(sorted([*foreign, *own]))
        raise ValueError(
            f"controller {schedule.controller} runs states of its own, which a table does not hold: {said}"
        )
    references = [reference for reference in INTEGRALS if INTEGRALS[reference] in states]
    integrals = [INTEGRALS[reference] for reference in references]
    measured = [state for state in states if state not in integrals]
    inputs = (*measured, *references, *_coordinates(schedule))
    table, count = _Gains(schedule), len(measured)

    def update(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        return np.array([u[inputs.index(r)] - u[inputs.index(FOLLOWED[r])] for r in references])

    def output(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        gains = table.at(u[count + len(references) :])
        value = dict(zip(integrals, x, strict=True)) | dict(zip(inputs, u, strict=True))
        return np.array(
            [
                sum(gains[f"N_{torque}_{r}"] * value[r] for r in references)
                - sum(gains[f"K_{torque}_{state}"] * value[state] for state in states)
                for torque in INPUTS
            ]
        )

    return nonlinear_system(update, output, tuple(integrals), inputs, INPUTS, schedule.controller)


def _tab_law(schedule: GainSchedule, names: set[str], rate_filter: float | None) -> Any:
    filtered, by_rate = rate_filter is not None, "K_theta" in names
    measured = ["da", *(["da_rate"] if "K_d" in names and not filtered else []), *(["dt"] if by_rate else [])]
    inputs, table = (*measured, "r_a", *_coordinates(schedule)), _Gains(schedule)
    cutoff = rate_filter or 0.0

    def update(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        error = u[inputs.index("r_a")] - u[0]
        return np.array([error, cutoff * (u[0] - x[1])] if filtered else [error])

    def output(t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        gains = table.at(u[len(measured) + 1 :])
        value = dict(zip(inputs, u, strict=True))
        rate = cutoff * (u[0] - x[1]) if filtered else value.get("da_rate", 0.0)
        if schedule.kind == "negative_feedback":
            command = _SIGMA * (gains["K_i"] * x[0] - gains["K_p"] * u[0] - gains["K_d"] * rate)
        else:
            command = _SIGMA * (gains["K_i"] * x[0] + gains["K_f"] * u[0])
        return np.array([gains["K_theta"] * (command - value["dt"]) if by_rate else command])

    states = ("int_a", "da_filtered") if filtered else ("int_a",)
    outputs = ("dt_rate_command",) if by_rate else ("dt_command",)
    return nonlinear_system(update, output, states, inputs, outputs, schedule.controller)
