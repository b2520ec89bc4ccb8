"""Margins against changes of both actuators at once, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.disturbance.loop_responses import loop_responses
from design.estimation.cut_margins import margins_of_cuts
from design.frequency.margins import Margins
from design.loop import Loop
from design.robustness.diagonal import structured_singular_value
from design.robustness.return_difference import smallest_return_difference
from design.robustness.simultaneous import SimultaneousMargins, simultaneous_margins
from model.arrays import FloatArray

_AT_INFINITY = "the worst is approached as the frequency grows"
_ANY = "no such change of both at once destabilises the loop"
#: Why a figure is null where it is infinite.
_INFINITE = {
    "disk_omega_rad_s": _AT_INFINITY,
    "return_difference_omega_rad_s": _AT_INFINITY,
    "sensitivity_peak_omega_rad_s": _AT_INFINITY,
    "complementary_peak_omega_rad_s": _AT_INFINITY,
    "gain_margin_up_db": _ANY,
    "gain_margin_down_db": _ANY,
    "complementary_margin": _ANY,
}
_NOT_SEARCHED = (
    "not found: without its delays the loop has a pole on the imaginary axis, or they are too long to be searched with"
)


def simultaneous_margins_document(loop: Loop, omega: FloatArray) -> dict[str, Any]:
    """Margins of both actuators at once and one at a time, and their curves.

    Parameters
    ----------
    loop : at one point, of two inputs
    omega : (W,) of the curves [rad/s]
    """
    delays = np.array(loop.delay)
    found = simultaneous_margins(loop.A, loop.B, loop.K, delays)
    figures = _figures(found)
    worst = {
        name: factor if np.isfinite(factor) else None
        for name, factor in zip(loop.inputs, found.worst_factors, strict=True)
    }
    cuts = zip(loop.inputs, margins_of_cuts(loop), strict=True)
    return {
        "actuators": list(loop.inputs),
        "worst_factors": {name: _complex(factor) for name, factor in worst.items()},
        **figures,
        "proved": bool(found.proved),
        "reasons": _reasons(figures, worst),
        "one_at_a_time": {name: _cut(margins) for name, margins in cuts},
        "curves": _curves(loop, omega),
    }


def _figures(found: SimultaneousMargins) -> dict[str, float]:
    return {
        "disk_margin": float(found.disk_margin),
        "disk_omega_rad_s": float(found.disk_omega),
        "gain_margin_up_db": float(found.gain_margin_up_db),
        "gain_margin_down_db": float(found.gain_margin_down_db),
        "phase_margin_deg": float(np.rad2deg(found.phase_margin)),
        "sensitivity_margin": float(found.sensitivity_margin),
        "complementary_margin": float(found.complementary_margin),
        "return_difference": float(found.return_difference),
        "return_difference_omega_rad_s": float(found.return_difference_omega),
        "sensitivity_peak": float(found.sensitivity_peak),
        "sensitivity_peak_omega_rad_s": float(found.sensitivity_omega),
        "complementary_peak": float(found.complementary_peak),
        "complementary_peak_omega_rad_s": float(found.complementary_omega),
    }


def _complex(factor: complex | None) -> dict[str, float] | None:
    return None if factor is None else {"re": float(factor.real), "im": float(factor.imag)}


def _reasons(figures: dict[str, float], worst: dict[str, complex | None]) -> dict[str, str]:
    """Why each figure that is null is."""
    reasons = {
        name: _INFINITE[name] if np.isinf(value) and name in _INFINITE else _NOT_SEARCHED
        for name, value in figures.items()
        if not np.isfinite(value)
    }
    if any(factor is None for factor in worst.values()):
        reasons["worst_factors"] = reasons.get("disk_margin", "only an infinite factor would do")
    return reasons


def _cut(margins: Margins) -> dict[str, float]:
    return {
        "disk_margin": float(margins.disk_margin),
        "gain_margin_up_db": float(margins.gain_margin_up_db),
        "gain_margin_down_db": float(margins.gain_margin_down_db),
        "phase_margin_deg": float(np.rad2deg(margins.phase_margin)),
        "return_difference": float(1.0 / margins.sensitivity_peak),
    }


def _curves(loop: Loop, omega: FloatArray) -> dict[str, Any]:
    """Over frequency. A diagonal entry of ``S = (I + L)^-1`` is that of the loop cut there, the other closed."""
    S = loop_responses(loop, omega).sensitivity.value
    difference = 2.0 * S - np.eye(S.shape[-1])
    each = np.abs(np.diagonal(difference, axis1=-2, axis2=-1))
    with np.errstate(divide="ignore"):
        both, alone = 2.0 / structured_singular_value(difference), 2.0 / each
    return {
        "omega_rad_s": omega,
        "return_difference": smallest_return_difference(loop.A, loop.B, loop.K, omega, np.array(loop.delay)),
        "simultaneous_disk_margin": both,
        "disk_margins": {name: alone[:, i] for i, name in enumerate(loop.inputs)},
    }
