"""A gain table from anywhere, made a controller of a plant: to be proved, or refuted, between its grid points.

The gains are taken as they are. Nothing is judged and nothing withdrawn, so that a table that does not hold is refuted
at a point that is named. Only a loop that cannot be taken apart nor sampled between the grid points (a transport delay,
a digital controller, by its lag) loses its gains at the points where it is not proved stable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import get_args

import numpy as np

from design.classical.controller import ClassicalController
from design.classical.steering import StepReference
from design.classical.synthesis import design_classical
from design.classical.tab_loop import tab_loop
from design.estimation.rate_filters import with_rate_filters
from design.gains import Gain
from design.loop import Loop
from design.lqr.controller import LqrController
from design.lqr.measurement import Measurement, RateFilters
from design.lqr.structures import Reference, Structure
from design.lqr.synthesis import LqrDesign
from design.lqr.torque_loop import gains as named_gains
from design.lqr.torque_loop import lqr_loop
from design.lqr.weights import ExplicitWeights
from design.outcome import Outcome, Outcomes
from design.sampling import as_if_continuous
from model.arrays import FloatArray
from model.flight import GridAxis, SpeedAxis
from model.linear_model import INPUTS
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.flown_figures import Flight, figures_of
from schedules.judging import horizon
from schedules.proof.flown_with import unprovable
from schedules.study import Controller, GridRequest, Study


def on_axes(study: Study, axes: tuple[GridAxis, GridAxis]) -> Study:
    """The study on the breakpoints of a table, altitude first.

    Raises
    ------
    ValueError : the second axis is no measure of speed
    """
    altitude, speed = axes
    measures: dict[str, SpeedAxis] = {name: name for name in get_args(SpeedAxis)}
    if altitude.name != "altitude" or speed.name not in measures:
        raise ValueError(f"axes are altitude and one of {', '.join(measures)}, not {altitude.name} and {speed.name}")
    grid = GridRequest(altitude.values, measures[speed.name], speed.values, study.grid.temperature_offset)
    return replace(study, grid=grid)


def state_feedback_of(
    name: str, reference: Reference, measurement: Measurement | None = None, delay_states: int = 0
) -> LqrController:
    """A state feedback whose gains are given. It has no weights: none of its size, so that no synthesis takes them."""
    none = ExplicitWeights(np.zeros((0, 0)), np.zeros((0, 0)))
    return LqrController(name, none, reference=reference, measurement=measurement, delay_states=delay_states)


def gain_units(study: Study, model_states: tuple[str, ...], request: Controller) -> dict[str, str]:
    """Name and unit of every gain that a table for this controller has, feed-forward last.

    Parameters
    ----------
    model_states : names of the states of the linear model

    Raises
    ------
    ValueError : a state feedback that samples, or runs a model of its own
    """
    if isinstance(request, ClassicalController):
        return request.gain_units
    structure = _structure(study, request)
    states, inputs = structure.states(model_states), len(INPUTS)
    K, N = np.zeros((inputs, len(states))), np.zeros((inputs, len(structure.references)))
    given = _given(structure, states, K, N, Outcomes.all_ok(()))
    return {gain.name: gain.unit for gain in named_gains(given)}


def needed_gains(units: Mapping[str, str]) -> tuple[str, ...]:
    """The gains that a table cannot do without: feed-forward ``N_..`` has no part in stability."""
    return tuple(name for name in units if not name.startswith("N_"))


def uploaded_schedule(
    study: Study,
    plant: PlantEnvelope,
    request: Controller,
    gains: Mapping[str, FloatArray],
    outcomes: Outcomes | None = None,
) -> DesignedController:
    """The controller that flies a table of gains around a plant, over the table's own grid.

    Parameters
    ----------
    study, plant : on the table's axes (`on_axes`)
    request : kind and structure; specs, weights and gains of its own have no part
    gains : (*G,) each of `gain_units` by name, SI and radians; feed-forward that is left out is zero. A point where one
        of them is nan has none
    outcomes : (*G,) what the table says of its points; a point that is not ok has no gains

    Raises
    ------
    ValueError : a gain that is missing, unknown, of another shape than the grid or infinite; a negative one of a
        classical controller, whose law has the signs; a controller whose gains cannot be replaced
    """
    units = gain_units(study, plant.model.states, request)
    tables = _tables(units, gains, plant.outcomes.ok.shape)
    ok = _flown_points(plant.outcomes, outcomes, tables)
    tables = {name: np.where(ok.ok, values, np.nan) for name, values in tables.items()}
    if isinstance(request, ClassicalController):
        request = replace(request, specs=(), smoothness=0.0, gains={k: np.nan_to_num(v) for k, v in tables.items()})
        at_rest = StepReference(study.reference.aileron, horizon(study, request), plant.trim.state[..., 0])
        found = design_classical(plant.servo_tab, study.tab_actuator, request, at_rest, ok)
        ok, named = found.outcomes, tuple(replace(g, values=np.where(ok.ok, g.values, np.nan)) for g in found.gains)
        values = {gain.name: gain.values for gain in named}
        loop = tab_loop(plant.model, plant.servo_tab, study.tab_actuator, request, values)
    else:
        named = tuple(Gain(name, unit, tables[name]) for name, unit in units.items())
        loop = _state_feedback_loop(study, plant, request, tables, ok)
    none = np.full(ok.ok.shape, np.nan)
    flown = as_if_continuous(loop, request.sampling)
    designed = DesignedController(request, ok, named, flown, None, none.astype(complex), none, ())
    why = unprovable(study, plant, designed) if np.any(ok.ok) else None
    if why is not None and not why.known:
        return _stable_points(designed, flown)
    return designed


def _stable_points(designed: DesignedController, loop: Loop) -> DesignedController:
    """The controller without its gains at the points where it is not proved stable; a digital one by its lag."""
    ok = designed.outcomes.ok
    found = figures_of(loop.take(ok), Flight(0.0, 1.0, steps=False)).spread(ok)
    growth = found.largest_real_part

    def unstable(index: tuple[int, ...]) -> str:
        if np.isnan(growth[index]):
            return "the loop with its delay could not be proved stable"
        return f"the closed loop has an eigenvalue with real part {growth[index]:.4g} 1/s"

    outcomes = designed.outcomes.failing(~(growth < 0.0), Outcome.NOT_CERTIFIED, unstable)
    gains = tuple(replace(gain, values=np.where(outcomes.ok, gain.values, np.nan)) for gain in designed.gains)
    return replace(designed, outcomes=outcomes, gains=gains)


def _structure(study: Study, request: LqrController) -> Structure:
    if request.sampling is not None or not isinstance(request.measurement, RateFilters | None):
        raise ValueError(
            f"controller {request.name} runs as code, or a model of the plant: only gains of continuous feedback of "
            "measured states or filtered rates can be uploaded"
        )
    return request.structure(study.tab_actuator, study.aileron_actuator)


def _given(
    structure: Structure, states: tuple[str, ...], K: FloatArray, N: FloatArray, outcomes: Outcomes
) -> LqrDesign:
    """Gains that are given in the form of a design; what would certify it is nan."""
    none = np.full(K.shape[:-2], np.nan)
    X = np.full((*none.shape, len(states), len(states)), np.nan)
    return LqrDesign(K, N, X, none, none, none, outcomes, None, states, structure)


def _state_feedback_loop(
    study: Study, plant: PlantEnvelope, request: LqrController, tables: Mapping[str, FloatArray], outcomes: Outcomes
) -> Loop:
    structure = _structure(study, request)
    states = structure.states(plant.model.states)
    K = _matrix("K", states, tables, outcomes.ok.shape)
    N = _matrix("N", structure.references, tables, outcomes.ok.shape)
    loop = lqr_loop(plant.model, _given(structure, states, K, N, outcomes))
    measured = request.measurement
    return with_rate_filters(loop, measured.cutoff) if isinstance(measured, RateFilters) else loop


def _matrix(
    symbol: str, columns: tuple[str, ...], tables: Mapping[str, FloatArray], shape: tuple[int, ...]
) -> FloatArray:
    """Matrix (*G, 2, n) of the gains ``<symbol>_<input>_<column>``."""
    found = np.zeros((*shape, len(INPUTS), len(columns)))
    for i, u in enumerate(INPUTS):
        for j, x in enumerate(columns):
            found[..., i, j] = tables[f"{symbol}_{u}_{x}"]
    return found


def _tables(units: Mapping[str, str], gains: Mapping[str, FloatArray], shape: tuple[int, ...]) -> dict[str, FloatArray]:
    """Every gain of the controller, in its order; feed-forward that is left out is zero."""
    needed = needed_gains(units)
    if missing := [name for name in needed if name not in gains]:
        raise ValueError(f"the table has no gain {', '.join(missing)}")
    if unknown := [name for name in gains if name not in units]:
        raise ValueError(f"the controller has no gain {', '.join(unknown)}; it has {', '.join(units)}")
    found = {name: np.asarray(gains.get(name, np.zeros(shape)), dtype=float) for name in units}
    for name, values in found.items():
        if values.shape != shape:
            raise ValueError(f"{name} has shape {values.shape}, the grid has {shape}")
        if np.any(np.isinf(values)):
            raise ValueError(f"{name} is infinite")
    return found


def _flown_points(plant: Outcomes, table: Outcomes | None, tables: Mapping[str, FloatArray]) -> Outcomes:
    """The points that are flown: inside the model, and where the table has every gain."""
    outcomes = plant
    if table is not None:
        codes, reasons = table.codes, table.reasons
        for outcome in Outcome:
            said = np.asarray(codes == outcome, dtype=bool) & ~table.ok
            outcomes = outcomes.failing(said, outcome, lambda index: str(reasons[index]))
    missing = np.any(np.isnan(np.stack(list(tables.values()))), axis=0)
    return outcomes.failing(missing, Outcome.EXCLUDED, lambda index: "the table has no gains there")
