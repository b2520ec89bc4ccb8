"""Weights that were searched, on the wire: each point beside the controller's own weights."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.gains import Gain
from design.lqr.torque_loop import gains
from design.lqr.weight_request import UNITS
from design.lqr.weight_search import WeightsFound
from design.lqr.weight_tradeoff import TradeOff
from design.outcome import Outcomes
from model.arrays import FloatArray
from model.flight import FlightGrid
from service.presenters.grid import coordinates, grid_document, grid_index
from service.presenters.infeasibility import infeasibility_document
from service.to_domain.weight_search_of import WIRE_NAMES, SoughtWeights
from service.wire.spec_names import spec_field

#: Values of the specs (*G, s), and what is minimised (*G,), with the controller's own weights.
Figures = tuple[FloatArray, FloatArray]


def weight_search_document(
    sought: SoughtWeights, found: WeightsFound, own: Figures, common: bool, exchange: bool
) -> dict[str, Any]:
    """What was found at each point that was looked at; one set of weights also as the controller that has them."""
    grid, minimised = sought.feedback.envelope.plant.grid, found.search.minimised
    named, index_of = gains(found.design), {point: grid_index(grid, point) for point in sought.points}
    found_at = [index for index in index_of.values() if found.outcomes.ok[index]]
    controller = None
    if found_at and (common or len(index_of) == 1):
        controller = sought.entry | {"weights": sought.weights(found.maxima[found_at[0]])}
    return {
        **_head(sought),
        "minimised": {"quantity": minimised, "unit": UNITS[minimised]},
        "common": common,
        "exchange": exchange,
        "points": [_at_point(sought, found, point, index, own, named) for point, index in index_of.items()],
        "controller": controller,
    }


def trade_off_document(sought: SoughtWeights, found: TradeOff, own: Figures) -> dict[str, Any]:
    """The fronts of the points that were looked at, and what the controller's own weights cost."""
    grid, (values, torque) = sought.feedback.envelope.plant.grid, own
    time = values[..., [spec.quantity for spec in found.search.specs].index("settling_time")]
    points = []
    for point in sought.points:
        index = grid_index(grid, point)
        before = {"settling_time_s": float(time[index]), "peak_aileron_torque_n_m": float(torque[index])}
        place = _place(grid, found.outcomes, point, index)
        points.append({**place, "before": before, "front": _front(sought, found, index)})
    return {**_head(sought), "points": points}


def _head(sought: SoughtWeights) -> dict[str, Any]:
    search, feedback = sought.search, sought.feedback
    aileron, tab = (float(np.rad2deg(size)) for size in (search.step.aileron, search.step.tab))
    return {
        "name": feedback.request.name,
        "kind": feedback.request.kind,
        "step": {"aileron_deg": aileron, "tab_deg": tab, "duration_s": search.step.duration},
        "grid": grid_document(feedback.envelope.plant.grid),
        "searched": [WIRE_NAMES[name] for name in search.searched],
        "span": search.span,
        "before": sought.entry["weights"],
    }


def _place(grid: FlightGrid, outcomes: Outcomes, point: int, index: tuple[int, ...]) -> dict[str, Any]:
    return {
        "index": point,
        "coordinates": coordinates(grid, index),
        "outcome": outcomes.codes[index],
        "reason": outcomes.reasons[index],
    }


def _at_point(
    sought: SoughtWeights,
    found: WeightsFound,
    point: int,
    index: tuple[int, ...],
    own: Figures,
    named: tuple[Gain, ...],
) -> dict[str, Any]:
    ok, why = found.outcomes.ok[index], found.infeasible[index]
    before, after = float(own[1][index]), float(found.minimised[index])
    saved = 100.0 * (1.0 - after / before) if before > 0.0 else None
    return {
        **_place(sought.feedback.envelope.plant.grid, found.outcomes, point, index),
        "infeasibility": None if why is None else infeasibility_document(why),
        "weights": sought.weights(found.maxima[index]) if ok else None,
        "gains": [{"name": gain.name, "unit": gain.unit, "value": float(gain.values[index])} for gain in named],
        "minimised": {"before": before, "after": after, "saved_percent": saved},
        "specs": _specs(sought, found, index, own[0][index]),
    }


def _specs(sought: SoughtWeights, found: WeightsFound, index: tuple[int, ...], own: FloatArray) -> list[dict[str, Any]]:
    documents = []
    for spec, before, after in zip(found.search.specs, own, found.achieved[index], strict=True):
        field = spec_field(spec.quantity, spec.sense)
        documents.append(
            {
                "spec": field.name,
                "unit": field.unit,
                "source": spec.source,
                "limit": field.limit_at(spec, index),
                "before": field.value(float(before)),
                "before_passed": bool(spec.take(index).met(before)) if sought.own[index] else None,
                "after": field.value(float(after)),
            }
        )
    return documents


def _front(sought: SoughtWeights, found: TradeOff, index: tuple[int, ...]) -> list[dict[str, Any]]:
    """The places that there are, the fastest first."""
    return [
        {
            "allowed_s": float(found.limit[index][k]),
            "settling_time_s": float(found.settling_time[index][k]),
            "peak_aileron_torque_n_m": float(found.aileron_torque[index][k]),
            "weights": sought.weights(found.maxima[index][k]),
        }
        for k in np.flatnonzero(np.isfinite(found.settling_time[index]))
    ]
