"""The gain schedule of one controller of a stored design."""

from __future__ import annotations

from schedules.designed import DesignedController, DesignedEnvelope
from schedules.rules import USUAL_RULES, ScheduleRules
from schedules.schedule import GainSchedule, Provenance


def schedule_of(
    envelope: DesignedEnvelope,
    controller: DesignedController,
    provenance: Provenance,
    rules: ScheduleRules = USUAL_RULES,
) -> GainSchedule:
    """Axes, gains, outcomes and law of the controller, with where they come from and the rules they are flown by."""
    request = controller.request
    return GainSchedule(
        controller=request.name,
        kind=request.kind,
        axes=envelope.plant.grid.axes,
        gains=controller.gains,
        outcomes=controller.outcomes,
        law=request.law,
        provenance=provenance,
        rules=rules,
    )
