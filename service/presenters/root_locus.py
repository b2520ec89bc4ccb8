"""A root locus at one grid point, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.frequency.loci import RootLocus


def root_locus_document(locus: RootLocus) -> dict[str, Any]:
    """Branches ``[pole][k]`` over the gains, and the places that tell the locus's shape."""
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
    }
