"""Trajectories in the phase planes of two surfaces, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.lqr.phase_plane import PhasePlane
from model.arrays import FloatArray


def trajectory_document(found: PhasePlane) -> dict[str, FloatArray]:
    """One trajectory; totals."""
    return {
        "time_s": found.time,
        "aileron_deg": np.rad2deg(found.aileron),
        "tab_deg": np.rad2deg(found.tab),
        "aileron_rate_deg_s": np.rad2deg(found.aileron_rate),
        "tab_rate_deg_s": np.rad2deg(found.tab_rate),
        "aileron_torque_n_m": found.aileron_torque,
        "tab_torque_n_m": found.tab_torque,
    }


def free_documents(angles: FloatArray, found: PhasePlane) -> list[dict[str, Any]]:
    """Free trajectories (S, T) and the angles (S, 2) [deg] of aileron and tab that they start from."""
    return [
        {
            "aileron_start_deg": float(aileron),
            "tab_start_deg": float(tab),
            "trajectory": trajectory_document(found.take(start)),
        }
        for start, (aileron, tab) in enumerate(angles)
    ]
