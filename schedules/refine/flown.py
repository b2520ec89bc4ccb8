"""Gains that are read between the lines, flown at the points of a mesh and judged there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from design.assess import achieved
from design.classical.controller import ClassicalController
from design.classical.tab_loop import tab_loop
from design.estimation.rate_filters import with_rate_filters
from design.loop import Loop
from design.lqr.flown import flown_loop
from design.lqr.measurement import KalmanMeasurement, RateFilters
from model.arrays import FloatArray
from model.linear_model import INPUTS, LinearModel
from model.servo_tab import servo_tab
from schedules.analysis import PlantEnvelope, analyse
from schedules.flown_figures import MARGIN_QUANTITIES, STEP_QUANTITIES, Flight, figures_of
from schedules.judging import figures_at, horizon
from schedules.refine.lines import Lines
from schedules.refine.study_on import study_on
from schedules.study import Controller, Study

_STEP, _MARGINS = frozenset(STEP_QUANTITIES), frozenset(MARGIN_QUANTITIES)
#: Figures that do not need a whole assessment.
_QUICK = frozenset({"damping_ratio"}) | _STEP | _MARGINS


def refuse_unflown(request: Controller) -> None:
    """Refuse a controller whose gains cannot be read away from their points.

    Raises
    ------
    ValueError : a sampled state feedback, or one of estimates
    """
    if isinstance(request, ClassicalController):
        return
    if request.sampling is not None or isinstance(request.measurement, KalmanMeasurement):
        raise ValueError(
            f"controller {request.name} runs as code, or a model of its own point: only state feedback of measured "
            "states or filtered rates is flown away from its point"
        )


@dataclass(eq=False)
class Meshes:
    """Plants on meshes, those trimmed and linearised so far kept; and any gains flown on them.

    Attributes
    ----------
    study : the study
    request : the controller
    """

    study: Study
    request: Controller
    _known: dict[Lines, tuple[Study, PlantEnvelope]] = field(default_factory=dict)

    def at(self, mesh: Lines) -> tuple[Study, PlantEnvelope]:
        """The study on a mesh and its plant."""
        if mesh not in self._known:
            study = study_on(self.study, self.request, mesh)
            self._known[mesh] = study, analyse(study)
        return self._known[mesh]

    def figures(
        self, mesh: Lines, names: Sequence[str], gains: FloatArray, quantities: Sequence[str]
    ) -> dict[str, FloatArray]:
        """Figures (Nh, Ns) by quantity, of gains (Nh, Ns, g) flown on a mesh.

        nan where a gain or the plant does not exist, and of a loop that cannot be judged. Quantities that the loop does
        not have are left out.
        """
        study, plant = self.at(mesh)
        flown = plant.outcomes.ok & np.isfinite(gains).all(axis=-1)
        found: dict[str, FloatArray] = {}
        if not np.any(flown):
            return found
        table = {name: gains[flown][:, k] for k, name in enumerate(names)}
        loop = flown_with(study, plant.model.take(flown), self.request, table)
        for name, values in _figures(study, self.request, loop, quantities).items():
            found[name] = np.full(flown.shape, np.nan)
            found[name][flown] = values
        return found


def flown_with(study: Study, model: LinearModel, request: Controller, gains: dict[str, FloatArray]) -> Loop:
    """The loop of a controller with any gains (N,) by name around plants (N,), as it is assembled at a design point.

    Parameters
    ----------
    request : one that `refuse_unflown` takes
    """
    if isinstance(request, ClassicalController):
        return tab_loop(model, servo_tab(model), study.tab_actuator, request, gains)
    structure = request.structure(study.tab_actuator, study.aileron_actuator)
    states, N = structure.states(model.states), np.zeros((len(model.A), len(INPUTS), len(structure.references)))
    K = np.stack([np.stack([gains[f"K_{u}_{x}"] for x in states], axis=-1) for u in INPUTS], axis=-2)
    for i, u in enumerate(INPUTS):
        for j, r in enumerate(structure.references):
            N[:, i, j] = gains[f"N_{u}_{r}"]
    loop = flown_loop(model, structure, K, N)
    measured = request.measurement
    return with_rate_filters(loop, measured.cutoff) if isinstance(measured, RateFilters) else loop


def _figures(study: Study, request: Controller, loop: Loop, quantities: Sequence[str]) -> dict[str, FloatArray]:
    """Figures (N,) of loops (N,) by quantity; nan of a loop whose numbers cannot be judged."""
    if set(quantities) <= _QUICK and request.sampling is None and not any(loop.delay):
        flight = Flight(
            study.reference.aileron, horizon(study, request), not _STEP.isdisjoint(quantities),
            not _MARGINS.isdisjoint(quantities),
        )  # fmt: skip
        quick = figures_of(loop, flight)
        return {name: getattr(quick, name) for name in quantities}
    return _assessed(study, request, loop, quantities)


def _assessed(study: Study, request: Controller, loop: Loop, quantities: Sequence[str]) -> dict[str, FloatArray]:
    """The same by `design.assess`, which knows all of them, in as few batches as numbers allow."""
    count = len(loop.A)
    assessment = figures_at(study, request, loop, np.ones(count, dtype=bool))
    if assessment is not None:
        known = {name: achieved(assessment, name) for name in quantities}
        return {name: values for name, values in known.items() if values is not None}
    if count == 1:
        return {name: np.full(1, np.nan) for name in quantities}
    halves = [_assessed(study, request, loop.take(h), quantities) for h in (slice(count // 2), slice(count // 2, None))]
    return {
        name: np.concatenate([half[name] for half in halves]) for name in quantities if all(name in h for h in halves)
    }
