"""A root locus at one grid point, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.frequency.loci import RootLocus
from design.frequency.locus_damping import DampingGains
from model.arrays import ComplexArray, FloatArray


def root_locus_document(locus: RootLocus, damped: DampingGains, damping_ratio: float) -> dict[str, Any]:
    """Branches ``[pole][k]`` over the gains, the places that tell their shape, and the gains of a damping ratio."""
    return {
        "sign": locus.sign,
        "gains": locus.gains,
        "branches": locus.branches,
        "chosen_gain": locus.chosen_gain,
        "crossings": [
            {"gain": gain, "omega_rad_s": omega}
            for gain, omega in zip(locus.crossing_gain.tolist(), locus.crossing_omega.tolist(), strict=True)
            if np.isfinite(gain)
        ],
        "breakaways": [
            {"gain": gain, "at": {"re": point.real, "im": point.imag}}
            for gain, point in zip(locus.breakaway_gain.tolist(), locus.breakaway_point.tolist(), strict=True)
            if np.isfinite(gain)
        ],
        "asymptotes": {
            "centroid": locus.asymptote_centroid,
            "angles_deg": np.rad2deg(locus.asymptote_angles[np.isfinite(locus.asymptote_angles)]),
        },
        "departures": _angles(locus.branches[:, 0], locus.departure_angles),
        "arrivals": _angles(locus.zeros, locus.arrival_angles),
        "constant_damping": {
            "damping_ratio": damping_ratio,
            "gains": [
                {"gain": gain, "omega_n_rad_s": omega}
                for gain, omega in zip(damped.gains.tolist(), damped.natural_frequency.tolist(), strict=True)
                if np.isfinite(gain)
            ],
            "least_damping_ratio": damped.least_damping_ratio,
            "lowest_gain": damped.lowest_gain,
            "largest_gain": damped.largest_gain,
        },
    }


def _angles(points: ComplexArray, angles: FloatArray) -> list[dict[str, Any]]:
    """Points with the directions in which branches leave or reach them; those that no branch does are left out."""
    return [
        {"at": {"re": point.real, "im": point.imag}, "angle_deg": float(np.rad2deg(angle))}
        for point, angle in zip(points.tolist(), angles.tolist(), strict=True)
        if np.isfinite(angle)
    ]
