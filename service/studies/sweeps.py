"""Eigenvalue sweeps: over a quantity that the model knows by name, or over any number of the request."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import radians
from typing import Any

import numpy as np
from pydantic import ValidationError

from model.arrays import FloatArray
from model.eigenvalue_sweep import EigenvalueSweep, eigenvalue_sweep, sweep_models
from model.flight import FlightGrid
from model.linear_model import LinearModel
from model.swept_plant import SweptQuantity
from model.system import TabAileron
from schedules.analysis import PlantEnvelope, analyse
from schedules.study import PlantStudy
from service.limits import check_envelope
from service.schemas.aerodynamics import Table
from service.schemas.hinge_tables import Taylor
from service.schemas.studies import EigenvalueSweepRequest
from service.studies.plant import asked_of_model, flight_grid_of, system_of
from service.to_domain.study_of import breakpoints, plant_study
from service.wire.refusals import FieldRefusal, InvalidRequest
from service.wire.request_fields import changed_request, number_at, unit_at
from service.wire.units import unit_of

#: Wire name -> the model's name, and whether it is an angle in degrees.
QUANTITIES: dict[str, tuple[SweptQuantity, bool]] = {
    "tab_deg": ("tab", True),
    "aileron_deg": ("aileron", True),
    "alpha_deg": ("alpha", True),
    "airspeed_m_s": ("airspeed", False),
    "density_kg_m3": ("density", False),
    "tab_chord_ratio": ("tab_chord_ratio", False),
}


@dataclass(frozen=True, eq=False)
class Swept:
    """Eigenvalues (*G, m), the request's own grid and section, and what varies as the wire names it."""

    grid: FlightGrid
    system: TabAileron
    name: str
    unit: str
    values: tuple[float, ...]
    sweep: EigenvalueSweep


def swept(wanted: EigenvalueSweepRequest) -> Swept:
    """The eigenvalues that were asked for.

    Raises
    ------
    InvalidRequest : a pointer to no number, a value that its field does not take, or numbers the model refuses
    """
    study, values = plant_study(wanted), breakpoints(wanted.vary.values)
    grid, system = flight_grid_of(study), system_of(study)
    if wanted.vary.quantity is not None:
        quantity, angle = QUANTITIES[wanted.vary.quantity]
        inside = np.array([radians(value) if angle else value for value in values])
        with asked_of_model():
            found = eigenvalue_sweep(system, grid.condition, study.trim, quantity, inside)
        return Swept(grid, system, wanted.vary.quantity, unit_of(wanted.vary.quantity), values, found)
    pointer = str(wanted.vary.pointer)
    number_at(wanted, pointer)
    plants = [_plant_at(wanted, study, pointer, place, value) for place, value in enumerate(values)]
    with asked_of_model():
        found = _along_values(plants, np.array(values), pointer)
    return Swept(grid, system, pointer, unit_at(pointer), values, found)


def _plant_at(
    wanted: EigenvalueSweepRequest, base: PlantStudy, pointer: str, place: int, value: float
) -> PlantEnvelope:
    """The plant with one value put at the pointer; a refusal names the value and says what its field takes."""
    try:
        request = changed_request(wanted, pointer, value)
        study = plant_study(request, None if refits(wanted) else base.aerodynamics)
        check_envelope(study)
        with asked_of_model():
            return analyse(study)
    except (ValidationError, InvalidRequest) as error:
        span = not isinstance(wanted.vary.values, list)
        at = "/vary/values" if span else f"/vary/values/{place}"
        words, allowed = _why(error)
        detail = f"{pointer} cannot be {value:g}: {words}"
        raise InvalidRequest(f"{at}: {detail}", FieldRefusal(at, detail, unit_at(pointer), allowed)) from None


def _why(error: ValidationError | InvalidRequest) -> tuple[str, str | None]:
    """Words and allowed values of a refusal."""
    if isinstance(error, InvalidRequest):
        field = error.fields[0] if error.fields else FieldRefusal("", error.detail)
        return field.detail, field.allowed
    first: Any = error.errors(include_url=False)[0]
    context = first.get("ctx", {})
    words = str(context.get("detail") or first["msg"].replace("Input should", "must"))
    return words, context.get("allowed") or words


def refits(wanted: EigenvalueSweepRequest) -> bool:
    """Whether the source of hinge moments changes along the sweep."""
    part = str(wanted.vary.pointer).split("/")[1:2]
    if part in (["geometry"], ["aerodynamics"]):
        return part == ["aerodynamics"] or not isinstance(wanted.aerodynamics, Table)
    table = wanted.aerodynamics
    windowed = isinstance(table, Table) and isinstance(table.fit, Taylor) and table.fit.window_deg is not None
    return windowed and part == ["trim"]


def _along_values(plants: list[PlantEnvelope], values: FloatArray, pointer: str) -> EigenvalueSweep:
    """Eigenvalues along the plants, one a value."""
    outcomes = [plant.outcomes for plant in plants]
    covered = np.stack([each.ok for each in outcomes], axis=-1)
    reasons = np.stack([each.reasons for each in outcomes], axis=-1)
    if any(plant.grid.shape != plants[0].grid.shape for plant in plants):
        raise ValueError("the values do not leave the grid its shape")
    model = stacked([plant.model for plant in plants])
    return sweep_models(model, values, pointer, unit_at(pointer), covered, reasons)


def stacked(models: list[LinearModel]) -> LinearModel:
    """Models over one grid (*G, ...) as one over the grid and the values (*G, m, ...)."""
    axis = models[0].A.ndim - 2
    first = {field.name: getattr(models[0], field.name) for field in fields(LinearModel)}
    arrays: dict[str, Any] = {
        name: np.stack([getattr(model, name) for model in models], axis=axis)
        for name, value in first.items()
        if isinstance(value, np.ndarray)
    }
    return replace(models[0], **arrays)
