"""Why figures that do not exist do not, on the wire."""

from __future__ import annotations

import numpy as np


def reasons(figures: dict[str, float], why: dict[str, str]) -> dict[str, str]:
    """Why each figure that does not exist does not."""
    return {
        name: why.get(name, "the closed loop does not settle")
        for name, value in figures.items()
        if not np.isfinite(value)
    }
