"""The gain schedule of one controller of a stored design."""

from __future__ import annotations

from design.classical.controller import ClassicalController
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.schedule import GainSchedule, Provenance

#: Law of the state-feedback controllers.
STATE_FEEDBACK = "u = -K x + N r, u = [T_t, T_a]"


def schedule_of(envelope: DesignedEnvelope, controller: DesignedController, provenance: Provenance) -> GainSchedule:
    """Axes, gains, outcomes and law of the controller, with where they come from."""
    request = controller.request
    law = request.law if isinstance(request, ClassicalController) else STATE_FEEDBACK
    return GainSchedule(
        controller=request.name,
        kind=request.kind,
        axes=envelope.plant.grid.axes,
        gains=controller.gains,
        outcomes=controller.outcomes,
        law=law,
        provenance=provenance,
    )
