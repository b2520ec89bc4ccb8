"""A manoeuvre flown over a profile of altitude and speed, the gain schedule live (seed 3.2.3, 6.3).

The section obeys its equations in total angles (seed 2.2.17), in the air and at the load of each instant; the
controller has the gains of the schedule at each instant, multilinear in the grid's axes and clipped outside the grid,
and a trim of its own (`profile_instants`). Nothing is frozen, so what frozen points cannot show is in it: that gains
change while the surfaces move, and that the trim moves away under them.

The actuators are as fast as they are and have no limits; how long the limits would have been reached is told.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from design.manoeuvre import Manoeuvre
from design.simulation.quadrature import running_integral
from design.simulation.response import SimulationOutcome
from design.simulation.time_grid import LARGEST_COUNT, Segment
from model.arrays import IntArray
from model.hinge_moments.derivatives import Derivatives
from model.hinge_moments.thin_aerofoil import ThinAerofoil
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.profile import FlightProfile
from schedules.profile_instants import Course
from schedules.profile_response import ProfileRequest, ProfileResponse, TrackingError
from schedules.profile_signals import Asked, Seen, asked, completed, joined, outputs, sampled_nodes, seen
from schedules.profile_steps import Steps, fly, settled, substeps_of
from schedules.profile_time import flight_segments
from schedules.study import Study

#: How much longer a step takes with the hinge moments of a table.
TABLE_STEP = 20


def fly_profile(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    profile: FlightProfile,
    manoeuvre: Manoeuvre,
    request: ProfileRequest,
) -> ProfileResponse:
    """Fly a manoeuvre over a profile with the gains of the schedule at each instant.

    It begins at rest: at the trim of the first instant, or where the loop rests there with the trim that the
    controller works from.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : a controller in continuous time with all its states measured, or rates by filters, without delays
    profile : altitude and speed over time
    manoeuvre : of the loop's references, from the controller's trim

    Raises
    ------
    ProfileRefused : the profile leaves the model of the section
    ValueError : another controller, references that are not its own, gains that are missing on the way, no rest at the
        beginning, or too many steps
    """
    plan = _Plan.of(study, plant, designed, profile, manoeuvre, request)
    if plan.steps > LARGEST_COUNT:
        raise ValueError(
            f"the flight needs {plan.steps} steps, more than {LARGEST_COUNT}: its fastest mode is too fast"
        )
    made = _flown(plan, request, 1)
    if not request.estimate_error:
        return made
    finer = _flown(plan, request, 2)
    count = min(len(made.time), len(finer.time))
    error = np.abs(finer.outputs[:count] - made.outputs[:count]).max(axis=0, initial=0.0)
    return replace(finer, error_estimate=error)


def profile_work(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    profile: FlightProfile,
    manoeuvre: Manoeuvre,
    request: ProfileRequest,
) -> int:
    """What the time of `fly_profile` grows with: its steps, three times as many with an estimate of the error.

    Steps with hinge moments that are not linear in the angles, those of a table, count `TABLE_STEP` times. Raises what
    `fly_profile` raises of its arguments.
    """
    steps = _Plan.of(study, plant, designed, profile, manoeuvre, request).steps * (3 if request.estimate_error else 1)
    return steps if isinstance(study.aerodynamics.source, ThinAerofoil | Derivatives) else steps * TABLE_STEP


@dataclass(frozen=True, eq=False)
class _Plan:
    """A flight before it is flown: segments, and steps in each of their intervals."""

    course: Course
    manoeuvre: Manoeuvre
    segments: tuple[Segment, ...]
    substeps: tuple[int, ...]

    @classmethod
    def of(
        cls, study: Study, plant: PlantEnvelope, designed: DesignedController, profile: FlightProfile,
        manoeuvre: Manoeuvre, request: ProfileRequest,
    ) -> _Plan:  # fmt: skip
        course = Course(study, plant, designed, profile, request.trim)
        references = course.loop.references
        if manoeuvre.values.shape[-1] != len(references):
            raise ValueError(f"the manoeuvre must have the references {', '.join(references) or 'of none'}")
        segments = flight_segments(profile, plant.grid.axes, manoeuvre, request.duration, request.samples)
        substeps = substeps_of(course, segments, request.tolerance, manoeuvre.omega, request.substeps)
        return cls(course, manoeuvre, segments, tuple(substeps.tolist()))

    @property
    def steps(self) -> int:
        """How many there are."""
        return sum(s.intervals * count for s, count in zip(self.segments, self.substeps, strict=True))


def _flown(plan: _Plan, request: ProfileRequest, finer: int) -> ProfileResponse:
    """The flight with steps `finer` times as short."""
    course = plan.course
    substeps = finer * np.array(plan.substeps, dtype=np.int64)
    steps = Steps.through(plan.segments, substeps)
    parts: list[Seen] = []
    first, diverged_at = None, np.nan
    for nodes in fly(course, plan.manoeuvre, steps, settled(course)):
        first, diverged_at = first or nodes.instants.take([0]), nodes.diverged_at
        parts.append(seen(nodes))
    assert first is not None
    found = completed(joined(parts))
    demand = asked(course.study, first, found, diverged_at)
    return _response(plan, found, demand, diverged_at, substeps, len(steps.begin))


def _response(
    plan: _Plan, found: Seen, demand: Asked, diverged_at: float, substeps: IntArray, steps: int
) -> ProfileResponse:
    course, sampled = plan.course, sampled_nodes(found, substeps)
    loop = course.loop
    time = found.time[sampled]
    there = course.at(time)
    diverged = not np.isnan(diverged_at)
    return ProfileResponse(
        time=time,
        condition=there.condition,
        outputs=outputs(found, loop.outputs)[sampled],
        target=found.target[sampled],
        gains=there.gains,
        clipped=there.clipped,
        slowest=np.linalg.eigvals(there.closed).real.max(axis=-1),
        at_limit=demand.at_limit[sampled],
        time_at_limit=demand.time_at_limit,
        demand=demand.demand,
        tracking=_tracking(found, loop.references),
        code=SimulationOutcome.DIVERGED if diverged else SimulationOutcome.COMPLETED,
        reason=f"a surface passes a right angle within {diverged_at:.4g} s" if diverged else None,
        diverged_at=diverged_at if diverged else None,
        left_data_at=_left_data(course, found),
        names=loop.outputs,
        references=loop.references,
        actuators=loop.inputs,
        steps=steps,
    )


def _tracking(found: Seen, references: tuple[str, ...]) -> tuple[TrackingError, ...]:
    """How far each surface is from its target."""
    made = []
    for i, name in enumerate(references):
        error = found.target[:, i] - found.angle[:, 1 if name == "r_a" else 0]
        square = running_integral(found.time, found.segment, error[:, None] ** 2)[-1, 0]
        peak, mean = float(np.abs(error).max()), max(float(square), 0.0) / float(found.time[-1])
        made.append(TrackingError(name, peak, float(np.sqrt(mean)), float(error[-1])))
    return tuple(made)


def _left_data(course: Course, found: Seen) -> float | None:
    """When the angles are first beyond what the source of hinge moments knows [s]."""
    alpha = np.full(len(found.time), course.study.trim.alpha)
    known = course.plant.system.aerodynamics.source.covers(alpha, found.angle[:, 0], found.angle[:, 1])
    return None if np.all(known) else float(found.time[np.argmin(known)])
