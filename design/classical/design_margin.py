"""By how much all specs can be tightened together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.found import taken
from design.classical.gain_search import FEW
from design.classical.open_gains import OpenGains
from design.classical.requirement import IN_HAND
from design.classical.steering import StepReference
from design.classical.thorough_search import every_start, tightened
from design.specs import Spec
from model.arrays import FloatArray, GridArrays, IntArray

#: The margin is not looked for beyond this: eleven times the limit.
LARGEST = 10.0


@dataclass(frozen=True, eq=False)
class DesignMargin(GridArrays):
    """How much stricter all specs could be at each of P points.

    Attributes
    ----------
    margin : (P,) part of each limit, negative where the specs must be relaxed to be met together; nan where no stable
        loop was found
    binding : (P,) which of the specs is in the way first, -1 for none
    z : (P, J) unknowns that reach it
    """

    margin: FloatArray
    binding: IntArray
    z: FloatArray


def design_margin(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...]) -> DesignMargin:
    """Largest x such that all specs can be met at once with each limit tightened by x of itself (`Spec.tightened`).

    A limit of zero does not move: such a spec is met as it is.

    Parameters
    ----------
    family : loops of P points
    reference : its trim (P,)
    specs : their limits numbers or (P,)
    """
    parts = [slice(i, i + FEW) for i in range(0, family.form.frequency.size, FEW)]
    with np.errstate(all="ignore"):
        found = [_design_margin(*taken(family, reference, specs, part)) for part in parts]
    return DesignMargin(*(np.concatenate([getattr(f, name) for f in found]) for name in ("margin", "binding", "z")))


def _design_margin(family: OpenGains, reference: StepReference, specs: tuple[Spec, ...]) -> DesignMargin:
    found = tightened(family, reference, specs, (True,) * len(specs), every_start(family))
    moves = [np.where(np.asarray(spec.limit) == 0.0, np.inf, spec.scale) for spec in specs]
    distance = np.stack([spec.distance(found.achieved[:, s]) / moves[s] for s, spec in enumerate(specs)])
    least = np.argmin(np.where(np.isnan(distance), np.inf, distance), axis=0)
    exists = np.isfinite(found.aim) & found.met
    # The part in hand is a part of the margin.
    margin = np.where(exists, np.minimum(found.aim + IN_HAND, LARGEST), np.nan)
    return DesignMargin(margin, np.where(exists & (margin < LARGEST), least, -1), found.z)
