"""What the specs lose between the lines, and how far the gains that are read are from those that would be designed.

A spec is held against its limit where the point's own design meets it, and against what that design reaches where it
does not: a table cannot be better than its designs. Figures without a limit are held against the point's own design.
Points that have no design of their own have nothing to be held against.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.classical.controller import ClassicalController
from design.specs import Sense, Spec
from model.arrays import BoolArray, FloatArray
from schedules.refine.lines import Lines
from schedules.refine.point_designs import OwnDesigns
from schedules.refine.request import RefineRequest
from schedules.refine.study_on import spec_on
from schedules.study import Controller, Study

SENSES: dict[str, Sense] = {"damping_ratio": "min", "settling_time": "max", "bandwidth": "min"}


@dataclass(frozen=True)
class Criterion:
    """A figure that is to be kept between the lines.

    Attributes
    ----------
    quantity : one of `design.specs.QUANTITIES`
    sense : which way it binds
    spec : on the study's own grid; None: held against the point's own design
    """

    quantity: str
    sense: Sense
    spec: Spec | None


@dataclass(frozen=True)
class SpecLoss:
    """The largest loss of a figure among the points that were looked at.

    Attributes
    ----------
    quantity, sense : the figure
    against : ``limit`` of the spec, or the point's own ``design``
    loss : how much worse than that it is, as a part of it [-]; negative where it is better everywhere
    value, reference : there, and what it is held against, in the quantity's unit
    altitude : where [m]
    speed : in the axis's unit
    """

    quantity: str
    sense: Sense
    against: str
    loss: float
    value: float
    reference: float
    altitude: float
    speed: float


@dataclass(frozen=True)
class GainError:
    """The largest error of a gain that is read between the lines.

    Attributes
    ----------
    name : of the gain
    error : its distance from the gain that would be designed there, as a part of the gain's largest size [-]
    altitude, speed : where
    """

    name: str
    error: float
    altitude: float
    speed: float


def criteria(study: Study, request: Controller, wanted: RefineRequest) -> tuple[Criterion, ...]:
    """What is held: a classical controller's own specs, else the study's pack; and the figures of the designs."""
    classical = isinstance(request, ClassicalController)
    specs = request.specs if isinstance(request, ClassicalController) and request.specs else study.spec_pack
    relative = wanted.relative
    if relative is None:
        relative = () if classical else ("damping_ratio", "settling_time")
    return (
        *(Criterion(spec.quantity, spec.sense, spec) for spec in specs),
        *(Criterion(name, SENSES[name], None) for name in relative),
    )


@dataclass(frozen=True, eq=False)
class References:
    """What a figure is held against on a mesh (Nh, Ns).

    Attributes
    ----------
    values : in the figure's unit; nan where it is held against nothing
    limits : where that is the spec's limit, not what the point's own design reaches
    """

    values: FloatArray
    limits: BoolArray


def references(study: Study, held: Criterion, own: OwnDesigns, mesh: Lines) -> References:
    """What a figure is held against on a mesh, from the designs there."""
    reached = np.where(own.ok, own.figures[held.quantity], np.nan)
    if held.spec is None:
        return References(reached, np.zeros(reached.shape, dtype=bool))
    spec = spec_on(study, held.spec, mesh)
    met = own.ok & spec.met(reached)
    return References(np.where(met, spec.limit, reached), met)


def losses(held: Criterion, against: References, values: FloatArray, flown: BoolArray) -> FloatArray:
    """How much worse than its reference a figure is (Nh, Ns), as a part of it; infinite where it is lost altogether.

    Parameters
    ----------
    against : what it is held against
    values : (Nh, Ns) of the gains that are read; nan where the figure does not exist
    flown : (Nh, Ns) where there are gains; elsewhere the answer is nan
    """
    reference = against.values
    size = np.abs(reference)
    with np.errstate(invalid="ignore"):
        apart = reference - values if held.sense == "min" else values - reference
        lost = apart / np.where(size > 0.0, size, 1.0)
    lost = np.where(np.isnan(values), np.inf, lost)
    return np.where(np.isfinite(reference) & flown, lost, np.nan)


def gain_errors(read: FloatArray, own: OwnDesigns) -> FloatArray:
    """Errors (Nh, Ns, g) of the gains that are read, as parts of each gain's largest size; nan without a design."""
    known = np.where(own.ok[..., None], np.abs(own.gains), 0.0)
    size = np.max(known, axis=(0, 1))
    return np.asarray(np.abs(read - own.gains) / np.where(size > 0.0, size, 1.0))


def worst(field: FloatArray) -> tuple[int, int] | None:
    """Where a field (Nh, Ns) is largest, the first of equals; None where it is nan everywhere."""
    known = np.where(np.isnan(field), -np.inf, field)
    if not np.any(~np.isnan(field)):
        return None
    i, j = np.unravel_index(int(np.argmax(known)), field.shape)
    return int(i), int(j)


def spec_loss(
    held: Criterion, field: FloatArray, values: FloatArray, against: References, mesh: Lines
) -> SpecLoss | None:
    """The largest loss of a field (Nh, Ns); None where nothing was held against anything."""
    at = worst(field)
    if at is None:
        return None
    return SpecLoss(
        held.quantity, held.sense, "limit" if against.limits[at] else "design", float(field[at]), float(values[at]),
        float(against.values[at]), mesh.altitude[at[0]], mesh.speed[at[1]],
    )  # fmt: skip


def largest_gain_errors(names: Sequence[str], errors: FloatArray, mesh: Lines) -> tuple[GainError, ...]:
    """Of each gain, from errors (Nh, Ns, g)."""
    found = []
    for k, name in enumerate(names):
        at = worst(errors[..., k])
        if at is not None:
            found.append(GainError(name, float(errors[(*at, k)]), mesh.altitude[at[0]], mesh.speed[at[1]]))
    return tuple(found)
