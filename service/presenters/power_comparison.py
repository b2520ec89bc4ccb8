"""Power weighed and not, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.lqr.power_comparison import PowerComparison, PoweredStep
from design.lqr.power_figures import PowerFigures
from design.lqr.retuning import Retuning
from model.arrays import FloatArray
from service.presenters.grid import outcome_documents


def comparison_document(found: PowerComparison, factors: Retuning) -> dict[str, Any]:
    """Figures of both steps over the grid, the factors between them, and the largest totals."""
    before, after = found.before.figures, found.after.figures
    both = np.isfinite(before.total) & np.isfinite(after.total)
    return {
        **outcome_documents(found.outcomes),
        "factors": {"tab": factors.tab, "aileron": factors.aileron, "integrals": factors.integrals},
        "before": _figures(before),
        "after": _figures(after),
        "total_ratio": found.total_ratio,
        "largest_total_power_w": {
            "before": _largest(np.where(both, before.total, np.nan)),
            "after": _largest(np.where(both, after.total, np.nan)),
        },
    }


def traces_document(found: PowerComparison, point: int) -> dict[str, Any]:
    """Both steps over time; `found` is that of one point."""
    return {
        "point": point,
        "time_s": found.after.time,
        "before": _trace(found.before) if np.isfinite(found.before.figures.total) else None,
        "after": _trace(found.after),
    }


def _figures(figures: PowerFigures) -> dict[str, FloatArray]:
    return {
        "tab_peak_power_w": figures.tab,
        "aileron_peak_power_w": figures.aileron,
        "total_peak_power_w": figures.total,
        "net_peak_power_w": figures.net,
        "settling_time_s": figures.settling_time,
        "overshoot_percent": 100.0 * figures.overshoot,
    }


def _largest(values: FloatArray) -> dict[str, Any]:
    """Largest value and its flat point; null when no point has one."""
    if np.all(np.isnan(values)):
        return {"value": None, "point": None}
    point = int(np.nanargmax(values))
    return {"value": float(values.flat[point]), "point": point}


def _trace(step: PoweredStep) -> dict[str, FloatArray]:
    return {
        "aileron_deg": np.rad2deg(step.aileron),
        "tab_deg": np.rad2deg(step.tab),
        "aileron_torque_n_m": step.aileron_torque,
        "tab_torque_n_m": step.tab_torque,
        "aileron_power_w": step.aileron_power,
        "tab_power_w": step.tab_power,
        "total_power_w": np.abs(step.aileron_power) + np.abs(step.tab_power),
    }
