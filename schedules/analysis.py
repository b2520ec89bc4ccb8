"""The plant over the grid: air, trim, hinge moments and linear models, before any control."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from design.frequency.fastest_mode import fastest_surface_mode
from design.outcome import Outcome, Outcomes
from model.aerodynamics import Aerodynamics
from model.arrays import BoolArray, FloatArray
from model.flight import FlightCondition, FlightGrid, flight_grid
from model.hinge_moments.expansion import HingeMoments, HingeMomentSource
from model.linear_model import LinearModel
from model.linearise import linearise
from model.reduced_frequency import reduced_frequency
from model.servo_tab import ServoTab, servo_tab
from model.system import TabAileron
from model.trim import Trim, trim
from schedules.study import PlantStudy

#: Above these Mach numbers the aerodynamic model is doubtful, without and with compressibility correction.
MACH_DOUBTFUL = {"none": 0.3, "prandtl_glauert": 0.7}


@dataclass(frozen=True)
class EnvelopeWarning:
    """Something the engineer should know about some points of the grid.

    Attributes
    ----------
    code : one word to filter by
    detail : what it means, with numbers
    points : flat row-major indices
    """

    code: str
    detail: str
    points: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class PlantEnvelope:
    """The plant over the grid. Points outside the model hold nan and an outcome that says why."""

    grid: FlightGrid
    system: TabAileron
    outcomes: Outcomes
    trim: Trim
    hinge_moments: HingeMoments
    model: LinearModel
    servo_tab: ServoTab
    warnings: tuple[EnvelopeWarning, ...]

    @cached_property
    def reduced_frequency(self) -> FloatArray:
        """Reduced frequency k of the fastest mode of both surfaces without control (*G,) [-]; nan outside the model."""
        A = self.model.A
        finite = np.isfinite(A).all(axis=(-2, -1))
        fastest = np.full(finite.shape, complex(np.nan, np.nan))
        fastest[finite] = fastest_surface_mode(A[finite], self.model.states, ("dt", "da"))
        condition, chord = self.grid.condition, self.system.geometry.chord
        return reduced_frequency(fastest[..., None], condition, chord)[..., 0]


def analyse(study: PlantStudy) -> PlantEnvelope:
    """Linearise the section over the whole grid.

    Raises
    ------
    ValueError : the grid cannot be built (altitude outside the atmosphere, breakpoints not increasing)
    """
    request = study.grid
    grid = flight_grid(
        np.array(request.altitude), request.speed_axis, np.array(request.speed), request.temperature_offset
    )
    system = TabAileron(study.geometry, study.inertia, study.aerodynamics)
    covered = study.aerodynamics.covers(grid.condition.mach)
    outcomes = _outside(grid, covered)
    condition = grid.condition.take(covered)
    found = trim(system, condition, study.trim)
    trimmed = found.spread(covered)
    outcomes = outcomes.failing(
        covered & ~trimmed.reached, Outcome.OUTSIDE_MODEL, lambda index: str(trimmed.reason[index])
    )
    outcomes = _outside_data(outcomes, covered, found, study.aerodynamics.source)
    # Only points inside the model have a linear model; an extrapolated one would be taken for real.
    ok = outcomes.ok
    condition, found = grid.condition.take(ok), trimmed.take(ok)
    angles = found.state[..., 0], found.state[..., 2]
    moments = study.aerodynamics.hinge_moments(found.alpha, *angles, condition.mach)
    model = linearise(system, condition, found)
    return PlantEnvelope(
        grid, system, outcomes, trimmed, moments.spread(ok), model.spread(ok),
        servo_tab(model).spread(ok), _mach_warnings(study.aerodynamics, grid.condition, ok),
    )  # fmt: skip


def _outside(grid: FlightGrid, covered: BoolArray) -> Outcomes:
    mach = grid.condition.mach
    return Outcomes.all_ok(grid.shape).failing(
        ~covered,
        Outcome.OUTSIDE_MODEL,
        lambda index: f"Mach {mach[index]:.4g} is outside the subsonic model (Mach < 1)",
    )


def _outside_data(outcomes: Outcomes, covered: BoolArray, found: Trim, source: HingeMomentSource) -> Outcomes:
    """Mark the trims (those of `covered`) whose angles the hinge-moment source knows nothing about."""
    known = np.ones(covered.shape, dtype=bool)
    known[covered] = source.covers(found.alpha, found.state[..., 0], found.state[..., 2])
    trimmed = found.spread(covered)

    def reason(index: tuple[int, ...]) -> str:
        alpha, dt, da = np.rad2deg([trimmed.alpha[index], trimmed.state[index][0], trimmed.state[index][2]])
        return (
            f"the trim at alpha {alpha:.4g}, tab {dt:.4g}, aileron {da:.4g} deg lies outside the hinge-moment data: "
            f"{source.domain}"
        )

    return outcomes.failing(~known, Outcome.OUTSIDE_MODEL, reason)


def _mach_warnings(
    aerodynamics: Aerodynamics, condition: FlightCondition, ok: BoolArray
) -> tuple[EnvelopeWarning, ...]:
    limit = MACH_DOUBTFUL[aerodynamics.compressibility]
    doubtful = ok & (condition.mach > limit)
    if not np.any(doubtful):
        return ()
    correction = "no compressibility correction" if aerodynamics.compressibility == "none" else "Prandtl-Glauert"
    detail = (
        f"Mach up to {np.max(condition.mach[doubtful]):.3f} with {correction}; hinge moments are doubtful above "
        f"Mach {limit}"
    )
    return (EnvelopeWarning("mach", detail, tuple(int(i) for i in np.flatnonzero(doubtful))),)
