"""Sample times that were tried, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.lqr.sample_time_sweep import SampleTimeSweep, SweptWay
from design.lqr.sample_time_trials import SampleTimeTrials
from design.specs import QUANTITIES, Spec
from service.wire.spec_names import SpecField, spec_field

#: Figures that are no quantity of a spec have no unit.
_RADIUS = "spectral_radius"


def sweep_document(found: SampleTimeSweep, specs: tuple[Spec, ...]) -> dict[str, Any]:
    """Specs and both ways, of points (N,) in one row; the limits of the specs are theirs."""
    points = len(found.redesigned.counted)
    return {
        "specs": [_spec(spec, points) for spec in specs],
        "redesigned": _way(found.redesigned),
        "emulated": _way(found.emulated),
    }


def _spec(spec: Spec, points: int) -> dict[str, Any]:
    field = spec_field(spec.quantity, spec.sense)
    whole = Spec(spec.quantity, spec.sense, np.broadcast_to(np.asarray(spec.limit, dtype=float), points))
    limits = [field.limit_at(whole, (i,)) for i in range(points)]
    return {"spec": field.name, "unit": field.unit, "limits": limits}


def _way(way: SweptWay) -> dict[str, Any]:
    by_point = way.by_point
    return {
        "slowest_s": by_point.slowest,
        "unbroken_s": by_point.unbroken,
        "limited": by_point.limited,
        "slowest_together_s": way.slowest_together,
        "unbroken_together_s": way.unbroken_together,
        "trials": [_trial(by_point, place, time) for place, time in enumerate(by_point.times)],
    }


def _trial(trials: SampleTimeTrials, place: int, time: float) -> dict[str, Any]:
    points = range(len(trials.tried))
    figures = {}
    for column, name in enumerate(trials.names):
        values = trials.figures[:, place, column]
        if name in QUANTITIES:
            field = spec_field(name, "min")
            figures[field.name.removesuffix("_min")] = values / field.scale
        else:
            figures[name] = values
    return {
        "sample_time_s": time,
        "tried": trials.tried[:, place],
        "passed": trials.passed[:, place],
        "reasons": [_reason(trials, point, place) for point in points],
        "figures": figures,
    }


def _reason(trials: SampleTimeTrials, point: int, place: int) -> str | None:
    """Why a time did not pass: the specs that are missed, in their units; or that there is no stable loop."""
    if not trials.figure(_RADIUS)[point, place] < 1.0:
        said: str | None = trials.reasons[point, place]
        return said
    missed = []
    for spec, met in zip(trials.specs, trials.met[point, place], strict=True):
        if not met:
            field = spec_field(spec.quantity, spec.sense)
            missed.append(_missed(field, field.value(float(trials.figure(spec.quantity)[point, place]))))
    return "; ".join(missed) or None


def _missed(field: SpecField, value: float) -> str:
    if np.isnan(value):
        return f"{field.name}: the value does not exist"
    unit = "" if field.unit == "1" else f" {field.unit}"
    return f"{field.name}: {value:.6g}{unit}"
