"""The certificate of optimal gains, on the wire."""

from __future__ import annotations

from typing import Any

import numpy as np

from design.assess import Assessment
from design.lqr.sampled_design import SampledLqrDesign
from design.lqr.synthesis import LqrDesign


def riccati_document(
    design: LqrDesign | SampledLqrDesign, assessment: Assessment, index: tuple[int, ...]
) -> dict[str, Any]:
    """Residual of the Riccati equation, largest real part of the closed loop, smallest ``|1 + L|``, at a point.

    Parameters
    ----------
    design : over the grid
    assessment : of the loop at the point; the return difference of a sampled design is that of its cuts
    """
    here = design.take(index)
    if isinstance(here, SampledLqrDesign):
        return {
            "residual": float(here.residual),
            "largest_real_part": float(np.log(here.spectral_radius) / here.sampling.time),
            "return_difference_min": float(assessment.return_difference.min()),
            "spectral_radius": float(here.spectral_radius),
        }
    return {
        "residual": float(here.residual),
        "largest_real_part": float(here.largest_real_part),
        "return_difference_min": float(here.return_difference_min),
        "spectral_radius": None,
    }
