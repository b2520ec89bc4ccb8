"""Margins of one loop at one grid point, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.frequency.margins import Margins
from model.arrays import FloatArray
from service.presenters.reasons import reasons

#: Why a margin is null.
NO_MARGIN = {
    "gain_margin_up_db": "no larger gain destabilises the loop",
    "gain_margin_down_db": "no smaller gain destabilises the loop",
    "phase_margin_deg": "the loop gain is never 1: no phase destabilises it",
    "delay_margin_s": "no delay destabilises the loop",
    "crossover_rad_s": "the loop gain is never 1",
}


def margins_document(margins: Margins) -> dict[str, Any]:
    """Margins of one loop; what is null is explained under `reasons`."""
    ratio = margins.gain_ratio
    exists = np.isfinite(ratio) & (ratio > 0.0)
    gains = zip(ratio[exists].tolist(), margins.gain_omega[exists].tolist(), strict=True)
    crossed = np.isfinite(margins.phase)
    phases = zip(np.rad2deg(margins.phase[crossed]).tolist(), margins.phase_omega[crossed].tolist(), strict=True)
    figures = {name: float(value) for name, value in margin_figures(margins).items()}
    return {
        "gain_margins": [{"ratio": k, "db": 20.0 * float(np.log10(k)), "omega_rad_s": w} for k, w in gains],
        "phase_margins": [{"deg": phase, "omega_rad_s": w} for phase, w in phases],
        **figures,
        "reasons": reasons(figures, NO_MARGIN),
    }


def margin_figures(margins: Margins) -> dict[str, FloatArray]:
    """The least of each kind of margin (*G,); not finite where nothing in that direction destabilises the loop."""
    return {
        "gain_margin_up_db": margins.gain_margin_up_db,
        "gain_margin_down_db": margins.gain_margin_down_db,
        "phase_margin_deg": np.rad2deg(margins.phase_margin),
        "delay_margin_s": margins.delay_margin,
        "disk_margin": margins.disk_margin,
        "sensitivity_peak": margins.sensitivity_peak,
        "crossover_rad_s": margins.crossover,
    }
