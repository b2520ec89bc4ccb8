"""From a question about weights to the search of the domain: which controller, points, specs and weights."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import degrees
from typing import Any

import numpy as np
import orjson
from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from design.assess import limit_specs
from design.lqr.controller import LqrController
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights, ReferenceStep
from design.lqr.step_figures import step_figures
from design.lqr.weight_request import Minimised, WeightSearch
from design.lqr.weights import BrysonWeights
from design.outcome import Outcome, Outcomes
from design.specs import Spec
from model.actuators import Actuator
from model.arrays import BoolArray, FloatArray
from schedules.study import Study
from schedules.wire_names import axis_name
from service.schemas import weights
from service.schemas.grid_values import GridAxes, fields_on_grid
from service.schemas.weight_search_requests import SearchRequest, SoughtSpecs
from service.studies.state_feedback import StateFeedback
from service.to_domain.study_of import over_grid
from service.wire.refusals import FieldRefusal, InvalidRequest, StudyNotPossible
from service.wire.spec_names import SPEC_FIELDS

#: Weight of Bryson's rule -> its field on the wire. Those that end in ``_n_m`` are torques, the others angles.
WIRE_NAMES: dict[str, str] = {
    "aileron": "aileron_deg",
    "aileron_rate": "aileron_rate_deg_s",
    "tab": "tab_deg",
    "tab_rate": "tab_rate_deg_s",
    "aileron_integral": "aileron_integral_deg_s",
    "tab_integral": "tab_integral_deg_s",
    "tab_torque": "tab_torque_n_m",
    "aileron_torque": "aileron_torque_n_m",
}
#: The weight that is not searched unless it is named: the others are sought relative to it.
SCALE = "tab_torque"


@dataclass(frozen=True, eq=False)
class SoughtWeights:
    """A question about weights, in terms of the domain.

    Attributes
    ----------
    feedback : the controller, and the design that it is of
    entry : the controller as the stored request of the design has it
    start : the weights that the search starts from, by their fields there
    search : what is asked for
    points : flat indices of the points that are looked at
    outcomes : (*G,) of the plant, the other points excluded
    """

    feedback: StateFeedback
    entry: dict[str, Any]
    start: dict[str, Any]
    search: WeightSearch
    points: list[int]
    outcomes: Outcomes

    @property
    def count(self) -> int:
        """Points that are looked at and have a model."""
        return int(self.outcomes.ok.sum())

    @property
    def actuators(self) -> tuple[Actuator, Actuator]:
        """Those of tab and aileron."""
        study = self.feedback.envelope.study
        return study.tab_actuator, study.aileron_actuator

    @property
    def own(self) -> BoolArray:
        """(*G,) points that are looked at where the controller has gains of its own."""
        return np.asarray(self.outcomes.ok & self.feedback.controller.outcomes.ok)

    def weights(self, maxima: FloatArray) -> dict[str, Any]:
        """Weights by Bryson's rule as a request has them, of largest acceptable values in the order of the search."""
        found = dict(zip(self.search.names, map(float, maxima), strict=True))
        return self.start | {WIRE_NAMES[name]: _on_wire(name, found[name]) for name in self.search.searched}

    def own_figures(self) -> tuple[FloatArray, FloatArray]:
        """What the controller's own gains lead to: values of the specs (*G, s) and what is minimised (*G,).

        nan where it has no gains, and at the points that are not looked at.
        """
        search, ok = self.search, self.own
        values, least = np.full((*ok.shape, len(search.specs)), np.nan), np.full(ok.shape, np.nan)
        if ok.any():
            loop = self.feedback.loop.take(ok)
            values[ok], least[ok] = step_figures(loop, search.specs, search.minimised, search.step)
        return values, least


def sought_weights(
    feedback: StateFeedback, stored: bytes, wanted: SearchRequest, minimised: Minimised
) -> SoughtWeights:
    """The search that is asked for of a controller of a design whose request is stored as these bytes.

    Raises
    ------
    StudyNotPossible : the controller follows no reference, or its weights are not by Bryson's rule
    InvalidRequest : points that the grid does not have, values that do not fit it, weights that are not there
    """
    envelope, controller = feedback.envelope, _by_bryson(feedback.request)
    study, grid = envelope.study, envelope.plant.grid
    (entry,) = [one for one in orjson.loads(stored)["controllers"] if one["name"] == controller.name]
    start: dict[str, Any] = entry["weights"].get("base", entry["weights"])
    searched = _searched(wanted, start)
    _check_span(wanted.span, start, searched)
    first, second = (axis_name(axis) for axis in grid.axes)
    axes = GridAxes((first, second), (grid.shape[0], grid.shape[1]))
    search = WeightSearch(
        controller=controller,
        specs=_specs(wanted, axes, study),
        step=ReferenceStep(
            study.reference.aileron,
            study.reference.duration,
            study.reference.tab if controller.reference == "aileron_and_tab" else 0.0,
        ),
        minimised=minimised,
        searched=searched,
        span=wanted.span,
    )
    points = _points(wanted.points, envelope.plant.outcomes.codes.size)
    left_out = np.full(grid.shape, True)
    left_out.flat[points] = False
    outcomes = envelope.plant.outcomes.failing(
        left_out, Outcome.EXCLUDED, lambda index: "not among the points asked for"
    )
    return SoughtWeights(feedback, entry, start, search, points, outcomes)


