"""Sizing turned round: of an actuator with these limits, the part of the envelope that a design holds, and what the
fastest design within them would be (6.3.2).

The design's own reference step is what is asked of the actuator. Where its peaks are within all limits the point is
held, and the design stays as it is. Elsewhere it is slowed down until they are (`schedules.slower_tab_only`,
`schedules.slower_state_feedback`), or the answer is by how much the nearest design misses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from design.classical.controller import ClassicalController
from design.loop import Loop
from model.actuators import ActuatorLimits
from model.arrays import BoolArray, FloatArray
from schedules.actuator_limits import ROUNDING, Limited
from schedules.analysis import PlantEnvelope
from schedules.designed import DesignedController
from schedules.slower import Slower
from schedules.slower_state_feedback import slower_state_feedback
from schedules.slower_tab_only import slower_tab_only
from schedules.study import Study


@dataclass(frozen=True, eq=False)
class Held:
    """What a design asks of an actuator with limits.

    Attributes
    ----------
    limited : the limits (k)
    peaks : (*G, k) of what is limited; nan where there is no design
    held : (*G,) whether all of them are within their limits
    """

    limited: Limited
    peaks: FloatArray
    held: BoolArray

    @property
    def breaks(self) -> BoolArray:
        """(*G, k) which limits a design breaks; none where there is no design."""
        known = np.asarray(~np.all(np.isnan(self.peaks), axis=-1))
        within = self.peaks <= self.limited.values * (1.0 + ROUNDING)
        return np.asarray(known[..., None] & ~within)


@dataclass(frozen=True, eq=False)
class InverseSizing:
    """What an actuator with limits makes of a design.

    Attributes
    ----------
    before : what the design asks of it
    after : what the slower design does
    slower : the slower design; None where nothing can be chosen
    reason : why nothing can be chosen; None where it can
    """

    before: Held
    after: Held | None
    slower: Slower | None
    reason: str | None


def held(designed: DesignedController, actuator: str, limits: ActuatorLimits) -> Held:
    """The part of the envelope that a design holds with an actuator of these limits.

    Raises
    ------
    ValueError : no limits, a controller that runs as code, or one without such an actuator
    """
    name = designed.request.name
    if not isinstance(designed.loop, Loop):
        raise ValueError(f"the controller {name} runs as code: its torques are not known in continuous time")
    if actuator not in designed.loop.inputs:
        raise ValueError(f"the controller {name} has no actuator {actuator}, only {', '.join(designed.loop.inputs)}")
    limited = Limited.of(actuator, limits)
    peaks = limited.peaks_of(designed)
    return Held(limited, peaks, np.asarray(designed.outcomes.ok & limited.met(peaks)))


def inverse_sizing(
    study: Study, plant: PlantEnvelope, designed: DesignedController, actuator: str, limits: ActuatorLimits
) -> InverseSizing:
    """What a design makes of an actuator with these limits, and the fastest design within them.

    Parameters
    ----------
    study, plant : of which the controller is one
    designed : a controller with a loop in continuous time
    actuator : ``tab`` or ``aileron``
    limits : one of them at least

    Raises
    ------
    ValueError : see `held`; or no point carries a design
    """
    before, request = held(designed, actuator, limits), designed.request
    if not np.any(designed.outcomes.ok):
        raise ValueError(f"the controller {request.name} has no design at any point")
    if isinstance(request, ClassicalController) and request.all_gains_given:
        return InverseSizing(before, None, None, f"all gains of the controller {request.name} are given")
    slow = slower_tab_only if isinstance(request, ClassicalController) else slower_state_feedback
    slower = slow(study, plant, designed, before.limited)
    return InverseSizing(before, held(slower.designed, actuator, limits), slower, None)
