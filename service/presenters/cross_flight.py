"""Every point's design flown at every other point, on the wire."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from design.specs import Spec
from model.arrays import BoolArray, FloatArray, ObjectArray
from schedules.cross_flight import CrossFlight
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.flown_figures import FlownFigures
from schedules.judging import horizon
from schedules.robust_performance import Quantity
from service.presenters.grid import grid_document, outcome_documents
from service.presenters.requirements import reference_document
from service.wire.spec_names import spec_field

#: Field on the wire -> attribute of `FlownFigures`, what one unit of it is on the wire, and the wire's unit.
FIGURES: dict[str, tuple[Quantity, float, str]] = {
    "damping_ratio": ("damping_ratio", 1.0, "1"),
    "largest_real_part": ("largest_real_part", 1.0, "1/s"),
    "settling_time_s": ("settling_time", 1.0, "s"),
    "overshoot_percent": ("overshoot", 100.0, "%"),
}
MARGINS: dict[str, tuple[Quantity, float, str]] = {
    "gain_margin_db": ("gain_margin", 1.0, "dB"),
    "phase_margin_deg": ("phase_margin", 180.0 / np.pi, "deg"),
    "delay_margin_s": ("delay_margin", 1.0, "s"),
    "disk_margin": ("disk_margin", 1.0, "1"),
}
NOTHING_FLOWN = "no point carries a design"


def cross_flight_document(
    envelope: DesignedEnvelope,
    controller: DesignedController,
    found: CrossFlight,
    left_out: Sequence[Spec],
    margins: bool,
) -> dict[str, Any]:
    """The pairs as matrices [design][flown] over flat points, and what they come to for each design.

    Parameters
    ----------
    envelope, controller : whose designs are flown
    found : what came of it
    left_out : specs that were not judged
    margins : whether margins are shown
    """
    ok, plant = controller.outcomes.ok, envelope.plant.outcomes
    square = (ok.size, ok.size)
    flown = found.flown.reshape(square)
    not_flown = np.where(ok.reshape(-1, 1), "outside_model", "no_design")
    outcomes = np.where(flown, flown_outcomes(found.figures).reshape(square), not_flown).astype(object)
    figures = {name: _wire(found.figures, name).reshape(square) for name in FIGURES}
    return {
        **flown_head(envelope, controller),
        "plant_outcomes": plant.codes,
        "plant_reasons": plant.reasons,
        "specs": spec_documents(found.specs, left_out),
        "points_flown": only_where(ok, found.points_flown),
        "points_held": only_where(ok, found.points_held),
        "worst_damping_ratio": found.worst_damping_ratio,
        "best": _best(found),
        "worst_pair": _worst_pair(found, outcomes, figures),
        "reason": None if flown.any() else NOTHING_FLOWN,
        "pairs": {
            "outcomes": outcomes,
            "stable": only_where(flown, found.figures.stable.reshape(square)),
            "held": only_where(flown, found.held.reshape(square)),
            **figures,
            "margins": {name: _wire(found.figures, name).reshape(square) for name in MARGINS} if margins else None,
        },
    }


def flown_head(envelope: DesignedEnvelope, controller: DesignedController) -> dict[str, Any]:
    """Whose gains are flown, over which grid, and the step that they are flown with."""
    study = envelope.study
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        **reference_document(study.reference, horizon(study, controller.request)),
        "grid": grid_document(envelope.plant.grid),
        **outcome_documents(controller.outcomes),
    }


def spec_documents(judged: Sequence[Spec], left_out: Sequence[Spec]) -> list[dict[str, Any]]:
    """Specs that held loops meet, and those that are not known of a loop away from its design."""
    return [_spec(spec, None) for spec in judged] + [
        _spec(spec, f"{spec.quantity} is not judged away from the design") for spec in left_out
    ]


def _spec(spec: Spec, reason: str | None) -> dict[str, Any]:
    field = spec_field(spec.quantity, spec.sense)
    return {
        "spec": field.name,
        "limit": field.limit(spec),
        "unit": field.unit,
        "source": spec.source,
        "judged": reason is None,
        "reason": reason,
    }


def flown_outcomes(figures: FlownFigures) -> ObjectArray:
    """What became of each loop (*S,): the first reason why one of its figures does not exist, or ``ok``."""
    return np.select(
        [
            np.isnan(figures.largest_real_part) | np.isnan(figures.damping_ratio),
            ~figures.stable,
            np.isnan(figures.overshoot),
            np.isnan(figures.settling_time),
        ],
        ["unproved", "unstable", "no_step", "not_settled"],
        "ok",
    ).astype(object)


def only_where(mask: BoolArray, values: Any) -> ObjectArray:
    """The values where the mask is, None elsewhere."""
    shown = np.full(mask.shape, None, dtype=object)
    shown[mask] = values[mask]
    return shown


def _wire(figures: FlownFigures, name: str) -> FloatArray:
    attribute, scale, _ = (FIGURES | MARGINS)[name]
    values: FloatArray = getattr(figures, attribute)
    return values * scale


def _best(found: CrossFlight) -> dict[str, Any] | None:
    point = found.best
    if point is None:
        return None
    return {
        "point": point,
        "points_held": int(found.points_held.flat[point]),
        "points_flown": int(found.points_flown.flat[point]),
        "worst_damping_ratio": float(found.worst_damping_ratio.flat[point]),
    }


def _worst_pair(found: CrossFlight, outcomes: ObjectArray, figures: dict[str, FloatArray]) -> dict[str, Any] | None:
    pair = found.worst_pair
    if pair is None:
        return None
    values = {name: float(of_pairs[pair]) for name, of_pairs in figures.items()}
    return {"design": pair[0], "flown": pair[1], "outcome": outcomes[pair], **values}