def _on_wire(name: str, value: float) -> float:
    return value if WIRE_NAMES[name].endswith("_n_m") else degrees(value)


def _by_bryson(asked: LqrController) -> LqrController:
    """The controller with its weights without regard to power, which a search starts from."""
    plain = asked.weights.base if isinstance(asked.weights, NetWorkWeights | PowerBalancedWeights) else asked.weights
    if not isinstance(plain, BrysonWeights):
        raise StudyNotPossible(
            f"the weights of the controller {asked.name}, without regard to power, are not by Bryson's rule: there are "
            "none to start a search from"
        )
    if asked.reference == "none":
        raise StudyNotPossible(
            f"the controller {asked.name} follows no reference: there is no step to search weights on"
        )
    return replace(asked, weights=plain)


def _searched(wanted: SearchRequest, start: dict[str, Any]) -> tuple[str, ...]:
    """Weights that are searched, of those that the controller has."""
    known = {field: name for name, field in WIRE_NAMES.items() if start.get(field) is not None}
    if wanted.searched is None:
        return tuple(name for name in known.values() if name != SCALE)
    for place, field in enumerate(wanted.searched):
        if field not in known:
            raise _refused(
                f"/searched/{place}", f"the controller has no weight {field}", None, f"one of {', '.join(known)}"
            )
        if field in wanted.searched[:place]:
            raise _refused(f"/searched/{place}", f"{field} is among the weights before", None, "each weight once")
    return tuple(known[field] for field in wanted.searched)


def _check_span(span: float, start: dict[str, Any], searched: tuple[str, ...]) -> None:
    """Refuse a span that leads to weights which no request takes."""
    for factor in (1.0 / span, span):
        ends = start | {WIRE_NAMES[name]: factor * start[WIRE_NAMES[name]] for name in searched}
        try:
            weights.BrysonWeights.model_validate(ends)
        except ValidationError as error:
            (field, *_), allowed = error.errors()[0]["loc"], "a span within what the weight may be, or it not searched"
            detail = f"{field} would be sought as far as {ends[str(field)]:g}, which no request takes"
            raise _refused("/span", detail, "1", allowed) from None


def _points(asked: list[int] | None, size: int) -> list[int]:
    """Flat indices of the points that are looked at."""
    if asked is None:
        return list(range(size))
    seen: set[int] = set()
    for place, point in enumerate(asked):
        if point >= size:
            raise _refused(f"/points/{place}", f"the grid has no point {point}", None, f">= 0 and <= {size - 1}")
        if point in seen:
            raise _refused(f"/points/{place}", f"{point} is among the points before", None, "each point once")
        seen.add(point)
    return asked


def _specs(wanted: SearchRequest, axes: GridAxes, study: Study) -> tuple[Spec, ...]:
    """The specs asked for, and the actuators' limits; of one quantity the stricter."""
    specs = {
        spec.quantity: spec
        for name, limit in _on_grid(wanted.specs, axes)
        if limit is not None
        for spec in (SPEC_FIELDS[name].spec(over_grid(limit, axes)),)
    }
    if wanted.actuator_limits:
        for limit in limit_specs({"tab": study.tab_actuator, "aileron": study.aileron_actuator}):
            asked = specs.get(limit.quantity)
            if asked is None or np.all(np.asarray(limit.limit) <= asked.limit):
                specs[limit.quantity] = limit
            elif np.any(np.asarray(limit.limit) < asked.limit):
                specs[limit.quantity] = replace(asked, limit=np.minimum(asked.limit, limit.limit))
    return tuple(specs.values())


def _on_grid(specs: SoughtSpecs, axes: GridAxes) -> SoughtSpecs:
    """The specs, refused unless those that vary fit the grid."""
    try:
        return fields_on_grid(specs, axes, "/specs")
    except PydanticCustomError as error:
        said = error.context or {}
        pointer = str(said["at"]).replace("/object", "")
        raise _refused(
            pointer, str(said["detail"]), SPEC_FIELDS[pointer.split("/")[2]].unit, str(said["allowed"])
        ) from None


def _refused(pointer: str, detail: str, unit: str | None, allowed: str) -> InvalidRequest:
    return InvalidRequest(f"{pointer}: {detail}", FieldRefusal(pointer, detail, unit, allowed))
