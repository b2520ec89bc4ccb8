"""The certificate of optimal gains, on the wire."""

from __future__ import annotations

from typing import Any

from design.lqr.synthesis import LqrDesign


def riccati_document(design: LqrDesign, index: tuple[int, ...]) -> dict[str, Any]:
    """Residual of the Riccati equation, largest real part of the closed loop, smallest ``|1 + L|``, at a point."""
    here = design.take(index)
    return {
        "residual": float(here.residual),
        "largest_real_part": float(here.largest_real_part),
        "return_difference_min": float(here.return_difference_min),
    }
