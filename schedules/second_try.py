"""Gains that just miss a spec on the loop that is flown: asked for again, a little more strictly.

The search judges on polynomials, with approximants of delays and, for a digital controller, with the continuous loop
that lags as much. What that leaves out is small; where it makes the chosen gains miss a spec, the spec is tightened
there by what was missed.
"""

from __future__ import annotations

import numpy as np

from design.assess import Assessment, achieved
from design.specs import Spec
from model.arrays import BoolArray, FloatArray

#: How often gains are asked for again.
TRIES = 3
#: Of what was missed, how much more is asked for; and what is put on top, as a part of the limit.
FACTOR, ON_TOP = 1.3, 1e-4
#: A spec that is missed by more than this part of its limit is not missed by a little.
LITTLE = 0.1


def missed_a_little(specs: tuple[Spec, ...], found: Assessment, where: BoolArray) -> FloatArray:
    """By what part of its limit to tighten each spec (s, *G): zero where it is met, or missed by more than a little.

    Parameters
    ----------
    specs : as asked for, (*G,)
    found : gains judged at the points of the mask `where` (*G,), in one row
    """
    parts = np.zeros((len(specs), *where.shape))
    for part, spec in zip(parts, specs, strict=True):
        values, here = achieved(found, spec.quantity), spec.take(where)
        if values is not None:
            missed = -here.distance(values) / here.scale
            with np.errstate(invalid="ignore"):
                part[where] = np.where((missed > 0.0) & (missed < LITTLE), FACTOR * missed + ON_TOP, 0.0)
    return parts
