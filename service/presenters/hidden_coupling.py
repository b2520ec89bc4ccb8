"""Hidden coupling on the wire: growth and deviations per unit of the scheduling variable's rate, both placements."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.arrays import ComplexArray, FloatArray
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.hidden_coupling import HiddenCoupling, PlacedCoupling
from schedules.moving_loop import SPEED
from schedules.rules import INTERPOLATIONS, OUTS_OF_RANGE
from schedules.schedule import GainSchedule
from schedules.wire_names import axis_name
from service.presenters.cross_flight import flown_head

SIDES = ("below", "above")
#: Peaks below this are what rounding leaves of none [rad s per unit of the axis].
NOTHING = 1e-15


def hidden_coupling_document(
    envelope: DesignedEnvelope,
    controller: DesignedController,
    schedule: GainSchedule,
    found: HiddenCoupling,
    point: tuple[int, ...] | None,
) -> dict[str, Any]:
    """What a moving scheduling variable does; linearised loops at a point (grid index) where one is asked for."""
    axis = schedule.axes[SPEED]
    rate = f"({axis.unit}/s)"
    return {
        **flown_head(envelope, controller),
        "scheduling_variable": axis_name(axis),
        "signal_lag_s": found.signal_lag,
        "rule": INTERPOLATIONS[schedule.rules.interpolation],
        "out_of_range": OUTS_OF_RANGE[schedule.rules.out_of_range],
        "sides": list(SIDES),
        "states": list(found.states),
        "eigenvalues": _complex(found.eigenvalues),
        "units": {"growth": f"1/s per {rate}", "deviation": f"deg per {rate}"},
        **{name: _placed(placed) for name, placed in found.placed.items()},
        "comparison": _comparison(found.before_gain.peak, found.after_gain.peak),
        "linearised": None if point is None else _linearised(found, point),
    }


def _placed(placed: PlacedCoupling) -> dict[str, Any]:
    return {
        "growth": _complex(placed.rate_shift),
        "settled": np.rad2deg(placed.settled),
        "peak": np.rad2deg(placed.peak),
        "worst": _worst(placed.peak),
    }


def _complex(values: ComplexArray) -> ComplexArray:
    """The same numbers, complex also where all of them happen to be real."""
    return np.asarray(values, dtype=complex)


def _worst(peak: FloatArray) -> dict[str, Any] | None:
    if not np.any(np.isfinite(peak)):
        return None
    point, side = divmod(int(np.nanargmax(peak)), len(SIDES))
    return {"point": point, "side": SIDES[side], "peak": float(np.rad2deg(np.nanmax(peak)))}


def _comparison(before: FloatArray, after: FloatArray) -> dict[str, Any]:
    known = np.isfinite(before) & np.isfinite(after)
    nothing = known & (before < NOTHING) & (after < NOTHING)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(known & ~nothing, after / before, np.nan)
    alike = nothing | (np.abs(ratio - 1.0) <= 0.01)
    return {
        "peak_ratio": ratio,
        "smaller_after_gain": int(np.count_nonzero(~alike & (ratio < 1.0))),
        "smaller_before_gain": int(np.count_nonzero(~alike & (ratio > 1.0))),
        "alike": int(np.count_nonzero(alike)),
    }


def _linearised(found: HiddenCoupling, point: tuple[int, ...]) -> list[dict[str, Any]]:
    states = [*found.states, *(["scheduling_signal"] if found.signal_lag > 0.0 else [])]
    return [
        {"placement": name, "side": side, "states": states, "A": placed.A[point][k], "B": placed.B[point][k]}
        for name, placed in found.placed.items()
        for k, side in enumerate(SIDES)
    ]
