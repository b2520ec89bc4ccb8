"""Hinge moments on the wire."""

from __future__ import annotations

from typing import Any

from model.hinge_moments.expansion import HingeMoments, HingeMomentSource
from model.hinge_moments.fit_report import FitError
from model.hinge_moments.interpolant import GridInterpolant
from model.hinge_moments.taylor import TaylorExpansion


def derivatives(moments: HingeMoments) -> dict[str, Any]:
    """Coefficient and derivatives of each surface at one point; rows [tab, aileron], columns (alpha, dt, da)."""
    document: dict[str, float] = {}
    for row, surface in ((1, "a"), (0, "t")):
        alpha, dt, da = moments.gradient[row].tolist()
        document |= {
            f"C_H{surface}_0": float(moments.value[row]),
            f"C_H{surface}_alpha": alpha,
            f"C_H{surface}_da": da,
            f"C_H{surface}_dt": dt,
        }
    return document


def fit_document(source: HingeMomentSource) -> dict[str, Any] | None:
    """How well a fitted source represents its table; None for a source that was not fitted."""
    if not isinstance(source, TaylorExpansion | GridInterpolant):
        return None
    report, count = source.report, source.report.count
    return {
        "method": source.kind if isinstance(source, GridInterpolant) else "taylor",
        "errors": report.kind,
        "C_Ha": _error(report.C_Ha),
        "C_Ht": _error(report.C_Ht),
        "rows": {
            "given": count.given,
            "used": report.rows_used,
            "outside_window": report.rows_outside_window,
            "dropped": count.without_coefficients,
            "averaged": count.merged,
            "C_Ha_disagreement": count.C_Ha_disagreement,
            "C_Ht_disagreement": count.C_Ht_disagreement,
        },
        "domain": source.domain,
        "notes": list(report.notes),
    }


def _error(error: FitError) -> dict[str, float]:
    return {
        "max": error.largest,
        "rms": error.rms,
        "range": error.value_range,
        "max_percent_of_range": error.percent_of_range,
        "rms_percent_of_range": error.rms_percent_of_range,
    }
