"""Cases of perturbed plants, flown some at a time: what workers do of a Monte Carlo, and keep.

Margins and steps are taken of many loops together, and differ in their last bits with the company that a loop has. So
cases are flown in blocks that only depend on the controller and on how many cases there are. Whoever flies cases flies
whole blocks, and every cutting of the cases gives the same figures to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from design.delay.characteristic import SHORTEST
from design.loop import Loop
from model.arrays import FloatArray, IntArray
from schedules.analysis import PlantEnvelope
from schedules.carried_loop import carried_loop
from schedules.designed import DesignedController
from schedules.digests import digest_of, study_digest
from schedules.exact_bytes import read, written
from schedules.flown_figures import AT_ONCE, Flight, FlownFigures, fly, refuse_too_many
from schedules.perturbations import Cases, perturbed_model
from schedules.study import Study

#: Loops of a block, at least those of one case: about a third of a second of work.
LOOPS, DELAYED_LOOPS = AT_ONCE, 256


@dataclass(frozen=True, eq=False)
class FlownCases:
    """Figures of some of the cases.

    Attributes
    ----------
    start, stop : number of the first case, and of the one behind the last
    of : digest of study, controller, all the cases and what they are asked for
    figures : (*G, stop - start)

    Raises
    ------
    ValueError : another number of cases
    """

    start: int
    stop: int
    of: str
    figures: FlownFigures

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.stop or self.figures.stable.shape[-1:] != (self.stop - self.start,):
            raise ValueError(f"cases {self.start} to {self.stop} do not have figures {self.figures.stable.shape}")

    def to_bytes(self) -> bytes:
        """The same bytes for the same figures, whenever and wherever they are written; no pickle."""
        return written(self)

    @classmethod
    def from_bytes(cls, content: bytes) -> FlownCases:
        """What was written, to the last bit.

        Raises
        ------
        ValueError : damaged, or not the bytes of flown cases
        """
        found = read(content, (cls, FlownFigures))
        if not isinstance(found, cls):
            raise ValueError(f"not flown cases: {type(found).__name__}")
        return found


def case_blocks(designed: DesignedController, cases: Cases) -> tuple[tuple[int, int], ...]:
    """First case of each block, and the one behind its last."""
    loops = DELAYED_LOOPS if _delayed(designed) else LOOPS
    size = max(1, loops // max(1, int(designed.outcomes.ok.sum())))
    return tuple((first, min(first + size, len(cases))) for first in range(0, len(cases), size))


def fly_cases(
    study: Study,
    plant: PlantEnvelope,
    designed: DesignedController,
    cases: Cases,
    flight: Flight,
    start: int,
    stop: int,
) -> FlownCases:
    """Fly the cases from `start` to `stop`; of a block that is only begun or only ended the other cases too, in vain.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : the controller
    cases : all of them
    flight : what is wanted, specs included (`Flight.judging`)
    start, stop : number of the first case, and of the one behind the last

    Raises
    ------
    ValueError : no such cases, too many loops in all of them (`schedules.flown_figures`), or factors that leave a mass
        or inertia which is not positive
    """
    if not 0 <= start < stop <= len(cases):
        raise ValueError(f"there are no cases {start} to {stop}: there are {len(cases)}")
    refuse_too_many(int(designed.outcomes.ok.sum()) * len(cases), _delayed(designed))
    blocks = [(first, last) for first, last in case_blocks(designed, cases) if first < stop and start < last]
    figures = cases_in_a_row(
        [flown_factors(study, plant, designed, cases, flight, slice(first, last)) for first, last in blocks]
    )
    first = blocks[0][0]
    wanted = figures.take((..., slice(start - first, stop - first)))
    return FlownCases(start, stop, flown_digest(study, designed, cases, flight), wanted)


def flown_factors(
    study: Study, plant: PlantEnvelope, designed: DesignedController, cases: Cases, flight: Flight, which: slice
) -> FlownFigures:
    """Figures (*G, d) of some cases, flown all together."""
    ok, factors = designed.outcomes.ok, cases.factors[which]
    count = len(factors)

    def loop_of(index: IntArray) -> Loop:
        points = index // count
        model = perturbed_model(plant, points, cases.parameters, factors[index % count])
        return carried_loop(study, plant, designed, model, points)

    return fly(np.broadcast_to(ok[..., None], (*ok.shape, count)), loop_of, flight)


def flown_digest(study: Study, designed: DesignedController, cases: Cases, flight: Flight) -> str:
    """Digest of what the figures of cases depend on."""
    return digest_of(study_digest(study, designed.request), designed.gains, cases, flight)


def cases_in_a_row(figures: Sequence[FlownFigures]) -> FlownFigures:
    """Figures (*G, D) of cases, one block (*G, d) behind the other."""
    names = [field.name for field in fields(FlownFigures)]
    return FlownFigures(*(np.concatenate([getattr(one, name) for one in figures], axis=-1) for name in names))


def nominal(cases: Cases) -> Cases:
    """The plant as modelled, as a case of the same parameters."""
    factors: FloatArray = np.ones((1, len(cases.parameters)))
    return Cases(cases.parameters, factors)


def _delayed(designed: DesignedController) -> bool:
    return max(designed.loop.delay, default=0.0) > SHORTEST
