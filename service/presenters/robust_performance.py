"""Gains flown on plants that are off, on the wire: fractions, the worst and its plant, percentiles, influence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from design.specs import Spec
from model.arrays import BoolArray, FloatArray, ObjectArray
from schedules.case_statistics import Influence
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.flown_figures import FlownFigures
from schedules.perturbations import Cases, Uncertainty
from schedules.robust_performance import Quantity, RobustPerformance, least_fraction
from service.presenters.cross_flight import FIGURES, MARGINS, flown_head, flown_outcomes, only_where, spec_documents

#: Why a figure does not exist in a case, in words.
_WHY = {
    "unproved": "not proved stable",
    "unstable": "not stable",
    "no_step": "without a step to follow",
    "not_settled": "not settled in time",
}


@dataclass(frozen=True)
class Drawn:
    """How the plants were drawn.

    Attributes
    ----------
    seed, distribution : of the draws
    confidence : of what they say about all plants that could be drawn
    """

    seed: int
    distribution: Literal["uniform", "normal"]
    confidence: float


def robust_performance_document(
    envelope: DesignedEnvelope,
    controller: DesignedController,
    found: RobustPerformance,
    uncertainties: Sequence[Uncertainty],
    drawn: Drawn | None,
    left_out: Sequence[Spec],
    margins: bool,
) -> dict[str, Any]:
    """Fractions of the cases, and each figure over them, at every point.

    Parameters
    ----------
    envelope, controller : whose gains are flown
    found : what came of it
    uncertainties : what is off, and how far
    drawn : how the plants were drawn; None for corners
    left_out : specs that were not judged
    margins : whether margins are shown
    """
    confidence = None if drawn is None else drawn.confidence
    names = (*FIGURES, *MARGINS) if margins else tuple(FIGURES)
    row = _in_one_row(found)
    return {
        **flown_head(envelope, controller),
        "specs": spec_documents(found.specs, left_out),
        "method": "corners" if drawn is None else "monte_carlo",
        "cases": len(found.cases),
        "seed": None if drawn is None else drawn.seed,
        "distribution": None if drawn is None else drawn.distribution,
        "confidence": confidence,
        "parameters": [_parameter(uncertainty) for uncertainty in uncertainties],
        "stable": _fractions(found.stable_fraction, len(found.cases), confidence),
        "held": _fractions(found.held_fraction, len(found.cases), confidence),
        "everywhere": {
            "stable": _everywhere(found, found.stable_everywhere, confidence),
            "held": _everywhere(found, found.held_everywhere, confidence),
        },
        "figures": {name: _figure(found, row, name) for name in names},
    }


def _parameter(uncertainty: Uncertainty) -> dict[str, Any]:
    deviation = uncertainty.deviation
    return {
        "parameter": uncertainty.parameter,
        "change_percent": _percent(uncertainty.change),
        "deviation_percent": None if deviation is None else _percent(deviation),
    }


def _percent(part: float) -> float:
    """In per cent: turning 7 % to a part and back must not leave 7.000000000000001."""
    return float(f"{100.0 * part:.12g}")


def _fractions(part: FloatArray, cases: int, confidence: float | None) -> dict[str, Any]:
    return {"part": part, "at_least": None if confidence is None else least_fraction(part, cases, confidence)}


def _everywhere(found: RobustPerformance, met: BoolArray, confidence: float | None) -> dict[str, Any]:
    if not found.flown.any():
        return {"part": None, "at_least": None}
    of_all = _fractions(np.array(np.mean(met)), len(met), confidence)
    return {name: None if part is None else float(part) for name, part in of_all.items()}


def _figure(found: RobustPerformance, row: RobustPerformance | None, name: str) -> dict[str, Any]:
    """One figure over the cases, at every point."""
    attribute, scale, unit = (FIGURES | MARGINS)[name]
    over, influence = found.distribution(attribute), found.influence(attribute)
    return {
        "unit": unit,
        "nominal": getattr(found.nominal, attribute) * scale,
        "worst": over.worst * scale,
        "worst_case": only_where(found.flown, over.worst_case),
        "worst_factors": _by_parameter(found, over.worst_factors),
        "p05": over.p05 * scale,
        "p50": over.p50 * scale,
        "p95": over.p95 * scale,
        "reasons": _missing(found, attribute),
        "influence": _influence(found, attribute, influence, scale),
        "worst_of_all": _worst_of_all(found, row, attribute, scale),
    }


def _by_parameter(found: RobustPerformance, values: FloatArray) -> dict[str, FloatArray]:
    """Arrays over the grid by the name of the parameter, from (*G, k)."""
    return {name: values[..., k] for k, name in enumerate(found.cases.parameters)}


def _missing(found: RobustPerformance, attribute: str) -> ObjectArray:
    """In how many cases the figure does not exist at each point, and why; None where it does in all."""
    values, outcomes = getattr(found.figures, attribute), flown_outcomes(found.figures)
    reasons = np.full(found.flown.shape, None, dtype=object)
    for index in map(tuple, np.argwhere(found.flown)):
        codes, counts = np.unique(outcomes[index][np.isnan(values[index])].astype(str), return_counts=True)
        said = zip((_WHY.get(code, "without a value") for code in codes.tolist()), counts.tolist(), strict=True)
        reasons[index] = "; ".join(f"{words} in {count} of {len(found.cases)} cases" for words, count in said) or None
    return reasons


def _influence(found: RobustPerformance, attribute: str, influence: Influence, scale: float) -> dict[str, Any]:
    known = np.asarray(np.isfinite(influence.standardised).all(axis=-1))
    strongest = np.argmax(np.abs(np.where(known[..., None], influence.standardised, 0.0)), axis=-1)
    names = np.array(found.cases.parameters, dtype=object)
    return {
        "most_influential": only_where(known, names[strongest]),
        "explained": influence.explained,
        "standardised": _by_parameter(found, influence.standardised),
        "change_per_percent": _by_parameter(found, influence.slope * (scale / 100.0)),
        "reasons": _why_no_influence(found, attribute, influence, known),
    }


def _why_no_influence(found: RobustPerformance, attribute: str, influence: Influence, known: BoolArray) -> ObjectArray:
    fitted = np.isfinite(influence.slope).all(axis=-1)
    needed = len(found.cases.parameters) + 2
    enough = np.isfinite(getattr(found.figures, attribute)).sum(axis=-1) >= needed
    words = np.select(
        [~enough, ~fitted],
        [f"fewer than {needed} cases have a value", "the cases with a value do not tell the parameters apart"],
        "it does not change",
    )
    return only_where(found.flown & ~known, words)


def _in_one_row(found: RobustPerformance) -> RobustPerformance | None:
    """The cases of all points as those of one, point by point; None where there is none."""
    points, figures = int(found.flown.sum()), found.figures.take(found.flown)
    if not points:
        return None
    cases = Cases(found.cases.parameters, np.tile(found.cases.factors, (points, 1)))
    row = FlownFigures(*(getattr(figures, field.name).ravel() for field in fields(FlownFigures)))
    return replace(found, cases=cases, flown=np.array(True), figures=row)


def _worst_of_all(
    found: RobustPerformance, row: RobustPerformance | None, attribute: Quantity, scale: float
) -> dict[str, Any] | None:
    if row is None:
        return None
    over = row.distribution(attribute)
    place, case = divmod(int(over.worst_case), len(found.cases))
    return {
        "point": int(np.flatnonzero(found.flown)[place]),
        "case": case,
        "value": float(over.worst) * scale,
        "factors": dict(zip(found.cases.parameters, over.worst_factors.tolist(), strict=True)),
    }
