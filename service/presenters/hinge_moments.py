"""Hinge moments on the wire."""

from __future__ import annotations

from typing import Any

from model.hinge_moments.expansion import HingeMoments


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
