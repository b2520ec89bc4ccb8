"""Loops between the grid points that cannot be taken apart: trimmed, linearised and assembled at a few of them."""

from __future__ import annotations

import numpy as np

from model.flight import flight_condition
from model.linearise import linearise
from model.trim import trim
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.proof.cells import cells
from schedules.proof.flown_with import closed_with, feedback_gains
from schedules.proof.frozen import SAMPLES, SlowestPoint, multilinear, rightmost
from schedules.proof.plant_terms import given_point_by_point
from schedules.study import Study


def sampled_points(
    study: Study, plant: PlantEnvelope, designed: DesignedController
) -> dict[tuple[int, int], SlowestPoint]:
    """The slowest of `SAMPLES` by `SAMPLES` points of each cell whose corners have gains, by the cell's index.

    Cells where no point can be trimmed are left out; all are where the trim is given grid point by grid point.
    """
    asked, grid = study.trim, study.grid
    if given_point_by_point(asked):
        return {}
    table = feedback_gains(designed)
    tables = np.stack(list(table.values()), axis=-1)
    fractions = np.linspace(0.0, 1.0, SAMPLES)
    across, along = (x.ravel() for x in np.meshgrid(fractions, fractions, indexing="ij"))
    found: dict[tuple[int, int], SlowestPoint] = {}
    for cell in cells(plant.grid.axes):
        if cell.failed(designed.outcomes) is not None:
            continue
        low, high = cell.box.altitude
        slow, fast = cell.box.speed
        altitude, speed = low + across * (high - low), slow + along * (fast - slow)
        condition = flight_condition(altitude, grid.speed_axis, speed, grid.temperature_offset)
        inside = plant.system.aerodynamics.covers(condition.mach)
        held = trim(plant.system, condition.take(inside), asked).spread(inside)
        inside = np.asarray(inside & held.reached)
        if not np.any(inside):
            continue
        condition = condition.take(inside)
        model = linearise(plant.system, condition, held.take(inside))
        gains = multilinear(cell.corners(tables), across[inside], along[inside])
        by_name = {name: gains[:, i] for i, name in enumerate(table)}
        values = rightmost(closed_with(study, plant, designed, model, by_name))
        k = int(np.argmax(values.real))
        found[cell.index] = SlowestPoint(
            float(altitude[inside][k]), float(speed[inside][k]), float(condition.dynamic_pressure[k]),
            complex(values[k]), (),
        )  # fmt: skip
    return found
