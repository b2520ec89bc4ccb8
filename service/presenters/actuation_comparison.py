"""Controllers of a design side by side on the wire: what each asks of both actuators, and over the reference's rate."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.arrays import BoolArray, FloatArray, IntArray
from schedules.actuation_comparison import Actuation
from schedules.designed import DesignedController, DesignedEnvelope
from service.presenters.grid import grid_document, outcome_documents
from service.presenters.requirements import reference_document

#: Field on the wire -> attribute of `Actuation`, how many of its unit make one inside, and why it may not exist.
_UNLIMITED = "unlimited"
_FIGURES: dict[str, tuple[str, float, str]] = {
    "aileron_peak_torque_n_m": ("aileron_peak_torque", 1.0, _UNLIMITED),
    "tab_held_peak_torque_n_m": ("tab_held_peak_torque", 1.0, _UNLIMITED),
    "tab_peak_torque_n_m": ("tab_peak_torque", 1.0, "unlimited: the tab's actuator is ideal"),
    "tab_peak_rate_deg_s": ("tab_peak_rate", float(np.rad2deg(1.0)), "unlimited: the tab's angle jumps"),
    "tab_peak_deflection_deg": ("tab_peak_deflection", float(np.rad2deg(1.0)), _UNLIMITED),
    "settling_time_s": ("settling_time", 1.0, "the aileron does not settle within the time it is followed"),
    "overshoot_percent": ("overshoot", 100.0, "the aileron does not change in the end"),
}
_SAVED = "torque_saved_percent"
_NOTHING_TO_SAVE = "no torque is needed, or what is needed is not known"


def comparison_document(
    envelope: DesignedEnvelope, rates: FloatArray, controllers: list[dict[str, Any]]
) -> dict[str, Any]:
    """All controllers of the design over rates (R,) [rad/s]."""
    study = envelope.study
    return {
        **reference_document(study.reference, study.reference.duration),
        "rate_limit_deg_s": np.rad2deg(rates),
        "grid": grid_document(envelope.plant.grid),
        "controllers": controllers,
    }


def left_out_document(controller: DesignedController, reason: str) -> dict[str, Any]:
    """A controller that has no place in the comparison."""
    nothing = dict.fromkeys(("step", "envelope", "curves"))
    return _head(controller) | {"reason": reason} | nothing | {"missing": []}


def compared_document(
    controller: DesignedController, step: Actuation, curves: Actuation, rates: FloatArray
) -> dict[str, Any]:
    """A controller: figures (*G,) of the step, their worst, and curves (*G, R) over the rates (R,) [rad/s]."""
    ok = controller.outcomes.ok
    over_grid, over_rates = _wire(step), _wire(curves)
    each = [curves.take((..., r)) for r in range(len(rates))]
    return _head(controller) | {
        "reason": None,
        "step": over_grid,
        "envelope": _envelope(step, over_grid),
        "curves": {
            "envelope": {
                **{name: [_worst(values[..., r]) for r in range(len(rates))] for name, values in _maxima(over_rates)},
                _SAVED: [_saved_of_the_envelope(one) for one in each],
            },
            "points": over_rates,
        },
        "missing": [
            *_missing(over_grid, ok, None),
            *(
                gap
                for r, rate in enumerate(np.rad2deg(rates).tolist())
                for gap in _missing({name: values[..., r] for name, values in over_rates.items()}, ok, rate)
            ),
        ],
    }


def _head(controller: DesignedController) -> dict[str, Any]:
    return {
        "name": controller.request.name,
        "kind": controller.request.kind,
        **outcome_documents(controller.outcomes),
    }


def _wire(figures: Actuation) -> dict[str, FloatArray]:
    shown = {name: getattr(figures, attribute) * size for name, (attribute, size, _) in _FIGURES.items()}
    return shown | {_SAVED: 100.0 * figures.saving.saved}


def _envelope(figures: Actuation, over_grid: dict[str, FloatArray]) -> dict[str, Any]:
    worst = {name: _worst(values) for name, values in _maxima(over_grid)}
    return worst | {_SAVED: _saved_of_the_envelope(figures)}


def _maxima(shown: dict[str, FloatArray]) -> list[tuple[str, FloatArray]]:
    """The figures whose largest value is the worst."""
    return [(name, values) for name, values in shown.items() if name != _SAVED]


def _worst(values: FloatArray) -> dict[str, Any]:
    """Largest value, unlimited ones included, and its flat point; null where no point has one."""
    known: IntArray = np.flatnonzero(~np.isnan(values))
    if known.size == 0:
        return {"value": None, "point": None}
    point = int(known[np.argmax(values.flat[known])])
    return {"value": float(values.flat[point]), "point": point}


def _saved_of_the_envelope(figures: Actuation) -> float | None:
    saved = figures.saving.saved_of_the_envelope
    return None if saved is None else 100.0 * saved


def _missing(shown: dict[str, FloatArray], ok: BoolArray, rate_deg_s: float | None) -> list[dict[str, Any]]:
    """Points with a design at which a figure (*G,) does not exist, and why; none of the figures that all have."""
    found = []
    for name, values in shown.items():
        points = np.flatnonzero(ok & ~np.isfinite(values))
        if points.size:
            reason = _NOTHING_TO_SAVE if name == _SAVED else _FIGURES[name][2]
            found.append({"figure": name, "rate_limit_deg_s": rate_deg_s, "points": points, "reason": reason})
    return found
